use nalgebra::{Matrix3, Vector2};
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::geometry::{Homography, rotation_about_y, rotation_about_z, rows_of, wrap_angle};
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::source::WorkingFrame;

use super::synthetic::{FOCAL_PX, SIZE, Sweep, SyntheticScene, World, joined};
use super::tests::{missing, overlap};
use super::*;
use crate::match_points::OverlapWarp;
use crate::vanishing::{TriadOutcome, VanishingOptions};

const CELL_PX: f64 = 40.0;

/// An edge whose overlap allows turns from `low` to `high` and whose lines want `best`, all degrees.
struct Edge {
    a: usize,
    b: usize,
    low: f64,
    high: f64,
    best: f64,
}

fn edge(a: usize, b: usize, [low, high]: [f64; 2], best: f64) -> Edge {
    Edge { a, b, low, high, best }
}

/// Level cameras that look 30 degrees further each, so that straightening finds rolls of zero, joined by edges whose
/// turns are given.
struct Graph {
    cameras: Vec<Camera>,
    triads: Vec<TriadOutcome>,
    lines: Vec<Vec<LineSegment>>,
    frames: Vec<WorkingFrame>,
    edges: Vec<PairMatches>,
    overlaps: Vec<OverlapWarp>,
}

impl Graph {
    fn new(count: usize, edges: &[Edge]) -> Self {
        let camera = |index: usize| {
            let rotation = rotation_about_y((30.0 * index as f64).to_radians()).transpose();
            // Focal lengths 700, 1400, 2100, ...
            Camera::new(FOCAL_PX * (index + 1) as f64, SIZE.0, SIZE.1, &rotation)
        };
        let across = LineSegment { start: [350.0, 300.0], end: [450.0, 300.0], width_px: 3.0, significance: 10.0 };
        Self {
            cameras: (0..count).map(camera).collect(),
            triads: vec![missing(); count],
            lines: vec![vec![across]; count],
            frames: vec![WorkingFrame { width: SIZE.0, height: SIZE.1, working_from_full: 1.0 }; count],
            edges: edges.iter().map(pair).collect(),
            overlaps: edges.iter().map(warp).collect(),
        }
    }

    fn input<'a>(&'a self, vanishing: &'a VanishingOptions, reference: usize) -> PriorInput<'a> {
        PriorInput {
            method: PriorMethod::Gsp2d,
            cameras: &self.cameras,
            triads: &self.triads,
            lines: &self.lines,
            frames: &self.frames,
            gravity: &[],
            shown: &[],
            edges: &self.edges,
            overlaps: &self.overlaps,
            cell_px: CELL_PX,
            vanishing,
            turn: 0.0,
            reference,
        }
    }

    fn prior(&self, prior: PriorMethod, reference: usize, turn_deg: f64) -> SimilarityPrior {
        let vanishing = VanishingOptions::default();
        let input = PriorInput { method: prior, turn: turn_deg.to_radians(), ..self.input(&vanishing, reference) };
        run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("a well-formed graph")
    }

    fn theta_deg(&self, prior: PriorMethod, reference: usize) -> Vec<f64> {
        self.prior(prior, reference, 0.0).theta.iter().map(|theta| theta.to_degrees()).collect()
    }
}

/// A pair whose homography turns everything by minus the best turn about the photograph's center.
fn pair(edge: &Edge) -> PairMatches {
    let (sine, cosine) = (-edge.best.to_radians()).sin_cos();
    let (x, y) = (SIZE.0 / 2.0, SIZE.1 / 2.0);
    let matrix =
        Matrix3::new(cosine, -sine, x - cosine * x + sine * y, sine, cosine, y - sine * x - cosine * y, 0.0, 0.0, 1.0);
    PairMatches { b_from_a: Some(rows_of(&matrix)), ..joined(edge.a, edge.b, Vec::new()) }
}

/// A linear warp that turns horizontal grid edges by -low and vertical ones by -high.
fn warp(edge: &Edge) -> OverlapWarp {
    let (low, high) = (-edge.low.to_radians(), -edge.high.to_radians());
    let grid = GridMesh::regular(SIZE.0, SIZE.1, CELL_PX);
    let carry = |vertex| {
        let [x, y] = grid.source(vertex).into();
        Some([x * low.cos() - y * high.sin(), x * low.sin() + y * high.cos()])
    };
    OverlapWarp { from: edge.a, to: edge.b, vertices: (0..grid.len()).map(carry).collect() }
}

