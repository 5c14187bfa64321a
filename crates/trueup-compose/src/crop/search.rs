//! The best of all rectangles of cells.

use std::ops::Range;

use rayon::prelude::*;

/// What keeping cells and cutting between them is worth, on a grid of cells.
#[derive(Debug, Clone, Default)]
pub(super) struct Worths {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// What each cell adds; `None` for those that may not be kept.
    pub(super) cells: Vec<Option<f32>>,
    /// What a side costs that cuts a column above the row: `rows + 1` rows of `columns`.
    pub(super) above: Vec<f32>,
    /// The same below the row, which is the rectangle's last one or, as the first, none of it.
    pub(super) below: Vec<f32>,
    /// What a side costs that cuts a row left of the column: `rows` rows of `columns + 1`.
    pub(super) beside: Vec<f32>,
}

/// A rectangle of cells and what it is worth.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Best {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
    pub(super) worth: f64,
}

impl Worths {
    /// The rectangle that is worth most, the topmost and leftmost of equal ones; of the whole width only if
    /// `whole_rows`. `None` if none is worth anything.
    ///
    /// All pairs of rows, and between them the best stretch of columns by one pass (Bentley, "Programming pearls:
    /// algorithm design techniques", Communications of the ACM 27(9), 1984, in two dimensions).
    pub(super) fn best(&self, whole_rows: bool) -> Option<Best> {
        let of_top = |top: usize| self.best_from(top, whole_rows);
        let all: Vec<Option<Best>> = (0..self.rows).into_par_iter().map(of_top).collect();
        all.into_iter().flatten().reduce(|best, next| if next.worth > best.worth { next } else { best })
    }

    /// The best one whose first row is `top`.
    fn best_from(&self, top: usize, whole_rows: bool) -> Option<Best> {
        let columns = self.columns;
        let mut sums = vec![0.0_f64; columns];
        let mut sides = vec![0.0_f64; columns + 1];
        let mut is_open = vec![true; columns];
        let mut best: Option<Best> = None;
        for bottom in top..self.rows {
            let row = bottom * columns..(bottom + 1) * columns;
            for ((sum, open), cell) in sums.iter_mut().zip(&mut is_open).zip(&self.cells[row]) {
                match cell {
                    Some(worth) => *sum += f64::from(*worth),
                    None => *open = false,
                }
            }
            let beside = &self.beside[bottom * (columns + 1)..][..columns + 1];
            sides.iter_mut().zip(beside).for_each(|(sum, &cost)| *sum += f64::from(cost));
            let (above, below) = (&self.above[top * columns..], &self.below[(bottom + 1) * columns..]);
            let worth = |x: usize| sums[x] - f64::from(above[x]) - f64::from(below[x]);
            let found = match whole_rows {
                true => is_open.iter().all(|&open| open).then(|| {
                    let worth = (0..columns).map(worth).sum();
                    Stretch { columns: 0..columns, worth }
                }),
                false => best_stretch(&is_open, &sides, worth),
            };
            if let Some(Stretch { columns, worth }) = found
                && worth > best.as_ref().map_or(0.0, |best| best.worth)
            {
                best = Some(Best { columns, rows: top..bottom + 1, worth });
            }
            if !is_open.contains(&true) {
                break;
            }
        }
        best
    }
}

/// Columns and what they are worth.
struct Stretch {
    columns: Range<usize>,
    worth: f64,
}

/// The best stretch of open columns, with what its `sides` cost.
fn best_stretch(is_open: &[bool], sides: &[f64], worth: impl Fn(usize) -> f64) -> Option<Stretch> {
    let mut best: Option<Stretch> = None;
    // The best stretch that ends before the column, without its right side: its first column and its worth.
    let mut running: Option<(usize, f64)> = None;
    for x in 0..is_open.len() {
        if !is_open[x] {
            running = None;
            continue;
        }
        let afresh = -sides[x];
        let (first, before) = running.filter(|&(_, before)| before >= afresh).unwrap_or((x, afresh));
        let inside = before + worth(x);
        running = Some((first, inside));
        let all = inside - sides[x + 1];
        if best.as_ref().is_none_or(|best| all > best.worth) {
            best = Some(Stretch { columns: first..x + 1, worth: all });
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The worth of a rectangle by its definition; `None` if a cell of it may not be kept.
    fn worth(worths: &Worths, columns: &Range<usize>, rows: &Range<usize>) -> Option<f64> {
        let mut sum = 0.0;
        for y in rows.clone() {
            for x in columns.clone() {
                sum += f64::from(worths.cells[y * worths.columns + x]?);
            }
            for x in [columns.start, columns.end] {
                sum -= f64::from(worths.beside[y * (worths.columns + 1) + x]);
            }
        }
        for x in columns.clone() {
            sum -= f64::from(worths.above[rows.start * worths.columns + x]);
            sum -= f64::from(worths.below[rows.end * worths.columns + x]);
        }
        Some(sum)
    }

    fn numbers(count: usize, range: Range<i8>) -> impl Strategy<Value = Vec<f32>> {
        prop::collection::vec(range.prop_map(f32::from), count)
    }

    proptest! {
        #[test]
        fn the_best_rectangle_is_the_best(
            cells in prop::collection::vec(prop::option::weighted(0.85, (-3..6_i8).prop_map(f32::from)), 35),
            above in numbers(42, 0..4),
            below in numbers(42, 0..4),
            beside in numbers(40, 0..4),
        ) {
            let worths = Worths { columns: 7, rows: 5, cells, above, below, beside };
            for whole_rows in [false, true] {
                let mut most: f64 = 0.0;
                for (top, bottom) in (0..5).flat_map(|top| (top + 1..6).map(move |bottom| (top, bottom))) {
                    for (left, right) in (0..7).flat_map(|left| (left + 1..8).map(move |right| (left, right))) {
                        if whole_rows && (left, right) != (0, 7) {
                            continue;
                        }
                        let sides: f64 = (top..bottom).map(|y| f64::from(worths.beside[y * 8] + worths.beside[y * 8 + 7])).sum();
                        // The ends of a full turn are no sides.
                        let free = if whole_rows { sides } else { 0.0 };
                        most = most.max(worth(&worths, &(left..right), &(top..bottom)).map_or(0.0, |sum| sum + free));
                    }
                }
                let found = worths.best(whole_rows);
                prop_assert_eq!(found.as_ref().map_or(0.0, |best| best.worth), most);
                if let Some(best) = found {
                    prop_assert!(worth(&worths, &best.columns, &best.rows).is_some());
                }
            }
        }
    }
}
