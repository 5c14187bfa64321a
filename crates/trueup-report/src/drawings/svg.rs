//! What the drawings have in common.

use std::fmt::Write;

use nalgebra::Vector2;
use trueup::{Canvas, ImageRecord, Project, Result};
use trueup_core::mesh::GridMesh;

use super::palette::HALO;
use crate::text::escape;

/// How much wider than a stroke is what lies below it, pixels of the screen.
const HALO_PX: f64 = 2.4;

/// An SVG document that is drawn piece by piece.
#[derive(Debug)]
pub(super) struct Document {
    size: [usize; 2],
    class: &'static str,
    drawn: String,
}

/// How a line is drawn. Its width is in pixels of the screen, however large the drawing is shown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke {
    pub color: &'static str,
    pub width: f64,
    /// Lengths of dashes and gaps; empty for none.
    pub dashes: &'static str,
}

impl Document {
    /// A drawing of `size` units, of the class `drawing` and `class`.
    pub(super) fn new(size: [usize; 2], class: &'static str) -> Self {
        Self { size, class, drawn: String::new() }
    }

    /// Adds an element that needs no escaping: names and numbers only.
    pub(super) fn element(&mut self, element: std::fmt::Arguments) {
        // Writing to a text does not fail.
        let _ = self.drawn.write_fmt(element);
        self.drawn.push('\n');
    }

    /// Adds a path, with a halo below it, so that it shows on bright and on dark pictures.
    pub(super) fn stroke(&mut self, data: &str, stroke: &Stroke) {
        let halo = stroke.width + HALO_PX;
        self.element(format_args!(
            "<path d=\"{data}\" fill=\"none\" stroke=\"{HALO}\" stroke-opacity=\"0.55\" stroke-width=\"{halo}\" \
             vector-effect=\"non-scaling-stroke\"/>"
        ));
        let Stroke { color, width, dashes } = stroke;
        let dashes = if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dashes}\"") };
        self.element(format_args!(
            "<path d=\"{data}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"{dashes} \
             vector-effect=\"non-scaling-stroke\"/>"
        ));
    }

    /// Adds words around a place, readable on any picture.
    pub(super) fn words(&mut self, place: [f64; 2], size: f64, text: &str) {
        let [x, y] = place.map(tenths);
        let (halo, text) = (tenths(size / 5.0), escape(text));
        self.element(format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" font-weight=\"600\" text-anchor=\"middle\" \
             dominant-baseline=\"central\" fill=\"#ffffff\" stroke=\"{HALO}\" stroke-width=\"{halo}\" \
             stroke-linejoin=\"round\" paint-order=\"stroke\">{text}</text>"
        ));
    }

    /// What was drawn, told to those who do not see it as `label`.
    pub(super) fn finish(self, label: &str) -> String {
        let Self { size: [width, height], class, drawn } = self;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" preserveAspectRatio=\"none\" \
             class=\"drawing {class}\" role=\"img\" aria-label=\"{}\" font-family=\"system-ui, sans-serif\">\n{drawn}</svg>",
            escape(label)
        )
    }

    /// The same with what was drawn on a canvas that goes all the way round drawn again a turn to either side: what
    /// runs beyond one end shows at the other.
    pub(super) fn finish_around(mut self, canvas: Canvas, label: &str) -> String {
        if let Some(period) = canvas.period() {
            let once = self.drawn.clone();
            for shift in [-period, period] {
                self.element(format_args!("<g transform=\"translate({shift} 0)\">\n{once}</g>"));
            }
        }
        self.finish(label)
    }
}

/// The photographs in use, each with its position and its grid on the canvas.
pub(super) fn placed(project: &Project) -> Result<Vec<(usize, &ImageRecord, GridMesh)>> {
    let used = project.used_positions().into_iter();
    used.map(|position| Ok((position, &project.images[position], project.images[position].grid()?))).collect()
}

/// The data of a path through points, broken where one is no place or lies half a canvas from the last: cells around a
/// pole are torn.
pub(super) fn path(points: impl IntoIterator<Item = [f64; 2]>, canvas_width: usize) -> String {
    let mut data = String::new();
    let mut last: Option<[f64; 2]> = None;
    for point in points {
        if !point.iter().all(|coordinate| coordinate.is_finite()) {
            last = None;
            continue;
        }
        let follows = last.is_some_and(|last| (last[0] - point[0]).abs() < canvas_width as f64 / 2.0);
        let [x, y] = point.map(tenths);
        let _ = write!(data, "{}{x} {y}", if follows { 'L' } else { 'M' });
        last = Some(point);
    }
    data
}

/// To tenths of a pixel.
pub(super) fn tenths(coordinate: f64) -> f64 {
    (coordinate * 10.0).round() / 10.0
}

/// Where the middle of a photograph lies on the canvas; `None` where a projection has no place for it.
pub(super) fn middle(mesh: &GridMesh) -> Option<[f64; 2]> {
    let place = mesh.warp(Vector2::new(mesh.width / 2.0, mesh.height / 2.0));
    (place.x.is_finite() && place.y.is_finite()).then(|| place.into())
}

/// The size of letters on a canvas: a share of its height, and no less than can be read on a wide one.
pub(super) fn letters_px(canvas: Canvas) -> f64 {
    /// Shares of the height and of the width.
    const SHARES: [f64; 2] = [0.045, 0.014];
    (SHARES[0] * canvas.height as f64).max(SHARES[1] * canvas.width as f64).round().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_break_where_there_is_no_place_and_where_cells_are_torn() {
        let points = [[0.04, 1.0], [2.55, 3.0], [f64::NAN, 0.0], [4.0, 4.0], [90.0, 4.0]];
        assert_eq!(path(points, 100), "M0 1L2.6 3M4 4M90 4");
    }

    #[test]
    fn labels_and_words_are_escaped() {
        let mut document = Document::new([2, 1], "x");
        document.words([0.0, 0.0], 1.0, "</svg><script>");
        let text = document.finish("a\" onload=\"alert(1)");
        assert!(!text.contains("\" onload") && !text.contains("<script"), "{text}");
    }

    #[test]
    fn a_full_turn_is_drawn_a_turn_to_either_side_too() {
        let mut document = Document::new([100, 10], "x");
        document.words([99.0, 5.0], 1.0, "7");
        let text = document.finish_around(Canvas { width: 100, height: 10, full_turn: true }, "x");
        assert_eq!(text.matches(">7</text>").count(), 3);
        assert!(text.contains("translate(-100 0)") && text.contains("translate(100 0)"), "{text}");
    }
}