/// Hard constraints have residual weight 1e4 against 1 to 10: they give way by some 1e-6 degrees.
fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (one, other) in found.iter().zip(expected) {
        assert!((one - other).abs() < 1e-4, "{found:?} instead of {expected:?}");
    }
}

#[test]
fn the_graphs_of_these_tests_have_the_turns_they_state() {
    let graph = Graph::new(2, &[edge(0, 1, [-3.0, 8.0], 4.0)]);
    let homography = Homography::from_rows(&graph.edges[0].b_from_a.expect("given"));
    let turned = homography.apply(Vector2::new(500.0, 300.0)) - Vector2::new(400.0, 300.0);
    assert!((turned.y.atan2(turned.x).to_degrees() + 4.0).abs() < 1e-9);
    let vanishing = VanishingOptions::default();
    let input = graph.input(&vanishing, 0);
    let turns = edge_range::OverlapTurns::of(&input, &graph.edges[0]);
    let range = turns.range.expect("a warped overlap");
    assert!((range.start.to_degrees() + 3.0).abs() < 1e-9 && (range.extent.to_degrees() - 11.0).abs() < 1e-9);
    assert!((turns.best(&input, &graph.edges[0]).expect("a segment").to_degrees() - 4.0).abs() < 1e-9);
}

/// Triangle: edge 0 - 1 allows 4 to 8 degrees and wants 6, so it takes 6 with weight 1; the others hold 0 with weight
/// 100. As complex numbers, e = exp(6i deg): minimize |e z0 - z1|^2 + 100 |z1 - z2|^2 + 100 |z0 - z2|^2. z0 = 1 gives
/// z1 = (e + 50) / 51, z2 = (e + 101) / 102; z2 = 1 gives z1 = (e + 101) / 102, z0 = (conj(e) + 101) / 102. arg(e + 50)
/// = atan(0.10452846 / 50.99452190) = 0.11744460 degrees, arg(e + 101) = 0.05871921 degrees.
#[test]
fn gsp_3d_spreads_a_contradiction_from_the_reference() {
    let graph =
        Graph::new(3, &[edge(0, 1, [4.0, 8.0], 6.0), edge(0, 2, [-5.0, 5.0], 3.0), edge(1, 2, [-5.0, 5.0], -2.0)]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp3d, 0), &[0.0, 0.117_444_60, 0.058_719_21]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp3d, 2), &[-0.058_719_21, 0.058_719_21, 0.0]);
}

/// On a chain nothing contradicts the edge that is out of range: its turn is taken whole.
#[test]
fn gsp_3d_takes_the_turn_of_the_lines_where_the_overlap_refuses_the_cameras() {
    let graph = Graph::new(3, &[edge(0, 1, [4.0, 8.0], 6.0), edge(1, 2, [-5.0, 5.0], 3.0)]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp3d, 0), &[0.0, 6.0, 6.0]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp3d, 1), &[-6.0, 0.0, 0.0]);
}

#[test]
fn gsp_3d_does_not_depend_on_the_reference_where_overlaps_agree_with_the_cameras() {
    let mut scene = SyntheticScene::new(Sweep { count: 4, ..Sweep::default() }, World::Random, 0.0, 31);
    scene.triads = vec![missing(); 4];
    let overlaps: Vec<OverlapWarp> = scene
        .edges
        .iter()
        .flat_map(|edge| [overlap(&scene, edge.a, edge.b), overlap(&scene, edge.b, edge.a)])
        .collect();
    let prior = |reference| {
        let vanishing = VanishingOptions::default();
        let method = PriorMethod::Gsp3d;
        let input = PriorInput { method, overlaps: &overlaps, reference, ..scene.input(&vanishing) };
        run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("a well-formed scene")
    };
    let rotations: Vec<Matrix3<f64>> = scene.cameras.iter().map(Camera::rotation).collect();
    let straightened = rolls(&straightening::straighten(&rotations).down, &rotations);
    assert!(straightened.iter().any(|roll| roll.to_degrees().abs() > 2.0), "rolls to keep: {straightened:?}");
    for reference in 0..4 {
        for (theta, roll) in prior(reference).theta.iter().zip(&straightened) {
            assert!(wrap_angle(theta - roll).abs() < 1e-9);
        }
    }
}

