//! Photographs in OpenEXR.

use std::io::Seek;

use exr::error::Error as ExrError;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{Chromaticities as ExrChromaticities, SampleType};
use exr::meta::header::Header;
use exr::prelude::{Compression, ReadChannels, ReadLayers, ReadSpecificChannel, read};
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use crate::color::{Chromaticities, profile_of_chromaticities};
use crate::format::{HeaderError, Input, StoredPixels};
use crate::formats::alpha::straight;
use crate::formats::decoded::{check_unchanged, damaged, sample_count, sixteen};
use crate::formats::linear_light::encoded;
use crate::metadata::exif_fields::ExifFields;

/// Bytes a pixel takes in memory while it is read: four samples of 32 bits, and of 16.
pub(super) const PIXEL_BYTES: usize = 24;

/// The part of a file that is the photograph.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    width: usize,
    height: usize,
    has_color: bool,
    has_alpha: bool,
    /// Most bits of a sample.
    bits: u16,
    chromaticities: Option<Chromaticities>,
    software: Option<String>,
}

impl Part {
    /// Looks for it in the headers of a file.
    fn of(input: &mut Input) -> std::result::Result<Self, HeaderError> {
        let headers = MetaData::read_from_buffered(input, false).map_err(failure)?.headers;
        let found = headers.iter().find(|header| has(header, "R") && has(header, "G") && has(header, "B"));
        let Some(header) = found.or_else(|| headers.iter().find(|header| has(header, "Y") && !has(header, "RY")))
        else {
            return Err(HeaderError::Unsupported(format!("its channels are {}", channel_names(&headers))));
        };
        if header.deep {
            return Err(HeaderError::Unsupported("deep data".to_owned()));
        }
        use Compression::{DWAA, DWAB, HTJ2K32, HTJ2K256};
        if matches!(header.compression, DWAA(_) | DWAB(_) | HTJ2K32 | HTJ2K256) {
            return Err(HeaderError::Unsupported(format!("compressed by {}", header.compression)));
        }
        let is_half = header.channels.list.iter().all(|channel| channel.sample_type == SampleType::F16);
        let Vec2(width, height) = header.layer_size;
        Ok(Self {
            width,
            height,
            has_color: found.is_some(),
            has_alpha: has(header, "A"),
            bits: if is_half { 16 } else { 32 },
            chromaticities: header.shared_attributes.chromaticities.map(chromaticities),
            software: header.own_attributes.software_name.as_ref().map(ToString::to_string),
        })
    }

    /// Samples of a pixel as they are handed out.
    fn channels(&self) -> usize {
        if self.has_color { 3 + usize::from(self.has_alpha) } else { 1 + usize::from(self.has_alpha) }
    }
}

/// Whether a part has a channel of this name, at full resolution.
fn has(header: &Header, name: &str) -> bool {
    header.channels.list.iter().any(|channel| channel.name.eq(name) && channel.sampling == Vec2(1, 1))
}

fn channel_names(headers: &[Header]) -> String {
    let names: Vec<String> = headers
        .iter()
        .flat_map(|header| &header.channels.list)
        .take(8)
        .map(|channel| channel.name.to_string())
        .collect();
    names.join(", ")
}

fn chromaticities(found: ExrChromaticities) -> Chromaticities {
    let place = |Vec2(x, y): Vec2<f32>| [x, y];
    Chromaticities {
        red: place(found.red),
        green: place(found.green),
        blue: place(found.blue),
        white: place(found.white),
    }
}

fn failure(error: ExrError) -> HeaderError {
    match error {
        ExrError::NotSupported(words) => HeaderError::Unsupported(words.into_owned()),
        other => HeaderError::damaged(other),
    }
}

pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let Part { width, height, bits, .. } = Part::of(input)?;
    Ok(StoredPixels { width, height, bits, is_float: true })
}

/// Of the primaries of the file, with the curve that samples are handed out in.
pub(super) fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let part = Part::of(input).ok()?;
    part.chromaticities.filter(|_| part.has_color).and_then(profile_of_chromaticities)
}

pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    Some(ExifFields { software: Part::of(input).ok()?.software, ..ExifFields::default() })
}

/// Samples that are collected, channels interleaved.
struct Collected {
    samples: Vec<f32>,
    width: usize,
    channels: usize,
    /// Pixels that were there.
    pixels: usize,
}

impl Collected {
    fn set(&mut self, Vec2(x, y): Vec2<usize>, pixel: [f32; 4]) {
        let start = (y * self.width + x) * self.channels;
        if let Some(place) = self.samples.get_mut(start..start + self.channels) {
            place.copy_from_slice(&pixel[..self.channels]);
            self.pixels += 1;
        }
    }
}

/// Decodes the pixels.
pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let part = Part::of(&mut input).map_err(|error| damaged(source, error.words()))?;
    check_unchanged(source, part.width, part.height)?;
    let channels = part.channels();
    let count = sample_count(source, part.width, part.height, channels)?;
    input.rewind().map_err(|error| Error::io("reading", &source.path, error))?;
    // Of any other part than the one whose size was judged, nothing is collected.
    let start = |size: Vec2<usize>| Collected {
        samples: vec![0.0; if size == Vec2(part.width, part.height) { count } else { 0 }],
        width: part.width,
        channels,
        pixels: 0,
    };
    let collected = if part.has_color { colors(input, start) } else { grays(input, start) };
    let Collected { samples, pixels, .. } = collected.map_err(|error| damaged(source, error))?;
    if samples.len() != count || pixels < part.width * part.height {
        return Err(damaged(source, "not all of them are there"));
    }
    // Colors are stored multiplied by alpha ("OpenEXR File Layout", predefined channel names).
    let samples = straight(samples, channels, true);
    sixteen(part.width, part.height, channels, encoded(&samples, channels, source.light))
}

fn colors(input: Input, start: impl Fn(Vec2<usize>) -> Collected) -> exr::error::Result<Collected> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| start(size),
            |collected: &mut Collected, at, (red, green, blue, alpha): (f32, f32, f32, f32)| {
                collected.set(at, [red, green, blue, alpha]);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(input)?;
    Ok(image.layer_data.channel_data.pixels)
}

fn grays(input: Input, start: impl Fn(Vec2<usize>) -> Collected) -> exr::error::Result<Collected> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("Y")
        .optional("A", 1.0_f32)
        .collect_pixels(
            |size, _| start(size),
            |collected: &mut Collected, at, (gray, alpha): (f32, f32)| collected.set(at, [gray, alpha, 0.0, 0.0]),
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(input)?;
    Ok(image.layer_data.channel_data.pixels)
}
