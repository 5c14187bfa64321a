//! Tiles of squared distances between bytes, one kernel per instruction set, all with the same results.
//!
//! A kernel compares `ROWS` descriptors with one block of `LANES` columns. Its products are whole numbers, so that
//! the order of summation does not matter and every kernel returns the same bits.
#![allow(unsafe_code)] // Runtime-dispatched vector instructions; nowhere else in the matching.

use super::keys::{LANES, LaneBest, LaneWords, ROWS, SHIFT};
use super::squared_distance;
use crate::features::Descriptor;

/// The instruction set a search runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchKernel {
    /// Plain Rust, for every processor.
    Portable,
    /// 16-bit multiply-add on 256-bit registers.
    Avx2,
    /// Byte products on 256-bit registers.
    AvxVnni,
    /// Byte products on 512-bit registers.
    Avx512Vnni,
}

impl SearchKernel {
    /// The kernels this processor can run, slowest first.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut)]
        let mut kernels = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") {
                kernels.push(Self::Avx2);
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("avxvnni") {
                kernels.push(Self::AvxVnni);
            }
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vnni") {
                kernels.push(Self::Avx512Vnni);
            }
        }
        kernels
    }

    /// The fastest kernel this processor can run.
    pub(super) fn best() -> Self {
        Self::available().last().copied().unwrap_or(Self::Portable)
    }

    /// Elements of a descriptor in one packed word: four bytes (unsigned columns, signed rows), two 16-bit numbers, or
    /// one 32-bit floating-point number, in which whole numbers up to 2^24, and so all products here, are exact.
    pub(super) fn elements_per_word(self) -> usize {
        match self {
            Self::Portable => 1,
            Self::Avx2 => 2,
            Self::AvxVnni | Self::Avx512Vnni => 4,
        }
    }
}

/// What a kernel reads: [`ROWS`] rows against one block of columns.
///
/// With `dot` the product of a packed row and a packed column, `(row_terms + column_terms) - (dot << (SHIFT + 1))` is
/// the squared distance shifted left by [`SHIFT`], in wrapping 32-bit arithmetic.
#[derive(Debug, Clone, Copy)]
pub(super) struct DistanceTile<'a> {
    /// Packed rows, one after the other.
    pub(super) rows: &'a [u32],
    /// Shifted squared norms of the rows.
    pub(super) row_terms: &'a [u32; ROWS],
    /// The same with the row's number added.
    pub(super) numbered_row_terms: &'a [u32; ROWS],
    /// The packed block: for every word of a descriptor, that word of [`LANES`] columns.
    pub(super) block: &'a [LaneWords],
    /// Shifted norm terms of the columns.
    pub(super) column_terms: &'a LaneWords,
    /// The block's number.
    pub(super) block_number: u32,
}

/// Lowers `row_best` and `column_best` by the keys of a tile.
///
/// # Panics
/// If the tile was not packed for `kernel`, or the processor lacks it: both are errors of the caller in this crate.
pub(super) fn lower(
    kernel: SearchKernel,
    tile: &DistanceTile<'_>,
    row_best: &mut [LaneBest; ROWS],
    column_best: &mut LaneWords,
) {
    match kernel {
        SearchKernel::Portable => portable(tile, row_best, column_best),
        #[cfg(target_arch = "x86_64")]
        SearchKernel::Avx2 => {
            assert!(is_x86_feature_detected!("avx2"), "the kernel needs AVX2");
            // SAFETY: the processor has the instructions the function is compiled for.
            unsafe { x86::avx2(tile, row_best, column_best) }
        }
        #[cfg(target_arch = "x86_64")]
        SearchKernel::AvxVnni => {
            assert!(is_x86_feature_detected!("avxvnni"), "the kernel needs AVX-VNNI");
            // SAFETY: the processor has the instructions the function is compiled for; AVX-VNNI implies AVX2.
            unsafe { x86::avx_vnni(tile, row_best, column_best) }
        }
        #[cfg(target_arch = "x86_64")]
        SearchKernel::Avx512Vnni => {
            assert!(is_x86_feature_detected!("avx512vnni"), "the kernel needs AVX-512 VNNI");
            // SAFETY: the processor has the instructions the function is compiled for; VNNI implies AVX-512F.
            unsafe { x86::avx512_vnni(tile, row_best, column_best) }
        }
        #[cfg(not(target_arch = "x86_64"))]
        _ => portable(tile, row_best, column_best),
    }
}

