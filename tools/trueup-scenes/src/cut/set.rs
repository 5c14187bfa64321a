//! Cut sets on disk with their truth.

use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use rand::Rng;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::geometry::{roll_from_down, rows_of};
use trueup_core::raster::Raster;
use trueup_core::truth::{ImageTruth, Truth};
use trueup_core::{Error, Result, StageContext};

use crate::dice::Dice;
use crate::set::{jpeg, write_truth};

use super::level::{LevelOptions, measure_level};
use super::panorama::Panorama360;
use super::spec::{CutSpec, ViewSpec, world_from_panorama};
use super::view::{PinholeView, to_bytes};

/// The name of the work in progress reports.
const STAGE: &str = "cutting";
/// Samples along the side of a pixel at least, so that edges are smooth where the view is finer than the panorama.
const LEAST_SAMPLES: usize = 2;

/// Cuts the views of `spec` into a folder, which is made if need be: `00.jpg`, `01.jpg`, ... and `truth.json`.
///
/// Values are interpolated, averaged and multiplied by the gain as they are encoded, not in linear light. The world is
/// defined by the spec's `down`, or where that is absent by [`measure_level`] with default options. Noise derives from
/// the context's seed. A spec made for a panorama of another name is reported as `spec-of-another-panorama`.
///
/// # Errors
/// [`Error::Input`] for a spec that fails [`CutSpec::check`], [`Error::Io`] if a file cannot be written,
/// [`Error::Cancelled`].
pub fn cut_set(panorama: &Panorama360, spec: &CutSpec, directory: &Path, context: &StageContext) -> Result<Truth> {
    spec.check("the spec")?;
    warn_of_another_panorama(panorama, spec, context);
    let level = match spec.given_level() {
        Some(level) => level,
        None => measure_level(panorama, &LevelOptions::default(), context)?,
    };
    let panorama_from_world = world_from_panorama(&Vector3::from(level.down)).transpose();
    fs::create_dir_all(directory).map_err(|error| Error::io("making the folder", directory, error))?;
    context.progress().begin(STAGE, spec.views.len() as u64);
    let mut images = Vec::with_capacity(spec.views.len());
    for (index, view_spec) in spec.views.iter().enumerate() {
        let view = spec.camera_of(view_spec);
        let picture = take(panorama, &view, view_spec, index, context)?;
        let file = format!("{index:02}.jpg");
        let path = directory.join(&file);
        fs::write(&path, jpeg(&picture)?).map_err(|error| Error::io("writing", &path, error))?;
        let camera_from_world = view.camera.rotation() * panorama_from_world;
        images.push(ImageTruth {
            file,
            width: view.width,
            height: view.height,
            focal_px: view.camera.focal_px,
            lens: None,
            rotation: rows_of(&camera_from_world),
            gamma_deg: roll_from_down(&(camera_from_world * Vector3::y())).to_degrees(),
            center: None,
            depth: None,
        });
        context.progress().advance(STAGE, 1);
    }
    context.progress().finish(STAGE);
    let truth = Truth { source: panorama.name().to_owned(), images, level: Some(level) };
    write_truth(directory, &truth)?;
    Ok(truth)
}

fn take(
    panorama: &Panorama360,
    view: &PinholeView,
    spec: &ViewSpec,
    index: usize,
    context: &StageContext,
) -> Result<Raster<u8>> {
    let seed = context.generator(STAGE, index as u64).next_u64();
    let develop = |row: usize| {
        let mut dice = Dice::new(seed, row as u64);
        move |color: [f32; 3]| {
            to_bytes(color.map(|value| {
                let grain = if spec.noise > 0.0 { spec.noise * dice.normal() } else { 0.0 };
                (f64::from(value) * spec.gain + grain) as f32
            }))
        }
    };
    view.take(panorama, LEAST_SAMPLES, develop, context)
}

fn warn_of_another_panorama(panorama: &Panorama360, spec: &CutSpec, context: &StageContext) {
    let stem = Path::new(panorama.name()).file_stem().map(|stem| stem.to_string_lossy());
    if let (Some(made_for), Some(stem)) = (&spec.pano, stem)
        && *made_for != stem
    {
        context.report(Diagnostic::warning(
            "spec-of-another-panorama",
            Subject::file(panorama.name()),
            format!("the spec was made for {made_for}; its vertical may not be this panorama's"),
            "Make a spec for this panorama, or leave its down and level out to have them measured.",
        ));
    }
}
