//! A picture and its smaller copies, row of tiles by row of tiles, in one pass.

use std::ops::Range;

use rayon::prelude::*;

use super::failure::WriteFailure;
use super::samples::{OutputSample, RGBA};

/// How every level is cut into tiles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tiling {
    /// Side of a tile without overlap, in pixels.
    pub(crate) side: usize,
    /// Pixels by which a tile reaches into its neighbors.
    pub(crate) overlap: usize,
}

impl Tiling {
    /// Number of tiles along `length` pixels.
    pub(crate) fn count(self, length: usize) -> usize {
        length.div_ceil(self.side)
    }

    /// The pixels of tile `index` along `length` pixels.
    pub(crate) fn span(self, index: usize, length: usize) -> Range<usize> {
        let start = (index * self.side).saturating_sub(self.overlap);
        start..((index + 1) * self.side + self.overlap).min(length)
    }
}

/// Sizes (width, height) of a picture and its copies, each half the one before, rounded up; the last is the first that
/// `is_last` accepts, or of one pixel.
pub(crate) fn level_sizes(width: usize, height: usize, is_last: impl Fn(usize, usize) -> bool) -> Vec<[usize; 2]> {
    let mut sizes = vec![[width, height]];
    let mut last = [width, height];
    while !is_last(last[0], last[1]) && last != [1, 1] {
        last = last.map(|length| length.div_ceil(2));
        sizes.push(last);
    }
    sizes
}

/// Rows of a level that make up one row of tiles.
pub(crate) struct TileRow<'a, S> {
    /// 0 for the picture itself, 1 for the copy of half its size, and so on.
    pub(crate) level: usize,
    /// Which row of tiles of the level.
    pub(crate) index: usize,
    /// Width of the level in pixels.
    pub(crate) width: usize,
    /// The rows, RGBA.
    pub(crate) rows: &'a [S],
}

impl<'a, S: OutputSample> TileRow<'a, S> {
    /// The pixels of `columns`, row by row.
    pub(crate) fn columns(&self, columns: Range<usize>) -> impl Iterator<Item = &'a [S]> + use<'a, S> {
        let (first, last) = (columns.start * RGBA, columns.end * RGBA);
        self.rows.chunks_exact(self.width * RGBA).map(move |row| &row[first..last])
    }
}

/// Takes the rows of a picture from top to bottom and hands out the rows of tiles of all levels as they are complete.
/// Holds of every level little more than one row of tiles, of all together about twice as much as of the first.
///
/// A pixel of a copy is the mean of the four under it, weighted by alpha: of encoded values, as programs that make such
/// pyramids do; linear light would brighten fine patterns as a camera does, but differs visibly in these only.
pub(crate) struct TilePyramid<S> {
    tiling: Tiling,
    levels: Vec<Level<S>>,
}

struct Level<S> {
    width: usize,
    height: usize,
    /// The rows from `first` on that are still needed.
    rows: Vec<S>,
    first: usize,
    /// The next row of tiles to be handed out.
    next: usize,
    /// Rows of the next level that were made from this one.
    halved: usize,
}

impl<S: OutputSample> TilePyramid<S> {
    /// Levels of the given sizes, each half the one before.
    pub(crate) fn new(sizes: &[[usize; 2]], tiling: Tiling) -> Self {
        let level =
            |&[width, height]: &[usize; 2]| Level { width, height, rows: Vec::new(), first: 0, next: 0, halved: 0 };
        Self { tiling, levels: sizes.iter().map(level).collect() }
    }

    /// Takes the next whole rows of the picture.
    pub(crate) fn push(
        &mut self,
        rows: &[S],
        emit: &mut dyn FnMut(TileRow<'_, S>) -> Result<(), WriteFailure>,
    ) -> Result<(), WriteFailure> {
        let mut halves: Vec<S>;
        let mut rows = rows;
        for index in 0..self.levels.len() {
            let has_next = index + 1 < self.levels.len();
            let level = &mut self.levels[index];
            level.rows.extend_from_slice(rows);
            level.emit_complete(index, self.tiling, emit)?;
            halves = if has_next { level.halve() } else { Vec::new() };
            level.forget(self.tiling, has_next);
            if halves.is_empty() {
                break;
            }
            rows = &halves;
        }
        Ok(())
    }
}

impl<S: OutputSample> Level<S> {
    /// Number of rows that were taken so far.
    fn end(&self) -> usize {
        self.first + self.rows.len() / (self.width * RGBA)
    }

