//! Measures a panorama by its own lines and matches.

use rayon::prelude::*;
use trueup_align::metrics::{
    self, MatchedPair, Outside, Straightness, VerticalLinesInput, expected_magnitude, folded_cells, mean_relative_turn,
    rectangle_rotation,
};
use trueup_align::similarity::{EstimatedRoll, RollsInput, estimated_rolls};
use trueup_core::matches::PointMatch;
use trueup_core::mesh::GridMesh;

use super::measures::{
    BentLine, HUNDREDTHS, LongLines, Measures, PhotographMeasures, ReprojectionMeasures, UprightMeasures, WorstPair,
};
use crate::pipeline::align::Geometry;
use crate::pipeline::align::component::Component;
use crate::pipeline::arrange::Arrangement;

/// A photograph whose lean is less sure than this, half the width of its 95 % interval, has no figure: a lean of a degree is
/// seen. Degrees.
const WIDEST_DEG: f64 = 1.0;
/// Fewer photographs have no uprightness in common.
const FEWEST: usize = 2;

/// A photograph's lean in the panorama and the roll it follows from. Radians.
#[derive(Debug, Clone, Copy)]
struct Lean {
    lean: f64,
    by: EstimatedRoll,
}

impl Lean {
    fn is_certain(&self) -> bool {
        self.by.within <= WIDEST_DEG.to_radians()
    }
}

/// Measures a panorama as it is delivered, whatever it is drawn on.
pub(crate) fn run(component: &Component, geometry: &Geometry, arrangement: &Arrangement) -> Measures {
    let period = arrangement.drawn.period.map(|columns| columns as f64);
    let turn = arrangement.projection.as_ref().and_then(|projection| projection.turn_px());
    let whole: Vec<GridMesh> =
        arrangement.delivered.iter().map(|mesh| metrics::without_torn_cells(mesh, turn)).collect();
    let meshes: Vec<&GridMesh> = whole.iter().collect();
    // The same grids over the working pictures, in whose pixels lines are.
    let working: Vec<GridMesh> = meshes
        .iter()
        .zip(&component.frames)
        .map(|(&mesh, frame)| GridMesh { width: frame.width, height: frame.height, ..mesh.clone() })
        .collect();
    let leans = leans(component, geometry, &working);
    let certain: Vec<Option<Lean>> = leans.iter().map(|one| one.filter(Lean::is_certain)).collect();
    let vertical_lines = vertical_lines(component, geometry);
    let distortion = metrics::local_distortion(&working, Outside::Center, period);
    Measures {
        upright: upright(&certain),
        estimated_gdic_deg: estimated_inconsistency(&certain, &working, component.reference),
        reprojection: reprojection(component, geometry, &meshes, period),
        long_lines: long_lines(component, &working),
        ld: HUNDREDTHS * distortion.worst,
        ld_mean: HUNDREDTHS * distortion.mean,
        folds: working.iter().map(folded_cells).sum(),
        photographs: (0..working.len())
            .map(|k| PhotographMeasures {
                path: component.images[k].path.display().to_string(),
                vertical_lines: vertical_lines[k],
                lean_deg: leans[k].map(|one| one.lean.to_degrees()),
                standard_error_deg: leans[k].map(|one| one.by.standard_error.to_degrees()),
                within_deg: leans[k].map(|one| one.by.within.to_degrees()),
                gamma_deg: leans[k].map(|one| one.by.roll.to_degrees()),
                certain: certain[k].is_some(),
            })
            .collect(),
    }
}

/// How many vertical lines each photograph has.
fn vertical_lines(component: &Component, geometry: &Geometry) -> Vec<usize> {
    let down = geometry.prior.level_from_world().row(1).transpose();
    let count = |k: usize| {
        let camera = &geometry.cameras.cameras[k];
        let photograph = VerticalLinesInput {
            lines: &component.lines[k],
            frame: &component.frames[k],
            camera,
            expected_down: camera.rotation() * down,
        };
        metrics::vertical_segments(&photograph).len()
    };
    (0..component.lines.len()).into_par_iter().map(count).collect()
}

/// The lean of every photograph that the lines of all of them tell.
fn leans(component: &Component, geometry: &Geometry, working: &[GridMesh]) -> Vec<Option<Lean>> {
    let input = RollsInput {
        cameras: &geometry.cameras.cameras,
        edges: &geometry.coinciding,
        lines: &component.lines,
        frames: &component.frames,
        prior: &geometry.prior,
    };
    let Some(rolls) = estimated_rolls(&input) else { return vec![None; working.len()] };
    let lean = |(mesh, roll): (&GridMesh, Option<EstimatedRoll>)| {
        let by = roll?;
        let lean = mesh.lean_in_the_middle(by.roll);
        // Where the photograph's middle is not shown, it is no number.
        (!lean.is_nan()).then_some(Lean { lean, by })
    };
    working.iter().zip(rolls).map(lean).collect()
}

