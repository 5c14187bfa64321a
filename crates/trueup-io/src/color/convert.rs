//! A photograph's samples from its own color space to the panorama's.

use std::sync::Arc;

use moxcms::{ColorProfile, Layout, RenderingIntent, Transform16BitExecutor, TransformOptions};
use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::{Error, Result};

/// Pixels converted at a time: enough to keep a thread busy, little beside a photograph.
const CHUNK_PIXELS: usize = 1 << 16;

/// Full light as a 16-bit sample.
const FULL: f64 = u16::MAX as f64;

/// From one color space to another; for the kinds of samples that need no conversion there is none.
#[derive(Debug, Clone)]
pub(crate) struct Conversion {
    /// From the profile of RGB samples.
    pub(crate) rgb: Option<Arc<ColorProfile>>,
    /// From the curve of gray samples.
    pub(crate) gray: Option<TransferCurve>,
    /// Whether the profile is one of gray. Gray that was spread over three channels, as beside alpha, follows it, too.
    pub(crate) is_gray: bool,
    pub(crate) target: Arc<ColorProfile>,
    pub(crate) target_curve: TransferCurve,
}

impl Conversion {
    /// Converts a photograph, with 16 bits a sample, since 8 would lose; alpha stays. `name` is for messages.
    ///
    /// # Errors
    /// [`Error::Input`] if the profile describes no conversion.
    pub(crate) fn apply(&self, photograph: Photograph, name: &str) -> Result<Photograph> {
        let channels = photograph.channels();
        if channels == 1 || self.is_gray && has_no_color(&photograph) {
            // Gray is neutral in every space: only the curve differs.
            return match &self.gray {
                Some(curve) => relit(&photograph, curve, &self.target_curve, 1.0),
                None => Ok(photograph),
            };
        }
        let Some(source) = &self.rgb else { return Ok(photograph) };
        let layout = if channels == 4 { Layout::Rgba } else { Layout::Rgb };
        let transform = transform(source, &self.target, layout).map_err(|reason| {
            Error::input(name, format!("its ICC profile cannot be followed ({reason})"), "Convert it to sRGB.")
        })?;
        Ok(Photograph::Sixteen(match photograph {
            Photograph::Eight(raster) => convert(&raster, &*transform, |sample| u16::from(sample) * 257)?,
            Photograph::Sixteen(raster) => convert(&raster, &*transform, |sample| sample)?,
        }))
    }

    /// Converts a photograph whose samples are light by `curve`, one that keeps what is brighter than white; alpha
    /// stays. Its profile tells primaries alone, and the target is sRGB's. Colors that sRGB has not are brought to its
    /// border.
    ///
    /// # Errors
    /// [`Error::Input`] if the profile describes no conversion. `name` is for messages.
    pub(crate) fn apply_to_light(
        &self,
        photograph: Photograph,
        curve: &TransferCurve,
        name: &str,
    ) -> Result<Photograph> {
        let mut raster = match photograph {
            Photograph::Sixteen(raster) if raster.channels() >= 3 => raster,
            other => return Ok(other),
        };
        let Some(source) = &self.rgb else { return Ok(Photograph::Sixteen(raster)) };
        let of_xyz = self.target.rgb_to_xyz_matrix().inverse();
        let matrix = of_xyz.mat_mul(source.rgb_to_xyz_matrix()).v;
        if !matrix.as_flattened().iter().all(|entry| entry.is_finite()) {
            return Err(Error::input(name, "its primaries make no colors", "Export it in sRGB's primaries."));
        }
        let light: Vec<f64> = (0..=u16::MAX).map(|level| curve.linear(f64::from(level) / FULL)).collect();
        let channels = raster.channels();
        raster.data_mut().par_chunks_mut(CHUNK_PIXELS * channels).for_each(|samples| {
            for pixel in samples.chunks_exact_mut(channels) {
                let own: [f64; 3] = std::array::from_fn(|channel| light[usize::from(pixel[channel])]);
                for (sample, row) in pixel.iter_mut().zip(matrix) {
                    let converted = (0..3).map(|channel| row[channel] * own[channel]).sum::<f64>();
                    *sample = (curve.encoded(converted) * FULL).round() as u16;
                }
            }
        });
        Ok(Photograph::Sixteen(raster))
    }
}

