//! Even steps, on two photographs of a facade whose cameras are not quite where they are said to be.

use trueup_core::geometry::rotation_about_y;

use super::*;

const FOCAL_PX: f64 = 700.0;
const SIZE: [f64; 2] = [800.0, 600.0];

/// Two level photographs 30 degrees apart, and meetings at every vertex of both whose place in the other lies `apart`
/// pixels (as a function of the pixel, in the second photograph) from where the cameras have it.
fn pair(apart: impl Fn(Vector2<f64>) -> Vector2<f64>) -> (Vec<Camera>, Vec<GridMesh>, Vec<Meeting>) {
    pair_on_lattices(SIZE[0] / LATTICE_CELLS, apart)
}

fn pair_on_lattices(
    cell_px: f64,
    apart: impl Fn(Vector2<f64>) -> Vector2<f64>,
) -> (Vec<Camera>, Vec<GridMesh>, Vec<Meeting>) {
    let camera = |yaw: f64| Camera::new(FOCAL_PX, SIZE[0], SIZE[1], &rotation_about_y(yaw).transpose());
    let cameras = vec![camera(0.0), camera(30_f64.to_radians())];
    let lattices = vec![GridMesh::regular(SIZE[0], SIZE[1], cell_px); 2];
    let is_inside = |place: &Vector2<f64>| (0..2).all(|axis| (0.0..=SIZE[axis]).contains(&place[axis]));
    let mut meetings = Vec::new();
    for vertex in 0..lattices[0].len() {
        let pixel = lattices[0].source(vertex);
        let right = cameras[0].transfer(&cameras[1], pixel).map(|place| place + apart(place));
        // The nearest pixel whose own place is this vertex: `apart` changes slowly.
        let left = cameras[1].transfer(&cameras[0], pixel - apart(pixel));
        for (from, place) in [(0, right), (1, left)] {
            if let Some(place) = place.filter(is_inside) {
                meetings.push(Meeting { from: [from, vertex], to: 1 - from, place, share: 1.0 });
            }
        }
    }
    (cameras, lattices, meetings)
}

/// Largest distance of the vertices of a row or column, after their steps, from the line through its ends, as a share
/// of its length.
fn largest_bend(steps: &GridMesh) -> f64 {
    let at = |row: usize, column: usize| {
        let vertex = row * steps.columns + column;
        steps.source(vertex) + Vector2::from(steps.target[vertex])
    };
    let bend = |line: Vec<Vector2<f64>>| {
        let chord = line[line.len() - 1] - line[0];
        line.iter().map(|point| chord.perp(&(point - line[0])).abs()).fold(0.0, f64::max) / chord.norm_squared()
    };
    let rows = (0..steps.rows).map(|row| bend((0..steps.columns).map(|column| at(row, column)).collect()));
    let columns = (0..steps.columns).map(|column| bend((0..steps.rows).map(|row| at(row, column)).collect()));
    rows.chain(columns).fold(0.0, f64::max)
}

/// A facade that the second photographer saw from a step aside and farther: its places lie up to 6 pixels off, growing
/// evenly. Overlaps meet, and no line of either photograph bends by more than 0.2 % of its length, as the steps fade
/// beside the overlap.
#[test]
fn what_grows_evenly_bends_nothing() {
    let apart = |place: Vector2<f64>| Vector2::new(0.0, 0.015 * (place.x + 0.5 * place.y - 400.0));
    let (cameras, lattices, meetings) = pair(apart);
    assert!(meetings.len() > 80, "{}", meetings.len());
    let steps = smooth_steps(&cameras, &lattices, &meetings).expect("steps");
    for meeting in &meetings {
        let Meeting { from: [from, vertex], to, place, .. } = *meeting;
        let pixel = lattices[from].source(vertex);
        let own = pixel + steps[from].warp(pixel);
        let other = cameras[to].transfer(&cameras[from], place + steps[to].warp(place)).expect("in front");
        let before = (cameras[to].transfer(&cameras[from], place).expect("in front") - pixel).norm();
        assert!((own - other).norm() < 0.5 + 0.1 * before, "{} of {before} px are left", (own - other).norm());
    }
    for steps in &steps {
        assert!(largest_bend(steps) < 2e-3, "{}", largest_bend(steps));
    }
    let moved =
        steps.iter().flat_map(|steps| &steps.target).map(|step| Vector2::from(*step).norm()).fold(0.0, f64::max);
    assert!(moved > 1.0, "{moved}");
}

/// The second photograph leans by half a degree against the first. Near its border a photograph leans most of the way,
/// since the other one, which is alone just beyond, hardly does; where photographs are alone, verticals stand.
#[test]
fn what_leans_in_an_overlap_stands_beside_it() {
    let turn = 0.5_f64.to_radians();
    let apart = |place: Vector2<f64>| Vector2::new(-turn * (place.y - 300.0), 0.0);
    let (cameras, lattices, meetings) = pair(apart);
    let steps = smooth_steps(&cameras, &lattices, &meetings).expect("steps");
    let lean = |column: usize| {
        let last = (steps[0].rows - 1) * steps[0].columns + column;
        (steps[0].target[last][0] - steps[0].target[column][0]) / SIZE[1]
    };
    let columns = steps[0].columns;
    let (alone, overlapping) = (lean(0).abs(), lean(columns - 2).abs());
    assert!(overlapping > 0.5 * turn && overlapping < 0.9 * turn, "{} of {}", overlapping, turn);
    assert!(alone < 0.1 * turn, "{alone} of {turn}");
}

#[test]
fn where_nothing_meets_nothing_steps_aside() {
    let (cameras, lattices, _) = pair(|_| Vector2::zeros());
    assert_eq!(smooth_steps(&cameras, &lattices, &[]), None);
    let (_, _, meetings) = pair(|_| Vector2::zeros());
    let still = smooth_steps(&cameras, &lattices, &meetings).expect("steps");
    let moved =
        still.iter().flat_map(|steps| &steps.target).map(|step| Vector2::from(*step).norm()).fold(0.0, f64::max);
    assert!(moved < 1e-6, "{moved}");
}

/// Cells twice as wide have weights of their own, so that photographs give way as far, within a pixel of six.
#[test]
fn a_coarser_lattice_steps_aside_alike() {
    let apart = |place: Vector2<f64>| Vector2::new(0.0, 0.015 * (place.x + 0.5 * place.y - 400.0));
    let [fine, coarse] = [50.0, 100.0].map(|cell_px| {
        let (cameras, lattices, meetings) = pair_on_lattices(cell_px, apart);
        smooth_steps(&cameras, &lattices, &meetings).expect("steps")
    });
    for (fine, coarse) in fine.iter().zip(&coarse) {
        for place in (0..coarse.len()).map(|vertex| coarse.source(vertex)) {
            let off = (fine.warp(place) - coarse.warp(place)).norm();
            assert!(off < 1.0, "{off} px at {place}");
        }
    }
}
