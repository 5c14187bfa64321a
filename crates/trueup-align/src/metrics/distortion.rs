//! Local distortion (LD): how unevenly the cells of a grid are stretched.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::outline::{Outline, is_sound, target};

/// Samples per axis of a cell, at most.
const SAMPLES: usize = 16;
/// Change of area below which a cell counts as collapsed.
const COLLAPSED: f64 = 1e-6;

/// When a cell counts as lying outside a photograph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// Its center does.
    Center,
    /// Its center and its four corners do: fewer cells at the border of overlaps, where grids are stretched least. LD
    /// is larger by 0 to 7 % on panoramas of one row.
    CenterAndCorners,
}

/// The local distortion of a panorama.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalDistortion {
    /// Largest over the photographs; the paper's LD (printed times 100). 0 if no photograph has a cell to judge.
    pub worst: f64,
    /// Mean over the photographs that have cells to judge.
    pub mean: f64,
    /// Mean coefficient of variation of every photograph's cells outside all others; `None` without such cells.
    pub photographs: Vec<Option<f64>>,
    /// Cells outside all others that could not be judged: turned over, crossed or collapsed. Figures with different
    /// counts do not compare.
    pub folds: usize,
}

/// The local distortion of photographs deformed by `meshes`.
///
/// In every cell that lies outside all other photographs, the area's change under the homography through its four
/// corners is sampled at evenly spaced points, one a pixel but at most 16 x 16; its standard deviation over its mean is
/// the cell's distortion. Similarities and affine maps have none. The figure grows with the size of the cells: compare
/// grids of equal cells only.
///
/// On a full turn whose ends meet, places that differ by its `period` are the same.
///
/// # Source
/// VPG equations 12 and 13.
///
/// # Departures
/// The paper does not say when a cell is outside; `outside` does.
pub fn local_distortion(meshes: &[GridMesh], outside: Outside, period: Option<f64>) -> LocalDistortion {
    let outlines: Vec<Outline> = meshes.iter().map(Outline::new).collect();
    // Photographs begin in one turn and end in the next at the latest.
    let shifts = period.map_or(vec![0.0], |period| vec![-period, 0.0, period]);
    let shifts: Vec<Vector2<f64>> = shifts.into_iter().map(|shift| Vector2::new(shift, 0.0)).collect();
    let mut folds = 0;
    let mut photographs = Vec::with_capacity(meshes.len());
    for (k, mesh) in meshes.iter().enumerate() {
        let others = outlines.iter().enumerate().filter(|&(other, _)| other != k).map(|(_, outline)| outline);
        // Of many photographs few reach this one at all.
        let reaching: Vec<(&Outline, Vector2<f64>)> = others
            .flat_map(|other| shifts.iter().map(move |&shift| (other, shift)))
            .filter(|(other, shift)| other.may_hold(mesh.bounds(), *shift))
            .collect();
        let alone = |point: Vector2<f64>| !reaching.iter().any(|(other, shift)| other.contains(point + shift));
        let vertices_alone: Vec<bool> = match outside {
            Outside::CenterAndCorners => (0..mesh.len()).map(|vertex| alone(target(mesh, vertex))).collect(),
            Outside::Center => vec![true; mesh.len()],
        };
        let (mut sum, mut count) = (0.0, 0_usize);
        for cell in mesh.whole_cells() {
            let center = cell.iter().map(|&corner| target(mesh, corner)).sum::<Vector2<f64>>() / 4.0;
            if !cell.iter().all(|&corner| vertices_alone[corner]) || !alone(center) {
                continue;
            }
            match cell_distortion(mesh, cell) {
                Some(distortion) => {
                    sum += distortion;
                    count += 1;
                }
                None => folds += 1,
            }
        }
        photographs.push((count > 0).then(|| sum / count as f64));
    }
    let judged: Vec<f64> = photographs.iter().flatten().copied().collect();
    LocalDistortion {
        worst: judged.iter().copied().fold(0.0, f64::max),
        mean: judged.iter().sum::<f64>() / judged.len().max(1) as f64,
        photographs,
        folds,
    }
}

