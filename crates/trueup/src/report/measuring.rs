//! Measures a panorama by its own lines and matches.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use trueup_align::metrics::{
    self, MatchedPair, Outside, Straightness, expected_magnitude, folded_cells, mean_relative_turn, rectangle_rotation,
};
use trueup_align::similarity::EstimatedRoll;
use trueup_compose::layout::CanvasLayout;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PointMatch;
use trueup_core::mesh::GridMesh;

use super::evidence::{Evidence, EvidenceLine, EvidencePair, EvidencePhotograph};
use super::measures::{
    BentLine, FEWEST_CERTAIN, HUNDREDTHS, LongLines, MeasuredLine, Measures, PairMeasures, PhotographMeasures,
    PlaceMeasures, ReprojectionMeasures, UprightMeasures, WorstPair,
};
use crate::pipeline::arrange::Arrangement;
use crate::project::record::ImageRecord;

/// A photograph whose lean is less sure than this, half the width of its 95 % interval, has no figure: a lean of a
/// degree is seen. Degrees.
const WIDEST_DEG: f64 = 1.0;
/// Squares along the longer side of a photograph by which distances of matches are gathered: as fine as a look at the
/// whole panorama tells apart.
const PLACES_ALONG_A_SIDE: f64 = 16.0;

/// A photograph's lean in the panorama, where its upright lines are, and the roll it follows from. Radians.
#[derive(Debug, Clone, Copy)]
struct Lean {
    lean: f64,
    by: EstimatedRoll,
}

/// The part of the plane that a panorama shows: its canvas, all round where that is a turn. What lies beside it is not
/// measured, since nobody sees it.
#[derive(Debug, Clone, Copy)]
struct ShownPart {
    size: [f64; 2],
    is_turn: bool,
}

impl ShownPart {
    /// Whether a place, in pixels of the canvas, is shown; nowhere that is not a number.
    fn holds(&self, place: Vector2<f64>) -> bool {
        let [width, height] = self.size;
        (0.0..=height).contains(&place.y) && place.x.is_finite() && (self.is_turn || (0.0..=width).contains(&place.x))
    }
}

impl Lean {
    fn is_certain(&self) -> bool {
        self.by.within <= WIDEST_DEG.to_radians()
    }
}

/// Measures a panorama as it is delivered, whatever it is drawn on, by what its photographs show. Of the project's
/// `images` only their names are asked.
pub(crate) fn run(evidence: &Evidence, arrangement: &Arrangement, images: &[ImageRecord]) -> Measures {
    let period = arrangement.drawn.period.map(|columns| columns as f64);
    let CanvasLayout { width, height, .. } = arrangement.drawn;
    let shown = ShownPart { size: [width as f64, height as f64], is_turn: period.is_some() };
    let turn = arrangement.projection.as_ref().and_then(|projection| projection.turn_px());
    let whole: Vec<GridMesh> =
        arrangement.delivered.iter().map(|mesh| metrics::without_torn_cells(mesh, turn)).collect();
    // The same grids over the working pictures, in whose pixels lines are.
    let working: Vec<GridMesh> = whole
        .iter()
        .zip(&evidence.photographs)
        .map(|(mesh, one)| GridMesh { width: one.frame.width, height: one.frame.height, ..mesh.clone() })
        .collect();
    let leans: Vec<Option<Lean>> =
        working.iter().zip(&evidence.photographs).map(|(mesh, one)| lean(mesh, one, shown)).collect();
    let certain: Vec<Option<Lean>> = leans.iter().map(|one| one.filter(Lean::is_certain)).collect();
    let matched = matched_pairs(evidence, &whole, shown);
    let pairs = pair_measures(evidence, &matched, period);
    let lines: Vec<Vec<MeasuredLine>> =
        evidence.photographs.iter().zip(&working).map(|(one, mesh)| measured_lines(one, mesh, shown)).collect();
    let path = |photograph: usize| images[evidence.photographs[photograph].position].path.clone();
    let distortion = metrics::local_distortion(&working, Outside::Center, period);
    Measures {
        upright: upright(&certain),
        estimated_gdic_deg: estimated_inconsistency(&certain, &working, evidence.reference),
        reprojection: reprojection(&matched, &pairs, period, images),
        long_lines: long_lines(&lines, path),
        ld: HUNDREDTHS * distortion.worst,
        ld_mean: HUNDREDTHS * distortion.mean,
        folds: working.iter().map(folded_cells).sum(),
        pairs,
        photographs: lines
            .into_iter()
            .enumerate()
            .map(|(k, lines)| PhotographMeasures {
                path: path(k),
                vertical_lines: evidence.photographs[k].vertical_lines.len(),
                lean_deg: leans[k].map(|one| one.lean.to_degrees()),
                standard_error_deg: leans[k].map(|one| one.by.standard_error.to_degrees()),
                within_deg: leans[k].map(|one| one.by.within.to_degrees()),
                gamma_deg: evidence.photographs[k].roll.map(|by| by.roll.to_degrees()),
                certain: certain[k].is_some(),
                lines,
            })
            .collect(),
    }
}

