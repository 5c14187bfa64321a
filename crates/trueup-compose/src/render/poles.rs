//! Holes at the poles of a sphere, where a tripod stood.
//!
//! On the canvas such a hole is a strip, from inside a disc. What its border's colors differ by in direction must
//! vanish toward its middle, which is one place, or they meet there in a star.

use crate::gaps::Gaps;
use crate::pyramid::{PyramidPlane, color};

/// The holes at the upper and the lower border of a canvas that is a whole sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Poles {
    height: usize,
    holes: [Option<Hole>; 2],
}

/// A hole around a pole.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hole {
    /// Rows from the pole that no photograph reaches into.
    rows: usize,
    /// Mean over all directions, square roots of linear light.
    color: [f32; 3],
}

impl Poles {
    /// Of a canvas of `size` pixels; none unless it goes all the way round and is twice as wide as high. `surface` is
    /// what gaps are filled with, `columns` those of its samples that go round once.
    pub(super) fn of(
        [width, height]: [usize; 2],
        gaps: &Gaps,
        surface: &PyramidPlane<[f32; 4]>,
        columns: std::ops::Range<usize>,
    ) -> Self {
        if !gaps.is_around() || width != 2 * height {
            return Self { height, holes: [None; 2] };
        }
        let is_empty = |y: &usize| gaps.covered(0..width, *y).next().is_none();
        let samples = surface.rows.clone();
        let hole = |rows: usize, sample: Option<usize>| {
            let own = surface.row(sample.filter(|_| rows > 0)?);
            let first = surface.columns.start;
            let colors: Vec<[f32; 3]> =
                columns.clone().filter_map(|x| color(*own.get(x.checked_sub(first)?)?)).collect();
            let mean = |k: usize| colors.iter().map(|color| color[k]).sum::<f32>() / colors.len() as f32;
            (!colors.is_empty()).then(|| Hole { rows, color: [mean(0), mean(1), mean(2)] })
        };
        let above = (0..height).take_while(is_empty).count();
        let below = (0..height).rev().take_while(is_empty).count();
        Self { height, holes: [hole(above, samples.clone().next()), hole(below, samples.last())] }
    }

    /// A color that a gap is filled with in row `y`: the nearer a pole, the more like the mean around it, as a surface
    /// without bends is.
    pub(super) fn faded(&self, y: usize, [r, g, b]: [f32; 3]) -> [f32; 3] {
        let from_poles = [y, self.height - 1 - y];
        let near = self.holes.iter().zip(from_poles).find_map(|(hole, from)| {
            let hole = (*hole)?;
            (from < hole.rows).then_some((hole, from))
        });
        let Some((hole, from)) = near else { return [r, g, b] };
        let share = (from as f32 + 0.5) / hole.rows as f32;
        let between = |own: f32, k: usize| hole.color[k] + share * (own - hole.color[k]);
        [between(r, 0), between(g, 1), between(b, 2)]
    }
}
