//! Which empty cells may be filled: those beside which the picture is so smooth that a smooth surface goes on as it would.

use super::cells::Cells;

/// Largest standard deviation of the luma in a smooth cell, levels: noise of a sky, its slope, and soft clouds.
const SMOOTH_DEVIATION: f32 = 6.0;
/// Largest contrast between smooth cells beside each other, levels.
const SMOOTH_CONTRAST: f32 = 10.0;

/// Least share of what is nearest to an empty cell that is smooth: a twig or a wire that runs into the border may be beside it,
/// a tree may not.
const LEAST_SMOOTH: f32 = 0.5;

/// What may be filled.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fillable {
    /// For every empty cell that may be filled, which share of what is nearest to it is smooth.
    pub(super) smooth: Vec<Option<f32>>,
}

impl Fillable {
    /// Empty cells of which what is nearest is smooth, no farther than `reach` cells from it: from the covered cells
    /// outwards, step by step, each is as smooth as those beside it that were reached before are in the mean.
    pub(super) fn of(cells: &Cells, reach: usize) -> Self {
        let border = |at: usize| smooth_border(cells, at).map(|smooth| if smooth { 1.0 } else { 0.0 });
        let mut smooth: Vec<Option<f32>> = (0..cells.covered.len()).map(border).collect();
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

/// The cells around one, across the ends of a full turn, too.
fn near(cells: &Cells, at: usize) -> impl Iterator<Item = usize> {
    let (columns, rows, around) = (cells.columns, cells.rows, cells.around);
    let (x, y) = (at % columns, at / columns);
    let beside = move |step: usize| {
        // 0, 1, 2: left, here, right.
        match (x + step).checked_sub(1) {
            Some(other) if other < columns => Some(other),
            _ if around => Some((x + step + columns - 1) % columns),
            _ => None,
        }
    };
    (y.saturating_sub(1)..(y + 2).min(rows)).flat_map(move |v| (0..3).filter_map(beside).map(move |u| v * columns + u))
}

/// Whether a covered cell beside an empty one, and what is covered around it, is smooth; `None` for all other cells.
fn smooth_border(cells: &Cells, at: usize) -> Option<bool> {
    let is_border = cells.covered[at] && near(cells, at).any(|other| !cells.covered[other]);
    is_border.then(|| {
        near(cells, at)
            .filter(|&other| cells.covered[other])
            .all(|other| cells.deviations[other] <= SMOOTH_DEVIATION && cells.contrast(at, other) <= SMOOTH_CONTRAST)
    })
}