/// Standard deviation over mean of the area's change in a cell; `None` for a degenerate one.
///
/// The homography from the cell divides by w = 1 + g u + h v, u and v from 0 to 1 along its sides, and changes areas in
/// proportion to w^-3 (Heckbert, Fundamentals of Texture Mapping and Image Warping, 1989, section 2.2.3): g and h are
/// all it takes.
fn cell_distortion(mesh: &GridMesh, cell: [usize; 4]) -> Option<f64> {
    if !is_sound(mesh, cell) {
        return None;
    }
    let [top_left, top_right, bottom_right, bottom_left] = cell.map(|vertex| target(mesh, vertex));
    let (width, height) = (mesh.cell_width(), mesh.cell_height());
    let twice_area = (bottom_right - top_left).perp(&(bottom_left - top_right));
    if twice_area / (2.0 * width * height) <= COLLAPSED {
        return None;
    }
    let (right, bottom) = (top_right - bottom_right, bottom_left - bottom_right);
    let skew = top_left - top_right + bottom_right - bottom_left;
    let both = right.perp(&bottom);
    let (g, h) = (skew.perp(&bottom) / both, right.perp(&skew) / both);
    let samples = |length: f64| (length.round() as usize).clamp(1, SAMPLES);
    let (columns, rows) = (samples(width), samples(height));
    let count = (columns * rows) as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for row in 0..rows {
        let along_side = 1.0 + h * (row as f64 + 0.5) / rows as f64;
        for column in 0..columns {
            let w = along_side + g * (column as f64 + 0.5) / columns as f64;
            let change = 1.0 / (w * w * w);
            // From 1, which is near the mean: the difference of large sums would lose digits.
            sum += change - 1.0;
            squares += (change - 1.0) * (change - 1.0);
        }
    }
    let mean = sum / count;
    let variance = (squares / count - mean * mean).max(0.0);
    Some(variance.sqrt() / (1.0 + mean).abs())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn mapped(map: impl Fn(Vector2<f64>) -> Vector2<f64>) -> GridMesh {
        let mut mesh = GridMesh::regular(400.0, 300.0, 40.0);
        mesh.target = (0..mesh.len()).map(|vertex| map(mesh.source(vertex)).into()).collect();
        mesh
    }

    /// One cell of 16 x 16 px under w = 1 - x / 100: det J = det H / w^3. Standard deviation over mean of (1 - x /
    /// 100)^-3 at x = 0.5, 1.5 ... 15.5, computed apart: 0.196748261 / 1.303776091.
    #[test]
    fn a_known_perspective_has_its_known_distortion() {
        let mut mesh = GridMesh::regular(16.0, 16.0, 16.0);
        let map = |p: Vector2<f64>| p / (1.0 - p.x / 100.0);
        mesh.target = (0..4).map(|vertex| map(mesh.source(vertex)).into()).collect();
        assert!(
            (local_distortion(&[mesh], Outside::CenterAndCorners, None).worst - 0.196748261 / 1.303776091).abs() < 1e-8
        );
    }

    #[test]
    fn covered_cells_are_not_judged_and_turned_ones_are_counted() {
        let whole = mapped(|p| p);
        let hidden = mapped(|p| p * 0.5 + Vector2::new(50.0, 50.0));
        assert_eq!(local_distortion(&[hidden, whole.clone()], Outside::Center, None).photographs[0], None);
        let mut folded = whole;
        folded.target[12] = [390.0, 290.0];
        assert!(local_distortion(&[folded], Outside::Center, None).folds > 0);
    }

    /// Two photographs of 100 x 100 px overlap by 14 px: of ten columns of cells, the ninth has its center outside the
    /// other photograph and two corners inside.
    #[test]
    fn the_corners_rule_leaves_out_cells_that_the_other_photograph_cuts() {
        let bent = |p: Vector2<f64>| Vector2::new(p.x + 1e-3 * p.x * p.x, p.y + 1e-4 * p.x * p.x * p.y);
        let mut left = GridMesh::regular(100.0, 100.0, 10.0);
        left.target = (0..left.len()).map(|vertex| bent(left.source(vertex)).into()).collect();
        let mut right = GridMesh::regular(100.0, 100.0, 10.0);
        for vertex in &mut right.target {
            vertex[0] += bent(Vector2::new(86.0, 0.0)).x;
        }
        let meshes = [left, right];
        let strict = local_distortion(&meshes, Outside::CenterAndCorners, None).photographs[0].expect("cells");
        let loose = local_distortion(&meshes, Outside::Center, None).photographs[0].expect("cells");
        assert!(loose > strict, "the distortion grows to the right: {loose} {strict}");
    }

    proptest! {
        /// A6: similarities and affine maps have no local distortion.
        #[test]
        fn affine_maps_have_none(a in 0.5..2.0_f64, b in -0.4..0.4_f64, c in -0.4..0.4_f64, d in 0.5..2.0_f64) {
            let mesh = mapped(|p| Vector2::new(a * p.x + b * p.y + 17.0, c * p.x + d * p.y - 3.0));
            let distortion = local_distortion(&[mesh], Outside::CenterAndCorners, None);
            prop_assert!(distortion.worst < 1e-9 && distortion.folds == 0);
        }
    }
}
