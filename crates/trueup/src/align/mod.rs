//! From matches to deformed grids for one group of overlapping photographs.

mod component;
mod overlaps;

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_align::cameras::Cameras;
use trueup_align::full_turn::{self, FullTurnCut};
use trueup_align::match_points::OverlapWarp;
use trueup_align::mesh::{self, Closure, MeshInput, Refinements, WarpedMesh};
use trueup_align::similarity::{self, PriorInput, PriorMethod, SimilarityOptions, SimilarityPrior};
use trueup_align::stitch_graph::GraphEdge;
use trueup_align::vanishing::{self, TriadOutcome};
use trueup_align::warps::{self, WarpInput};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;

use crate::cache::Known;
use crate::clock::Clock;
use crate::memory::{OverlapMemory, Overlaps};
use crate::method::Shape;
use crate::options::StitchOptions;
use crate::refinement::Material;

use component::name_seed;

pub(crate) use component::{Component, camera_groups};

/// The geometry of one group.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Geometry {
    pub cameras: Cameras,
    pub triads: Vec<TriadOutcome>,
    pub prior: SimilarityPrior,
    pub mesh: WarpedMesh,
    /// The pairs whose overlaps were to coincide.
    pub met: Vec<PairMatches>,
}

/// [`run`], unless an earlier run found this geometry.
pub(crate) fn run_or_recall(
    component: &Component,
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
    known: &Known<'_>,
    photographs: &FilePhotographs,
) -> Result<Geometry> {
    let Some(key) = known.geometry_key(component, options) else {
        return run(component, options, context, clock, None, photographs);
    };
    if let Some((geometry, findings)) = known.geometry(&key) {
        findings.into_iter().for_each(|one| context.report(one));
        return Ok(geometry);
    }
    let found = context.gather(|context| run(component, options, context, clock, None, photographs))?;
    known.keep_geometry(&key, &found.value, &found.findings);
    Ok(context.absorb(found))
}

/// Runs the geometry stages in their order. With a `memory`, cameras and overlaps that it holds are not found again.
/// `photographs` are looked at again only if the options ask for pixels that were not kept.
pub(crate) fn run(
    component: &Component,
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
    memory: Option<&OverlapMemory>,
    photographs: &FilePhotographs,
) -> Result<Geometry> {
    let grids: Vec<GridMesh> = component
        .frames
        .iter()
        .map(|frame| GridMesh::regular(frame.width, frame.height, options.mesh.cell_px))
        .collect();
    let overlaps = match memory {
        None => Arc::new(overlaps::find(component, &grids, options, context, clock)?),
        Some(memory) => overlaps::recall(memory, component, &grids, options, context, clock)?,
    };
    let Overlaps { cameras, pairs, warps, .. } = overlaps.as_ref();
    let triads = clock.time("vanishing points", || find_triads(component, cameras, options, context))?;
    let shape = options.stitch.method.shape();
    let prior = in_one_step("prior", context, clock, || {
        let input = PriorInput {
            cameras: &cameras.cameras,
            triads: &triads,
            lines: &component.lines,
            frames: &component.frames,
            edges: pairs,
            overlaps: warps,
            cell_px: options.mesh.cell_px,
            vanishing: &options.vanishing,
            turn: component.reference_rotation,
            reference: component.reference,
        };
        similarity::run(&input, &wanted_prior(shape, options), context)
    })?;

    let edges: Vec<GraphEdge> =
        pairs.iter().map(|pair| GraphEdge { a: pair.a, b: pair.b, weight: pair.agreeing }).collect();
    let cut = full_turn::find_cut(&cameras.cameras, &edges, &prior.level_from_world());
    let turn = cut.as_ref().map(|cut| Turn::new(cut, warps));
    let kept: Cow<'_, [OverlapWarp]> = turn.as_ref().map_or(warps.into(), |turn| turn.within.as_slice().into());
    let unsevered = |pair: &PairMatches| {
        let severed = |cut: &FullTurnCut| cut.severed.binary_search(&(pair.a, pair.b)).is_ok();
        !cut.as_ref().is_some_and(severed)
    };
    let met: Vec<PairMatches> = pairs.iter().filter(|pair| unsevered(pair)).cloned().collect();
    let mesh = in_one_step("mesh", context, clock, || match shape {
        Shape::Mesh(_) => {
            let bases = mesh::bases(&cameras.cameras, &grids, &prior, &options.mesh);
            let material = Material::new(component, (&grids, &kept), photographs, options, context)?;
            let closure = turn.as_ref().and_then(|turn| turn.closure(mesh::turn_length(&cameras.cameras, &prior)));
            // What is turned as a whole does not go round along the panorama's rows.
            let closure = closure.filter(|_| component.reference_rotation == 0.0);
            let refinements = Refinements { closure, ..material.refinements(component, &met, options) };
            let reference = component.reference;
            let input = MeshInput { grids: &grids, warps: &kept, bases: &bases, reference, refinements };
            mesh::run(&input, &options.mesh, context)
        }
        Shape::Warp(model) => {
            let fine: Vec<GridMesh> = grids.iter().map(|grid| mesh::divided(grid, options.mesh.subdivision)).collect();
            let input = WarpInput {
                cameras: &cameras.cameras,
                frames: &component.frames,
                grids: &fine,
                pairs: &met,
                match_grids: &grids,
                overlaps: &kept,
                names: &component.names(),
                seeds: &component.seeds(),
                reference: component.reference,
                level_from_world: prior.level_from_world(),
                cut_yaw: cut.as_ref().map(|cut| cut.yaw),
                turn: component.reference_rotation,
            };
            warps::run(model, &input, &options.warps, context)
        }
    })?;
    if let Some(cut) = &cut {
        report_cut(cut, mesh.period.is_some(), component, context);
    }
    let met = if mesh.period.is_some() { pairs.clone() } else { met };
    Ok(Geometry { cameras: cameras.clone(), triads, prior, mesh, met })
}

