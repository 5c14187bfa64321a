//! Exact nearest-neighbor search over byte descriptors, both directions in one pass.
//!
//! # How
//!
//! Squared distances are whole numbers, |a|^2 + |b|^2 - 2ab, at most 128 * 255^2 < 2^23. A distance and a 9-bit number
//! therefore fit one 32-bit key, and the minimum of keys is the nearest neighbor with the smaller number winning ties.
//! One pass over all products keeps, for every row (a descriptor of the first picture), the two smallest keys of each
//! of 16 interleaved lanes of columns, and for every column the smallest key over the rows.
//!
//! # Exactness
//!
//! The nearest neighbors of rows and columns are exact. What else is asked of a row is the nearest column that is
//! not *excluded* (too close in the picture to the nearest one). In a lane, the smallest key that is not excluded
//! answers; only where both keys of a lane are excluded is the lane searched again, column by column. So the second
//! neighbor is exact too: see [`Nearest::nearest_allowed`].

mod kernels;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

pub use kernels::Kernel;

use crate::features::{DESCRIPTOR_LENGTH, Descriptor};

/// Columns compared at once.
const LANES: usize = 16;
/// Rows compared at once.
const ROWS: usize = 16;
/// Bits of a key that hold a row's or a block's number.
const SHIFT: u32 = 9;
/// Columns whose block numbers fit a key.
const COLUMNS_PER_PASS: usize = LANES << SHIFT;
/// Rows a thread takes at once; their numbers fit a key.
const ROWS_PER_TASK: usize = 256;
/// Makes unsigned bytes signed for the kernels that multiply unsigned by signed bytes.
const BYTE_OFFSET: u32 = 128;

/// One 32-bit number per lane.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Lanes([u32; LANES]);

const FARTHEST: Lanes = Lanes([u32::MAX; LANES]);

/// The two smallest keys of every lane.
#[derive(Debug, Clone, Copy)]
struct LaneBest {
    first: Lanes,
    second: Lanes,
}

/// A descriptor and how far it is.
///
/// Ordered by distance, then index: the minimum is the nearest, the smaller index winning ties.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Neighbor {
    /// Squared distance in descriptor units.
    pub squared_distance: u32,
    /// Index of the descriptor.
    pub descriptor: usize,
}

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
        Self::search_with(Kernel::best(), rows, columns)
    }

    /// The same on a kernel of choice, which this processor must be able to run ([`Kernel::available`]).
    pub fn search_with(kernel: Kernel, rows: &'a [Descriptor], columns: &'a [Descriptor]) -> Option<Self> {
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
pub fn squared_distance(a: &Descriptor, b: &Descriptor) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}

/// Descriptors packed as rows, a multiple of [`ROWS`] (the last one repeated, which never wins a tie).
#[derive(Debug)]
struct PackedRows {
    kernel: Kernel,
    count: usize,
    words: Vec<u32>,
    terms: Vec<[u32; ROWS]>,
    numbered_terms: Vec<[u32; ROWS]>,
}

impl PackedRows {
    /// `descriptors` must not be empty.
    fn new(kernel: Kernel, descriptors: &[Descriptor]) -> Self {
        let last = descriptors.len() - 1;
        let padded = descriptors.len().next_multiple_of(ROWS);
        let offset = row_offset(kernel);
        let mut packed = Self {
            kernel,
            count: descriptors.len(),
            words: Vec::with_capacity(padded * words_per_descriptor(kernel)),
            terms: vec![[0; ROWS]; padded / ROWS],
            numbered_terms: vec![[0; ROWS]; padded / ROWS],
        };
        for row in 0..padded {
            let descriptor = &descriptors[row.min(last)];
            packed.words.extend(packed_words(kernel, descriptor, offset));
            let term = squared_norm(descriptor) << SHIFT;
            packed.terms[row / ROWS][row % ROWS] = term;
            packed.numbered_terms[row / ROWS][row % ROWS] = term + (row % ROWS_PER_TASK) as u32;
        }
        packed
    }

    /// The two smallest keys of every lane for every row, and the nearest row of every column.
    fn compare(&self, columns: &PackedColumns) -> (Vec<LaneBest>, Vec<Neighbor>) {
        const TILES_PER_TASK: usize = ROWS_PER_TASK / ROWS;
        let mut bests = vec![[LaneBest { first: FARTHEST, second: FARTHEST }; ROWS]; self.terms.len()];
        let task_nearest: Vec<Vec<Lanes>> = bests
            .par_chunks_mut(TILES_PER_TASK)
            .enumerate()
            .map(|(task, bests)| {
                let mut nearest = vec![FARTHEST; columns.terms.len()];
                for (tile, best) in bests.iter_mut().enumerate() {
                    self.compare_tile(task * TILES_PER_TASK + tile, columns, best, &mut nearest);
                }
                nearest
            })
            .collect();
        let mut bests = bests.into_flattened();
        bests.truncate(self.count);
        (bests, nearest_rows(&task_nearest))
    }

