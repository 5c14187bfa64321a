//! What is kept of laid out photographs.

use trueup_core::Result;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::RowSource;

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

/// A picture of so many pixels, painted by a gray level for every place.
struct Painted<F>([usize; 2], F);

impl<F: Fn(usize, usize) -> u8 + Sync> RowSource for Painted<F> {
    fn width(&self) -> usize {
        self.0[0]
    }

    fn height(&self) -> usize {
        self.0[1]
    }

    fn is_opaque(&self) -> bool {
        true
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
            let level = (self.1)(x, y);
            pixel.copy_from_slice(&[level, level, level, 255]);
        }
        Ok(())
    }

    fn rgba16_row(&self, _: usize, _: &mut [u16]) -> Result<()> {
        unreachable!("eight bits are enough")
    }

    fn linear_row(&self, _: usize, _: &mut [f32]) -> Result<()> {
        unreachable!("eight bits are enough")
    }
}

/// What is kept of a layout that shows `picture`.
fn kept(layout: &CanvasLayout, crop: Crop, picture: impl Fn(usize, usize) -> u8 + Sync) -> Option<Rectangle> {
    kept_by(layout, CanvasOptions { crop, ..CanvasOptions::default() }, picture)
}

fn kept_by(
    layout: &CanvasLayout,
    options: CanvasOptions,
    picture: impl Fn(usize, usize) -> u8 + Sync,
) -> Option<Rectangle> {
    let painted = Painted([layout.width, layout.height], picture);
    let framing = Framing { coverage: &Coverage::of(layout), options: &options, known: None, check: None };
    match framing.of_panorama(&painted, layout).expect("a picture in memory") {
        Frame::Whole => None,
        Frame::Part(kept) => Some(kept),
    }
}

fn upright(left: f64, top: f64, right: f64, bottom: f64) -> [[f64; 2]; 4] {
    [[left, top], [right, top], [right, bottom], [left, bottom]]
}

/// Levels without any order: nothing is smooth.
fn rough(x: usize, y: usize) -> u8 {
    let mixed = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    (mixed.wrapping_mul(0xC2B2_AE3D) >> 24) as u8
}

#[test]
fn two_steps_leave_the_common_rows() {
    let steps = layout(190, 70, &[upright(0.0, 0.0, 100.0, 60.0), upright(90.0, 9.5, 190.0, 70.0)]);
    let coverage = Coverage::of(&steps);
    assert_eq!(coverage.area(), 100 * 60 + 100 * 60 - 10 * 50);
    let largest = Rectangle { columns: 0..190, rows: 10..60 };
    assert_eq!(coverage.largest_rectangle(), largest);
    assert_eq!(coverage.area_within(&largest), 190 * 50);
    let part = cropped(steps.clone(), &largest);
    assert_eq!((part.width, part.height, part.origin), (190, 50, [5.0, 12.0]));
    assert_eq!(part.placed[0].mesh.target[0], [0.0, -10.0]);
    assert_eq!(kept(&steps, Crop::Rectangle, rough), Some(largest.clone()));
    assert_eq!(kept(&steps, Crop::Auto, rough), Some(largest), "9500 of 11500 pixels, all alike");
    assert_eq!(kept(&steps, Crop::None, rough), None);
}

/// A wide photograph, and a narrower one above it that leaves 80 columns empty: to lose these columns costs 20000
/// pixels, to lose the rows above 16000.
fn with_a_tower() -> CanvasLayout {
    layout(400, 300, &[upright(0.0, 50.0, 400.0, 300.0), upright(80.0, 0.0, 400.0, 200.0)])
}

#[test]
fn a_tower_is_worth_more_than_the_columns_beside_it() {
    // Rough ground up to row 220, a bright sky above it that is not smooth where it is empty, and a tower up to row 20.
    let scene = |tower: bool| {
        move |x: usize, y: usize| match (y >= 220, (240..260).contains(&x) && y >= 20) {
            (true, _) => rough(x, y),
            (false, true) if tower => 60,
            _ if x < 120 => 190 + rough(x, y) / 8,
            _ => 220,
        }
    };
    let without = kept(&with_a_tower(), Crop::Auto, scene(false)).expect("a rectangle");
    assert_eq!(without, Rectangle { columns: 0..400, rows: 50..300 });
    let with = kept(&with_a_tower(), Crop::Auto, scene(true)).expect("a rectangle");
    assert_eq!(with, Rectangle { columns: 80..400, rows: 0..300 });
    // The largest rectangle cares for neither.
    assert_eq!(kept(&with_a_tower(), Crop::Rectangle, scene(true)), Some(without.clone()));
    // Of the 116000 covered pixels the one with the tower keeps 0.83, the largest 0.86.
    let at_least =
        |min_kept| kept_by(&with_a_tower(), CanvasOptions { min_kept, ..CanvasOptions::default() }, scene(true));
    assert_eq!(at_least(0.82), Some(with));
    assert_eq!(at_least(0.85), Some(without));
    assert_eq!(at_least(0.87), None);
}