fn portable(tile: &DistanceTile<'_>, row_best: &mut [LaneBest; ROWS], column_best: &mut LaneWords) {
    let words = tile.block.len();
    for (row, best) in row_best.iter_mut().enumerate() {
        let mut dots = [0.0_f32; LANES];
        for (&word, columns) in tile.rows[row * words..(row + 1) * words].iter().zip(tile.block) {
            let element = f32::from_bits(word);
            for (dot, column) in dots.iter_mut().zip(columns.0) {
                *dot += element * f32::from_bits(column);
            }
        }
        for (lane, dot) in dots.into_iter().enumerate() {
            let key = tile.column_terms.0[lane].wrapping_sub((dot as u32) << (SHIFT + 1));
            let row_key = key.wrapping_add(tile.row_terms[row]).wrapping_add(tile.block_number);
            best.second.0[lane] = best.second.0[lane].min(best.first.0[lane].max(row_key));
            best.first.0[lane] = best.first.0[lane].min(row_key);
            let column_key = key.wrapping_add(tile.numbered_row_terms[row]);
            column_best.0[lane] = column_best.0[lane].min(column_key);
        }
    }
}

/// Puts the squared distances of `descriptor` from those of `all` whose numbers are `members` into `found`, in their
/// order.
pub(crate) fn squared_distances(descriptor: &Descriptor, all: &[&Descriptor], members: &[u32], found: &mut Vec<u32>) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::squared_distances(descriptor, all, members, found) };
    }
    squared_distances_portable(descriptor, all, members, found);
}

