//! Measures a panorama by its own lines and matches.

use std::collections::BTreeMap;

use rayon::prelude::*;
use trueup_align::metrics::{
    self, MatchedPair, Outside, Straightness, VerticalLinesInput, expected_magnitude, folded_cells, mean_relative_turn,
    rectangle_rotation,
};
use trueup_align::similarity::{EstimatedRoll, RollsInput, estimated_rolls};
use trueup_core::lines::LineSegment;
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::mesh::GridMesh;

use super::measures::{
    BentLine, HUNDREDTHS, LongLines, MeasuredLine, Measures, PairMeasures, PhotographMeasures, PlaceMeasures,
    ReprojectionMeasures, UprightMeasures, WorstPair,
};
use crate::pipeline::align::Geometry;
use crate::pipeline::align::component::Component;
use crate::pipeline::arrange::Arrangement;

/// A photograph whose lean is less sure than this, half the width of its 95 % interval, has no figure: a lean of a degree is
/// seen. Degrees.
const WIDEST_DEG: f64 = 1.0;
/// Fewer photographs have no uprightness in common.
const FEWEST: usize = 2;
/// Squares along the longer side of a photograph by which distances of matches are gathered: as fine as a look at the whole
/// panorama tells apart.
const PLACES_ALONG_A_SIDE: f64 = 16.0;

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
    let matched = matched_pairs(component, geometry, &meshes);
    let pairs = pair_measures(component, geometry, &matched, period);
    let lines = measured_lines(component, geometry, &working);
    let distortion = metrics::local_distortion(&working, Outside::Center, period);
    Measures {
        upright: upright(&certain),
        estimated_gdic_deg: estimated_inconsistency(&certain, &working, component.reference),
        reprojection: reprojection(component, &matched, &pairs, period),
        long_lines: long_lines(component, &lines),
        ld: HUNDREDTHS * distortion.worst,
        ld_mean: HUNDREDTHS * distortion.mean,
        folds: working.iter().map(folded_cells).sum(),
        pairs,
        photographs: lines
            .into_iter()
            .enumerate()
            .map(|(k, lines)| PhotographMeasures {
                path: component.images[k].path.display().to_string(),
                vertical_lines: vertical_lines[k],
                lean_deg: leans[k].map(|one| one.lean.to_degrees()),
                standard_error_deg: leans[k].map(|one| one.by.standard_error.to_degrees()),
                within_deg: leans[k].map(|one| one.by.within.to_degrees()),
                gamma_deg: leans[k].map(|one| one.by.roll.to_degrees()),
                certain: certain[k].is_some(),
                lines,
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
    // Rolls are of rotating cameras.
    let rolls = if geometry.cameras.flat_scene.is_some() { None } else { estimated_rolls(&input) };
    let Some(rolls) = rolls else { return vec![None; working.len()] };
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

/// The matches that were to coincide, in the photographs' own pixels, on the grids.
fn matched_pairs<'a>(component: &Component, geometry: &Geometry, meshes: &[&'a GridMesh]) -> Vec<MatchedPair<'a>> {
    let full = |point: [f64; 2], photograph: usize| {
        point.map(|coordinate| coordinate / component.frames[photograph].working_from_full)
    };
    let matched = |pair: &PairMatches| {
        let in_full = |one: &PointMatch| PointMatch { in_a: full(one.in_a, pair.a), in_b: full(one.in_b, pair.b) };
        MatchedPair { a: meshes[pair.a], b: meshes[pair.b], matches: pair.inliers.iter().map(in_full).collect() }
    };
    geometry.coinciding.iter().map(matched).collect()
}

/// How far apart the matches of each pair land, where any can be measured.
fn pair_measures(
    component: &Component,
    geometry: &Geometry,
    pairs: &[MatchedPair],
    period: Option<f64>,
) -> Vec<PairMeasures> {
    let measured = |(pair, known): (&MatchedPair, &PairMatches)| {
        let found = metrics::reprojection(std::slice::from_ref(pair), period)?;
        Some(PairMeasures {
            a: component.members[known.a],
            b: component.members[known.b],
            matches: found.matches,
            mean_px: found.mean_px,
            percentile_95_px: found.percentile_95_px,
            places: places(pair, period),
        })
    };
    pairs.iter().zip(&geometry.coinciding).filter_map(measured).collect()
}

