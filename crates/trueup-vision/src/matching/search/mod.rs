//! Exact nearest-neighbor search over byte descriptors, both directions in one pass.
//!
//! # How
//!
//! Squared distances are whole numbers, |a|^2 + |b|^2 - 2ab, at most 128 * 255^2 < 2^23. A distance and a 9-bit number
//! therefore fit one 32-bit key, and the minimum of keys is the nearest neighbor with the smaller number winning ties.
//! One pass over all products keeps, for every row (a descriptor of the first photograph), the two smallest keys of
//! each of 16 interleaved lanes of columns, and for every column the smallest key over the rows.
//!
//! # Exactness
//!
//! The nearest neighbors of rows and columns are exact. What else is asked of a row is the nearest column that is
//! not *excluded* (too close in the photograph to the nearest one). In a lane, the smallest key that is not excluded
//! answers; only where both keys of a lane are excluded is the lane searched again, column by column. So the second
//! neighbor is exact too: see [`Nearest::nearest_allowed`].

mod kernels;
mod keys;
mod packed;
#[cfg(test)]
mod tests;

pub use kernels::SearchKernel;
pub(crate) use kernels::squared_distances;
pub use keys::Neighbor;

use crate::features::Descriptor;
use keys::{COLUMNS_PER_PASS, LANES, LaneBest, SHIFT};
use packed::{PackedColumns, PackedRows};

/// The answers of one search of rows against columns.
#[derive(Debug)]
pub struct Nearest<'a> {
    rows: &'a [Descriptor],
    columns: &'a [Descriptor],
    /// For every pass over columns, for every row.
    lane_bests: Vec<Vec<LaneBest>>,
    column_nearest: Vec<Neighbor>,
}

impl<'a> Nearest<'a> {
    /// Compares all descriptors of `rows` with all of `columns`; `None` if either is empty.
    pub fn search(rows: &'a [Descriptor], columns: &'a [Descriptor]) -> Option<Self> {
        Self::search_with(SearchKernel::best(), rows, columns)
    }

    /// The same on a kernel of choice, which this processor must be able to run ([`SearchKernel::available`]).
    pub fn search_with(kernel: SearchKernel, rows: &'a [Descriptor], columns: &'a [Descriptor]) -> Option<Self> {
        if rows.is_empty() || columns.is_empty() {
            return None;
        }
        let packed_rows = PackedRows::new(kernel, rows);
        let (mut lane_bests, mut column_nearest) = (Vec::new(), Vec::with_capacity(columns.len()));
        for pass in columns.chunks(COLUMNS_PER_PASS) {
            let (bests, nearest) = packed_rows.compare(&PackedColumns::new(kernel, pass));
            lane_bests.push(bests);
            column_nearest.extend_from_slice(&nearest[..pass.len()]);
        }
        Some(Self { rows, columns, lane_bests, column_nearest })
    }

    /// The row nearest to a column.
    pub fn nearest_row(&self, column: usize) -> Neighbor {
        self.column_nearest[column]
    }

    /// The column nearest to a row.
    pub fn nearest_column(&self, row: usize) -> Neighbor {
        let lanes = self.lane_bests.iter().enumerate().flat_map(|(pass, bests)| {
            let first = bests[row].first.0;
            (0..LANES).map(move |lane| (pass, lane, first[lane]))
        });
        let nearest = lanes.map(|(pass, lane, key)| self.neighbor(pass, lane, key)).min();
        nearest.unwrap_or(Neighbor { squared_distance: u32::MAX, descriptor: 0 })
    }

    /// The squared distance from a row to the nearest column that `excluded` does not name; `None` if it names all.
    ///
    /// A distance below `enough` may be returned in place of the exact one when it is known that the exact one is no
    /// larger: the caller has then no use for more.
    pub fn nearest_allowed(&self, row: usize, enough: u32, excluded: impl Fn(usize) -> bool) -> Option<u32> {
        let mut nearest: Option<u32> = None;
        let mut lower = |distance: u32| nearest = Some(nearest.map_or(distance, |nearest| nearest.min(distance)));
        let mut hidden = Vec::new();
        for (pass, bests) in self.lane_bests.iter().enumerate() {
            for lane in 0..LANES {
                let keys = [bests[row].first.0[lane], bests[row].second.0[lane]];
                let candidates = keys.map(|key| (key != u32::MAX).then(|| self.neighbor(pass, lane, key)));
                match candidates.into_iter().flatten().find(|candidate| !excluded(candidate.descriptor)) {
                    Some(candidate) => lower(candidate.squared_distance),
                    None => hidden.push((pass, lane)),
                }
            }
        }
        if nearest.is_some_and(|nearest| nearest < enough) {
            return nearest;
        }
        for (pass, lane) in hidden {
            let start = pass * COLUMNS_PER_PASS;
            let end = self.columns.len().min(start + COLUMNS_PER_PASS);
            for column in (start + lane..end).step_by(LANES).filter(|&column| !excluded(column)) {
                let distance = squared_distance(&self.rows[row], &self.columns[column]);
                nearest = Some(nearest.map_or(distance, |nearest| nearest.min(distance)));
            }
        }
        nearest
    }

    fn neighbor(&self, pass: usize, lane: usize, key: u32) -> Neighbor {
        let block = (key & ((1 << SHIFT) - 1)) as usize;
        // The last block repeats the last column to be full.
        let descriptor = (pass * COLUMNS_PER_PASS + block * LANES + lane).min(self.columns.len() - 1);
        Neighbor { squared_distance: key >> SHIFT, descriptor }
    }
}

/// The squared Euclidean distance of two descriptors.
#[inline(always)] // Compiled with the vector instructions of whoever asks.
pub(crate) fn squared_distance(a: &Descriptor, b: &Descriptor) -> u32 {
    // Products of 16-bit numbers summed to 32 bits: one instruction on most processors. At most 128 * 255^2.
    let difference = |(&a, &b): (&u8, &u8)| i32::from(i16::from(a).wrapping_sub(i16::from(b)));
    a.iter().zip(b).map(difference).fold(0_i32, |sum, d| sum.wrapping_add(d.wrapping_mul(d))) as u32
}