/// The overlaps of a full turn, by whether they lie across its cut.
struct Turn {
    within: Vec<OverlapWarp>,
    across: Vec<OverlapWarp>,
    /// For each of those across, see [`Closure::turns`].
    turns: Vec<f64>,
}

impl Turn {
    fn new(cut: &FullTurnCut, warps: &[OverlapWarp]) -> Self {
        let is_within =
            |warp: &&OverlapWarp| cut.severed.binary_search(&(warp.from.min(warp.to), warp.from.max(warp.to))).is_err();
        let across = warps.iter().filter_map(|warp| Some((warp.clone(), cut.turns(warp.from, warp.to)?)));
        let (across, turns) = across.unzip();
        Self { within: warps.iter().filter(is_within).cloned().collect(), across, turns }
    }

    /// What closes the turn, whose length is `expected` by the cameras.
    fn closure(&self, expected: f64) -> Option<Closure<'_>> {
        (!self.across.is_empty()).then(|| Closure { warps: &self.across, turns: &self.turns, expected })
    }
}

/// The options of the prior that a method means.
fn wanted_prior(shape: Shape, options: &StitchOptions) -> SimilarityOptions {
    let prior = match shape {
        Shape::Mesh(None) => options.similarity.prior,
        Shape::Mesh(Some(prior)) => prior,
        Shape::Warp(_) => PriorMethod::Straightening,
    };
    SimilarityOptions { prior, ..options.similarity.clone() }
}

/// Times a stage that is one step and reports it as such.
fn in_one_step<T>(stage: &str, context: &StageContext, clock: &mut Clock, work: impl FnOnce() -> T) -> T {
    context.progress().begin(stage, 1);
    let result = clock.time(stage, work);
    context.progress().advance(stage, 1);
    context.progress().finish(stage);
    result
}

fn find_triads(
    component: &Component,
    cameras: &Cameras,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Vec<TriadOutcome>> {
    const STAGE: &str = "vanishing points";
    context.progress().begin(STAGE, component.frames.len() as u64);
    let triads = (0..component.frames.len())
        .into_par_iter()
        .map(|k| {
            context.check_cancelled()?;
            // Seeded by the photograph's own content-independent name, so that the order of inputs does not matter.
            let mut generator = context.generator(STAGE, name_seed(&component.images[k].path));
            let focal_px = cameras.cameras[k].focal_px;
            let mut outcome = vanishing::detect_triad(
                &component.lines[k],
                focal_px,
                &component.frames[k],
                &options.vanishing,
                &mut generator,
            );
            if options.vanishing.outlier_share > 0.0 {
                vanishing::spoil(&mut outcome, options.vanishing.outlier_share, &mut generator);
            }
            context.progress().advance(STAGE, 1);
            Ok(outcome)
        })
        .collect();
    context.progress().finish(STAGE);
    triads
}

fn report_cut(cut: &FullTurnCut, closed: bool, component: &Component, context: &StageContext) {
    let name = |k: usize| &component.images[k].name;
    let pairs: Vec<String> = cut.severed.iter().map(|&(a, b)| format!("{} - {}", name(a), name(b))).collect();
    let pairs = pairs.join(", ");
    let message = match closed {
        true => format!("a full turn: the ends meet, between {pairs}"),
        false => format!("the photographs go all the way round; the panorama is cut between {pairs}"),
    };
    context.report(Diagnostic::note("full-turn", Subject::stage("mesh"), message, ""));
}
