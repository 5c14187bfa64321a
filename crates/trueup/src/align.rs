//! From matches to deformed grids for one group of overlapping photographs.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_align::cameras::{self, CameraPrior, Cameras};
use trueup_align::full_turn::{self, FullTurnCut};
use trueup_align::match_points::{self, OverlapWarp};
use trueup_align::mesh::{self, Closure, Refinements, WarpedMesh};
use trueup_align::similarity::{self, PriorInput, PriorMethod, SimilarityOptions, SimilarityPrior};
use trueup_align::stitch_graph::GraphEdge;
use trueup_align::vanishing::{self, TriadOutcome};
use trueup_align::warps::{self, WarpInput};
use trueup_core::diagnostics::Diagnostic;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::source::{SourceImage, WorkingFrame};
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;

use crate::cache::Known;
use crate::clock::Clock;
use crate::measure::Measured;
use crate::memory::{OverlapMemory, Overlaps};
use crate::method::Shape;
use crate::options::StitchOptions;
use crate::refinement::Material;

/// One group of overlapping photographs with everything the geometry stages need; indices are local, 0..N.
pub(crate) struct Component<'a> {
    /// Positions of the members among all photographs, ascending.
    pub members: Vec<usize>,
    pub images: Vec<&'a SourceImage>,
    pub frames: Vec<WorkingFrame>,
    pub lines: Vec<Vec<LineSegment>>,
    /// Grey values at the working size, for those that were kept.
    pub grays: Vec<Option<&'a Raster<u8>>>,
    pub pairs: Vec<PairMatches>,
    pub reference: usize,
    /// Rotation that the user's graph wants of the reference photograph, radians clockwise.
    pub reference_rotation: f64,
}

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

impl<'a> Component<'a> {
    /// Cuts a component out of the measured photographs; pairs are renumbered to local indices.
    pub fn new(
        members: &[usize],
        reference: usize,
        reference_rotation: f64,
        images: &'a [SourceImage],
        measured: &'a [Option<Measured>],
        pairs: &[PairMatches],
    ) -> Self {
        let local = |picture: usize| members.binary_search(&picture).ok();
        let known = |picture: &usize| measured[*picture].as_ref();
        let pairs = pairs
            .iter()
            .filter(|pair| pair.verdict.is_joined())
            .filter_map(|pair| Some(PairMatches { a: local(pair.a)?, b: local(pair.b)?, ..pair.clone() }))
            .collect();
        Self {
            members: members.to_vec(),
            images: members.iter().map(|&picture| &images[picture]).collect(),
            frames: members.iter().filter_map(known).map(|one| one.frame).collect(),
            lines: members.iter().filter_map(known).map(|one| one.lines.clone()).collect(),
            grays: members.iter().filter_map(known).map(|one| one.gray.as_ref()).collect(),
            pairs,
            reference: local(reference).unwrap_or(0),
            reference_rotation,
        }
    }

    fn names(&self) -> Vec<String> {
        self.images.iter().map(|image| image.name.clone()).collect()
    }

    /// A number for each photograph that depends neither on its folder nor on the order of the inputs.
    fn seeds(&self) -> Vec<u64> {
        self.images.iter().map(|image| name_seed(&image.path)).collect()
    }

    /// Which photographs one camera took: [`camera_groups`].
    pub(crate) fn camera_groups(&self) -> Vec<usize> {
        camera_groups(&self.images)
    }

    /// What metadata say of the cameras, in working pixels.
    fn camera_priors(&self) -> Vec<CameraPrior> {
        self.images
            .iter()
            .zip(&self.frames)
            .zip(self.camera_groups())
            .map(|((image, frame), camera_group)| CameraPrior {
                frame: *frame,
                focal_px: image.focal_prior.map(|prior| prior.focal_px * frame.working_from_full),
                camera_group,
            })
            .collect()
    }
}

/// Which photographs one camera took, as far as models and sizes tell: a number for each.
pub(crate) fn camera_groups(images: &[&SourceImage]) -> Vec<usize> {
    let key = |image: &SourceImage| {
        let (short, long) = (image.width.min(image.height), image.width.max(image.height));
        (image.camera_model.clone(), short, long)
    };
    let mut keys: Vec<_> = images.iter().map(|image| key(image)).collect();
    keys.sort();
    keys.dedup();
    images.iter().map(|image| keys.binary_search(&key(image)).unwrap_or(0)).collect()
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
    let before = context.take_diagnostics();
    let geometry = run(component, options, context, clock, None, photographs)?;
    let findings = context.take_diagnostics();
    known.keep_geometry(&key, &geometry, &findings);
    before.into_iter().chain(findings).for_each(|one| context.report(one));
    Ok(geometry)
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
        None => Arc::new(find_overlaps(component, &grids, options, context, clock)?),
        Some(memory) => recall_overlaps(memory, component, &grids, options, context, clock)?,
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
            mesh::run_refined(&grids, &kept, &bases, component.reference, &options.mesh, &refinements, context)
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

/// Cameras, the pairs that agree with them, and the grids carried across these.
fn find_overlaps(
    component: &Component,
    grids: &[GridMesh],
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
) -> Result<Overlaps> {
    let names = component.names();
    let priors = component.camera_priors();
    let cameras = in_one_step("cameras", context, clock, || {
        cameras::run(&priors, &names, &component.pairs, component.reference, &options.cameras, context)
    })?;
    let pairs: Vec<PairMatches> = (0..component.pairs.len())
        .filter(|position| cameras.contradicting.binary_search(position).is_err())
        .map(|position| component.pairs[position].clone())
        .collect();
    let warps = clock.time("match points", || {
        match_points::run(&component.frames, grids, &cameras.cameras, &pairs, &options.match_points, context)
    })?;
    Ok(Overlaps { cameras, pairs, warps, findings: Vec::new(), seconds: BTreeMap::new() })
}

fn recall_overlaps(
    memory: &OverlapMemory,
    component: &Component,
    grids: &[GridMesh],
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
) -> Result<Arc<Overlaps>> {
    let key = OverlapMemory::key(&component.members, component.reference, options);
    let overlaps = match memory.recall(&key) {
        Some(overlaps) => overlaps,
        None => {
            let before = context.take_diagnostics();
            let mut own_clock = Clock::default();
            let mut overlaps = find_overlaps(component, grids, options, context, &mut own_clock)?;
            overlaps.seconds = own_clock.into_seconds();
            overlaps.findings = context.take_diagnostics();
            before.into_iter().for_each(|one| context.report(one));
            let overlaps = Arc::new(overlaps);
            memory.keep(key, &overlaps);
            overlaps
        }
    };
    overlaps.findings.iter().for_each(|one| context.report(one.clone()));
    clock.add_all(&overlaps.seconds);
    Ok(overlaps)
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

/// A number for a file name, the same whatever folder it lies in and wherever it stands among the inputs.
fn name_seed(path: &Path) -> u64 {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.bytes().fold(0, |hash: u64, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)))
}

fn report_cut(cut: &FullTurnCut, closed: bool, component: &Component, context: &StageContext) {
    let name = |k: usize| &component.images[k].name;
    let pairs: Vec<String> = cut.severed.iter().map(|&(a, b)| format!("{} - {}", name(a), name(b))).collect();
    let pairs = pairs.join(", ");
    let message = match closed {
        true => format!("a full turn: the ends meet, between {pairs}"),
        false => format!("the photographs go all the way round; the panorama is cut between {pairs}"),
    };
    context.report(Diagnostic::note("full-turn", "mesh", message, ""));
}
