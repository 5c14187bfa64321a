//! A photograph's samples from its own color space to the panorama's.

use std::sync::Arc;

use moxcms::{ColorProfile, Layout, RenderingIntent, Transform16BitExecutor, TransformOptions};
use rayon::prelude::*;
use trueup_core::color::TransferCurve;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::{Error, Result};

/// Pixels converted at a time: enough to keep a thread busy, little beside a photograph.
const CHUNK_PIXELS: usize = 1 << 16;

/// From one color space to another; for the kinds of samples that need no conversion there is none.
#[derive(Debug, Clone)]
pub(crate) struct Conversion {
    /// From the profile of RGB samples.
    pub(crate) rgb: Option<Arc<ColorProfile>>,
    /// From the curve of gray samples.
    pub(crate) gray: Option<TransferCurve>,
    pub(crate) target: Arc<ColorProfile>,
    pub(crate) target_curve: TransferCurve,
}

impl Conversion {
    /// Converts a photograph, with 16 bits a sample, since 8 would lose; alpha stays. `name` is for messages.
    ///
    /// # Errors
    /// [`Error::Input`] if the profile describes no conversion.
    pub(crate) fn apply(&self, photograph: Photograph, name: &str) -> Result<Photograph> {
        match (photograph.channels(), &self.rgb, &self.gray) {
            (1, _, Some(curve)) => Ok(self.convert_gray(&photograph, curve)?),
            (1, _, None) | (_, None, _) => Ok(photograph),
            (channels, Some(source), _) => {
                let layout = if channels == 4 { Layout::Rgba } else { Layout::Rgb };
                let transform = transform(source, &self.target, layout).map_err(|reason| {
                    Error::input(name, format!("its ICC profile cannot be followed ({reason})"), "Convert it to sRGB.")
                })?;
                Ok(Photograph::Sixteen(match photograph {
                    Photograph::Eight(raster) => convert(&raster, &*transform, |sample| u16::from(sample) * 257)?,
                    Photograph::Sixteen(raster) => convert(&raster, &*transform, |sample| sample)?,
                }))
            }
        }
    }

    /// Gray is neutral in every space: only the curve differs.
    fn convert_gray(&self, photograph: &Photograph, curve: &TransferCurve) -> Result<Photograph> {
        let (width, height) = (photograph.width(), photograph.height());
        let table = |last: usize| -> Vec<u16> {
            let level = |index: usize| self.target_curve.encoded(curve.linear(index as f64 / last as f64));
            (0..=last).map(|index| (level(index) * 65535.0).round() as u16).collect()
        };
        let data = match photograph {
            Photograph::Eight(raster) => {
                let table = table(usize::from(u8::MAX));
                raster.data().iter().map(|&sample| table[usize::from(sample)]).collect()
            }
            Photograph::Sixteen(raster) => {
                let table = table(usize::from(u16::MAX));
                raster.data().iter().map(|&sample| table[usize::from(sample)]).collect()
            }
        };
        Ok(Photograph::Sixteen(Raster::from_data(width, height, 1, data)?))
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
