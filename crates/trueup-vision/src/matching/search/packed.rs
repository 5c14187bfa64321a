//! Descriptors packed into the words that a kernel multiplies.

use rayon::prelude::*;

use super::kernels::{DistanceTile, SearchKernel, lower};
use super::keys::{FARTHEST, LANES, LaneBest, LaneWords, Neighbor, ROWS, ROWS_PER_TASK, SHIFT};
use crate::features::{DESCRIPTOR_LENGTH, Descriptor};

/// Makes unsigned bytes signed for the kernels that multiply unsigned by signed bytes.
const BYTE_OFFSET: u32 = 128;

/// Descriptors packed as rows, a multiple of [`ROWS`] (the last one repeated, which never wins a tie).
#[derive(Debug)]
pub(super) struct PackedRows {
    kernel: SearchKernel,
    count: usize,
    words: Vec<u32>,
    terms: Vec<[u32; ROWS]>,
    numbered_terms: Vec<[u32; ROWS]>,
}

impl PackedRows {
    /// `descriptors` must not be empty.
    pub(super) fn new(kernel: SearchKernel, descriptors: &[Descriptor]) -> Self {
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
    pub(super) fn compare(&self, columns: &PackedColumns) -> (Vec<LaneBest>, Vec<Neighbor>) {
        const TILES_PER_TASK: usize = ROWS_PER_TASK / ROWS;
        let mut bests = vec![[LaneBest { first: FARTHEST, second: FARTHEST }; ROWS]; self.terms.len()];
        let task_nearest: Vec<Vec<LaneWords>> = bests
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
        column_nearest: &mut [LaneWords],
    ) {
        let words = words_per_descriptor(self.kernel);
        for (block, nearest) in column_nearest.iter_mut().enumerate() {
            let tile = DistanceTile {
                rows: &self.words[tile * ROWS * words..(tile + 1) * ROWS * words],
                row_terms: &self.terms[tile],
                numbered_row_terms: &self.numbered_terms[tile],
                block: &columns.words[block * words..(block + 1) * words],
                column_terms: &columns.terms[block],
                block_number: block as u32,
            };
            lower(self.kernel, &tile, best, nearest);
        }
    }
}

/// Descriptors packed as blocks of columns, at most one pass of them (the last one repeated to fill its block).
#[derive(Debug)]
pub(super) struct PackedColumns {
    words: Vec<LaneWords>,
    terms: Vec<LaneWords>,
}

impl PackedColumns {
    /// `descriptors` must not be empty.
    pub(super) fn new(kernel: SearchKernel, descriptors: &[Descriptor]) -> Self {
        let last = descriptors.len() - 1;
        let (blocks, words) = (descriptors.len().div_ceil(LANES), words_per_descriptor(kernel));
        let mut packed =
            Self { words: vec![LaneWords([0; LANES]); blocks * words], terms: vec![LaneWords([0; LANES]); blocks] };
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
fn nearest_rows(task_nearest: &[Vec<LaneWords>]) -> Vec<Neighbor> {
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

fn words_per_descriptor(kernel: SearchKernel) -> usize {
    DESCRIPTOR_LENGTH / kernel.elements_per_word()
}

/// What rows are packed less, to make bytes signed where the kernel multiplies unsigned by signed bytes.
fn row_offset(kernel: SearchKernel) -> u32 {
    if kernel.elements_per_word() == 4 { BYTE_OFFSET } else { 0 }
}

/// The words a kernel multiplies; bytes less `offset` as two's complement.
fn packed_words(kernel: SearchKernel, descriptor: &Descriptor, offset: u32) -> impl Iterator<Item = u32> + '_ {
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
