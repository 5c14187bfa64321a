//! Which photographs were found to overlap.

use trueup::{PairRecord, Project, Result};

use super::palette::photograph_color;
use super::svg::{Document, Stroke, letters_px, middle, path, placed, tenths};
use crate::text::counted;

/// Size of counts, relative to the photographs' numbers.
const COUNTS: f64 = 0.8;

/// The graph of overlaps over the panorama: photographs in their places with their numbers, joined where matches agree,
/// with their count; the more there are, the thicker the line.
///
/// # Errors
/// [`trueup::Error::Input`] if the project's grids are damaged.
pub fn overlaps(project: &Project) -> Result<String> {
    let canvas = project.canvas;
    let size = letters_px(canvas);
    let placed = placed(project)?;
    let places: Vec<(usize, [f64; 2])> =
        placed.iter().filter_map(|(position, _, mesh)| Some((*position, middle(mesh)?))).collect();
    let place = |position: usize| places.iter().find(|(known, _)| *known == position).map(|(_, place)| *place);
    let edge = |pair: &PairRecord| {
        let (start, mut end) = (place(pair.a)?, place(pair.b)?);
        if let Some(period) = canvas.period() {
            end[0] -= ((end[0] - start[0]) / period).round() * period;
        }
        Some(Edge { start, end, inliers: pair.inliers })
    };
    let joined = project.pairs.iter().filter(|pair| pair.verdict.is_joined());
    let edges: Vec<Edge> = joined.filter_map(edge).collect();
    let mut document = Document::new([canvas.width, canvas.height], "overlaps");
    for edge in &edges {
        let data = path([edge.start, edge.end], usize::MAX);
        document.stroke(&data, &Stroke { color: "#ffffff", width: edge.stroke_px(), dashes: "" });
    }
    for edge in &edges {
        document.words(edge.middle(), size * COUNTS, &edge.inliers.to_string());
    }
    for (position, place) in &places {
        let ([x, y], color) = (place.map(tenths), photograph_color(*position));
        document.element(format_args!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{size}\" fill=\"{color}\" stroke=\"#000000\" stroke-width=\"1.5\" \
             vector-effect=\"non-scaling-stroke\"/>"
        ));
        document.words(*place, size, &(position + 1).to_string());
    }
    let label = format!("{} joined by {}.", counted(places.len(), "photograph"), counted(edges.len(), "overlap"));
    Ok(document.finish_around(canvas, &label))
}

/// An overlap on the canvas.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    start: [f64; 2],
    end: [f64; 2],
    inliers: usize,
}

impl Edge {
    fn middle(&self) -> [f64; 2] {
        [(self.start[0] + self.end[0]) / 2.0, (self.start[1] + self.end[1]) / 2.0]
    }

    /// Thicker by a pixel for every doubling of the matches.
    fn stroke_px(&self) -> f64 {
        tenths((self.inliers.max(1) as f64 / 8.0).log2().clamp(1.0, 9.0))
    }
}