/// Whether all pixels have as much red as green and blue.
fn has_no_color(photograph: &Photograph) -> bool {
    fn is_neutral<T: Copy + Default + PartialEq + Sync>(raster: &Raster<T>) -> bool {
        let is_gray = |pixel: &[T]| matches!(pixel, [red, green, blue, ..] if red == green && green == blue);
        raster.data().par_chunks_exact(raster.channels().max(1)).all(is_gray)
    }
    match photograph {
        Photograph::Eight(raster) => is_neutral(raster),
        Photograph::Sixteen(raster) => is_neutral(raster),
    }
}

/// The conversion of RGB samples from one profile to another, relative to white, with floating point between.
pub(crate) fn transform(
    source: &ColorProfile,
    target: &ColorProfile,
    layout: Layout,
) -> std::result::Result<Arc<Transform16BitExecutor>, String> {
    let options = TransformOptions {
        rendering_intent: RenderingIntent::RelativeColorimetric,
        allow_use_cicp_transfer: false,
        prefer_fixed_point: false,
        ..TransformOptions::default()
    };
    source.create_transform_16bit(layout, target, layout, options).map_err(|error| error.to_string())
}

fn convert<T: Copy + Default + Sync>(
    raster: &Raster<T>,
    transform: &Transform16BitExecutor,
    widened: impl Fn(T) -> u16 + Sync,
) -> Result<Raster<u16>> {
    let channels = raster.channels();
    let mut converted = vec![0; raster.data().len()];
    let samples = CHUNK_PIXELS * channels;
    converted.par_chunks_mut(samples).zip(raster.data().par_chunks(samples)).try_for_each(|(target, source)| {
        let wide: Vec<u16> = source.iter().map(|&sample| widened(sample)).collect();
        transform
            .transform(&wide, target)
            .map_err(|error| Error::input("color conversion", error, "Report this as a defect."))
    })?;
    Raster::from_data(raster.width(), raster.height(), channels, converted)
}

/// A photograph whose samples are light by `from`, as 16-bit samples of `to`, whose full light is `full` of that; alpha
/// stays.
pub(crate) fn relit(
    photograph: &Photograph,
    from: &TransferCurve,
    to: &TransferCurve,
    full: f64,
) -> Result<Photograph> {
    let table = |last: usize| -> Vec<u16> {
        let level = |index: usize| to.encoded(from.linear(index as f64 / last as f64) / full);
        (0..=last).map(|index| (level(index) * FULL).round() as u16).collect()
    };
    Ok(Photograph::Sixteen(match photograph {
        // 257 * 255 = 65535.
        Photograph::Eight(raster) => looked_up(raster, &table(u8::MAX.into()), |alpha| u16::from(alpha) * 257)?,
        Photograph::Sixteen(raster) => looked_up(raster, &table(u16::MAX.into()), |alpha| alpha)?,
    }))
}

/// The samples of a table, of alpha those of a function.
fn looked_up<T: Copy + Default + Into<usize> + Sync>(
    raster: &Raster<T>,
    table: &[u16],
    alpha: impl Fn(T) -> u16 + Sync,
) -> Result<Raster<u16>> {
    let channels = raster.channels();
    let mut samples = vec![0; raster.data().len()];
    let at_a_time = CHUNK_PIXELS * channels.max(1);
    samples.par_chunks_mut(at_a_time).zip(raster.data().par_chunks(at_a_time)).for_each(|(target, source)| {
        for (place, (target, &sample)) in target.iter_mut().zip(source).enumerate() {
            *target = if channels == 4 && place % 4 == 3 { alpha(sample) } else { table[sample.into()] };
        }
    });
    Raster::from_data(raster.width(), raster.height(), channels, samples)
}
