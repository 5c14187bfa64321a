//! Where photographs lie.

use trueup::{Project, Result};
use trueup_core::mesh::GridMesh;

use super::palette::photograph_color;
use super::svg::{Document, Stroke, letters_px, middle, path, placed};
use crate::text::counted;

/// The border of every photograph on the panorama, in its color, with its number in its middle: its place among all
/// that were given, counted from 1.
///
/// # Errors
/// [`trueup::Error::Input`] if the project's grids are damaged.
pub fn outlines(project: &Project) -> Result<String> {
    let canvas = project.canvas;
    let size = letters_px(canvas);
    let placed = placed(project)?;
    let mut document = Document::new([canvas.width, canvas.height], "outlines");
    for (position, _, mesh) in &placed {
        let stroke = Stroke { color: photograph_color(*position), width: 2.5, dashes: "" };
        document.stroke(&path(border(mesh), canvas.width), &stroke);
    }
    for (position, _, mesh) in &placed {
        if let Some(place) = middle(mesh) {
            document.words(place, size, &(position + 1).to_string());
        }
    }
    let label = format!("Outlines of {} on the panorama.", counted(placed.len(), "photograph"));
    Ok(document.finish_around(canvas, &label))
}

/// The vertices around a grid, clockwise from its first corner and back to it.
fn border(mesh: &GridMesh) -> Vec<[f64; 2]> {
    let (rows, columns) = (mesh.rows, mesh.columns);
    let top = (0..columns).map(|column| (0, column));
    let right = (1..rows).map(|row| (row, columns - 1));
    let bottom = (0..columns - 1).rev().map(|column| (rows - 1, column));
    let left = (0..rows - 1).rev().map(|row| (row, 0));
    let around = top.chain(right).chain(bottom).chain(left);
    around.map(|(row, column)| mesh.target[row * columns + column]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_go_once_around() {
        let around = border(&GridMesh::regular(20.0, 10.0, 10.0));
        assert_eq!(around, [[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [20.0, 10.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]]);
    }
}
