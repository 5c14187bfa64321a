//! Things that one photograph shows and another does not: they must not be cut.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::neighbors::neighbors;
use crate::small_views::{SmallView, WHOLLY};

/// Difference, in gray levels, from which on photographs are taken to show different things.
const MOVING_HIGH: f64 = 32.0;

/// Difference, in gray levels, down to which such a thing extends.
const MOVING_LOW: f64 = 14.0;

/// Numbers the connected parts of the canvas where photographs differ; 0 where they do not.
///
/// A pixel differs if no pixel of the other photograph within one step looks like it, both ways, so that misalignment
/// by a pixel or two says nothing. Parts grow from strong differences into weak ones that touch them (hysteresis).
///
/// `turn` is the width of a canvas that is a cylinder, 0 on a plane.
pub(super) fn moving_things(views: &[SmallView], [width, height]: [usize; 2], turn: usize) -> Vec<u32> {
    let mut difference = vec![0_u8; width * height];
    difference.par_chunks_exact_mut(width).enumerate().for_each(|(y, difference)| {
        // Photographs whose box meets the row; neighbors in their order are compared.
        let met: Vec<&SmallView> = views.iter().filter(|view| view.rows.contains(&y)).collect();
        for (x, place) in difference.iter_mut().enumerate() {
            let mut last: Option<&SmallView> = None;
            for &view in &met {
                if view.flags(x, y, turn) & WHOLLY == 0 {
                    continue;
                }
                if let Some(last) = last {
                    let level = unlike(last, view, [x, y], turn).min(unlike(view, last, [x, y], turn));
                    *place = level.max(*place);
                }
                last = Some(view);
            }
        }
    });
    label_parts(&difference, [width, height], turn)
}

/// Smallest difference of `a` at (x, y) from `b` at that pixel and its eight neighbors, mean of the channels.
fn unlike(a: &SmallView, b: &SmallView, [x, y]: [usize; 2], turn: usize) -> u8 {
    let Some(at) = a.index_around(x, y, turn) else { return 0 };
    let color = a.pixels[at];
    let mut least = u16::MAX;
    for v in y.saturating_sub(1)..=y + 1 {
        for u in neighbors(x, usize::MAX, turn) {
            if let Some(index) = b.index_around(u, v, turn) {
                let other = b.pixels[index];
                if other[3] & WHOLLY != 0 {
                    least = least.min((0..3).map(|c| u16::from(color[c].abs_diff(other[c]))).sum());
                }
            }
        }
    }
    if least == u16::MAX { 0 } else { (least / 3) as u8 }
}

fn label_parts(difference: &[u8], [width, height]: [usize; 2], turn: usize) -> Vec<u32> {
    let mut number = vec![0_u32; width * height];
    let mut parts = 0;
    let mut open = VecDeque::new();
    for start in 0..difference.len() {
        if number[start] != 0 || f64::from(difference[start]) < MOVING_HIGH {
            continue;
        }
        parts += 1;
        number[start] = parts;
        open.push_back(start);
        while let Some(at) = open.pop_front() {
            let (x, y) = (at % width, at / width);
            for v in y.saturating_sub(1)..(y + 2).min(height) {
                for u in neighbors(x, width, turn) {
                    let next = v * width + u;
                    if number[next] == 0 && f64::from(difference[next]) >= MOVING_LOW {
                        number[next] = parts;
                        open.push_back(next);
                    }
                }
            }
        }
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small_views::PARTLY;

    #[test]
    fn a_thing_in_one_photograph_is_one_part_and_a_shift_is_none() {
        let view = |shift: usize, thing: bool| {
            let pixels = (0..30 * 20)
                .map(|index| {
                    let (x, y) = (index % 30, index / 30);
                    let inside = thing && (10..16).contains(&x) && (5..12).contains(&y);
                    let level = if inside { 250 } else { ((x + shift) / 4 % 2 * 60) as u8 };
                    [level, level, level, PARTLY | WHOLLY]
                })
                .collect();
            SmallView { columns: 0..30, rows: 0..20, pixels }
        };
        let found = moving_things(&[view(0, false), view(1, true)], [30, 20], 0);
        for (index, &number) in found.iter().enumerate() {
            let (x, y) = (index % 30, index / 30);
            let inside = (10..16).contains(&x) && (5..12).contains(&y);
            let core = (11..15).contains(&x) && (6..11).contains(&y);
            assert!(inside || number == 0, "({x}, {y})");
            assert!(!core || number == 1, "({x}, {y})");
        }
        assert!(moving_things(&[view(0, false), view(1, false)], [30, 20], 0).iter().all(|&number| number == 0));
    }
}
