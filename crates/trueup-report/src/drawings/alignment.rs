//! How far apart matched points land, over the panorama.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use trueup::{Project, Result};

use super::palette::error_color;
use super::svg::{Document, placed, tenths};

/// Squares along the longer side of the panorama in which distances are averaged.
const SQUARES_ALONG_A_SIDE: f64 = 72.0;

/// Matches of a square.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Square {
    matches: usize,
    /// Sum of the distances, in the photographs' own pixels.
    sum_px: f64,
}

/// A heat map of the alignment error: squares of the panorama in which photographs were matched, colored by how far
/// apart the matched points land on average: blue for none, yellow for the limit of good, vermilion from the limit of
/// fair on.
///
/// # Errors
/// [`trueup::Error::Input`] if the project's grids are damaged.
pub fn alignment_error(project: &Project) -> Result<String> {
    let canvas = project.canvas;
    let limits = project.limits_apart_px();
    let side = side_px(project);
    let squares = squares(project, side)?;
    let mut document = Document::new([canvas.width, canvas.height], "alignment-error");
    for ([row, column], square) in &squares {
        let mean = square.sum_px / square.matches as f64;
        let [x, y, side] = [*column as f64 * side, *row as f64 * side, side].map(tenths);
        document.element(format_args!(
            "<rect x=\"{x}\" y=\"{y}\" width=\"{side}\" height=\"{side}\" fill=\"{}\" fill-opacity=\"0.72\">\
             <title>{mean:.2} px, {} matches</title></rect>",
            error_color(mean, limits),
            square.matches
        ));
    }
    let matches: usize = squares.values().map(|square| square.matches).sum();
    let label = format!("Heat map of how far apart {matches} matched points land on the panorama.");
    Ok(document.finish(&label))
}

/// The colors of [`alignment_error`] with the errors they stand for, in the photographs' own pixels: from none to the
/// limit of fair.
pub fn alignment_legend(project: &Project) -> Vec<(String, f64)> {
    let [good, fair] = project.limits_apart_px();
    let errors = [0.0, good / 2.0, good, (good + fair) / 2.0, fair];
    errors.map(|error| (error_color(error, [good, fair]), error)).to_vec()
}

fn side_px(project: &Project) -> f64 {
    project.canvas.width.max(project.canvas.height) as f64 / SQUARES_ALONG_A_SIDE
}

/// The squares with matches, by row and column.
fn squares(project: &Project, side: f64) -> Result<BTreeMap<[usize; 2], Square>> {
    let grids: BTreeMap<usize, _> = placed(project)?.into_iter().map(|(position, _, mesh)| (position, mesh)).collect();
    let canvas = project.canvas;
    let mut squares: BTreeMap<[usize; 2], Square> = BTreeMap::new();
    for pair in project.measures.iter().flat_map(|measures| &measures.pairs) {
        let Some(mesh) = grids.get(&pair.a) else { continue };
        for place in &pair.places {
            let at = mesh.warp(Vector2::from(place.at));
            let x = canvas.period().map_or(at.x, |period| at.x.rem_euclid(period));
            let inside = (0.0..canvas.width as f64).contains(&x) && (0.0..canvas.height as f64).contains(&at.y);
            if !inside {
                continue;
            }
            let square = squares.entry([(at.y / side) as usize, (x / side) as usize]).or_default();
            square.matches += place.matches;
            square.sum_px += place.mean_px * place.matches as f64;
        }
    }
    squares.retain(|_, square| square.matches > 0);
    Ok(squares)
}
