//! Some of the pixels of a canvas, row by row.

use std::ops::Range;

use rayon::prelude::*;

use crate::label::Label;

/// Some pixels of a canvas, or of a cylinder's, whose first column lies beside its last.
#[derive(Debug)]
pub(super) struct Band {
    /// Columns of the canvas.
    width: usize,
    /// Columns of a turn on a cylinder, its width; 0 on a plane.
    turn: usize,
    /// The columns that belong to it, ascending in each row; a small canvas has far fewer than 2^32.
    rows: Vec<Vec<u32>>,
}

impl Band {
    /// All pixels of a canvas.
    pub(super) fn whole([width, height]: [usize; 2], turn: usize) -> Self {
        Self { width, turn, rows: vec![(0..width as u32).collect(); height] }
    }

    /// Some columns, which ascend, of a canvas.
    #[cfg(test)]
    pub(super) fn of_columns(columns: impl Iterator<Item = u32>, [width, height]: [usize; 2]) -> Self {
        Self { width, turn: 0, rows: vec![columns.collect(); height] }
    }

    /// The pixels within `reach` of a change of labels.
    pub(super) fn around_changes(labels: &[Label], width: usize, turn: usize, reach: usize) -> Self {
        let rows = labels.len() / width;
        let row = |y: usize| &labels[y * width..][..width];
        // A square dilation: along rows, then along columns.
        let wide = |y: usize| {
            let mut changes = vec![false; width];
            let own = row(y);
            for x in 1..width {
                let differs = own[x] != own[x - 1];
                changes[x] |= differs;
                changes[x - 1] |= differs;
            }
            if turn > 0 && own[0] != own[width - 1] {
                (changes[0], changes[width - 1]) = (true, true);
            }
            for other in [y.checked_sub(1), Some(y + 1).filter(|&below| below < rows)].into_iter().flatten() {
                let pairs = own.iter().zip(row(other));
                changes.iter_mut().zip(pairs).for_each(|(change, (own, other))| *change |= own != other);
            }
            let places = (0..width).filter(|&x| changes[x]);
            spread(places, reach, width, turn)
        };
        let wide: Vec<Vec<u32>> = (0..rows).into_par_iter().map(wide).collect();
        let near = |y: usize| y.saturating_sub(reach)..(y + reach + 1).min(rows);
        let rows = (0..rows).into_par_iter().map(|y| union(&wide[near(y)], width)).collect();
        Self { width, turn, rows }
    }

    /// The pixels of this and the four neighbors of each.
    pub(super) fn with_neighbors(&self) -> Self {
        let with_neighbors = |y: usize| {
            let own = spread(self.rows[y].iter().map(|&x| x as usize), 1, self.width, self.turn);
            let above = y.checked_sub(1).map(|above| self.rows[above].clone());
            union(&[own, above.unwrap_or_default(), self.rows.get(y + 1).cloned().unwrap_or_default()], self.width)
        };
        let rows = (0..self.rows.len()).into_par_iter().map(with_neighbors).collect();
        Self { width: self.width, turn: self.turn, rows }
    }

    /// Those columns of row `y` that belong to it and lie in `columns`, which may run into the next turn, in ascending
    /// order.
    pub(super) fn within<'a>(&'a self, columns: &Range<usize>, y: usize) -> impl Iterator<Item = usize> + use<'a> {
        let row = &self.rows[y][..];
        let part = |columns: Range<usize>| {
            let first = row.partition_point(|&x| (x as usize) < columns.start);
            let end = row.partition_point(|&x| (x as usize) < columns.end);
            &row[first..end.max(first)]
        };
        let first = part(columns.start.min(self.width)..columns.end.min(self.width));
        let next = part(columns.start.max(self.width) - self.width..columns.end.max(self.width) - self.width);
        let turn = self.turn;
        first.iter().map(|&x| x as usize).chain(next.iter().map(move |&x| x as usize + turn))
    }

    /// Column and row of all its pixels.
    pub(super) fn pixels(&self) -> impl Iterator<Item = [usize; 2]> {
        self.rows.iter().enumerate().flat_map(|(y, row)| row.iter().map(move |&x| [x as usize, y]))
    }
}

