//! One exposure of a stack, in the frame of the reference.

use std::ops::Range;

use trueup_core::geometry::Homography;
use trueup_core::raster::Photograph;

use super::ghosts::{Expectation, Small};
use crate::kernel::{Bicubic, Bilinear};
use crate::pyramid::PyramidPlane;
use crate::sampling::interpolate;
use crate::simd::Positions;

/// One exposure.
#[derive(Debug)]
pub(super) struct Exposure<'a> {
    photograph: &'a Photograph,
    /// Its small copy in the reference's frame.
    small: Small,
    /// Where it lies; `None` for the reference itself.
    aligned: Option<Aligned>,
}

#[derive(Debug)]
struct Aligned {
    member_from_reference: Homography,
    /// `None` where the reference lets expect nothing of it.
    expectation: Option<Expectation>,
}

impl<'a> Exposure<'a> {
    pub(super) fn reference(photograph: &'a Photograph) -> Self {
        let size = [photograph.width(), photograph.height()];
        let small = Small::new(size, |scale, columns, row| sampled(photograph, None, scale, columns, row));
        Self { photograph, small, aligned: None }
    }

    /// A member on its reference; both have one size.
    pub(super) fn other(reference: &Self, photograph: &'a Photograph, member_from_reference: Homography) -> Self {
        let size = [photograph.width(), photograph.height()];
        let small = Small::new(size, |scale, columns, row| {
            sampled(photograph, Some(&member_from_reference), scale, columns, row)
        });
        let expectation = Expectation::new(&reference.small, &small);
        Self { photograph, small, aligned: Some(Aligned { member_from_reference, expectation }) }
    }

    /// The pixels of its small copy, of every exposure the same ones in the same order; `None` where it is not to be
    /// compared with others: beyond its border, and where it contradicts the reference.
    pub(super) fn compared(&self) -> impl Iterator<Item = Option<[f32; 4]>> {
        let is_exchanged = |index: usize| match &self.aligned {
            None => false,
            Some(aligned) => aligned.expectation.as_ref().is_none_or(|one| one.is_exchanged(index)),
        };
        self.small.pixels().iter().enumerate().map(move |(index, pixel)| pixel.filter(|_| !is_exchanged(index)))
    }

    /// Its own colors along a row of the reference, as in [`Self::window`], and how far each is to be trusted, 0 to 1.
    pub(super) fn trusted_row(&self, columns: Range<usize>, y: usize) -> Vec<(Option<[f32; 4]>, f32)> {
        let map = self.aligned.as_ref().map(|aligned| &aligned.member_from_reference);
        let trust = |x: usize| match &self.aligned {
            None => 1.0,
            Some(aligned) => aligned.expectation.as_ref().map_or(0.0, |one| 1.0 - one.share_at([x, y])),
        };
        sampled(self.photograph, map, 1.0, columns.clone(), y).into_iter().zip(columns.map(trust)).collect()
    }

    pub(super) fn has_color(&self) -> bool {
        self.photograph.channels() >= 3
    }

    /// Its colors, 0 to 255 and wholly covered, within a window of the reference, whose own colors there are
    /// `reference`.
    pub(super) fn window(
        &self,
        columns: &Range<usize>,
        rows: &Range<usize>,
        reference: Option<&PyramidPlane<[f32; 4]>>,
    ) -> PyramidPlane<[f32; 4]> {
        let mut window = PyramidPlane::new(columns.clone(), rows.clone());
        let map = self.aligned.as_ref().map(|aligned| &aligned.member_from_reference);
        for y in rows.clone() {
            let samples = sampled(self.photograph, map, 1.0, columns.clone(), y);
            for (texel, sample) in window.row_mut(y).iter_mut().zip(samples) {
                *texel = sample.unwrap_or([f32::NAN; 4]);
            }
        }
        let (Some(aligned), Some(reference)) = (&self.aligned, reference) else { return window };
        for y in rows.clone() {
            let expected = reference.row(y);
            for ((x, texel), own) in columns.clone().zip(window.row_mut(y)).zip(expected) {
                let [r, g, b, _] = *own;
                *texel = match &aligned.expectation {
                    Some(expectation) => expectation.without_ghost([x, y], *texel, [r, g, b]),
                    None => *own,
                };
            }
        }
        window
    }
}

/// A row of pixels of the reference's frame `scale` as large as it is, as a photograph shows them: colors from 0 to 255
/// and share 1; `None` beyond its border.
fn sampled(
    photograph: &Photograph,
    member_from_reference: Option<&Homography>,
    scale: f64,
    columns: Range<usize>,
    row: usize,
) -> Vec<Option<[f32; 4]>> {
    let (width, height) = (photograph.width() as f64, photograph.height() as f64);
    let mut positions = Positions::default();
    positions.resize(columns.len());
    let mut is_inside = vec![true; columns.len()];
    // Along a row of the frame, all three coordinates of a place are linear.
    let map = member_from_reference.map_or_else(Homography::identity, |map| *map).0;
    let y = (row as f64 + 0.5) / scale;
    let start = [0, 1, 2].map(|axis| map[(axis, 1)] * y + map[(axis, 2)]);
    for (index, column) in columns.enumerate() {
        let x = (column as f64 + 0.5) / scale;
        let [x, y, depth] = [0, 1, 2].map(|axis| map[(axis, 0)] * x + start[axis]);
        let (mut x, mut y) = (x / depth, y / depth);
        if !((0.0..=width).contains(&x) && (0.0..=height).contains(&y)) {
            is_inside[index] = false;
            (x, y) = (0.5, 0.5);
        }
        // One more, so that the cast, which cuts off, finds the whole number below; within the photograph, whose sides
        // are far below the range.
        let whole = |place: f64| (place + 0.5) as i32 - 1;
        (positions.column[index], positions.row[index]) = (whole(x), whole(y));
        positions.fraction_x[index] = (x - 0.5 - f64::from(positions.column[index])) as f32;
        positions.fraction_y[index] = (y - 0.5 - f64::from(positions.row[index])) as f32;
    }
    let mut samples = vec![[0.0; 4]; positions.len()];
    let (mut at_border, stretch) = (Vec::new(), (1.0 / scale).clamp(1.0, crate::sampling::MAX_STRETCH));
    if stretch > 1.0 {
        interpolate::<Bilinear>(photograph, &positions, [stretch; 2], &mut samples, &mut at_border);
    } else {
        interpolate::<Bicubic>(photograph, &positions, [1.0, 1.0], &mut samples, &mut at_border);
    }
    let one = |([r, g, b, _], is_inside): ([f32; 4], bool)| {
        is_inside.then(|| [r.clamp(0.0, 255.0), g.clamp(0.0, 255.0), b.clamp(0.0, 255.0), 1.0])
    };
    samples.into_iter().zip(is_inside).map(one).collect()
}
