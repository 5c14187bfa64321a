//! Filling gaps: a smooth surface over the colors along their borders, and beside what is no such surface what the
//! panorama shows elsewhere.

mod border_colors;
mod completion;

use std::ops::Range;

use rayon::prelude::*;
use trueup_core::{Result, StageContext};

use self::border_colors::BorderColors;
use self::completion::{Completion, Elsewhere};
use super::grain;
use super::panorama::{Panorama, PanoramaPixels, linear_of_sum};
use super::poles::Poles;
use crate::coverage::Rectangle;
use crate::gaps::Gaps;
use crate::pyramid::{PyramidPlane, color, first_level, tile_margin, tile_side};
use crate::store::{Pixel, PixelStore, RootPixel, SumPixel};
use crate::window::widened;

/// A pixel whose color can be looked at and set.
trait Shade: Pixel {
    /// Square roots of linear light, and the share that is covered.
    fn root(self) -> [f32; 4];
    /// A pixel of that color, covered wholly.
    fn of_root(root: [f32; 3]) -> Self;
}

impl Shade for RootPixel {
    fn root(self) -> [f32; 4] {
        self.map(|value| f32::from(value) / f32::from(u16::MAX))
    }

    fn of_root([r, g, b]: [f32; 3]) -> Self {
        // The casts saturate.
        [r, g, b, 1.0].map(|value| (value * f32::from(u16::MAX) + 0.5) as u16)
    }
}

impl Shade for SumPixel {
    fn root(self) -> [f32; 4] {
        let [r, g, b, share] = linear_of_sum(self);
        [r.max(0.0).sqrt(), g.max(0.0).sqrt(), b.max(0.0).sqrt(), share]
    }

    fn of_root([r, g, b]: [f32; 3]) -> Self {
        [r * r, g * g, b * b, 1.0]
    }
}

impl Panorama {
    /// Fills the gaps with a smooth surface that has the grain of what lies beside it, or where that differs more from
    /// place to place, with what the panorama shows elsewhere; returns how many pixels that were. `gaps` are those of
    /// the layout it was made of. The same pixels come out however the panorama is held.
    ///
    /// # Errors
    /// [`trueup_core::Error::Io`] if a scratch file cannot be read or written; [`trueup_core::Error::Cancelled`].
    ///
    /// # Source
    /// The surface by push-pull: Gortler, Grzeszczuk, Szeliski, Cohen, "The lumigraph", SIGGRAPH 1996, section 3.4.
    /// What is shown elsewhere by few offsets: He, Sun, "Statistics of patch offsets for image completion", ECCV 2012.
    ///
    /// # Departures
    /// Only what lies beside a gap is carried into it, and what is of another kind than the border around it is not.
    pub fn fill(&mut self, gaps: &Gaps, context: &StageContext) -> Result<usize> {
        let size = gaps.canvas();
        match &mut self.pixels {
            PanoramaPixels::Sums(sums) => fill(sums, size, gaps, context),
            PanoramaPixels::Roots(roots) => fill(roots, size, gaps, context),
        }
    }
}

/// The parts of the canvas that [`Panorama::fill`] reads.
pub(super) fn read_for(gaps: &Gaps) -> Vec<Rectangle> {
    let canvas = Canvas::new(gaps.canvas(), gaps);
    let of_tile = |tile: FillTile| {
        let (columns, rows) = canvas.with_margin(&tile);
        canvas.stretches(&columns).into_iter().map(move |(_, columns)| Rectangle { columns, rows: rows.clone() })
    };
    canvas.tiles().1.into_iter().flat_map(of_tile).collect()
}

/// Tiles that are finished before they are put on the canvas; a number of threads must not show in the panorama.
const TILES_AT_ONCE: usize = 64;