/// The lean of a photograph whose vertical the lines of all of them tell, on its grid. `None` where too few of its own
/// carry it: nothing there would be seen to lean.
fn lean(mesh: &GridMesh, photograph: &EvidencePhotograph, part: ShownPart) -> Option<Lean> {
    let by = photograph.roll?;
    let is_shown = |line: &&LineSegment| {
        let middle = Vector2::from(line.start).lerp(&line.end.into(), 0.5);
        part.holds(mesh.warp(middle))
    };
    let lines: Vec<LineSegment> = photograph.vertical_lines.iter().filter(is_shown).copied().collect();
    let lean = metrics::drawn_lean(mesh, &photograph.camera, &by.down, &lines)?;
    Some(Lean { lean, by })
}

fn upright(certain: &[Option<Lean>]) -> Option<UprightMeasures> {
    let found: Vec<Lean> = certain.iter().flatten().copied().collect();
    let measured = found.len();
    if measured < FEWEST_CERTAIN {
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

/// The matches that were to coincide, on the grids, as far as one of the two places is shown.
fn matched_pairs<'a>(evidence: &Evidence, meshes: &'a [GridMesh], part: ShownPart) -> Vec<MatchedPair<'a>> {
    let matched = |pair: &EvidencePair| {
        let (a, b) = (&meshes[pair.a], &meshes[pair.b]);
        let is_shown = |one: &&PointMatch| part.holds(a.warp(one.in_a.into())) || part.holds(b.warp(one.in_b.into()));
        MatchedPair { a, b, matches: pair.matches.iter().filter(is_shown).copied().collect() }
    };
    evidence.pairs.iter().map(matched).collect()
}

/// How far apart the matches of each pair land, where any can be measured.
fn pair_measures(evidence: &Evidence, pairs: &[MatchedPair], period: Option<f64>) -> Vec<PairMeasures> {
    let measured = |(pair, known): (&MatchedPair, &EvidencePair)| {
        let found = metrics::reprojection(std::slice::from_ref(pair), period)?;
        Some(PairMeasures {
            a: evidence.photographs[known.a].position,
            b: evidence.photographs[known.b].position,
            matches: found.matches,
            mean_px: found.mean_px,
            percentile_95_px: found.percentile_95_px,
            places: places(pair, period),
        })
    };
    pairs.iter().zip(&evidence.pairs).filter_map(measured).collect()
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
    pairs: &[MatchedPair],
    alone: &[PairMeasures],
    period: Option<f64>,
    images: &[ImageRecord],
) -> Option<ReprojectionMeasures> {
    let found = metrics::reprojection(pairs, period)?;
    let path = |position: usize| Some(images.get(position)?.path.clone());
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

/// The long lines of a photograph, as far as the panorama shows them whole.
fn measured_lines(photograph: &EvidencePhotograph, working: &GridMesh, part: ShownPart) -> Vec<MeasuredLine> {
    let is_shown = |line: &&EvidenceLine| {
        [line.segment.start, line.segment.end].into_iter().all(|end| part.holds(working.warp(end.into())))
    };
    let full = |end: [f64; 2]| end.map(|coordinate| coordinate / photograph.frame.working_from_full);
    let measured = |line: &EvidenceLine| {
        let found = Straightness::of(&line.segment, &photograph.camera, working, metrics::LINE_STEP_PX)?;
        Some(MeasuredLine {
            start: full(line.segment.start),
            end: full(line.segment.end),
            direction: line.direction,
            length_px: found.length_px,
            rms_px: found.rms_px,
            off_px: found.largest_px,
        })
    };
    photograph.long_lines.iter().filter(is_shown).filter_map(measured).collect()
}

fn long_lines(lines: &[Vec<MeasuredLine>], path: impl Fn(usize) -> String) -> Option<LongLines> {
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
            path: path(*k),
            length_px: line.length_px,
            off_px: line.off_px,
        }),
    })
}

#[cfg(test)]
mod tests {
    use trueup_core::StageContext;

    use crate::inputs::Inputs;
    use crate::options::StitchOptions;
    use crate::pipeline::Stitcher;
    use crate::test_room::ROOM;

    /// A narrow view into the middle of the room: the photographs at its ends are not in it.
    #[test]
    fn what_the_view_does_not_show_is_not_measured() {
        let mut options = StitchOptions::default();
        for assignment in ["canvas.scale=0.2", "projection.kind=perspective", "projection.fov=20"] {
            options.set(assignment).expect("an option");
        }
        let context = StageContext::default();
        let aligned = Stitcher::new(&options, &context).align(&Inputs::new([ROOM])).expect("a panorama");
        let project = &aligned.alignments[0].project;
        let is_left_out = |path: &str| {
            let index = project.images.iter().position(|image| image.path == path);
            let subject = index.map(trueup_core::diagnostics::Subject::Photograph);
            project
                .diagnostics
                .iter()
                .any(|one| one.code == "projection-left-out" && Some(&one.subject) == subject.as_ref())
        };
        let measures = project.measures.as_ref().expect("measures");
        let (unseen, seen): (Vec<_>, Vec<_>) = measures.photographs.iter().partition(|one| is_left_out(&one.path));
        assert!(!unseen.is_empty() && seen.iter().any(|one| one.lean_deg.is_some()), "{measures:?}");
        for one in unseen {
            assert!(one.lean_deg.is_none() && one.lines.is_empty(), "{one:?}");
        }
    }
}
