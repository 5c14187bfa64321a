//! The align phase: from matches to deformed grids for one group of overlapping photographs.

pub(crate) mod component;
mod deformation;
mod overlaps;
mod refinement;
mod straightened;
mod turn;
mod vanishing;

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use trueup_align::cameras::{Cameras, FlatScene};
use trueup_align::full_turn::{self, FullTurnCut};
use trueup_align::match_points::OverlapWarp;
use trueup_align::mesh::WarpedMesh;
use trueup_align::similarity::{self, PriorInput, PriorMethod, SimilarityPrior};
use trueup_align::stitch_graph::GraphEdge;
use trueup_align::vanishing::{MissingTriad, TriadOutcome};
use trueup_core::diagnostics::Reported;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;

use self::component::Component;
use self::deformation::Deformation;
use self::overlaps::Overlaps;
use self::turn::{Turn, report_cut};
use crate::memo::{GEOMETRY, Key, KeyMaker, Memo};
use crate::options::{AlignOptions, MethodForm};

pub(crate) use self::refinement::{PARALLAX, needs_pixels};

/// What the phase works on.
#[derive(Debug)]
pub(crate) struct AlignInput<'a> {
    pub component: &'a Component<'a>,
    /// The photographs' pixels, looked at again only if the options ask for some that were not kept.
    pub photographs: &'a FilePhotographs,
    /// Vanishing directions of each photograph that are known already, in place of those that its lines tell.
    pub directions: Option<&'a [TriadOutcome]>,
    /// What decides the measurements of each photograph of the set, and the matches; `None` where they cannot be known
    /// again.
    pub key: Option<KeyMaker>,
    /// Where earlier results are found.
    pub memo: Memo<'a>,
}

/// The geometry of one group of photographs.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Geometry {
    pub cameras: Cameras,
    pub triads: Vec<TriadOutcome>,
    pub prior: SimilarityPrior,
    pub mesh: WarpedMesh,
    /// The pairs whose overlaps are to coincide.
    pub coinciding: Vec<PairMatches>,
    /// The photographs' segments as they were found again behind lenses that bend, in working pixels; `None` where
    /// those measured stand.
    pub straightened: Option<Vec<Vec<LineSegment>>>,
}

impl Geometry {
    /// The segments of the photographs that it was found for, in working pixels.
    pub(crate) fn lines<'a>(&'a self, component: &'a Component) -> &'a [Vec<LineSegment>] {
        self.straightened.as_deref().unwrap_or(&component.lines)
    }
}

/// Finds the geometry of a group, unless an earlier run did, by `options` that are fixed by the method. Photographs are
/// numbered within the group.
///
/// # Errors
/// Those of the stages; [`trueup_core::Error::NotApplicable`] if a warp model cannot place the photographs;
/// [`trueup_core::Error::Cancelled`].
pub(crate) fn run(input: &AlignInput, options: &AlignOptions, context: &StageContext) -> Result<Reported<Geometry>> {
    input.memo.run(GEOMETRY, geometry_key(input, options).as_ref(), input, options, find_geometry, context)
}

/// Everything that decides the geometry; `None` if nothing is kept, or directions are given by hand.
fn geometry_key(input: &AlignInput, options: &AlignOptions) -> Option<Key> {
    let AlignInput { component, key, memo, directions, .. } = input;
    let file_name = |image: &&SourceImage| image.path.file_name().map(|file| file.to_string_lossy().into_owned());
    let images: Vec<_> =
        component.images.iter().map(|image| (&image.name, file_name(image), image.focal_prior, image.lens)).collect();
    let own = key.clone().filter(|_| directions.is_none())?;
    let own = own
        .part(&images)
        .part(&component.camera_groups())
        .part(&component.lens_groups())
        .part(&component.pairs)
        .part(&(component.reference, component.reference_rotation));
    memo.key(GEOMETRY, Some(own), options)
}