fn fill<P: Shade>(store: &mut PixelStore<P>, size: [usize; 2], gaps: &Gaps, context: &StageContext) -> Result<usize> {
    let canvas = Canvas::new(size, gaps);
    let (wanted, sources) = canvas.tiles();
    if wanted.is_empty() {
        return Ok(0);
    }
    let [all] = canvas.reduced(store, &sources, &BorderColors::default(), |known| [known], context)?;
    let around = BorderColors::of(&all, canvas.first_level);
    let with_grain = |known: PyramidPlane<[f32; 4]>| {
        let grain = grain::of(&known);
        [known, grain]
    };
    let [colors, grain] = canvas.reduced(store, &sources, &around, with_grain, context)?;
    let (surface, grain) = (surface(colors), surface(grain));
    let once = [canvas.lead, canvas.lead + canvas.width].map(|column| column >> canvas.first_level);
    let poles = Poles::of(size, gaps, &surface, once[0]..once[1]);
    let completion = Completion::of(&canvas, store, &surface, context)?;
    let filling = Filling { around, surface, grain, poles, completion };
    let mut filled = 0;
    for tiles in wanted.chunks(TILES_AT_ONCE) {
        context.check_cancelled()?;
        let finished: Vec<Option<(usize, Vec<P>)>> =
            tiles.par_iter().map(|tile| canvas.finished(store, tile, &filling)).collect::<Result<_>>()?;
        for (tile, finished) in tiles.iter().zip(finished) {
            let Some((count, pixels)) = finished else { continue };
            filled += count;
            let columns = tile.columns.start - canvas.lead..tile.columns.end - canvas.lead;
            for (y, row) in tile.rows.clone().zip(pixels.chunks_exact(columns.len())) {
                store.set(&columns, y, row)?;
            }
        }
    }
    Ok(filled)
}

/// A part of the canvas, which begins `lead` columns before the panorama does.
#[derive(Debug, Clone)]
struct FillTile {
    columns: Range<usize>,
    rows: Range<usize>,
}

/// The canvas, with as much beyond both ends of a full turn as is felt across them.
struct Canvas<'a> {
    gaps: &'a Gaps,
    width: usize,
    height: usize,
    lead: usize,
    /// Log2 of the pixels per sample of the level from which on the surface is found as a whole.
    first_level: u32,
}

impl<'a> Canvas<'a> {
    fn new([width, height]: [usize; 2], gaps: &'a Gaps) -> Self {
        let first_level = first_level([width, height]);
        let side = tile_side(first_level);
        // A gap is two radii wide at most; its borders' colors come from a little farther away.
        let reach = (4.0 * gaps.radius()).ceil() as usize;
        let lead = if gaps.is_around() { reach.clamp(1, width).next_multiple_of(side) } else { 0 };
        Self { gaps, width, height, lead, first_level }
    }

    /// The column of the panorama that is seen at a column of this canvas.
    fn column(&self, x: usize) -> usize {
        (x + self.lead.div_ceil(self.width) * self.width - self.lead) % self.width
    }

    /// The tiles of the panorama at and beside gaps, and all whose colors these may need.
    fn tiles(&self) -> (Vec<FillTile>, Vec<FillTile>) {
        let side = tile_side(self.first_level);
        let end = self.lead + self.width;
        let across = (end + self.lead).div_ceil(side);
        let down = self.height.div_ceil(side);
        let tile = |at: usize| {
            let (left, top) = (at % across * side, at / across * side);
            let right = (left + side).min(end + self.lead);
            FillTile { columns: left..right, rows: top..(top + side).min(self.height) }
        };
        let has_gap = |tile: &FillTile| {
            self.stretches(&tile.columns).iter().any(|(_, columns)| self.gaps.any_within(columns, &tile.rows))
        };
        let gap: Vec<bool> = (0..across * down).into_par_iter().map(|at| has_gap(&tile(at))).collect();
        let reach = (2.0 * self.gaps.radius() / side as f64).ceil() as usize + 1;
        let near = |at: usize| {
            let (column, row) = (at % across, at / across);
            let columns = column.saturating_sub(reach)..(column + reach + 1).min(across);
            (row.saturating_sub(reach)..(row + reach + 1).min(down))
                .any(|row| gap[row * across..][columns.clone()].contains(&true))
        };
        let sources: Vec<FillTile> = (0..across * down).filter(|&at| near(at)).map(tile).collect();
        // Borders that a photograph covers by less than a pixel's rounding lie beside gaps, too.
        let inside = sources.iter().filter(|tile| (self.lead..end).contains(&tile.columns.start)).cloned();
        let cut = |tile: FillTile| FillTile { columns: tile.columns.start..tile.columns.end.min(end), rows: tile.rows };
        let wanted = inside.map(cut).collect();
        (wanted, sources)
    }

