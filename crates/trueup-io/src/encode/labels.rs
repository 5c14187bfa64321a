//! Labels to a PNG: which photograph the panorama shows where.

use std::io::{BufWriter, Write};
use std::path::Path;

use png::{BitDepth, ColorType, Encoder, Info};
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result, StageContext};

use super::destination::check_sides;
use super::failure::WriteFailure;
use super::metadata::Metadata;
use super::options::OutputOptions;
use super::pending::{PendingFile, check_place};
use super::place::is_standard_output;
use super::strips::{BUFFER_BYTES, STRIP_ROWS};
use crate::format::Output;
use crate::formats::png::{PNG, SIDES, compression, failure};

/// The value where no photograph is; the first photograph has 1.
pub const NOTHING: u16 = 0;

/// Most photographs that a palette has room for beside [`NOTHING`].
const PALETTE: usize = 255;

/// Labels to be written, row by row.
pub trait LabelMap {
    /// Width and height in pixels.
    fn size(&self) -> [usize; 2];
    /// Names of the photographs, in the order of their labels.
    fn names(&self) -> Vec<String>;
    /// Replaces `row` by the labels of row `y`: 1 for the first photograph, [`NOTHING`] where none is.
    ///
    /// # Errors
    /// If the labels cannot be had.
    fn row(&self, y: usize, row: &mut Vec<u16>) -> Result<()>;
}

/// Checks that labels could be written to `path`, before the long work that makes them.
///
/// # Errors
/// As [`write_labels`].
pub fn check_labels_place(path: &Path) -> Result<()> {
    if PNG.names(path) || is_standard_output(path) {
        return check_place(path);
    }
    Err(Error::Unsupported {
        what: format!("writing seams to {}", path.display()),
        hint: "End the name in .png.".to_owned(),
    })
}

/// Writes labels to a PNG at `path`; returns its length in bytes.
///
/// Up to 255 photographs are indices into a palette of distinct colors, of which index 0 is transparent; more are
/// 16-bit gray. Either way the samples are the labels, and text chunks `Photograph N` hold the names. Of `metadata`,
/// the file has the EXIF. It appears complete or not at all.
///
/// # Errors
/// Those of [`write()`](super::write()), and of [`LabelMap::row`].
pub fn write_labels(
    path: &Path,
    map: &dyn LabelMap,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<u64> {
    options.check()?;
    check_labels_place(path)?;
    let [width, height] = map.size();
    check_sides(path, SIDES, width, height)?;
    let mut pending = PendingFile::create(path)?;
    write_map(pending.file(), map, metadata, options, context).map_err(|failure| failure.at(&pending.place()))?;
    context.check_cancelled()?;
    pending.commit()
}

pub(super) fn write_map(
    file: &mut dyn Output,
    map: &dyn LabelMap,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> std::result::Result<(), WriteFailure> {
    let names = map.names();
    let [width, height] = map.size();
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let mut info = Info::with_size(width as u32, height as u32);
    info.exif_metadata = metadata.exif.as_ref().map(|exif| exif.into());
    let mut encoder = Encoder::with_info(&mut output as &mut dyn Write, info).map_err(failure)?;
    let indexed = names.len() <= PALETTE;
    if indexed {
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_palette(palette(names.len()));
        // All other colors are opaque.
        encoder.set_trns(vec![0]);
    } else {
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Sixteen);
    }
    encoder.set_compression(compression(options));
    for (index, name) in names.into_iter().enumerate() {
        encoder.add_itxt_chunk(format!("Photograph {}", index + 1), name).map_err(failure)?;
    }
    let mut writer = encoder.write_header().map_err(failure)?;
    let mut stream = writer.stream_writer_with_size(BUFFER_BYTES).map_err(failure)?;
    let (mut row, mut bytes) = (Vec::new(), Vec::new());
    for y in 0..height {
        if y % STRIP_ROWS == 0 {
            context.check_cancelled()?;
        }
        map.row(y, &mut row)?;
        bytes.clear();
        match indexed {
            true => bytes.extend(row.iter().map(|&label| label as u8)),
            false => bytes.extend(row.iter().flat_map(|label| label.to_be_bytes())),
        }
        stream.write_all(&bytes)?;
    }
    stream.finish().map_err(failure)?;
    writer.finish().map_err(failure)?;
    output.flush()?;
    Ok(())
}

/// Black, then a color for every photograph: hues a golden angle apart, so that neighbors in number differ most, in
/// three brightnesses.
fn palette(photographs: usize) -> Vec<u8> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let color = |index: usize| {
        let hue = (index as f64 * GOLDEN).fract() * 6.0;
        let value = [255.0, 190.0, 225.0][index % 3];
        let channel = |shift: f64| {
            // A trapezium over the circle of hues: full for a third of it, falling over a sixth on either side.
            let distance = (hue + shift).rem_euclid(6.0);
            let share = (2.0 - (distance - 3.0).abs()).clamp(0.0, 1.0);
            (value * (0.2 + 0.8 * share)).round() as u8
        };
        [channel(3.0), channel(1.0), channel(5.0)]
    };
    std::iter::once([0; 3]).chain((0..photographs).map(color)).flatten().collect()
}
