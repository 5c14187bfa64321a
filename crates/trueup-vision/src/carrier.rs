//! What belongs to what carries the camera: a bonnet, the legs of a drone, a window's frame. Every photograph shows it
//! at the same place, whatever the camera looks at, and it matches better than anything in the scene.
//!
//! Two photographs alone do not tell it from what a view and its exposures have in common; all of them do: it stands
//! still in every pair, and nothing else does in any.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use trueup_core::carrier::{CarrierParts, Rectangle};
use trueup_core::source::WorkingFrame;
use trueup_core::{Result, StageContext};

use crate::features::{Descriptor, FeatureSource, Features};
use crate::matching::squared_distance;
use crate::squares::{SQUARE_PX, STILL_PX, Square, featured, square};

/// Fewest photographs that tell a carrier.
const FEWEST_PHOTOGRAPHS: usize = 3;
/// Most photographs that are compared, spread evenly over the set: 66 pairs.
const MOST_COMPARED: usize = 12;
/// Largest squared distance of descriptors of one thing in two photographs, of those of length 512. Noise and
/// compression move them by half of that (300 squared); two things at one place by chance differ by more than 400
/// squared.
const SAME_DESCRIPTOR: u32 = 90_000;
/// Least share of the squares with features of both photographs in which some stand still for the two to show one view.
/// Of what carries a camera more than this is not told.
const SAME_VIEW: f64 = 0.5;
/// Fewest pairs of different views that tell a carrier.
const FEWEST_PAIRS: usize = 3;
/// Least share of the pairs that show features in a square in which some stand still there, for it to be the carrier's.
/// Measured on 44 sets with a carrier drawn in, 85 without and 31 photographed ones: nearly all of its squares have
/// more than 0.8, the scene's less than 0.2.
const OFTEN_STILL: f64 = 0.75;
/// The same beside a square of the carrier's: its edge, behind which the scene changes.
const STILL_BESIDE: f64 = 0.4;
/// Least share of the squares with features that is a carrier; less is [written](crate::matching), or met by chance.
const LEAST_SHARE: f64 = 0.05;
/// Squares from a photograph's border within which a carrier begins. What stands still farther inside is what a camera
/// moves towards, or turns about.
const FROM_BORDER: i64 = 2;

/// Where photographs of one size, numbered in `photographs`, show what carries the camera, in working pixels of their
/// common `frame`; `None` where nothing tells it.
///
/// # Errors
/// Those of `features`; [`trueup_core::Error::Input`] where features contradict themselves;
/// [`trueup_core::Error::Cancelled`].
pub fn find(
    features: &dyn FeatureSource,
    photographs: &[usize],
    frame: &WorkingFrame,
    context: &StageContext,
) -> Result<Option<CarrierParts>> {
    // Three of them tell whether it is worth it.
    for most in [FEWEST_PHOTOGRAPHS, MOST_COMPARED] {
        let compared = spread(photographs, most);
        if compared.len() < FEWEST_PHOTOGRAPHS {
            return Ok(None);
        }
        let stillness = Stillness::of(features, &compared, context)?;
        let found = stillness.carrier(frame);
        // Of photographs of one view nothing is told yet.
        if compared.len() == photographs.len() || most == MOST_COMPARED || (found.is_none() && stillness.is_told()) {
            return Ok(found);
        }
    }
    Ok(None)
}

/// So many of the photographs at most, evenly spread.
fn spread(photographs: &[usize], most: usize) -> Vec<usize> {
    let count = photographs.len().min(most);
    (0..count).map(|number| photographs[number * photographs.len() / count]).collect()
}

/// In how many pairs something stands still.
#[derive(Debug, Default)]
struct Stillness {
    pairs: usize,
    /// Pairs of different views.
    counted: usize,
    /// By square with features of both photographs of a counted pair: such pairs, and those in which some stand still.
    squares: BTreeMap<Square, [usize; 2]>,
}

impl Stillness {
    fn of(features: &dyn FeatureSource, photographs: &[usize], context: &StageContext) -> Result<Self> {
        let placed: Vec<Placed> = photographs
            .iter()
            .map(|&photograph| {
                context.check_cancelled()?;
                let of_one = features.features(photograph)?;
                of_one.check(photograph)?;
                Ok(Placed::new(of_one))
            })
            .collect::<Result<_>>()?;
        let pairs: Vec<[&Placed; 2]> = placed
            .iter()
            .enumerate()
            .flat_map(|(number, one)| placed[number + 1..].iter().map(move |other| [one, other]))
            .collect();
        let compared: Vec<(BTreeSet<Square>, BTreeSet<Square>)> =
            pairs.par_iter().map(|[one, other]| (one.squares_with(other), one.still(other))).collect();
        let mut stillness = Self { pairs: compared.len(), ..Self::default() };
        for (both, still) in compared {
            if still.len() as f64 >= SAME_VIEW * both.len() as f64 {
                continue;
            }
            stillness.counted += 1;
            for square in both {
                let [seen, times] = stillness.squares.entry(square).or_default();
                *seen += 1;
                *times += usize::from(still.contains(&square));
            }
        }
        Ok(stillness)
    }

