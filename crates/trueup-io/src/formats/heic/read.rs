//! Photographs in HEIC.
//!
//! What the decoder would allocate is judged first: it has limits of its own, but they are those of the largest
//! machine.

use exif::{Field, Tag};
use heic_decoder::bitreader::strip_emulation_prevention;
use heic_decoder::hevc::nal::{NAL_SPS, parse_nal_header};
use heic_decoder::hevc::params::parse_sps;
use heic_decoder::isobmff::{self, HevcDecoderConfig, ParsedHeif};
use heic_decoder::{DecodedImage, HeifError, ImageInfo, Metadata, RgbaImage};
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::container::check_copies;
use crate::color::{names_primaries, profile_of_code_points};
use crate::format::{HeaderError, Input, StoredPixels};
use crate::formats::alpha::{Share, straight};
use crate::formats::boxes::contents;
use crate::formats::decoded::{check_unchanged, damaged, eight, sixteen};
use crate::metadata::block;
use crate::metadata::exif_fields::ExifFields;

/// What memory is asked for.
const READING: &str = "reading a HEIC file";

/// Bytes a pixel takes in memory while it is decoded: three planes of 32 bits, twice where tiles are put together, for
/// [`MOST_CODED`] coded ones. The samples handed out come when the tiles are gone.
pub(super) const PIXEL_BYTES: usize = 2 * 3 * size_of::<i32>() * MOST_CODED;

/// Most coded pixels for one that is shown, beside a tile of them: a crop can be as small as it likes, and what is
/// decoded for it as large.
const MOST_CODED: usize = 2;
const TILE_PIXELS: usize = 1 << 20;

/// The boxes of a file, if what is copied of them is no more than the file.
fn parsed(bytes: &[u8]) -> heic_decoder::Result<ParsedHeif> {
    check_copies(bytes)?;
    isobmff::parse(bytes)
}

/// What a file says of its picture, before anything as large as that is allocated.
fn info(bytes: &[u8]) -> heic_decoder::Result<ImageInfo> {
    let parsed = parsed(bytes)?;
    let info = heic_decoder::probe(bytes)?;
    let most = info.width.saturating_mul(info.height).saturating_mul(MOST_CODED).saturating_add(TILE_PIXELS);
    let alpha = parsed.alpha.as_ref().map_or(Ok(0), |alpha| coded_pixels(&alpha.image))?;
    if coded_pixels(&parsed)?.max(alpha).max(info.coded_width.saturating_mul(info.coded_height)) > most {
        return Err(HeifError::LimitExceeded("the picture is a small part of what is coded"));
    }
    Ok(info)
}

/// Pixels of all tiles of a picture, and of another by which it is predicted, as their parameters say.
fn coded_pixels(parsed: &ParsedHeif) -> heic_decoder::Result<usize> {
    let of_one = |image: &isobmff::ResolvedImage| coded_pixels_of_tile(&image.hevc_config);
    let pictures = parsed.images.iter().chain(&parsed.reference_image);
    pictures.map(of_one).try_fold(0_usize, |sum, pixels| Ok(sum.saturating_add(pixels?)))
}

/// By the first parameter set of the base layer, as the decoder takes it.
fn coded_pixels_of_tile(config: &HevcDecoderConfig) -> heic_decoder::Result<usize> {
    for unit in config.nalus_of_type(NAL_SPS) {
        let (header, payload) = parse_nal_header(unit)?;
        if (header.nal_unit_type, header.nuh_layer_id) == (NAL_SPS, 0) {
            let parameters = parse_sps(&strip_emulation_prevention(payload))?;
            let [width, height] = [parameters.pic_width_in_luma_samples, parameters.pic_height_in_luma_samples];
            return Ok((width as usize).saturating_mul(height as usize));
        }
    }
    Err(HeifError::MalformedHevc("no parameters of the picture"))
}

pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let bytes = contents(input, READING).map_err(HeaderError::damaged)?;
    let info = info(&bytes).map_err(|error| match error {
        HeifError::Unsupported(words) => HeaderError::Unsupported(words.to_owned()),
        other => HeaderError::damaged(other),
    })?;
    let depth = info.bit_depth_luma.max(info.bit_depth_chroma);
    let bits = if depth <= 8 { 8 } else { depth as u16 };
    Ok(StoredPixels { width: info.width, height: info.height, bits, is_float: false })
}

fn metadata(input: &mut Input) -> Option<Metadata> {
    Some(parsed(&contents(input, READING).ok()?).ok()?.metadata)
}

/// The profile; or one made of what the file says of its primaries and its curve in numbers.
pub(super) fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let metadata = metadata(input)?;
    metadata.icc_profile.or_else(|| {
        let color = metadata.color_info?;
        profile_of_code_points(color.color_primaries, color.transfer_characteristics)
    })
}

/// The pixels are turned upright as the file itself says, which outranks the orientation of EXIF (ISO/IEC 23008-12,
/// section 6.5.10 and annex A.2.3). So do the numbers of its colors.
pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    let Metadata { exif, color_info, .. } = metadata(input)?;
    let fields = ExifFields::from_exif(&block::parsed(exif?)?).turned_already();
    let says_colors = color_info.is_some_and(|color| names_primaries(color.color_primaries));
    Some(if says_colors { fields.without_color_space() } else { fields })
}

pub(super) fn whole_fields(input: &mut Input, wanted: &[Tag]) -> Option<Vec<Field>> {
    Some(block::fields_of(&block::parsed(metadata(input)?.exif?)?, wanted))
}

pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let failed = |error: HeifError| damaged(source, error);
    let bytes = contents(&mut input, READING).map_err(|error| Error::io("reading", &source.path, error))?;
    let info = info(&bytes).map_err(failed)?;
    check_unchanged(source, info.width, info.height)?;
    let image = heic_decoder::decode(&bytes).map_err(failed)?;
    drop(bytes);
    check_unchanged(source, image.width, image.height)?;
    let is_deep = image.bit_depth_luma.max(image.bit_depth_chroma) > 8;
    match (is_deep, image.alpha.is_some()) {
        (false, false) => eight(image.width, image.height, 3, image.to_rgb8().map_err(failed)?.data),
        (true, false) => sixteen(image.width, image.height, 3, image.to_rgb16().map_err(failed)?.data),
        (false, true) => eight(image.width, image.height, 4, of_alpha(&image, DecodedImage::to_rgba8).map_err(failed)?),
        (true, true) => {
            sixteen(image.width, image.height, 4, of_alpha(&image, DecodedImage::to_rgba16).map_err(failed)?)
        }
    }
}

/// Colors and opacity, the colors straight.
fn of_alpha<S: Share>(
    image: &DecodedImage,
    convert: fn(&DecodedImage) -> heic_decoder::Result<RgbaImage<S>>,
) -> heic_decoder::Result<Vec<S>> {
    let RgbaImage { data, premultiplied, .. } = convert(image)?;
    Ok(straight(data, 4, premultiplied))
}
