//! Values on the grid of a face.

use nalgebra::Vector3;

/// More grid points than this along one side of a face are not worth their time.
const MAX_GRID: usize = 320;

/// Grid points along a side of this length: two at least, and one in the middle of what is not tiny.
pub(super) fn grid_points(size_m: f64, spacing_m: f64) -> usize {
    const TINY_M: f64 = 0.12;
    const TINY_SHARE: f64 = 0.25;
    let least = if size_m < TINY_M.max(TINY_SHARE * spacing_m) { 2 } else { 3 };
    ((size_m / spacing_m).ceil() as usize + 1).clamp(least, MAX_GRID)
}

/// Weighs every `stride`-th value 1/2 and its two neighbors 1/4 each; border values count as their own neighbors.
pub(super) fn binomial(values: &mut [Vector3<f32>], stride: usize) {
    let mut before = values[0];
    for index in (0..values.len()).step_by(stride) {
        let here = values[index];
        let after = values.get(index + stride).copied().unwrap_or(here);
        values[index] = here * 0.5 + (before + after) * 0.25;
        before = here;
    }
}

/// One pass of filling unknown values with the mean of their known neighbors; returns what is known now.
pub(super) fn spread(values: &mut [Vector3<f32>], known: &[bool], columns: usize) -> Vec<bool> {
    let mut now_known = known.to_vec();
    for index in 0..values.len() {
        if known[index] {
            continue;
        }
        let column = index % columns;
        let neighbors = [
            (column > 0).then(|| index - 1),
            (column + 1 < columns).then_some(index + 1),
            index.checked_sub(columns),
            (index + columns < values.len()).then_some(index + columns),
        ];
        let lit: Vec<usize> = neighbors.into_iter().flatten().filter(|&neighbor| known[neighbor]).collect();
        if !lit.is_empty() {
            let sum: Vector3<f32> = lit.iter().map(|&neighbor| values[neighbor]).sum();
            values[index] = sum / lit.len() as f32;
            now_known[index] = true;
        }
    }
    now_known
}