    /// Whether all pairs are of different views.
    fn is_told(&self) -> bool {
        self.counted == self.pairs
    }

    fn carrier(&self, frame: &WorkingFrame) -> Option<CarrierParts> {
        if self.counted < FEWEST_PAIRS {
            return None;
        }
        let fewest = FEWEST_PAIRS.max(self.counted / 3);
        let told = || self.squares.iter().filter(|(_, [seen, _])| *seen >= fewest);
        let still =
            |share: f64| move |&(_, &[seen, times]): &(&Square, &[usize; 2])| times as f64 >= share * seen as f64;
        let sure: BTreeSet<Square> = told().filter(still(OFTEN_STILL)).map(|(&square, _)| square).collect();
        let perhaps: BTreeSet<Square> =
            self.squares.iter().filter(still(STILL_BESIDE)).map(|(&square, _)| square).collect();
        let at_border = |&square: &Square| is_at_border(square, frame);
        let from_border = joined(sure.iter().copied().filter(at_border), &sure);
        if (from_border.len() as f64) < LEAST_SHARE * told().count().max(1) as f64 {
            return None;
        }
        CarrierParts::new(rectangles(&joined(from_border.into_iter(), &perhaps)))
    }
}

fn is_at_border([column, row]: Square, frame: &WorkingFrame) -> bool {
    let is_near = |along: i64, length: f64| {
        let last = (length / SQUARE_PX).ceil() as i64 - 1;
        along < FROM_BORDER || along > last - FROM_BORDER
    };
    is_near(column, frame.width) || is_near(row, frame.height)
}

/// The first squares and all `others` that lie side by side, or corner by corner, with one of them, or with one that
/// does.
fn joined(first: impl Iterator<Item = Square>, others: &BTreeSet<Square>) -> BTreeSet<Square> {
    let mut joined: BTreeSet<Square> = first.collect();
    let mut open: Vec<Square> = joined.iter().copied().collect();
    while let Some([column, row]) = open.pop() {
        for beside in (-1..=1).flat_map(|right| (-1..=1).map(move |down| [column + right, row + down])) {
            if others.contains(&beside) && joined.insert(beside) {
                open.push(beside);
            }
        }
    }
    joined
}

/// The squares in working pixels, those side by side in one.
fn rectangles(squares: &BTreeSet<Square>) -> Vec<Rectangle> {
    let mut by_row: Vec<[i64; 2]> = squares.iter().map(|&[column, row]| [row, column]).collect();
    by_row.sort_unstable();
    let stretches = by_row.chunk_by(|[row, column], [next_row, next]| row == next_row && column + 1 == *next);
    let rectangle = |stretch: &[[i64; 2]]| {
        let ([row, first], last) = (stretch[0], stretch[stretch.len() - 1][1]);
        [first, row, last + 1, row + 1].map(|side| side as f64 * SQUARE_PX)
    };
    stretches.map(rectangle).collect()
}

/// The features of a photograph, found by their places.
struct Placed<'a> {
    features: Cow<'a, Features>,
    /// The cell of each descriptor, row first, and its number, by cells.
    by_cell: Vec<(Cell, usize)>,
    squares: BTreeSet<Square>,
}

/// A cell as wide as what stands still may have moved: its row and its column.
type Cell = [i64; 2];

fn cell([x, y]: [f64; 2]) -> Cell {
    [y, x].map(|along| (along / STILL_PX).floor() as i64)
}

impl<'a> Placed<'a> {
    fn new(features: Cow<'a, Features>) -> Self {
        let cell_of = |(number, &point): (usize, &u32)| (cell(features.points[point as usize].position), number);
        let mut by_cell: Vec<(Cell, usize)> = features.descriptor_points.iter().enumerate().map(cell_of).collect();
        by_cell.sort_unstable();
        let squares = featured(&features.points);
        Self { features, by_cell, squares }
    }

    /// The squares in which both photographs have features.
    fn squares_with(&self, other: &Self) -> BTreeSet<Square> {
        self.squares.intersection(&other.squares).copied().collect()
    }

    /// The squares in which something looks as it does at the same place of the other photograph.
    fn still(&self, other: &Self) -> BTreeSet<Square> {
        let is_still =
            |&(number, position): &(usize, [f64; 2])| other.shows(&self.features.descriptors[number], position);
        let positions = (0..self.features.descriptors.len()).map(|number| (number, self.position(number)));
        positions.filter(is_still).map(|(_, position)| square(position)).collect()
    }

    /// Whether something like it is at this place.
    fn shows(&self, descriptor: &Descriptor, position: [f64; 2]) -> bool {
        let [row, column] = cell(position);
        (row - 1..=row + 1).any(|row| {
            let first = self.by_cell.partition_point(|(cell, _)| *cell < [row, column - 1]);
            let near = self.by_cell[first..].iter().take_while(|(cell, _)| *cell <= [row, column + 1]);
            near.map(|&(_, number)| number).any(|number| {
                let [right, down] = [0, 1].map(|axis| self.position(number)[axis] - position[axis]);
                right.hypot(down) <= STILL_PX
                    && squared_distance(descriptor, &self.features.descriptors[number]) <= SAME_DESCRIPTOR
            })
        })
    }

