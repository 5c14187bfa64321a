//! Which empty cells may be filled: those beside which the picture is so smooth that what is filled goes on as it
//! would.

use super::cells::{Cells, near};
use super::worth::box_means;

/// What counts as smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Smoothness {
    /// Largest standard deviation of the luma in a smooth cell, levels.
    deviation: f32,
    /// Largest contrast between smooth cells beside each other, levels.
    contrast: f32,
}

impl Smoothness {
    /// Noise of a sky, its slope, and soft clouds.
    pub(super) const SKY: Self = Self { deviation: 6.0, contrast: 10.0 };
    /// Clouds with edges.
    pub(super) const CLOUDS: Self = Self { deviation: 10.0, contrast: 20.0 };
}

/// Half the side of the square over which the border of what is covered is judged, as a share of the panorama's longer
/// side: the colors of what is filled come from as far as it is deep, so that a twig, a wire or the edge of a cloud at
/// one place of a sky's border alone says nothing of it.
const BORDER_STRETCH: f64 = 0.05;
/// Least share of the border near an empty cell that is smooth: twigs that run into it may be beside it, a tree's crown
/// may not. With a half, the foggy sky over the twigs of CAVE-columbus_circle is not filled, and the tower beside it
/// not kept.
const LEAST_SMOOTH: f32 = 0.3;

/// What may be filled.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fillable {
    /// For every empty cell that may be filled, which share of the border of what is covered is smooth there.
    pub(super) smooth: Vec<Option<f32>>,
}

impl Fillable {
    /// Empty cells beside a smooth border, no farther than `reach` cells from it: from the covered cells outwards, step
    /// by step, each is as smooth as those beside it that were reached before are in the mean. Cells of the border are
    /// as smooth as the share of it within [`BORDER_STRETCH`] is.
    pub(super) fn of(cells: &Cells, smooth: Smoothness, reach: usize) -> Self {
        let border: Vec<Option<bool>> = (0..cells.covered.len()).map(|at| smooth_border(cells, smooth, at)).collect();
        let is_border: Vec<bool> = border.iter().map(Option::is_some).collect();
        let is_smooth: Vec<f32> =
            border.iter().map(|smooth| if smooth.is_some_and(|smooth| smooth) { 1.0 } else { 0.0 }).collect();
        let stretch = (BORDER_STRETCH * cells.columns.max(cells.rows) as f64).round().max(1.0) as usize;
        let shares = box_means(&is_smooth, &is_border, cells, stretch);
        let of_border = |(share, is_border): (f32, &bool)| is_border.then_some(share);
        let mut smooth: Vec<Option<f32>> = shares.into_iter().zip(&is_border).map(of_border).collect();
        let mut front: Vec<usize> = (0..smooth.len()).filter(|&at| smooth[at].is_some()).collect();
        for _ in 0..reach {
            let mut next: Vec<usize> = front
                .iter()
                .flat_map(|&at| near(cells, at))
                .filter(|&at| smooth[at].is_none() && !cells.covered[at])
                .collect();
            if next.is_empty() {
                break;
            }
            next.sort_unstable();
            next.dedup();
            let mean = |&at: &usize| {
                let known = near(cells, at).filter_map(|other| smooth[other]);
                let (sum, count) = known.fold((0.0, 0.0_f32), |(sum, count), one| (sum + one, count + 1.0));
                sum / count.max(1.0)
            };
            let found: Vec<f32> = next.iter().map(mean).collect();
            next.iter().zip(found).for_each(|(&at, mean)| smooth[at] = Some(mean));
            front = next;
        }
        let fillable = smooth
            .iter()
            .zip(&cells.covered)
            .map(|(smooth, &covered)| smooth.filter(|&share| !covered && share >= LEAST_SMOOTH));
        Self { smooth: fillable.collect() }
    }
}

/// Whether a covered cell beside an empty one, and what is covered around it, is smooth; `None` for all other cells.
fn smooth_border(cells: &Cells, smooth: Smoothness, at: usize) -> Option<bool> {
    let is_border = cells.covered[at] && near(cells, at).any(|other| !cells.covered[other]);
    is_border.then(|| {
        near(cells, at)
            .filter(|&other| cells.covered[other])
            .all(|other| cells.deviations[other] <= smooth.deviation && cells.contrast(at, other) <= smooth.contrast)
    })
}
