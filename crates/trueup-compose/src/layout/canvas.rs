//! The canvas and what lies on it.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use trueup_core::mesh::GridMesh;

/// A photograph and the deformed grid that carries it to the panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Placed {
    /// Index of the photograph in the [`trueup_core::source::PhotographSource`].
    pub photograph: usize,
    /// Grid over the full-resolution photograph: width and height are its pixels.
    pub mesh: GridMesh,
}

/// The canvas and where every photograph lies on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CanvasLayout {
    /// Width of the canvas in pixels, at least 1.
    pub width: usize,
    /// Height of the canvas in pixels, at least 1.
    pub height: usize,
    /// Canvas pixels per unit of the targets that were given.
    pub canvas_from_target: f64,
    /// What lies at the canvas's corner (0, 0), in the unit of the targets that were given.
    #[serde(default)]
    pub origin: [f64; 2],
    /// The photographs used, in the order given; targets are canvas pixels and may lie outside the canvas.
    pub placed: Vec<Placed>,
    /// The canvas is a cylinder of that many columns, its width: what lies beyond one end is seen at the other. A
    /// multiple of the largest power of two (at least 8) that it holds 32 times, so that all levels of a blend repeat
    /// exactly; with others its ends may show a faint step.
    #[serde(default)]
    pub period: Option<usize>,
}

impl CanvasLayout {
    /// The smaller side of a photograph on the canvas, pixels: the median over those placed; 1 if there is none.
    pub(crate) fn photograph_side(&self) -> f64 {
        let side = |placed: &Placed| {
            let (low, high) = placed.mesh.bounds();
            (high - low).min()
        };
        let mut sides: Vec<f64> = self.placed.iter().map(side).collect();
        sides.sort_by(f64::total_cmp);
        sides.get(sides.len() / 2).copied().unwrap_or(1.0)
    }
}

/// Whether a whole cell of the grid reaches into the box; on a cylinder, into its rows.
pub(crate) fn reaches_into(mesh: &GridMesh, around: bool, low: Vector2<f64>, high: Vector2<f64>) -> bool {
    mesh.whole_cells().any(|corners| {
        let corners = corners.map(|vertex| mesh.target[vertex]);
        (usize::from(around)..2).all(|axis| {
            corners.iter().any(|corner| corner[axis] > low[axis])
                && corners.iter().any(|corner| corner[axis] < high[axis])
        })
    })
}