    /// A tile with what its levels are made of beside it.
    fn with_margin(&self, tile: &FillTile) -> (Range<usize>, Range<usize>) {
        let margin = tile_margin(self.first_level);
        let width = self.width + 2 * self.lead;
        (widened(&tile.columns, margin, width), widened(&tile.rows, margin, self.height))
    }

    /// Columns of this canvas in stretches that lie beside each other in the panorama: the first of each, and the
    /// panorama's columns.
    fn stretches(&self, columns: &Range<usize>) -> Vec<(usize, Range<usize>)> {
        let mut stretches = Vec::new();
        let mut first = columns.start;
        while first < columns.end {
            let start = self.column(first);
            let count = (columns.end - first).min(self.width - start);
            stretches.push((first, start..start + count));
            first += count;
        }
        stretches
    }

    /// Colors times the share covered of a tile with its margin; nothing where the gaps are, nor farther from them than
    /// [`Canvas::border`]; `None` where all of it is.
    fn known<P: Shade>(
        &self,
        store: &PixelStore<P>,
        tile: &FillTile,
        around: &BorderColors,
    ) -> Result<Option<PyramidPlane<[f32; 4]>>> {
        let (columns, rows) = self.with_margin(tile);
        let Some(beside) = self.beside_gaps(&columns, &rows) else { return Ok(None) };
        let mut plane = PyramidPlane::new(columns.clone(), rows.clone());
        for (first, own) in self.stretches(&columns) {
            let pixels = store.window(&own, &rows)?;
            for (y, pixels) in rows.clone().zip(pixels.chunks_exact(own.len())) {
                let from = first - columns.start;
                let beside = &beside[(y - rows.start) * columns.len() + from..][..own.len()];
                let texels = &mut plane.row_mut(y)[from..][..own.len()];
                for x in self.gaps.covered(own.clone(), y).flatten().map(|x| x - own.start).filter(|&x| beside[x]) {
                    let [r, g, b, share] = pixels[x].root();
                    let share = share * around.belonging(first + x, y, [r, g, b]);
                    texels[x] = [r * share, g * share, b * share, share];
                }
            }
        }
        Ok(Some(plane))
    }

    /// How far from a gap its colors are taken, pixels: what lies behind the border of a narrow strip of sky is no sky.
    fn border(&self) -> usize {
        /// As a share of the half width of the widest gap, which a wider border would tell no more about.
        const SHARE: f64 = 0.25;
        /// Fewest and most pixels: so many that noise averages out, and no more than are soon looked through.
        const WIDTHS: [f64; 2] = [8.0, 64.0];
        (SHARE * self.gaps.radius()).clamp(WIDTHS[0], WIDTHS[1]).round() as usize
    }

    /// Whether some gap lies in the square of [`Canvas::border`] pixels to every side of each pixel of a window, row by
    /// row; none where it does nowhere.
    fn beside_gaps(&self, columns: &Range<usize>, rows: &Range<usize>) -> Option<Vec<bool>> {
        let border = self.border();
        let wide = widened(columns, border, self.width + 2 * self.lead);
        let high = widened(rows, border, self.height);
        let stretches = self.stretches(&wide);
        let across = |y: usize| {
            let of_stretch = |(first, own): (usize, Range<usize>)| {
                let start = own.start;
                self.gaps.within_row(own, y).map(move |gap| first + gap.start - start..first + gap.end - start)
            };
            let mut gaps = stretches.iter().cloned().flat_map(of_stretch).peekable();
            gaps.peek().is_some().then(|| spread(gaps, border, columns))
        };
        let across: Vec<Option<Vec<bool>>> = high.clone().map(across).collect();
        if across.iter().all(Option::is_none) {
            return None;
        }
        // For every column, how many of the rows that a row sees have a gap beside it.
        let mut seen = vec![0_u16; columns.len()];
        let mut beside = Vec::with_capacity(columns.len() * rows.len());
        let (mut first, mut end) = (high.start, high.start);
        for y in rows.clone() {
            for across in across[end - high.start..(y + border + 1).min(high.end) - high.start].iter().flatten() {
                seen.iter_mut().zip(across).for_each(|(seen, &across)| *seen += u16::from(across));
            }
            end = (y + border + 1).min(high.end);
            let new_first = y.saturating_sub(border).max(high.start);
            for across in across[first - high.start..new_first - high.start].iter().flatten() {
                seen.iter_mut().zip(across).for_each(|(seen, &across)| *seen -= u16::from(across));
            }
            first = new_first;
            beside.extend(seen.iter().map(|&rows| rows > 0));
        }
        Some(beside)
    }