/// From 0: 1 may be upright, 2 may be within the slack of 1.5 degrees, 3 may not and takes the turn of its lines.
/// From 3: none of the others may, each takes its edge's turn backwards: -3, -3 - 2, -3 - 2 - 1.
#[test]
fn gsp_2d_leaves_photographs_upright_where_the_overlaps_let_it_and_depends_on_the_reference() {
    let graph =
        Graph::new(4, &[edge(0, 1, [-1.0, 3.0], 1.0), edge(1, 2, [1.4, 4.0], 2.0), edge(2, 3, [1.6, 5.0], 3.0)]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp2d, 0), &[0.0, 0.0, 0.0, 3.0]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp2d, 3), &[-6.0, -5.0, -3.0, 0.0]);
}

/// The reference takes its straightened roll and the others, whose overlaps allow them to, stay as they were taken:
/// each reference makes another panorama, which is what the paper holds against this prior.
#[test]
fn gsp_2d_straightens_its_reference_alone() {
    let mut graph = Graph::new(3, &[edge(0, 1, [-9.0, 9.0], 0.0), edge(1, 2, [-9.0, 9.0], 0.0)]);
    for (camera, roll) in graph.cameras.iter_mut().zip([6.0_f64, -3.0, 4.0]) {
        let rotation = rotation_about_z(-roll.to_radians()) * camera.rotation();
        camera.set_rotation(&rotation);
    }
    let rotations: Vec<Matrix3<f64>> = graph.cameras.iter().map(Camera::rotation).collect();
    let straightened = rolls(&straightening::straighten(&rotations).down, &rotations);
    assert!(straightened.iter().all(|roll| roll.to_degrees().abs() > 1.0), "{straightened:?}");
    for reference in 0..3 {
        let expected = [0, 1, 2].map(|index| if index == reference { straightened[index].to_degrees() } else { 0.0 });
        assert_close(&graph.theta_deg(PriorMethod::Gsp2d, reference), &expected);
    }
}

/// Photograph 1 cannot be upright as seen from 0 but can as seen from 2, which is asked before 1 takes its lines' turn.
#[test]
fn gsp_2d_asks_upright_photographs_first() {
    let graph =
        Graph::new(3, &[edge(0, 1, [8.0, 12.0], 10.0), edge(0, 2, [-1.0, 1.0], 0.5), edge(1, 2, [-2.0, 2.0], 1.0)]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp2d, 0), &[0.0, 0.0, 0.0]);
}

/// None may be upright. As complex numbers with z0 = 1, minimize |e^10i - z1|^2 + |e^10i z1 - z2|^2 + |e^26i - z2|^2
/// (degrees): z2 = (e^20i + 2 e^26i) / 3, z1 = (2 e^10i + e^16i) / 3; their angles are
/// 20 + atan2(2 sin 6, 1 + 2 cos 6) = 24.00081306 and 10 + atan2(sin 6, 2 + cos 6) = 11.99918694 degrees.
#[test]
fn gsp_2d_shares_out_what_does_not_close() {
    let graph =
        Graph::new(3, &[edge(0, 1, [8.0, 12.0], 10.0), edge(0, 2, [24.0, 28.0], 26.0), edge(1, 2, [8.0, 12.0], 10.0)]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp2d, 0), &[0.0, 11.999_186_94, 24.000_813_06]);
}

/// The reference is turned by 10 degrees; 1, which may turn by -11 to -9 against it, then stands upright. The published
/// methods in three dimensions turn the whole panorama.
#[test]
fn the_wanted_turn_is_the_references_in_two_dimensions_and_everyones_in_three() {
    let graph = Graph::new(2, &[edge(0, 1, [-11.0, -9.0], -9.5)]);
    let degrees = |prior: &SimilarityPrior| prior.theta.iter().map(|theta| theta.to_degrees()).collect::<Vec<f64>>();
    assert_close(&degrees(&graph.prior(PriorMethod::Gsp2d, 0, 10.0)), &[10.0, 0.0]);
    assert_close(&degrees(&graph.prior(PriorMethod::Gsp3d, 0, 10.0)), &[10.0, 0.5]);
}

