//! A panorama on its way into a file, a few rows at a time.

use rayon::prelude::*;
use trueup_core::StageContext;
use trueup_core::options::StageOptions;
use trueup_core::raster::RowSource;

use super::failure::WriteFailure;
use super::options::{Alpha, OutputOptions};
use super::samples::{OutputSample, RGBA};

/// Rows that are made at a time where the format does not say; rows of a strip of a TIFF.
pub(crate) const STRIP_ROWS: usize = 64;

/// Bytes collected before the operating system is called.
pub(crate) const BUFFER_BYTES: usize = 1 << 20;

/// Samples of a pixel in the file: 4, or 3 without alpha.
pub(crate) fn channels_of(picture: &dyn RowSource, options: &OutputOptions) -> usize {
    let opaque = options.alpha == Alpha::Auto && picture.is_opaque();
    RGBA - usize::from(opaque || !options.alpha.keeps(options.background))
}

/// Hands the picture to `consume` from top to bottom, in strips of at most `rows` rows of RGBA; the rows of a strip are
/// made in parallel. Stops when the work is cancelled and reports progress.
pub(crate) fn for_each_strip<S: OutputSample>(
    picture: &dyn RowSource,
    rows: usize,
    context: &StageContext<'_>,
    consume: &mut dyn FnMut(&[S]) -> Result<(), WriteFailure>,
) -> Result<(), WriteFailure> {
    let row_samples = picture.width() * RGBA;
    let mut strip = vec![S::default(); row_samples * rows.min(picture.height())];
    for first in (0..picture.height()).step_by(rows.max(1)) {
        context.check_cancelled()?;
        let count = rows.min(picture.height() - first);
        let strip = &mut strip[..count * row_samples];
        strip
            .par_chunks_exact_mut(row_samples)
            .enumerate()
            .try_for_each(|(row, pixels)| S::row(picture, first + row, pixels))?;
        consume(strip)?;
        context.progress().advance(OutputOptions::STAGE, count as u64);
    }
    Ok(())
}