/// The stages in their order.
fn find_geometry(input: &AlignInput, options: &AlignOptions, context: &StageContext) -> Result<Geometry> {
    let component = input.component;
    let grids = component.grids(component.cell_px(&options.mesh));
    let overlaps = overlaps::run(component, options, input.memo, context)?;
    let Overlaps { cameras, pairs, warps } = &overlaps.value;
    let lines = context
        .time("straightened lines", || straightened::lines(component, &cameras.cameras, input.photographs, context))?;
    if let Some(scene) = &cameras.flat_scene {
        let scene = scene.stood_upright(&lines, component.reference_rotation);
        let geometry = find_on_plane(input, scene, &grids, &overlaps.value, options, context)?;
        return Ok(Geometry { straightened: found_again(lines), ..geometry });
    }
    let triads = match input.directions {
        Some(known) => known.to_vec(),
        None => vanishing::run(component, &lines, cameras, &options.vanishing, context)?,
    };
    let measured = MeasuredLines { lines: &lines, triads: &triads };
    let prior = context.in_one_step("prior", || find_prior(component, &overlaps.value, measured, options, context))?;

    let edges: Vec<GraphEdge> = pairs.iter().map(GraphEdge::of).collect();
    let cut = full_turn::find_cut(&cameras.cameras, &edges, &prior.level_from_world());
    let turn = cut.as_ref().map(|cut| Turn::new(cut, warps));
    let within: Cow<'_, [OverlapWarp]> = turn.as_ref().map_or(warps.into(), |turn| turn.within.as_slice().into());
    let unsevered = |pair: &&PairMatches| {
        let severed = |cut: &FullTurnCut| cut.severed.binary_search(&(pair.a, pair.b)).is_ok();
        !cut.as_ref().is_some_and(severed)
    };
    let within_turn: Vec<PairMatches> = pairs.iter().filter(unsevered).cloned().collect();
    let deformation = Deformation {
        input,
        grids: &grids,
        cameras,
        prior: &prior,
        all_warps: warps,
        warps: &within,
        pairs: &within_turn,
        turn: turn.as_ref(),
        cut: cut.as_ref(),
    };
    let mesh = context.in_one_step("mesh", || match options.stitch.method.form() {
        MethodForm::Mesh(..) => deformation.by_mesh(options, context),
        MethodForm::Warp(model) => deformation.by_warp(model, options, context),
    })?;
    if let Some(cut) = &cut {
        report_cut(cut, mesh.period.is_some(), component, context);
    }
    let coinciding = if mesh.period.is_some() { pairs.clone() } else { within_turn };
    Ok(Geometry { cameras: cameras.clone(), triads, prior, mesh, coinciding, straightened: found_again(lines) })
}

/// Segments that are not those measured.
fn found_again(lines: Cow<[Vec<LineSegment>]>) -> Option<Vec<Vec<LineSegment>>> {
    match lines {
        Cow::Borrowed(_) => None,
        Cow::Owned(lines) => Some(lines),
    }
}

/// The geometry of a flat scene that stands upright: grids on its plane.
fn find_on_plane(
    input: &AlignInput,
    scene: FlatScene,
    grids: &[GridMesh],
    overlaps: &Overlaps,
    options: &AlignOptions,
    context: &StageContext,
) -> Result<Geometry> {
    let Overlaps { cameras, pairs, warps } = overlaps;
    let prior = similarity::of_flat_scene(&scene);
    let cameras = cameras.on_plane(scene);
    let deformation = Deformation {
        input,
        grids,
        cameras: &cameras,
        prior: &prior,
        all_warps: warps,
        warps,
        pairs,
        turn: None,
        cut: None,
    };
    let mesh = context.in_one_step("mesh", || deformation.by_mesh(options, context))?;
    let triads = vec![TriadOutcome::Missing(MissingTriad::FlatScene); grids.len()];
    Ok(Geometry { triads, prior, mesh, coinciding: pairs.clone(), cameras, straightened: None })
}

/// What the photographs' lines tell.
#[derive(Clone, Copy)]
struct MeasuredLines<'a> {
    /// The segments, as straight as they are behind a pinhole.
    lines: &'a [Vec<LineSegment>],
    triads: &'a [TriadOutcome],
}

/// How every photograph is to be turned and scaled, under the prior that the method means.
fn find_prior(
    component: &Component,
    overlaps: &Overlaps,
    MeasuredLines { lines, triads }: MeasuredLines,
    options: &AlignOptions,
    context: &StageContext,
) -> Result<SimilarityPrior> {
    let method = match options.stitch.method.form() {
        MethodForm::Mesh(prior, _) => prior,
        MethodForm::Warp(_) => PriorMethod::Straightening,
    };
    let shown = component.shown();
    let input = PriorInput {
        method,
        cameras: &overlaps.cameras.cameras,
        triads,
        lines,
        frames: &component.frames,
        gravity: &component.gravity(),
        shown: &shown,
        edges: &overlaps.pairs,
        overlaps: &overlaps.warps,
        cell_px: component.cell_px(&options.mesh),
        vanishing: &options.vanishing,
        turn: component.reference_rotation,
        reference: component.reference,
    };
    similarity::run(&input, &options.similarity, context)
}