fn upright(certain: &[Option<Lean>]) -> Option<UprightMeasures> {
    let found: Vec<Lean> = certain.iter().flatten().copied().collect();
    let measured = found.len();
    if measured < FEWEST {
        return None;
    }
    let largest = found.iter().fold(0.0, |largest: f64, one| largest.max(one.lean.abs()));
    let expected: f64 = found.iter().map(|one| expected_magnitude(one.lean, one.by.standard_error)).sum();
    let within = found.iter().fold(0.0, |widest: f64, one| widest.max(one.lean.abs() + one.by.within));
    Some(UprightMeasures {
        mean_deg: (expected / measured as f64).to_degrees(),
        max_deg: largest.to_degrees(),
        within_deg: Some(within.to_degrees()),
        measured,
    })
}

/// GDIC over the photographs that are certain, with the reference among them or else the first.
fn estimated_inconsistency(certain: &[Option<Lean>], meshes: &[GridMesh], reference: usize) -> Option<f64> {
    let known: Vec<(usize, f64)> =
        certain.iter().enumerate().filter_map(|(k, found)| Some((k, found.as_ref()?.by.roll))).collect();
    let rotations: Vec<f64> = known.iter().map(|&(k, _)| rectangle_rotation(&meshes[k])).collect();
    let gammas: Vec<f64> = known.iter().map(|&(_, gamma)| gamma).collect();
    let reference = known.iter().position(|&(k, _)| k == reference).unwrap_or(0);
    mean_relative_turn(&rotations, &gammas, reference).map(f64::to_degrees)
}

fn reprojection(
    component: &Component,
    geometry: &Geometry,
    meshes: &[&GridMesh],
    period: Option<f64>,
) -> Option<ReprojectionMeasures> {
    let pairs: Vec<MatchedPair> = geometry
        .coinciding
        .iter()
        .map(|pair| {
            let full = |point: [f64; 2], photograph: usize| {
                point.map(|coordinate| coordinate / component.frames[photograph].working_from_full)
            };
            let matches = pair
                .inliers
                .iter()
                .map(|one| PointMatch { in_a: full(one.in_a, pair.a), in_b: full(one.in_b, pair.b) })
                .collect();
            MatchedPair { a: meshes[pair.a], b: meshes[pair.b], matches }
        })
        .collect();
    let found = metrics::reprojection(&pairs, period)?;
    let apart = pairs.iter().zip(&geometry.coinciding).filter_map(|(pair, known)| {
        let alone = metrics::reprojection(std::slice::from_ref(pair), period)?;
        Some((known, alone.percentile_95_px))
    });
    let path = |photograph: usize| component.images[photograph].path.display().to_string();
    let worst_pair = apart.max_by(|one, two| one.1.total_cmp(&two.1)).map(|(pair, percentile_95_px)| WorstPair {
        a: path(pair.a),
        b: path(pair.b),
        percentile_95_px,
    });
    Some(ReprojectionMeasures {
        matches: found.matches,
        mean_px: found.mean_px,
        rms_px: found.rms_px,
        percentile_95_px: found.percentile_95_px,
        worst_pair,
    })
}

fn long_lines(component: &Component, working: &[GridMesh]) -> Option<LongLines> {
    let measured: Vec<(usize, Straightness)> = (0..working.len())
        .flat_map(|k| {
            let shortest = metrics::LONG_LINE_DIAGONAL * component.frames[k].diagonal();
            let long = component.lines[k].iter().filter(move |line| line.length() >= shortest);
            long.filter_map(move |line| Some((k, Straightness::of(line, &working[k], metrics::LINE_STEP_PX)?)))
        })
        .collect();
    let bent: Vec<&(usize, Straightness)> = measured.iter().filter(|(_, line)| line.is_bent()).collect();
    let longest = bent.iter().max_by(|one, two| one.1.length_px.total_cmp(&two.1.length_px));
    let mean = measured.iter().map(|(_, line)| line.rms_px / line.length_px).sum::<f64>() / measured.len() as f64;
    (!measured.is_empty()).then(|| LongLines {
        lines: measured.len(),
        mean_bend: mean,
        bent: bent.len(),
        longest_bent: longest.map(|(k, line)| BentLine {
            path: component.images[*k].path.display().to_string(),
            length_px: line.length_px,
            off_px: line.largest_px,
        }),
    })
}