#[inline(always)]
fn squared_distances_portable(descriptor: &Descriptor, all: &[&Descriptor], members: &[u32], found: &mut Vec<u32>) {
    found.clear();
    found.reserve(members.len());
    for &member in members {
        found.push(squared_distance(descriptor, all[member as usize]));
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{Descriptor, DistanceTile, LaneBest, LaneWords, ROWS, SHIFT};

    #[target_feature(enable = "avx2")]
    pub(super) fn squared_distances(
        descriptor: &Descriptor,
        all: &[&Descriptor],
        members: &[u32],
        found: &mut Vec<u32>,
    ) {
        super::squared_distances_portable(descriptor, all, members, found);
    }

    const DOT_SHIFT: u32 = SHIFT + 1;
    /// Words of a descriptor whose bytes are multiplied four at a time.
    const BYTE_WORDS: usize = 32;
    /// Words of a descriptor whose 16-bit numbers are multiplied two at a time.
    const PAIR_WORDS: usize = 64;

    #[target_feature(enable = "avx512f,avx512vnni")]
    pub(super) fn avx512_vnni(tile: &DistanceTile<'_>, row_best: &mut [LaneBest; ROWS], column_best: &mut LaneWords) {
        let rows: &[u32; ROWS * BYTE_WORDS] = tile.rows.try_into().expect("rows are packed for this kernel");
        let block: &[LaneWords; BYTE_WORDS] = tile.block.try_into().expect("columns are packed for this kernel");
        let mut dots = [_mm512_setzero_si512(); ROWS];
        for (word, columns) in block.iter().enumerate() {
            let columns = load_512(columns);
            for (row, dot) in dots.iter_mut().enumerate() {
                let query = _mm512_set1_epi32(rows[row * BYTE_WORDS + word] as i32);
                *dot = _mm512_dpbusd_epi32(*dot, columns, query);
            }
        }
        let terms = load_512(tile.column_terms);
        let numbered_terms = _mm512_add_epi32(terms, _mm512_set1_epi32(tile.block_number as i32));
        let mut lowest = load_512(column_best);
        for (row, (dot, best)) in dots.into_iter().zip(row_best).enumerate() {
            let dot = _mm512_slli_epi32::<DOT_SHIFT>(dot);
            let row_term = _mm512_set1_epi32(tile.row_terms[row] as i32);
            let key = _mm512_add_epi32(_mm512_sub_epi32(numbered_terms, dot), row_term);
            let (first, second) = (load_512(&best.first), load_512(&best.second));
            store_512(&mut best.second, _mm512_min_epu32(second, _mm512_max_epu32(first, key)));
            store_512(&mut best.first, _mm512_min_epu32(first, key));
            let row_term = _mm512_set1_epi32(tile.numbered_row_terms[row] as i32);
            let key = _mm512_add_epi32(_mm512_sub_epi32(terms, dot), row_term);
            lowest = _mm512_min_epu32(lowest, key);
        }
        store_512(column_best, lowest);
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load_512(lanes: &LaneWords) -> __m512i {
        // SAFETY: `LaneWords` is 64 bytes, aligned to 64.
        unsafe { _mm512_load_si512(std::ptr::from_ref(lanes).cast()) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn store_512(lanes: &mut LaneWords, value: __m512i) {
        // SAFETY: `LaneWords` is 64 bytes, aligned to 64.
        unsafe { _mm512_store_si512(std::ptr::from_mut(lanes).cast(), value) }
    }

    /// Rows whose products fit the sixteen 256-bit registers at once, two registers a row.
    const ROWS_AT_ONCE: usize = 4;

    /// Declares a kernel on 256-bit registers; `$dot` is (sum, columns, row) -> sum plus products.
    macro_rules! kernel_256 {
        ($name:ident, $features:literal, $words:ident, $dot:expr) => {
            #[target_feature(enable = $features)]
            pub(super) fn $name(tile: &DistanceTile<'_>, row_best: &mut [LaneBest; ROWS], column_best: &mut LaneWords) {
                let rows: &[u32; ROWS * $words] = tile.rows.try_into().expect("rows are packed for this kernel");
                let block: &[LaneWords; $words] = tile.block.try_into().expect("columns are packed for this kernel");
                for start in (0..ROWS).step_by(ROWS_AT_ONCE) {
                    let mut dots = [[_mm256_setzero_si256(); 2]; ROWS_AT_ONCE];
                    for (word, columns) in block.iter().enumerate() {
                        let columns = load_256(columns);
                        for (row, dot) in dots.iter_mut().enumerate() {
                            let query = _mm256_set1_epi32(rows[(start + row) * $words + word] as i32);
                            dot[0] = $dot(dot[0], columns[0], query);
                            dot[1] = $dot(dot[1], columns[1], query);
                        }
                    }
                    for (row, dot) in dots.into_iter().enumerate() {
                        lower_256(tile, start + row, dot, &mut row_best[start + row], column_best);
                    }
                }
            }
        };
    }

    kernel_256!(avx2, "avx2", PAIR_WORDS, |sum, columns, row| _mm256_add_epi32(sum, _mm256_madd_epi16(columns, row)));
    kernel_256!(avx_vnni, "avx2,avxvnni", BYTE_WORDS, |sum, columns, row| _mm256_dpbusd_avx_epi32(sum, columns, row));

    /// Lowers the bests by the keys of one row.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn lower_256(
        tile: &DistanceTile<'_>,
        row: usize,
        dot: [__m256i; 2],
        best: &mut LaneBest,
        column_best: &mut LaneWords,
    ) {
        let (mut first, mut second) = (load_256(&best.first), load_256(&best.second));
        let (terms, mut lowest) = (load_256(tile.column_terms), load_256(column_best));
        let row_term = _mm256_set1_epi32(tile.row_terms[row].wrapping_add(tile.block_number) as i32);
        let numbered_row_term = _mm256_set1_epi32(tile.numbered_row_terms[row] as i32);
        for half in 0..2 {
            let dot = _mm256_slli_epi32::<{ DOT_SHIFT as i32 }>(dot[half]);
            let key = _mm256_sub_epi32(terms[half], dot);
            let row_key = _mm256_add_epi32(key, row_term);
            second[half] = _mm256_min_epu32(second[half], _mm256_max_epu32(first[half], row_key));
            first[half] = _mm256_min_epu32(first[half], row_key);
            lowest[half] = _mm256_min_epu32(lowest[half], _mm256_add_epi32(key, numbered_row_term));
        }
        store_256(&mut best.first, first);
        store_256(&mut best.second, second);
        store_256(column_best, lowest);
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn load_256(lanes: &LaneWords) -> [__m256i; 2] {
        let half: *const __m256i = std::ptr::from_ref(lanes).cast();
        // SAFETY: `LaneWords` is 64 bytes, aligned to 64: two registers, each aligned to 32.
        unsafe { [_mm256_load_si256(half), _mm256_load_si256(half.add(1))] }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn store_256(lanes: &mut LaneWords, value: [__m256i; 2]) {
        let half: *mut __m256i = std::ptr::from_mut(lanes).cast();
        // SAFETY: `LaneWords` is 64 bytes, aligned to 64: two registers, each aligned to 32.
        unsafe {
            _mm256_store_si256(half, value[0]);
            _mm256_store_si256(half.add(1), value[1]);
        }
    }
}