    /// What is `made` of what is known, at the first level, of so much of the panorama as gaps need.
    fn reduced<P: Shade, const N: usize>(
        &self,
        store: &PixelStore<P>,
        sources: &[FillTile],
        around: &BorderColors,
        made: impl Fn(PyramidPlane<[f32; 4]>) -> [PyramidPlane<[f32; 4]>; N] + Sync,
        context: &StageContext,
    ) -> Result<[PyramidPlane<[f32; 4]>; N]> {
        let samples = |length: usize| 0..length.div_ceil(1 << self.first_level);
        let size = [samples(self.width + 2 * self.lead), samples(self.height)];
        let mut all: [_; N] = std::array::from_fn(|_| PyramidPlane::new(size[0].clone(), size[1].clone()));
        let first = |plane| (0..self.first_level).fold(plane, |plane: PyramidPlane<[f32; 4]>, _| plane.reduced());
        for tiles in sources.chunks(TILES_AT_ONCE) {
            context.check_cancelled()?;
            let reduced: Vec<Option<[PyramidPlane<[f32; 4]>; N]>> = tiles
                .par_iter()
                .map(|tile| Ok(self.known(store, tile, around)?.map(|known| made(known).map(first))))
                .collect::<Result<_>>()?;
            for (tile, planes) in tiles.iter().zip(reduced) {
                let own =
                    |range: &Range<usize>| range.start >> self.first_level..range.end.div_ceil(1 << self.first_level);
                let columns = own(&tile.columns);
                for (all, plane) in all.iter_mut().zip(planes.into_iter().flatten()) {
                    for y in own(&tile.rows) {
                        let texels = &plane.row(y)[columns.start - plane.columns.start..][..columns.len()];
                        all.row_mut(y)[columns.clone()].copy_from_slice(texels);
                    }
                }
            }
        }
        Ok(all)
    }

    /// A tile's pixels with its gaps filled, and how many that were; `None` if none is to be filled.
    fn finished<P: Shade>(
        &self,
        store: &PixelStore<P>,
        tile: &FillTile,
        filling: &Filling,
    ) -> Result<Option<(usize, Vec<P>)>> {
        let columns = tile.columns.start - self.lead..tile.columns.end - self.lead;
        let mut pixels = store.window(&columns, &tile.rows)?;
        let lacks = |(y, pixels): (usize, &[P])| {
            columns.clone().zip(pixels).any(|(x, pixel)| pixel.root()[3] < 1.0 && self.gaps.is_gap(x, y))
        };
        if !tile.rows.clone().zip(pixels.chunks_exact(columns.len())).any(lacks) {
            return Ok(None);
        }
        let nothing_known = || {
            let (columns, rows) = self.with_margin(tile);
            PyramidPlane::new(columns, rows)
        };
        let known = |around: &BorderColors| -> Result<PyramidPlane<[f32; 4]>> {
            Ok(self.known(store, tile, around)?.unwrap_or_else(nothing_known))
        };
        let mut levels = vec![known(&filling.around)?];
        for _ in 1..self.first_level {
            levels.extend(levels.last().map(PyramidPlane::reduced));
        }
        // Whatever ends at a gap goes on for a pixel or two, which is all that there is of a hairline.
        let mut beside: PyramidPlane<[f32; 4]> = known(&BorderColors::default())?;
        for level in levels.iter_mut().take(HAIRLINE_LEVELS) {
            let reduced = beside.reduced();
            *level = std::mem::replace(&mut beside, reduced);
        }
        let elsewhere = Elsewhere::read(self, store, tile, &filling.completion)?;
        let surface = pulled(levels, Some(&filling.surface));
        let mut filled = 0;
        for (y, pixels) in tile.rows.clone().zip(pixels.chunks_exact_mut(columns.len())) {
            let texels = &surface.row(y)[tile.columns.start - surface.columns.start..];
            for (x, (pixel, &texel)) in columns.clone().zip(pixels.iter_mut().zip(texels)) {
                let own = pixel.root();
                let share = own[3];
                if share < 1.0
                    && self.gaps.is_gap(x, y)
                    && let Some(smooth) = color(texel)
                {
                    let smooth = filling.poles.faded(y, smooth);
                    let grain = self.grain([x, y], &filling.grain);
                    let grainy = [0, 1, 2].map(|k| smooth[k] + grain[k]);
                    let color = elsewhere.as_ref().map_or(grainy, |there| there.over([x + self.lead, y], grainy));
                    *pixel = P::of_root([0, 1, 2].map(|k| share * own[k] + (1.0 - share) * color[k].max(0.0)));
                    filled += 1;
                }
            }
        }
        Ok(Some((filled, pixels)))
    }

