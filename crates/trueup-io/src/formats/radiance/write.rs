//! Panoramas in Radiance's form.

use std::io::{BufWriter, Write};

use trueup_core::StageContext;
use trueup_core::raster::RowSource;

use super::pixel::{append_row, pixel};
use super::{FORMAT, SOFTWARE_KEY};
use crate::color::Chromaticities;
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::OutputOptions;
use crate::encode::samples::{OutputSample, flattened};
use crate::encode::strips::{BUFFER_BYTES, STRIP_ROWS, for_each_strip};
use crate::format::Output;
use crate::provenance::description::SOFTWARE;

/// Writes linear light in sRGB's primaries, 1 for white.
pub(super) fn write(
    file: &mut dyn Output,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> Result<(), WriteFailure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    writeln!(output, "#?RADIANCE")?;
    if metadata.exif.is_some() {
        writeln!(output, "{SOFTWARE_KEY}{SOFTWARE}")?;
    }
    let Chromaticities { red, green, blue, white } = Chromaticities::SRGB;
    let places: Vec<String> =
        [red, green, blue, white].as_flattened().iter().map(|place| format!("{place:.4}")).collect();
    writeln!(output, "PRIMARIES={}\n{FORMAT}\n", places.join(" "))?;
    writeln!(output, "-Y {} +X {}", picture.height(), picture.width())?;
    let (mut samples, mut bytes) = (Vec::new(), Vec::new());
    for_each_strip::<f32>(picture, STRIP_ROWS, context, &mut |strip| {
        flattened(strip, 3, f32::of(options.background), &mut samples);
        let pixels: Vec<[u8; 4]> = samples.as_chunks::<3>().0.iter().map(|&light| pixel(light)).collect();
        bytes.clear();
        pixels.chunks_exact(picture.width()).for_each(|row| append_row(row, &mut bytes));
        Ok(output.write_all(&bytes)?)
    })?;
    output.flush()?;
    Ok(())
}