    /// Where a descriptor's point is.
    fn position(&self, descriptor: usize) -> [f64; 2] {
        self.features.points[self.features.descriptor_points[descriptor] as usize].position
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::mask::Mask;

    use super::*;
    use crate::features::{DESCRIPTOR_LENGTH, FeaturePoint};

    const FRAME: WorkingFrame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };

    /// A descriptor of its own for each number.
    fn descriptor(number: u64) -> Descriptor {
        let mut state = number.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1;
        let values: [u8; DESCRIPTOR_LENGTH] = std::array::from_fn(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 57) as u8
        });
        values
    }

    /// A feature in each square of 40 px, its number by what is seen there: `moved` says by how many squares the scene
    /// has moved, and where it has not, what is seen stands still.
    fn photograph(moved: i64, is_still: impl Fn([i64; 2]) -> bool) -> Features {
        let mut features = Features::default();
        for row in 0..15_i64 {
            for column in 0..20_i64 {
                let shift = if is_still([column, row]) { 0 } else { moved };
                let position = [column, row].map(|along| 40.0 * along as f64 + 20.3);
                features.descriptor_points.push(features.points.len() as u32);
                features.points.push(FeaturePoint { position, scale_px: 2.0, response: 10.0 });
                features.descriptors.push(descriptor((1000 * row + column + 31 * shift) as u64));
            }
        }
        features
    }

    fn found(photographs: &[Features]) -> Option<Mask> {
        let numbers: Vec<usize> = (0..photographs.len()).collect();
        let parts = find(&photographs.to_vec(), &numbers, &FRAME, &StageContext::default()).expect("sound");
        parts.map(|parts| parts.mask([800, 600]))
    }

    fn squares_of(is_in: impl Fn([usize; 2]) -> bool) -> Mask {
        Mask::from_fn(800, 600, |x, y| is_in([x / 40, y / 40]))
    }

    #[test]
    fn what_stands_still_at_the_border_is_the_carrier() {
        let is_bonnet = |[_, row]: [i64; 2]| row >= 12;
        let bonnet = squares_of(|[_, row]| row >= 12);
        for count in [3, 5, 40] {
            let photographs: Vec<Features> = (0..count).map(|number| photograph(number, is_bonnet)).collect();
            assert_eq!(found(&photographs).as_ref(), Some(&bonnet), "{count} photographs");
        }
        // The same beside a photograph of the view of another, a burst of two, which tells nothing.
        let burst: Vec<Features> = [0, 0, 1, 2].map(|moved| photograph(moved, is_bonnet)).into();
        assert_eq!(found(&burst), Some(bonnet));
    }

    #[test]
    fn edges_of_the_carrier_belong_to_it() {
        // A row above the bonnet stands still now and then: in photographs 0 to 3 of five, which are 6 pairs of 10.
        let seen = |number: i64| photograph(number, move |[_, row]| row >= 13 || (row == 12 && number < 4));
        let photographs: Vec<Features> = (0..5).map(seen).collect();
        assert_eq!(found(&photographs), Some(squares_of(|[_, row]| row >= 12)));
    }

    #[test]
    fn views_are_no_carriers() {
        let views = |moved: &[i64], is_still: fn([i64; 2]) -> bool| {
            let photographs: Vec<Features> = moved.iter().map(|&moved| photograph(moved, is_still)).collect();
            found(&photographs)
        };
        let nothing = |_: [i64; 2]| false;
        assert_eq!(views(&[0, 1, 2, 3], nothing), None);
        assert_eq!(views(&[0, 0, 0, 0], nothing), None, "exposures of one view");
        assert_eq!(views(&[0, 0, 0, 1, 1, 1], nothing), None, "of two");
        assert_eq!(views(&[0, 1], |[_, row]| row >= 12), None, "two photographs do not tell");
        assert_eq!(views(&[0, 1, 2], |[_, row]| row >= 5), None, "more than half stands still");
        // What a camera moves towards.
        assert_eq!(views(&[0, 1, 2, 3], |[column, row]| (8..12).contains(&column) && (6..9).contains(&row)), None);
        // A corner by chance: 12 of 300 squares.
        assert_eq!(views(&[0, 1, 2, 3], |[column, row]| row == 0 && column < 12), None);
        assert_eq!(found(&[Features::default(), Features::default(), Features::default()]), None);
    }

    #[test]
    fn features_that_contradict_themselves_are_an_error() {
        let mut bad = photograph(1, |_| false);
        bad.descriptor_points[5] = 9999;
        let photographs = vec![photograph(0, |_| false), bad, photograph(2, |_| false)];
        assert!(find(&photographs, &[0, 1, 2], &FRAME, &StageContext::default()).is_err());
    }
}