    /// What the grain changes of the color of a pixel, by the `deviations` of what lies beside gaps.
    fn grain(&self, [x, y]: [usize; 2], deviations: &PyramidPlane<[f32; 4]>) -> [f32; 3] {
        let step = f64::from(1 << self.first_level);
        // Sample i lies on the middle of pixel i * step.
        let at = [(x + self.lead) as f64 / step, y as f64 / step];
        let noise = grain::noise([x, self.gaps.next_column(x)], y);
        grain::deviation(deviations.color_at(at).unwrap_or_default()).map(|deviation| deviation * noise)
    }
}

/// What gaps are filled with.
struct Filling {
    around: BorderColors,
    /// Over the whole of the canvas, at the first level.
    surface: PyramidPlane<[f32; 4]>,
    /// Deviations of the grain, in the same way.
    grain: PyramidPlane<[f32; 4]>,
    poles: Poles,
    completion: Completion,
}

/// The surface over the whole of a level, of which some is known.
fn surface(known: PyramidPlane<[f32; 4]>) -> PyramidPlane<[f32; 4]> {
    let mut levels = vec![known];
    while let Some(last) = levels.last().filter(|last| last.texels.len() > 1) {
        levels.push(last.reduced());
    }
    pulled(levels, None)
}

/// Which of `columns` lie no more than `reach` before or after one of the places of `stretches`, which ascend.
fn spread(stretches: impl Iterator<Item = Range<usize>>, reach: usize, columns: &Range<usize>) -> Vec<bool> {
    let mut spread = vec![false; columns.len()];
    let mut done = columns.start;
    for stretch in stretches {
        let range = stretch.start.saturating_sub(reach).max(done)..(stretch.end + reach).min(columns.end);
        if range.start < range.end {
            done = range.end;
            spread[range.start - columns.start..range.end - columns.start].fill(true);
        }
    }
    spread
}

/// Levels, from pixels on, at which all that lies beside a gap is carried into it.
const HAIRLINE_LEVELS: usize = 2;

/// A sample counts as wholly known if this share of its surroundings is, its inverse: colors reach into a gap as far as
/// the finest level that knows any, so that each place of a gap takes up what is next to it.
const SATURATION: f32 = 16.0;

/// The finest of `levels` with what it lacks from the coarser ones, the coarsest from `coarser`.
fn pulled(mut levels: Vec<PyramidPlane<[f32; 4]>>, coarser: Option<&PyramidPlane<[f32; 4]>>) -> PyramidPlane<[f32; 4]> {
    let mut whole: Option<PyramidPlane<[f32; 4]>> = None;
    while let Some(mut level) = levels.pop() {
        if let Some(coarser) = whole.as_ref().or(coarser) {
            let smooth = coarser.expanded(&level.columns, &level.rows);
            for (texel, smooth) in level.texels.iter_mut().zip(&smooth.texels) {
                if let Some([r, g, b]) = color(*smooth) {
                    let known = (SATURATION * texel[3]).min(1.0);
                    let [own_r, own_g, own_b] = color(*texel).unwrap_or_default();
                    *texel = [r + known * (own_r - r), g + known * (own_g - g), b + known * (own_b - b), 1.0];
                }
            }
        }
        whole = Some(level);
    }
    whole.unwrap_or_default()
}