/// Of photographs of 100 x 60 pixels with a step between them, what is empty is filled where it is smooth.
#[test]
fn what_is_missing_of_a_smooth_sky_costs_nothing() {
    let steps = layout(190, 64, &[upright(0.0, 0.0, 100.0, 60.0), upright(90.0, 4.0, 190.0, 64.0)]);
    assert_eq!(kept(&steps, Crop::Auto, |_, _| 200), Some(Rectangle { columns: 0..190, rows: 0..64 }));
    // Smooth above, rough below: the strip at the lower border is cut off.
    let ground = |x, y| if y < 30 { 200 } else { rough(x, y) };
    assert_eq!(kept(&steps, Crop::Auto, ground), Some(Rectangle { columns: 0..190, rows: 0..60 }));
}

/// A tower rises into rows that end beside it: over the sky there, in whose border a cloud's edge lies at one place,
/// what is missing is filled, so that the tower keeps its top; over the crown of a tree it is not.
#[test]
fn the_edge_of_a_cloud_costs_no_tower_its_top() {
    let layout = layout(400, 300, &[upright(0.0, 30.0, 400.0, 300.0), upright(0.0, 0.0, 150.0, 200.0)]);
    let scene = |rough_part: std::ops::Range<usize>| {
        move |x: usize, y: usize| match (y >= 220, (90..110).contains(&x) && y >= 8, y < 60 && rough_part.contains(&x))
        {
            (true, _, _) | (_, _, true) => rough(x, y),
            (_, true, _) => 60,
            _ => 220,
        }
    };
    let cloud = kept(&layout, Crop::Auto, scene(280..288)).expect("a rectangle");
    assert_eq!((cloud.columns, cloud.rows.start <= 6), (0..400, true), "{:?}", cloud.rows);
    let tree = kept(&layout, Crop::Auto, scene(200..400)).expect("a rectangle");
    assert!(tree.rows.start >= 30 || tree.columns.end <= 200, "{tree:?}");
}

/// A tower rises above a wall into rows that end beside it, under clouds of 11 levels from cell to cell: too uneven to
/// be filled, except that the tower keeps its top. Where cells themselves are uneven, by 12 levels, it does not.
#[test]
fn clouds_are_filled_for_a_tower_to_keep_its_top() {
    let layout = layout(400, 300, &[upright(0.0, 60.0, 400.0, 300.0), upright(0.0, 0.0, 200.0, 200.0)]);
    let scene = |grain: u8| {
        move |x: usize, y: usize| match (y >= 90, (90..110).contains(&x) && y >= 20) {
            (true, _) => rough(x, y),
            (false, true) => 60,
            // Cells are two pixels wide.
            _ => 160 + 11 * (x / 2 % 6).abs_diff(3) as u8 + if (x + y).is_multiple_of(2) { grain } else { 0 },
        }
    };
    let clouds = kept(&layout, Crop::Auto, scene(0)).expect("a rectangle");
    assert_eq!((clouds.columns, clouds.rows.start <= 20), (0..400, true), "{:?}", clouds.rows);
    let crowns = kept(&layout, Crop::Auto, scene(24)).expect("a rectangle");
    assert_eq!((crowns.columns, crowns.rows.start), (0..400, 60));
}