/// The distances of a pair's matches, gathered by squares of the first photograph.
fn places(pair: &MatchedPair, period: Option<f64>) -> Vec<PlaceMeasures> {
    let side = pair.a.width.max(pair.a.height) / PLACES_ALONG_A_SIDE;
    let mut found: BTreeMap<[usize; 2], PlaceMeasures> = BTreeMap::new();
    let measured = pair.matches.iter().zip(metrics::match_distances(pair, period));
    for (one, distance) in measured.filter(|(_, distance)| distance.is_finite()) {
        let [x, y] = one.in_a;
        let nothing = PlaceMeasures { at: [0.0; 2], matches: 0, mean_px: 0.0 };
        // The casts saturate.
        let sum = found.entry([(y / side) as usize, (x / side) as usize]).or_insert(nothing);
        let at = [sum.at[0] + x, sum.at[1] + y];
        *sum = PlaceMeasures { at, matches: sum.matches + 1, mean_px: sum.mean_px + distance };
    }
    let mean = |sum: PlaceMeasures| {
        let count = sum.matches as f64;
        PlaceMeasures { at: sum.at.map(|sum| sum / count), mean_px: sum.mean_px / count, ..sum }
    };
    found.into_values().map(mean).collect()
}

fn reprojection(
    component: &Component,
    pairs: &[MatchedPair],
    alone: &[PairMeasures],
    period: Option<f64>,
) -> Option<ReprojectionMeasures> {
    let found = metrics::reprojection(pairs, period)?;
    let path = |position: usize| {
        let local = component.members.binary_search(&position).ok()?;
        Some(component.images[local].path.display().to_string())
    };
    let worst_pair = alone.iter().max_by(|one, two| one.percentile_95_px.total_cmp(&two.percentile_95_px));
    let named = |pair: &PairMeasures| {
        let percentile_95_px = pair.percentile_95_px;
        Some(WorstPair { a: path(pair.a)?, b: path(pair.b)?, percentile_95_px })
    };
    Some(ReprojectionMeasures {
        matches: found.matches,
        mean_px: found.mean_px,
        rms_px: found.rms_px,
        percentile_95_px: found.percentile_95_px,
        worst_pair: worst_pair.and_then(named),
    })
}

/// The long lines of every photograph, as far as the panorama shows them whole.
fn measured_lines(component: &Component, geometry: &Geometry, working: &[GridMesh]) -> Vec<Vec<MeasuredLine>> {
    let of_one = |k: usize| {
        let shortest = metrics::LONG_LINE_DIAGONAL * component.frames[k].diagonal();
        let long: Vec<LineSegment> =
            component.lines[k].iter().filter(|line| line.length() >= shortest).copied().collect();
        let directions = match geometry.triads[k].triad() {
            Some(triad) => {
                let matrix = triad.matrix();
                let columns = std::array::from_fn(|column| matrix.column(column).into_owned());
                metrics::directions_of_segments(&long, &geometry.cameras.cameras[k], &columns)
            }
            None => vec![None; long.len()],
        };
        let full = |end: [f64; 2]| end.map(|coordinate| coordinate / component.frames[k].working_from_full);
        let measured = |(line, direction): (&LineSegment, Option<usize>)| {
            let found = Straightness::of(line, &working[k], metrics::LINE_STEP_PX)?;
            Some(MeasuredLine {
                start: full(line.start),
                end: full(line.end),
                direction,
                length_px: found.length_px,
                rms_px: found.rms_px,
                off_px: found.largest_px,
            })
        };
        long.iter().zip(directions).filter_map(measured).collect()
    };
    (0..working.len()).map(of_one).collect()
}

fn long_lines(component: &Component, lines: &[Vec<MeasuredLine>]) -> Option<LongLines> {
    let measured: Vec<(usize, &MeasuredLine)> =
        lines.iter().enumerate().flat_map(|(k, lines)| lines.iter().map(move |line| (k, line))).collect();
    let bent: Vec<&(usize, &MeasuredLine)> =
        measured.iter().filter(|(_, line)| line.straightness().is_bent()).collect();
    let longest = bent.iter().max_by(|one, two| one.1.length_px.total_cmp(&two.1.length_px));
    let mean = measured.iter().map(|(_, line)| line.rms_px / line.length_px).sum::<f64>() / measured.len() as f64;
    (!measured.is_empty()).then(|| LongLines {
        lines: measured.len(),
        mean_bend: mean,
        bent: bent.len(),
        longest_bent: longest.map(|(k, line)| BentLine {
            path: component.images[*k].path.display().to_string(),
            length_px: line.length_px,
            off_px: line.off_px,
        }),
    })
}
