//! Photographs in Digital Negatives.

use std::io::{Read, Seek, SeekFrom};

use exif::{Field, Tag};
use rayon::prelude::*;
use trueup_core::memory::check_room;
use trueup_core::raster::Photograph;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::blocks::unpacked;
use super::color::{Development, of_vector};
use super::described::{Described, described};
use super::lossless_jpeg;
use super::mosaic::Mosaic;
use crate::format::{HeaderError, Input, StoredPixels};
use crate::formats::decoded::{check_unchanged, damaged, sixteen};
use crate::formats::linear_light::level;
use crate::metadata::block;
use crate::metadata::exif_fields::ExifFields;

/// Bytes a pixel takes in memory while it is developed, of three colors: the sensor's numbers, their shares of white,
/// greens, and what is handed out.
pub(super) const PIXEL_BYTES: usize = 3 * (size_of::<u16>() + size_of::<f32>() + size_of::<u16>()) + size_of::<f32>();

/// Bits of what is developed.
const BITS: u16 = 16;

/// Colors of a pixel.
const COLORS: usize = 3;

pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let [.., width, height] = described(input)?.crop;
    Ok(StoredPixels { width, height, bits: BITS, is_float: false })
}

/// All fields. The sensor's numbers are read with them: of the directories that other libraries know, the first may be
/// theirs.
fn block(input: &mut Input) -> Option<exif::Exif> {
    let length = usize::try_from(input.get_ref().metadata().ok()?.len()).ok()?;
    check_room("reading a Digital Negative", length).ok()?;
    let mut bytes = Vec::new();
    input.rewind().ok()?;
    input.read_to_end(&mut bytes).ok()?;
    block::parsed(bytes)
}

/// The color space in EXIF is that of pictures that the camera makes itself: sensors' colors are developed to sRGB.
pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    Some(ExifFields::from_exif(&block(input)?).without_color_space())
}

pub(super) fn whole_fields(input: &mut Input, wanted: &[Tag]) -> Option<Vec<Field>> {
    Some(block::fields_of(&block(input)?, wanted))
}

pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let described = described(&mut input).map_err(|error| damaged(source, error.words()))?;
    let [left, top, width, height] = described.crop;
    check_unchanged(source, width, height)?;
    let numbers = numbers(source, &mut input, &described)?;
    let shares = balanced(&described, &numbers);
    drop(numbers);
    let [.., active_width, active_height] = described.active;
    let mut samples = vec![0; width * height * COLORS];
    let develop = |camera: [f32; COLORS], pixel: &mut [u16]| {
        let camera = camera.map(|share| f64::from(share).clamp(0.0, 1.0));
        let light = of_vector(&described.development.srgb_from_balanced, camera);
        pixel.iter_mut().zip(light).for_each(|(sample, light)| *sample = level(light * described.exposure));
    };
    let rows = samples.par_chunks_mut(width * COLORS).enumerate();
    match described.pattern {
        Some(pattern) => {
            let mosaic = Mosaic { width: active_width, height: active_height, pattern, samples: shares };
            let greens = mosaic.greens();
            rows.for_each(|(y, row)| {
                for (x, pixel) in row.chunks_exact_mut(COLORS).enumerate() {
                    develop(mosaic.pixel(&greens, left + x, top + y), pixel);
                }
            });
        }
        None => rows.for_each(|(y, row)| {
            let start = ((top + y) * active_width + left) * COLORS;
            for (camera, pixel) in shares[start..].as_chunks::<COLORS>().0.iter().zip(row.chunks_exact_mut(COLORS)) {
                develop(*camera, pixel);
            }
        }),
    }
    sixteen(width, height, COLORS, samples)
}

/// The numbers of the active area.
fn numbers(source: &SourceImage, input: &mut Input, described: &Described) -> Result<Vec<u16>> {
    let Described { samples_per_pixel: samples, bits, blocks, .. } = described;
    let [left, top, width, height] = described.active;
    let row_numbers = width * samples;
    let mut numbers = vec![0; row_numbers * height];
    let length = input.get_ref().metadata().map_err(|error| Error::io("reading", &source.path, error))?.len();
    for (number, &[offset, bytes]) in blocks.places.iter().enumerate() {
        let [block_left, block_top] = [number % blocks.across * blocks.width, number / blocks.across * blocks.height];
        let block_height = match blocks.are_padded {
            true => blocks.height,
            false => blocks.height.min(described.height - block_top),
        };
        if offset.checked_add(bytes).is_none_or(|end| end > length) {
            return Err(damaged(source, "a part of it is not in the file"));
        }
        let mut coded = Vec::new();
        let read = input.seek(SeekFrom::Start(offset)).and_then(|_| input.by_ref().take(bytes).read_to_end(&mut coded));
        read.map_err(|error| Error::io("reading", &source.path, error))?;
        let block_numbers = blocks.width * samples;
        let count = block_numbers * block_height;
        let block = match described.is_jpeg {
            true => lossless_jpeg::decode(&coded, count).map_err(|words| damaged(source, words))?,
            false => unpacked(&coded, *bits, block_numbers, described.is_little, count)
                .ok_or_else(|| damaged(source, "a part of it is cut off"))?,
        };
        for (row, from) in block.chunks_exact(block_numbers).enumerate() {
            let Some(y) = (block_top + row).checked_sub(top).filter(|&y| y < height) else { continue };
            let start = block_left.max(left);
            let end = (block_left + blocks.width).min(left + width);
            if start < end {
                let from = &from[(start - block_left) * samples..(end - block_left) * samples];
                let to = y * row_numbers + (start - left) * samples;
                numbers[to..to + from.len()].copy_from_slice(from);
            }
        }
    }
    Ok(numbers)
}

/// Shares of white of the active area, such that gray is gray, and 1 the most of every color.
fn balanced(described: &Described, numbers: &[u16]) -> Vec<f32> {
    let [.., width, height] = described.active;
    let samples = described.samples_per_pixel;
    let Development { balance, .. } = described.development;
    let mut shares = vec![0.0; numbers.len()];
    let rows = shares.par_chunks_mut(width * samples).zip(numbers.par_chunks(width * samples));
    rows.enumerate().for_each(|(y, (shares, numbers))| {
        described.levels.row(y, numbers, shares);
        for map in &described.gain_maps {
            map.apply(y, [width, height], samples, shares);
        }
        for (at, share) in shares.iter_mut().enumerate() {
            let color = described.pattern.map_or(at % COLORS, |pattern| pattern.color(at, y));
            *share = (f64::from(*share) * balance[color]).min(1.0) as f32;
        }
    });
    shares
}