/// The columns no more than `reach` before or after one of `places`, which ascend.
fn spread(places: impl Iterator<Item = usize>, reach: usize, width: usize, turn: usize) -> Vec<u32> {
    let mut around = Vec::new();
    let mut wrapped = Vec::new();
    let mut done = 0;
    for place in places {
        if turn > 0 && (place < reach || place + reach >= width) {
            wrapped.extend((place + turn - reach.min(turn)..=place + turn + reach).map(|x| (x % turn) as u32));
        }
        let end = (place + reach + 1).min(width);
        around.extend((place.saturating_sub(reach).max(done)..end).map(|x| x as u32));
        done = end.max(done);
    }
    if wrapped.is_empty() { around } else { union(&[around, wrapped], width) }
}

/// What some lists of columns hold together, ascending.
fn union(lists: &[Vec<u32>], width: usize) -> Vec<u32> {
    let mut filled = lists.iter().filter(|list| !list.is_empty());
    let (Some(first), next) = (filled.next(), filled.next()) else { return Vec::new() };
    if next.is_none() && first.is_sorted() {
        return first.clone();
    }
    let mut holds = vec![false; width];
    lists.iter().flatten().for_each(|&x| holds[x as usize] = true);
    (0..width as u32).filter(|&x| holds[x as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(band: &Band) -> Vec<[usize; 2]> {
        band.pixels().collect()
    }

    /// One pixel of another label at (1, 2) on 9 x 5: it and its four neighbors lie at a change.
    fn spot() -> Vec<Label> {
        let mut labels = vec![0; 45];
        labels[2 * 9 + 1] = 1;
        labels
    }

    #[test]
    fn a_band_reaches_as_far_as_it_is_told_from_a_change() {
        let cross = [[1, 1], [0, 2], [1, 2], [2, 2], [1, 3]];
        assert_eq!(listed(&Band::around_changes(&spot(), 9, 0, 0)), cross);
        // Squares of three around each: rows 0 and 4 hold columns 0 to 2, those between 0 to 3.
        let wide = listed(&Band::around_changes(&spot(), 9, 0, 1));
        let expected = (0..5).flat_map(|y| (0..if y == 0 || y == 4 { 3 } else { 4 }).map(move |x| [x, y]));
        assert_eq!(wide, expected.collect::<Vec<_>>());
        // On a cylinder column 8 is beside column 0, in the rows where that one is at a change.
        let around = listed(&Band::around_changes(&spot(), 9, 9, 1));
        assert_eq!(around.len(), wide.len() + 3);
        assert!([1, 2, 3].iter().all(|&y| around.contains(&[8, y])));
    }

    #[test]
    fn neighbors_are_added_to_every_side() {
        let band = Band::around_changes(&spot(), 9, 0, 0).with_neighbors();
        let expected: Vec<[usize; 2]> = (0..5_usize)
            .flat_map(|y| (0..9_usize).map(move |x| [x, y]))
            .filter(|&[x, y]| x.abs_diff(1) + y.abs_diff(2) <= 2)
            .collect();
        assert_eq!(listed(&band), expected);
    }

    #[test]
    fn columns_are_found_in_the_next_turn_too() {
        let band = Band::whole([9, 2], 9);
        assert_eq!(band.within(&(7..12), 1).collect::<Vec<_>>(), [7, 8, 9, 10, 11]);
        assert_eq!(band.within(&(2..4), 0).collect::<Vec<_>>(), [2, 3]);
        let some = Band::around_changes(&spot(), 9, 9, 0);
        assert_eq!(some.within(&(1..10), 2).collect::<Vec<_>>(), [1, 2, 9]);
    }
}
