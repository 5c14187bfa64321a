//! Gray values and gradients on a small grid that is placed, turned and scaled with a point.

use super::maths::turns;
use super::scale_space::BlurredPlane;

/// A square grid in a plane.
pub(super) struct Grid {
    /// Center of the grid (x, y), in the plane's samples.
    pub(super) center: [f64; 2],
    /// Distance of two grid points, in the plane's samples.
    pub(super) step: f64,
    /// Direction of the grid's first axis, radians clockwise on the screen from the plane's.
    pub(super) angle: f64,
}

/// Gray values at `N` x `N` grid points, by bilinear interpolation. Outside the photograph its edge is continued.
#[inline(always)]
pub(super) fn sample<const N: usize>(plane: &BlurredPlane, grid: &Grid) -> [[f32; N]; N] {
    // The last sample is left to the one before it, with a weight of nearly one.
    const EDGE: f32 = 1e-3;
    let (last_x, last_y) = ((plane.width - 1) as f32 - EDGE, (plane.height - 1) as f32 - EDGE);
    let (sin, cos) = grid.angle.sin_cos();
    let (sin, cos) = ((sin * grid.step) as f32, (cos * grid.step) as f32);
    let [center_x, center_y] = grid.center.map(|coordinate| coordinate as f32);
    let half = (N - 1) as f32 / 2.0;
    let mut values = [[0.0; N]; N];
    for (v, row) in values.iter_mut().enumerate() {
        let v = v as f32 - half;
        let (mut index, mut fraction_x, mut fraction_y) = ([0_u32; N], [0.0_f32; N], [0.0_f32; N]);
        for u in 0..N {
            let offset = u as f32 - half;
            let x = (center_x + cos * offset - sin * v).clamp(0.0, last_x);
            let y = (center_y + sin * offset + cos * v).clamp(0.0, last_y);
            let (whole_x, whole_y) = (x as u32, y as u32);
            index[u] = whole_y * plane.stride as u32 + whole_x;
            fraction_x[u] = x - whole_x as f32;
            fraction_y[u] = y - whole_y as f32;
        }
        let (mut top, mut bottom) = ([[0.0_f32; 2]; N], [[0.0_f32; 2]; N]);
        for u in 0..N {
            let at = index[u] as usize;
            top[u] = pair(&plane.data, at);
            bottom[u] = pair(&plane.data, at + plane.stride);
        }
        for u in 0..N {
            let upper = top[u][0] + fraction_x[u] * (top[u][1] - top[u][0]);
            let lower = bottom[u][0] + fraction_x[u] * (bottom[u][1] - bottom[u][0]);
            row[u] = upper + fraction_y[u] * (lower - upper);
        }
    }
    values
}

#[inline(always)]
fn pair(samples: &[f32], at: usize) -> [f32; 2] {
    let pair = &samples[at..at + 2];
    [pair[0], pair[1]]
}

/// Magnitude and direction (in turns) of the gradients in the `CELLS` cells between two lines of `CELLS + 1` values.
#[inline(always)]
pub(super) fn gradients<const CORNERS: usize, const CELLS: usize>(
    upper: &[f32; CORNERS],
    lower: &[f32; CORNERS],
) -> ([f32; CELLS], [f32; CELLS]) {
    const { assert!(CORNERS == CELLS + 1) };
    let (mut magnitude, mut direction) = ([0.0_f32; CELLS], [0.0_f32; CELLS]);
    for u in 0..CELLS {
        let (main, other) = (lower[u + 1] - upper[u], lower[u] - upper[u + 1]);
        let (gx, gy) = (main - other, main + other);
        magnitude[u] = (gx * gx + gy * gy).sqrt();
        direction[u] = turns(gy, gx);
    }
    (magnitude, direction)
}
