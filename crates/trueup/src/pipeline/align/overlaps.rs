//! Cameras and the overlaps that follow from them: what most methods share.

use std::sync::Arc;

use serde::Serialize;
use trueup_align::cameras::{self, CameraOptions, Cameras, SceneModel};
use trueup_align::match_points::{self, MatchPointOptions, OverlapWarp};
use trueup_align::mesh::BaseShape;
use trueup_core::diagnostics::Reported;
use trueup_core::matches::PairMatches;
use trueup_core::options::OptionValue;
use trueup_core::{Error, Result, StageContext};

use super::component::Component;
use crate::memo::{Memo, OVERLAPS};
use crate::options::{AlignOptions, MethodForm};

/// The options that overlaps depend on.
#[derive(Debug, Serialize)]
struct OverlapOptions<'a> {
    cameras: &'a CameraOptions,
    match_points: &'a MatchPointOptions,
    /// The largest side of a cell of the grids, working pixels.
    cell_px: f64,
}

/// Cameras and the overlaps that follow from them.
#[derive(Debug, Clone)]
pub(super) struct Overlaps {
    pub cameras: Cameras,
    /// The pairs that the cameras agree with.
    pub pairs: Vec<PairMatches>,
    /// Their grids carried across them.
    pub warps: Vec<OverlapWarp>,
}

/// Estimates the cameras and carries grids across the overlaps, unless this was done before for the same group of the
/// set.
///
/// # Errors
/// Those of the two stages.
pub(super) fn run(
    component: &Component,
    options: &AlignOptions,
    memo: Memo,
    context: &StageContext,
) -> Result<Arc<Reported<Overlaps>>> {
    let options = OverlapOptions {
        cameras: &camera_options(options)?,
        match_points: &options.match_points,
        cell_px: component.cell_px(&options.mesh),
    };
    let group = (&component.members, component.reference);
    let overlaps = memo.run_in_memory(OVERLAPS, &group, component, &options, find, context)?;
    context.absorb(overlaps.told());
    Ok(overlaps)
}

/// The options of the cameras, which rotate where the method has no place for a flat scene: it draws on its own mesh.
///
/// # Errors
/// [`Error::NotApplicable`] if a flat scene is asked for by such a method.
fn camera_options(options: &AlignOptions) -> Result<CameraOptions> {
    let method = options.stitch.method;
    let draws_planes = matches!(method.form(), MethodForm::Mesh(..)) && options.mesh.base == BaseShape::Sphere;
    match options.cameras.scene {
        SceneModel::Plane if !draws_planes => Err(Error::not_applicable(
            "cameras.scene = plane",
            format!("the method {} has no place for a flat scene", method.display()),
            "Leave the method to vpg, or cameras.scene to auto.",
        )),
        SceneModel::Auto if !draws_planes => {
            Ok(CameraOptions { scene: SceneModel::Rotating, ..options.cameras.clone() })
        }
        _ => Ok(options.cameras.clone()),
    }
}

fn find(component: &Component, options: &OverlapOptions, context: &StageContext) -> Result<Overlaps> {
    let priors = component.camera_priors();
    let cameras = context.in_one_step("cameras", || {
        let (pairs, curves, lines) = (&component.pairs, &component.curves, &component.lines);
        let input = cameras::CameraInput { priors: &priors, pairs, curves, lines, reference: component.reference };
        cameras::run(&input, options.cameras, context)
    })?;
    let pairs: Vec<PairMatches> = (0..component.pairs.len())
        .filter(|position| cameras.contradicting.binary_search(position).is_err())
        .map(|position| component.pairs[position].clone())
        .collect();
    let grids = component.grids(options.cell_px);
    let warps = context.time("match points", || {
        match_points::run(&component.frames, &grids, &cameras, &pairs, options.match_points, context)
    })?;
    Ok(Overlaps { cameras, pairs, warps })
}