/// Focal lengths 700, 1400, 2100: 1 / f is as 6 : 3 : 2, of mean 11 / 3.
#[test]
fn scales_are_the_inverse_focal_lengths_of_mean_one() {
    let graph = Graph::new(3, &[edge(0, 1, [-5.0, 5.0], 1.0), edge(1, 2, [-5.0, 5.0], 1.0)]);
    for (prior, reference) in [(PriorMethod::Gsp2d, 0), (PriorMethod::Gsp3d, 2)] {
        let prior = graph.prior(prior, reference, 0.0);
        for (scale, expected) in prior.scale.iter().zip([18.0 / 11.0, 9.0 / 11.0, 6.0 / 11.0]) {
            assert!((scale - expected).abs() < 1e-12);
        }
        assert!(!prior.guidance.used && prior.guidance.failed_clause.is_none());
        // Level cameras: the level world differs from theirs by a turn about the vertical alone.
        assert!((prior.level_from_world()[(1, 1)] - 1.0).abs() < 1e-9);
    }
}

#[test]
fn photographs_that_are_joined_to_none_keep_their_rolls() {
    let graph = Graph::new(3, &[edge(0, 1, [4.0, 8.0], 6.0)]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp3d, 0), &[0.0, 0.0, 0.0]);
    assert_close(&graph.theta_deg(PriorMethod::Gsp2d, 0), &[0.0, 6.0, 0.0]);
}

#[test]
fn the_published_priors_are_the_same_on_one_and_two_threads() {
    let edges: Vec<Edge> = (0..11)
        .flat_map(|index| {
            let low = (7 * index % 5) as f64 - 2.0;
            let next = edge(index, index + 1, [low, low + 3.0], low + 1.0);
            [Some(next), (index + 3 < 12).then(|| edge(index, index + 3, [low - 1.0, low + 1.0], low))]
        })
        .flatten()
        .collect();
    let graph = Graph::new(12, &edges);
    for prior in [PriorMethod::Gsp2d, PriorMethod::Gsp3d] {
        let with_threads = |count| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a thread pool");
            pool.install(|| graph.prior(prior, 5, 0.0))
        };
        assert_eq!(with_threads(1), with_threads(2));
    }
}

#[test]
fn a_range_can_be_reversed_and_widened() {
    let range = edge_range::TurnRange { start: 0.1, extent: 0.3 };
    let reversed = range.reversed();
    assert!(reversed.contains(-0.1) && reversed.contains(-0.4) && !reversed.contains(-0.41) && !reversed.contains(0.2));
    assert!(!range.contains(0.05) && range.contains_within(0.05, 0.06) && !range.contains_within(0.03, 0.06));
    assert!(range.contains_within(0.45, 0.06) && !range.contains_within(0.47, 0.06));
}

#[test]
fn a_segment_counts_if_any_part_of_it_shows() {
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let crosses = |start: [f64; 2], end: [f64; 2]| edge_range::crosses(&frame, start.into(), end.into());
    assert!(crosses([-100.0, 300.0], [20.0, 300.0]) && crosses([300.0, -50.0], [300.0, 700.0]));
    assert!(crosses([10.0, 10.0], [20.0, 20.0]) && crosses([-10.0, 10.0], [10.0, -10.0]));
    assert!(!crosses([-10.0, 5.0], [5.0, -10.0]) && !crosses([-100.0, 300.0], [-1.0, 300.0]));
    assert!(!crosses([-20.0, 700.0], [900.0, 700.0]) && !crosses([900.0, 100.0], [900.0, 200.0]));
}

#[test]
fn a_reference_that_does_not_exist_is_an_error() {
    let graph = Graph::new(2, &[edge(0, 1, [-1.0, 1.0], 0.0)]);
    let vanishing = VanishingOptions::default();
    let input = graph.input(&vanishing, 2);
    let error = run(&input, &SimilarityOptions::default(), &StageContext::default()).expect_err("no such photograph");
    assert!(error.to_string().contains("reference 2"));
}
