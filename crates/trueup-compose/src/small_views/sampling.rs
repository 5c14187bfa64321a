//! How photographs are read for small views.

use trueup_core::mesh::GridMesh;

use crate::render_options::Interpolation;
use crate::warped::Resampling;

/// Halved as often as can be, then read between samples: nothing here is ever looked at.
pub(super) const HALVING: Resampling =
    Resampling { interpolation: Interpolation::Bilinear, minification_threshold: 1.0, fits_photographs: false };

/// How what was halved is read: up to four of its pixels are skipped.
pub(super) const SAMPLING: Resampling =
    Resampling { interpolation: Interpolation::Bilinear, minification_threshold: 4.0, fits_photographs: false };

/// The grid with its targets scaled by `scale` and then moved by `shift`.
pub(super) fn scaled(mesh: &GridMesh, scale: [f64; 2], shift: f64) -> GridMesh {
    let mut mesh = mesh.clone();
    for vertex in &mut mesh.target {
        *vertex = [vertex[0] * scale[0] + shift, vertex[1] * scale[1] + shift];
    }
    mesh
}