/// A tower in an even sky bears a mast of a column of pixels, 6 levels darker than the sky, into rows that end beside
/// it: it is kept, and the sky beside it filled. Without it, and where it runs out of the photograph, they are not.
#[test]
fn a_tower_keeps_its_mast() {
    let layout = layout(500, 130, &[upright(0.0, 30.0, 500.0, 130.0), upright(200.0, 0.0, 300.0, 100.0)]);
    let scene = |mast: std::ops::Range<usize>| {
        move |x: usize, y: usize| match (y >= 110, (240..260).contains(&x) && y >= 60, x == 250 && mast.contains(&y)) {
            (true, _, _) => rough(x, y),
            (_, true, _) => 60,
            (_, _, true) => 194,
            _ => 200,
        }
    };
    let rows = |mast| {
        let found = kept(&layout, Crop::Auto, scene(mast)).expect("a rectangle");
        assert_eq!(found.columns, 0..500);
        found.rows
    };
    // Cells are a pixel wide; one row beside what is covered is filled without being asked for.
    assert!((29..=30).contains(&rows(0..0).start));
    assert!((29..=30).contains(&rows(0..60).start), "it runs out of the photograph");
    let with_mast = rows(12..60);
    assert!(with_mast.start <= 12 && with_mast.end == 130, "{with_mast:?}");
}

/// Beside an even sky the corner that is missing is filled; where a post runs out of the photograph below, it is not,
/// unless that would keep too little.
#[test]
fn a_post_does_not_end_in_front_of_what_is_filled() {
    let layout = layout(400, 300, &[upright(0.0, 30.0, 400.0, 300.0), upright(0.0, 0.0, 300.0, 200.0)]);
    let scene = |post: bool| {
        move |x: usize, y: usize| match (y >= 220, (350..356).contains(&x) && post) {
            (true, _) => rough(x, y),
            (false, true) => 60,
            _ => 220,
        }
    };
    let whole = Rectangle { columns: 0..400, rows: 0..300 };
    assert_eq!(kept(&layout, Crop::Auto, scene(false)), Some(whole.clone()));
    // But for a row of cells at most, two pixels.
    let found = kept(&layout, Crop::Auto, scene(true)).expect("a rectangle");
    assert!((28..=30).contains(&found.rows.start) && found.columns == (0..400), "{found:?}");
    // Without the rows above, 0.923 of what is covered.
    let most = CanvasOptions { min_kept: 0.95, ..CanvasOptions::default() };
    assert_eq!(kept_by(&layout, most, scene(true)), Some(whole));
}

/// A narrow photograph 80 pixels above a wide one: farther than a photograph's side, 60 pixels, nothing is filled.
#[test]
fn what_is_far_from_all_photographs_is_not_filled() {
    let layout = layout(120, 140, &[upright(0.0, 80.0, 120.0, 140.0), upright(0.0, 0.0, 60.0, 80.0)]);
    let found = kept(&layout, Crop::Auto, |_, _| 200).expect("a rectangle");
    assert!(!(found.columns.contains(&119) && found.rows.contains(&10)), "{found:?}");
}

#[test]
fn what_keeps_too_little_is_not_cropped() {
    // A cross, of which one beam is seven tenths.
    let cross = layout(300, 300, &[upright(0.0, 120.0, 300.0, 180.0), upright(120.0, 60.0, 180.0, 240.0)]);
    assert_eq!(kept(&cross, Crop::Auto, rough).map(|found| found.area()), Some(300 * 60));
    let star = layout(
        300,
        300,
        &[upright(0.0, 130.0, 100.0, 170.0), upright(120.0, 0.0, 180.0, 100.0), upright(200.0, 130.0, 300.0, 170.0)],
    );
    assert_eq!(kept(&star, Crop::Auto, rough), None);
    assert_eq!(kept(&star, Crop::Rectangle, rough).map(|found| found.area()), Some(60 * 100));
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
    for crop in [Crop::Rectangle, Crop::Auto] {
        let found = kept(&turn, crop, rough).expect("whole rows");
        assert_eq!(found, Rectangle { columns: 0..160, rows: 10..60 });
        let part = cropped(turn.clone(), &found);
        assert_eq!((part.width, part.height, part.period, part.placed.len()), (160, 50, Some(160), 2));
    }
}

#[test]
fn holes_are_seen() {
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
    let left = Rectangle { columns: 0..50, rows: 0..60 };
    assert_eq!(coverage.largest_rectangle(), left);
    assert_eq!(coverage.longest_whole_rows(), Rectangle { columns: 0..120, rows: 0..20 });
    // The hole is 20 x 20 pixels of the second cell; cells at the end are as large as there are pixels.
    assert_eq!(coverage.in_cells(50), [2500, 2500 - 400, 1000, 500, 500, 200]);
}