    fn compare_tile(
        &self,
        tile: usize,
        columns: &PackedColumns,
        best: &mut [LaneBest; ROWS],
        column_nearest: &mut [Lanes],
    ) {
        let words = words_per_descriptor(self.kernel);
        for (block, nearest) in column_nearest.iter_mut().enumerate() {
            let tile = kernels::Tile {
                rows: &self.words[tile * ROWS * words..(tile + 1) * ROWS * words],
                row_terms: &self.terms[tile],
                numbered_row_terms: &self.numbered_terms[tile],
                block: &columns.words[block * words..(block + 1) * words],
                column_terms: &columns.terms[block],
                block_number: block as u32,
            };
            kernels::lower(self.kernel, &tile, best, nearest);
        }
    }
}

/// Descriptors packed as blocks of columns, at most [`COLUMNS_PER_PASS`] (the last one repeated to fill its block).
#[derive(Debug)]
struct PackedColumns {
    words: Vec<Lanes>,
    terms: Vec<Lanes>,
}

impl PackedColumns {
    /// `descriptors` must not be empty.
    fn new(kernel: Kernel, descriptors: &[Descriptor]) -> Self {
        let last = descriptors.len() - 1;
        let (blocks, words) = (descriptors.len().div_ceil(LANES), words_per_descriptor(kernel));
        let mut packed =
            Self { words: vec![Lanes([0; LANES]); blocks * words], terms: vec![Lanes([0; LANES]); blocks] };
        for column in 0..blocks * LANES {
            let (block, lane) = (column / LANES, column % LANES);
            let descriptor = &descriptors[column.min(last)];
            for (word, value) in packed_words(kernel, descriptor, 0).enumerate() {
                packed.words[block * words + word].0[lane] = value;
            }
            // Kernels may see rows less an offset: ab = (a - offset) b + offset sum(b).
            let missing = 2 * row_offset(kernel) * sum(descriptor);
            packed.terms[block].0[lane] = squared_norm(descriptor).wrapping_sub(missing) << SHIFT;
        }
        packed
    }
}

/// The nearest row of every column from the keys of every task's rows.
fn nearest_rows(task_nearest: &[Vec<Lanes>]) -> Vec<Neighbor> {
    let columns = task_nearest.first().map_or(0, |nearest| nearest.len() * LANES);
    let nearest_of = |column: usize| {
        let candidates = task_nearest.iter().enumerate().map(|(task, nearest)| {
            let key = nearest[column / LANES].0[column % LANES];
            let row = (key & ((1 << SHIFT) - 1)) as usize;
            Neighbor { squared_distance: key >> SHIFT, descriptor: task * ROWS_PER_TASK + row }
        });
        candidates.min().unwrap_or(Neighbor { squared_distance: u32::MAX, descriptor: 0 })
    };
    (0..columns).map(nearest_of).collect()
}

fn words_per_descriptor(kernel: Kernel) -> usize {
    DESCRIPTOR_LENGTH / kernel.elements_per_word()
}

/// What rows are packed less, to make bytes signed where the kernel multiplies unsigned by signed bytes.
fn row_offset(kernel: Kernel) -> u32 {
    if kernel.elements_per_word() == 4 { BYTE_OFFSET } else { 0 }
}

/// The words a kernel multiplies; bytes less `offset` as two's complement.
fn packed_words(kernel: Kernel, descriptor: &Descriptor, offset: u32) -> impl Iterator<Item = u32> + '_ {
    let elements = kernel.elements_per_word();
    descriptor.chunks_exact(elements).map(move |chunk| match chunk {
        [element] => f32::from(*element).to_bits(),
        _ => {
            let bits = (u32::BITS as usize / elements) as u32;
            let packed = |&element: &u8| u32::from(element).wrapping_sub(offset) & ((1 << bits) - 1);
            chunk.iter().rev().fold(0, |word, element| (word << bits) | packed(element))
        }
    })
}

fn squared_norm(descriptor: &Descriptor) -> u32 {
    descriptor.iter().map(|&element| u32::from(element).pow(2)).sum()
}

fn sum(descriptor: &Descriptor) -> u32 {
    descriptor.iter().map(|&element| u32::from(element)).sum()
}
