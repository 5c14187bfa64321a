//! What is kept of laid out photographs.

use trueup_core::mesh::GridMesh;

use super::*;

/// Grids of 100 x 60 pixels with their corners (top left, top right, bottom right, bottom left) at the given places.
fn layout(width: usize, height: usize, outlines: &[[[f64; 2]; 4]]) -> CanvasLayout {
    let placed = outlines
        .iter()
        .enumerate()
        .map(|(photograph, corners)| {
            let mut mesh = GridMesh::regular(100.0, 60.0, 10.0);
            for vertex in 0..mesh.len() {
                let source = mesh.source(vertex);
                let (u, v) = (source.x / 100.0, source.y / 60.0);
                let shares = [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v];
                mesh.target[vertex] =
                    [0, 1].map(|axis| (0..4).map(|corner| corners[corner][axis] * shares[corner]).sum());
            }
            Placed { photograph, mesh }
        })
        .collect();
    CanvasLayout { width, height, canvas_from_target: 2.0, origin: [5.0, 7.0], placed, period: None }
}

fn options(crop: Crop, min_kept: f64) -> CanvasOptions {
    CanvasOptions { crop, min_kept, ..CanvasOptions::default() }
}

fn upright(left: f64, top: f64, right: f64, bottom: f64) -> [[f64; 2]; 4] {
    [[left, top], [right, top], [right, bottom], [left, bottom]]
}

#[test]
fn two_steps_leave_the_common_rows() {
    let steps = layout(190, 70, &[upright(0.0, 0.0, 100.0, 60.0), upright(90.0, 9.5, 190.0, 70.0)]);
    let coverage = Coverage::of(&steps);
    assert_eq!(coverage.area(), 100 * 60 + 100 * 60 - 10 * 50);
    let largest = coverage.largest_rectangle();
    assert_eq!(largest, Rectangle { columns: 0..190, rows: 10..60 });
    let kept = cropped(steps.clone(), &largest);
    assert_eq!((kept.width, kept.height, kept.origin), (190, 50, [5.0, 12.0]));
    assert_eq!(kept.placed[0].mesh.target[0], [0.0, -10.0]);
    // 9500 of 11500 pixels.
    assert_eq!(choose(&steps, &options(Crop::Auto, 0.8)), Some(largest.clone()));
    assert_eq!(choose(&steps, &options(Crop::Auto, 0.9)), None);
    assert_eq!(choose(&steps, &options(Crop::Rectangle, 0.9)), Some(largest));
    assert_eq!(choose(&steps, &options(Crop::None, 0.0)), None);
}

/// A square on its corner, 40 in half width: of rectangles inside the largest is a square of side 40.
#[test]
fn a_slanted_outline_keeps_whole_pixels_only() {
    let slanted = layout(80, 80, &[[[40.0, 0.0], [80.0, 40.0], [40.0, 80.0], [0.0, 40.0]]]);
    let largest = Coverage::of(&slanted).largest_rectangle();
    assert_eq!(largest, Rectangle { columns: 20..60, rows: 20..60 });
}

/// Two photographs around a cylinder of 160 columns: rows are cut where either ends.
#[test]
fn of_a_full_turn_rows_alone_are_cut() {
    let mut turn = layout(160, 70, &[upright(-20.0, 0.0, 80.0, 60.0), upright(70.0, 9.5, 170.0, 70.0)]);
    turn.period = Some(160);
    let kept = choose(&turn, &options(Crop::Auto, 0.5)).expect("whole rows");
    assert_eq!(kept, Rectangle { columns: 0..160, rows: 10..60 });
    let kept = cropped(turn, &kept);
    assert_eq!((kept.width, kept.height, kept.period, kept.placed.len()), (160, 50, Some(160), 2));
}

#[test]
fn holes_and_photographs_outside_are_seen() {
    let hole = layout(
        120,
        60,
        &[
            upright(0.0, 0.0, 50.0, 60.0),
            upright(50.0, 0.0, 120.0, 20.0),
            upright(50.0, 40.0, 120.0, 60.0),
            upright(70.0, 10.0, 120.0, 50.0),
        ],
    );
    let coverage = Coverage::of(&hole);
    assert_eq!(coverage.largest_rectangle(), Rectangle { columns: 0..50, rows: 0..60 });
    assert_eq!(coverage.longest_whole_rows(), Rectangle { columns: 0..120, rows: 0..20 });
    let kept = cropped(hole, &coverage.largest_rectangle());
    assert_eq!(kept.placed.len(), 1);
}