/// The cells of a full turn of 90 x 60, with things all along it, and an empty hole across its cut, turned by so many
/// columns.
fn turned(by: usize) -> Cells {
    const SIZE: [usize; 2] = [90, 60];
    let [columns, rows] = SIZE;
    let place = |at: usize| ((at % columns + columns - by) % columns, at / columns);
    let is_covered = |(x, y): (usize, usize)| y >= 3 && ((6..76).contains(&x) || !(40..52).contains(&y));
    let level = |(x, y): (usize, usize)| match (y > 20 + x * 7 % 13, (x + 3) % columns < 6 && y > 12) {
        (true, _) => 40.0 + f32::from(rough(x, y)) / 2.0,
        (false, true) => 70.0,
        _ => 200.0 + (x % 5) as f32,
    };
    let all = || (0..columns * rows).map(place);
    Cells {
        side: 4,
        columns,
        rows,
        covered: all().map(is_covered).collect(),
        colors: all().map(|place| [level(place); 3]).collect(),
        deviations: all().map(|(x, y)| f32::from(rough(x, y)) / 30.0).collect(),
        around: true,
    }
}

/// A full turn has no ends: what matters of it, and what may be filled, is the same wherever it is cut.
#[test]
fn a_full_turn_is_judged_alike_wherever_it_is_cut() {
    let whole = turned(0);
    let (columns, rows) = (whole.columns, whole.rows);
    let [worth, fillable] = [worth::Worth::of(&whole).salience, smooth_shares(&whole)];
    let ends = |cells: &Cells| auto::widened(&worth::Worth::of(cells).ends, 2, cells.around);
    let expected_ends = ends(&whole);
    assert!(expected_ends.iter().flatten().count() > 5, "there are things that end");
    for by in [1, 17, 45] {
        let cells = turned(by);
        let found = worth::Worth::of(&cells);
        let [salience, smooth] = [found.salience.clone(), smooth_shares(&cells)];
        let ends = ends(&cells);
        for (x, expected_end) in expected_ends.iter().enumerate() {
            let there = (x + by) % columns;
            assert_eq!(ends[there], *expected_end, "column {x} turned by {by}");
            for y in 0..rows {
                let (at, at_there) = (y * columns + x, y * columns + there);
                assert!((salience[at_there] - worth[at]).abs() < 1e-5, "({x}, {y}) turned by {by}");
                assert!((smooth[at_there] - fillable[at]).abs() < 1e-5, "({x}, {y}) turned by {by}");
            }
        }
    }
}

/// Of all cells the share of the border that is smooth; less than none where nothing may be filled.
fn smooth_shares(cells: &Cells) -> Vec<f32> {
    let fillable = smooth::Fillable::of(cells, smooth::Smoothness::CLOUDS, 30);
    fillable.smooth.into_iter().map(|share| share.unwrap_or(-1.0)).collect()
}

/// The last column of cells is a pixel wide, in which no middle of a pixel of the small views lies.
#[test]
fn cells_between_the_pixels_of_small_views_are_like_those_beside_them() {
    use crate::seam::Seams;
    use crate::small_views::{PARTLY, SmallView, WHOLLY};
    use crate::transfer_curve::Encoding;

    let layout = layout(1501, 1001, &[upright(0.0, 0.0, 1501.0, 1001.0); 2]);
    let (small, level) = ([750, 500], 120);
    let ahead = CellsAhead::new(&layout, &Coverage::of(&layout), small).expect("fine enough");
    let pixels = vec![[level, level, level, PARTLY | WHOLLY]; small[0] * small[1]];
    let view = SmallView { columns: 0..small[0], rows: 0..small[1], pixels };
    let cut = ahead.cut(&[view], &[Vec::new()], &Seams::of_one(small[0], small[1]));
    let changes = vec![[0.0; 3]; cut.places().len()];
    let cells = cut.blended(&changes, &Encoding::new(trueup_core::color::TransferCurve::SRGB, 1.0));
    assert!(cells.covered.iter().all(|&covered| covered));
    let first = cells.colors[0];
    assert!(first[0] > 100.0);
    for (at, color) in cells.colors.iter().enumerate() {
        assert!((color[0] - first[0]).abs() < 1e-3, "cell ({}, {})", at % cells.columns, at / cells.columns);
    }
}
