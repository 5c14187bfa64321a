//! Lines and grids to be drawn over a panorama.

use nalgebra::{Matrix3, Vector2};
use trueup_align::metrics::{VerticalLinesInput, vertical_segments};
use trueup_core::Result;
use trueup_core::geometry::rows_of;
use trueup_core::lines::LineSegment;
use trueup_core::mesh::GridMesh;
use trueup_core::source::WorkingFrame;

use trueup::MatchedPhotographs;
use trueup::{ImageRecord, Project};

/// Points in panorama pixels, to be joined.
pub type Polyline = Vec<[f64; 2]>;

/// What can be drawn over one panorama.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawing {
    /// Straight segments of the photographs that point to the vertical.
    pub vertical_lines: Vec<Polyline>,
    /// All other segments.
    pub other_lines: Vec<Polyline>,
    /// Grids, in the order of the photographs used.
    pub grids: Vec<PhotographGrid>,
}

/// The deformed grid of one photograph.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotographGrid {
    /// Path of the photograph.
    pub path: String,
    /// Rows and columns; the borders are among them.
    pub lines: Vec<Polyline>,
}

/// Steps along a segment, in the photograph's working pixels: a bend of the grid's cells, which are about as large,
/// shows.
const STEP_PX: f64 = 20.0;

/// Line segments drawn over each photograph, the longest first: more make the photograph unreadable.
const DRAWN_LINES: usize = 150;
/// Grid lines drawn over each photograph in either direction, its borders among them: as many as can be followed by
/// eye.
const DRAWN_GRID_LINES: usize = 13;

/// The drawing of a panorama whose photographs were measured in `set`.
///
/// # Errors
/// [`trueup_core::Error::Input`] if the project's grids are damaged.
pub(crate) fn draw(set: &MatchedPhotographs, project: &Project) -> Result<Drawing> {
    let mut drawing = Drawing::default();
    let used = project.images.iter().enumerate().filter(|(_, image)| image.mesh.is_some());
    for (position, image) in used {
        let mesh = image.grid()?;
        drawing.grids.push(PhotographGrid { path: image.path.clone(), lines: grid_lines(&mesh, DRAWN_GRID_LINES) });
        let Some((lines, frame)) = set.lines_of(position) else { continue };
        let working = GridMesh { width: frame.width, height: frame.height, ..mesh };
        let vertical = verticals(image, lines, &frame);
        for segment in longest(lines, DRAWN_LINES) {
            let drawn = carried(&lines[segment], &working);
            match vertical.binary_search(&segment) {
                Ok(_) => drawing.vertical_lines.push(drawn),
                Err(_) => drawing.other_lines.push(drawn),
            }
        }
    }
    Ok(drawing)
}

/// Positions of the vertical segments, as the measures of uprightness find them.
fn verticals(image: &ImageRecord, lines: &[LineSegment], frame: &WorkingFrame) -> Vec<usize> {
    let rotation = image.rotation.unwrap_or_else(|| rows_of(&Matrix3::identity()));
    let Some(camera) = image.camera(&rotation) else { return Vec::new() };
    // Down is the levelled world's second axis; without a rotation, cameras are expected to be held level.
    let down = camera.rotation().column(1).into_owned();
    let camera = camera.scaled(frame.working_from_full);
    let photograph = VerticalLinesInput { lines, frame, camera: &camera, expected_down: down };
    vertical_segments(&photograph)
}

/// Positions of the longest segments, ascending.
fn longest(lines: &[LineSegment], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..lines.len()).collect();
    order.sort_by(|&one, &two| lines[two].length().total_cmp(&lines[one].length()).then(one.cmp(&two)));
    order.truncate(count);
    order.sort_unstable();
    order
}

/// A segment in the panorama.
fn carried(line: &LineSegment, mesh: &GridMesh) -> Polyline {
    let (start, end) = (Vector2::from(line.start), Vector2::from(line.end));
    // The cast saturates.
    let steps = (line.length() / STEP_PX).ceil().max(1.0) as usize;
    (0..=steps).map(|step| mesh.warp(start.lerp(&end, step as f64 / steps as f64)).into()).collect()
}

/// Up to `count` of the grid's rows and as many of its columns, spread evenly from border to border.
fn grid_lines(mesh: &GridMesh, count: usize) -> Vec<Polyline> {
    let rows = spread(mesh.rows, count)
        .map(|row| (0..mesh.columns).map(|column| mesh.target[row * mesh.columns + column]).collect());
    let columns = spread(mesh.columns, count)
        .map(|column| (0..mesh.rows).map(|row| mesh.target[row * mesh.columns + column]).collect());
    rows.chain(columns).collect()
}

/// Up to `count`, at least 2, of `0..of`, the first and the last among them.
fn spread(of: usize, count: usize) -> impl Iterator<Item = usize> {
    let count = count.min(of).max(2);
    (0..count).map(move |k| k * (of - 1) / (count - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_lines_reach_from_border_to_border() {
        let mesh = GridMesh::regular(100.0, 60.0, 10.0);
        let lines = grid_lines(&mesh, 3);
        assert_eq!(lines.len(), 6);
        assert_eq!((lines[0].first(), lines[0].last()), (Some(&[0.0, 0.0]), Some(&[100.0, 0.0])));
        assert_eq!((lines[5].first(), lines[5].last()), (Some(&[100.0, 0.0]), Some(&[100.0, 60.0])));
        assert_eq!(spread(11, 4).collect::<Vec<_>>(), [0, 3, 6, 10]);
        assert_eq!(spread(2, 9).collect::<Vec<_>>(), [0, 1]);
    }

    #[test]
    fn the_longest_lines_are_drawn_where_the_grid_carries_them() {
        let line =
            |x: f64, length: f64| LineSegment { start: [x, 0.0], end: [x, length], width_px: 1.0, significance: 1.0 };
        assert_eq!(longest(&[line(0.0, 5.0), line(1.0, 9.0), line(2.0, 7.0)], 2), [1, 2]);
        let mut mesh = GridMesh::regular(100.0, 60.0, 10.0);
        for vertex in &mut mesh.target {
            *vertex = [2.0 * vertex[0], vertex[1] + 5.0];
        }
        let drawn = carried(&line(30.0, 40.0), &mesh);
        assert_eq!(drawn.len(), 3);
        assert!((Vector2::from(drawn[1]) - Vector2::new(60.0, 25.0)).norm() < 1e-9);
    }
}