    fn emit_complete(
        &mut self,
        level: usize,
        tiling: Tiling,
        emit: &mut dyn FnMut(TileRow<'_, S>) -> Result<(), WriteFailure>,
    ) -> Result<(), WriteFailure> {
        while self.next < tiling.count(self.height) && tiling.span(self.next, self.height).end <= self.end() {
            let span = tiling.span(self.next, self.height);
            let row = self.width * RGBA;
            let rows = &self.rows[(span.start - self.first) * row..(span.end - self.first) * row];
            emit(TileRow { level, index: self.next, width: self.width, rows })?;
            self.next += 1;
        }
        Ok(())
    }

    /// The rows of the next level that can be made now and were not before.
    fn halve(&mut self) -> Vec<S> {
        let end = self.end();
        // The last row of an odd number stands for itself.
        let possible = if end == self.height { end.div_ceil(2) } else { end / 2 };
        let width = self.width.div_ceil(2);
        let mut halves = vec![S::default(); (possible - self.halved) * width * RGBA];
        let row = |y: usize| &self.rows[(y - self.first) * self.width * RGBA..][..self.width * RGBA];
        halves.par_chunks_exact_mut(width * RGBA).zip(self.halved..possible).for_each(|(half, y)| {
            let (upper, lower) = (row(2 * y), row((2 * y + 1).min(self.height - 1)));
            let (upper, lower) = (upper.as_chunks::<RGBA>().0, lower.as_chunks::<RGBA>().0);
            for (x, pixel) in half.as_chunks_mut::<RGBA>().0.iter_mut().enumerate() {
                let (left, right) = (2 * x, (2 * x + 1).min(self.width - 1));
                *pixel = S::mean([upper[left], upper[right], lower[left], lower[right]]);
            }
        });
        self.halved = possible;
        halves
    }

    /// Drops the rows that neither the next row of tiles nor the next level needs.
    fn forget(&mut self, tiling: Tiling, has_next: bool) {
        let mut needed = (self.next * tiling.side).saturating_sub(tiling.overlap);
        if has_next {
            needed = needed.min(2 * self.halved);
        }
        let needed = needed.clamp(self.first, self.end());
        self.rows.drain(..(needed - self.first) * self.width * RGBA);
        self.first = needed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every level handed out in rows of tiles is the mean of the one before, whatever the rows come in.
    #[test]
    fn levels_are_halves_of_each_other() {
        for (width, height, side, overlap, step) in [(37, 53, 16, 0, 5), (64, 64, 16, 1, 64), (9, 41, 8, 2, 3)] {
            let picture: Vec<u8> = (0..width * height * RGBA)
                .map(|at| if at % 4 == 3 { [255, 255, 0, 100][at / 4 % 4] } else { (at * 31 % 251) as u8 })
                .collect();
            let sizes = level_sizes(width, height, |_, _| false);
            assert_eq!(*sizes.last().expect("one"), [1, 1]);
            let tiling = Tiling { side, overlap };
            let mut levels: Vec<Vec<u8>> = sizes.iter().map(|&[w, h]| vec![7; w * h * RGBA]).collect();
            let mut next = vec![0; sizes.len()];
            let mut pyramid = TilePyramid::<u8>::new(&sizes, tiling);
            for rows in picture.chunks(step * width * RGBA) {
                pyramid
                    .push(rows, &mut |tiles| {
                        assert_eq!(tiles.index, next[tiles.level]);
                        next[tiles.level] += 1;
                        let start = tiling.span(tiles.index, sizes[tiles.level][1]).start * tiles.width * RGBA;
                        levels[tiles.level][start..start + tiles.rows.len()].copy_from_slice(tiles.rows);
                        let columns = tiling.span(0, tiles.width);
                        assert_eq!(tiles.columns(columns.clone()).next().expect("a row").len(), columns.len() * RGBA);
                        Ok(())
                    })
                    .expect("nothing fails");
            }
            assert_eq!(levels[0], picture);
            for (level, &[w, h]) in sizes.iter().enumerate() {
                assert_eq!(next[level], tiling.count(h), "level {level}");
                let Some(&[half, halves]) = sizes.get(level + 1) else { continue };
                for at in 0..half * halves {
                    let pixel = |x: usize, y: usize| {
                        let (x, y) = ((2 * (at % half) + x).min(w - 1), (2 * (at / half) + y).min(h - 1));
                        let first = (y * w + x) * RGBA;
                        <[u8; 4]>::try_from(&levels[level][first..first + RGBA]).expect("four")
                    };
                    let expected = u8::mean([pixel(0, 0), pixel(1, 0), pixel(0, 1), pixel(1, 1)]);
                    assert_eq!(levels[level + 1][at * RGBA..][..RGBA], expected);
                }
            }
        }
    }

    #[test]
    fn tiles_overlap_their_neighbors_only() {
        let tiling = Tiling { side: 254, overlap: 1 };
        assert_eq!((tiling.span(0, 600), tiling.span(1, 600), tiling.span(2, 600)), (0..255, 253..509, 507..600));
        assert_eq!((tiling.count(508), tiling.count(509), tiling.count(1)), (2, 3, 1));
    }
}
