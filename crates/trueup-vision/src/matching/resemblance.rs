//! Whether two photographs look alike where matches lay them over each other, beside the matches themselves.
//!
//! Equal things, as the bays of a hall, match like one thing: where enough of their matches agree, photographs that
//! share nothing would be joined. But between those matches books, stains and shadows differ, so that far fewer of the
//! things shown match than in photographs of one place, and what surrounds the others does not look alike. Either alone
//! is also true of photographs that overlap: few things match where it is dark or one of them is shaken, and leaves in
//! the wind look otherwise.
//!
//! The other way round, few matches suffice where all that they lay over each other looks alike: what agrees by chance
//! lays anything over anything.

use nalgebra::{Matrix2, Vector2};
use trueup_core::raster::Raster;

use super::overlap::PredictedOverlap;
use super::refined::derivative;
use crate::features::Features;
use crate::gray::gray_at;

/// Matches in the overlap for each textured square there, below which photographs are compared. Of 34 pairs of
/// photographs of a hall's equal bays that share nothing and were joined, all have less (0.13 to 0.34). Of 1,500 joined
/// pairs of photographs that overlap (59 photographed sets; cut rows of eleven panoramas, as they are, noisy, shaken,
/// coarsely compressed, unevenly exposed, bent as by parallax) three have, one of them of equal pillars between other
/// frescoes; of rows in which all leaves are moved by some 3 px seven.
const FEW_MATCHED: f64 = 0.35;
/// Lower quartile of the correlations below which photographs do not look alike. Of the 34 pairs it is 0.26 to 0.44,
/// and once 0.56; of the three 0.31, 0.31 and 0.55, of the seven 0.48 to 0.67.
const LEAST_ALIKE: f64 = 0.5;
/// Agreeing matches for each textured square below which photographs are not joined by what looks alike. Of 121 pairs
/// of photographs that share nothing, and of which six matches and more agree, two look alike: of a library's ceiling,
/// with 0.14 and 0.18. Of 38 that do overlap, and were refused by their matches, 26 look alike and have enough.
const FEWEST_MATCHED: f64 = 0.25;
/// Lower quartile of the correlations from which on few matches suffice. Of the 121 pairs it is below 0.74 but for the
/// two (0.80 and 0.91); of two thirds of those that overlap it is 0.84 and more.
const WHOLLY_ALIKE: f64 = 0.8;
/// Fewest squares that tell it. Narrow overlaps have no more; of the 121 pairs none has fewer than 14.
const FEWEST_ALIKE_SQUARES: usize = 4;
/// Textured squares in the overlap from which on there is anything to tell.
const FEWEST_SQUARES: usize = 40;
/// Squares that are compared, spread evenly over the textured ones; more hardly change the lower quartile.
const COMPARED_SQUARES: usize = 150;
/// Distance of the squares from each other along each axis, working pixels: about their side.
const SPACING_PX: usize = 24;
/// Half of a square's side, less half a pixel, working pixels.
const HALF: i32 = 10;
/// How far beside its predicted place a square is sought along each axis, working pixels: so far are homographies of
/// few matches off, and what lies before and behind the plane they tell.
const SEARCHED: i32 = 6;
/// Deviation of a square's gray values from which on it is textured, gray levels of 255.
const TEXTURED: f64 = 8.0;
/// Least deviation that a square is counted with in photograph b, gray levels: noise is like nothing.
const CALM: f64 = 1.0;

/// Two photographs and how they overlap, as their matches say.
pub(super) struct Resemblance<'a> {
    pub(super) a: &'a Features,
    pub(super) b: &'a Features,
    pub(super) overlap: &'a PredictedOverlap<'a>,
}

impl Resemblance<'_> {
    /// Whether few of the things in the overlap are among its `in_overlap` matches, and the others do not look alike.
    /// False where nothing is known of what surrounds features.
    pub(super) fn is_missing(&self, in_overlap: usize) -> bool {
        let few = (in_overlap as f64 / FEW_MATCHED) as usize;
        // Of most overlaps so many match that all squares of the photograph would be fewer.
        let [columns, rows] = squares(&self.a.surroundings);
        if columns * rows <= few {
            return false;
        }
        let places = self.places();
        if places.len().max(FEWEST_SQUARES) <= few {
            return false;
        }
        let textured = self.all_textured(places);
        if textured.len() < FEWEST_SQUARES || textured.len() <= few {
            return false;
        }
        let alike = self.correlations(&textured);
        alike.get(alike.len() / 4).is_some_and(|&quartile| quartile < LEAST_ALIKE)
    }

    /// Whether all that the `agreeing` matches lay over each other looks alike, and they are not too few for that.
    /// False where too little is known of what surrounds features.
    pub(super) fn is_confirmed(&self, agreeing: usize) -> bool {
        let textured = self.all_textured(self.places());
        if (agreeing as f64) < FEWEST_MATCHED * textured.len() as f64 {
            return false;
        }
        let alike = self.correlations(&textured);
        alike.len() >= FEWEST_ALIKE_SQUARES && alike[alike.len() / 4] >= WHOLLY_ALIKE
    }

    /// The squares around these places that are textured.
    fn all_textured(&self, places: Vec<[usize; 2]>) -> Vec<Textured> {
        places.into_iter().filter_map(|place| self.textured(place)).collect()
    }

    /// Those of squares spread evenly over these, ascending.
    fn correlations(&self, textured: &[Textured]) -> Vec<f64> {
        let step = textured.len().div_ceil(COMPARED_SQUARES).max(1);
        let mut alike: Vec<f64> = textured.iter().step_by(step).filter_map(|square| self.correlation(square)).collect();
        alike.sort_by(f64::total_cmp);
        alike
    }

    /// Middles of the squares of a that b shows and that hold a feature in both: where parts are ignored there are
    /// none.
    fn places(&self) -> Vec<[usize; 2]> {
        let (of_a, of_b) = (Occupied::new(self.a), Occupied::new(self.b));
        let is_shown = |&middle: &[usize; 2]| {
            let at = center(middle);
            of_a.holds(at) && self.overlap.point_in_b(at).is_some_and(|place| of_b.holds(place))
        };
        let [columns, rows] = of_a.count;
        let all = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
        all.map(|square| square.map(|at| HALF as usize + SPACING_PX / 2 + at * SPACING_PX)).filter(is_shown).collect()
    }

    /// The square around a pixel of a, if it is textured.
    fn textured(&self, middle: [usize; 2]) -> Option<Textured> {
        let [x, y] = middle;
        let half = HALF as usize;
        let rows = y - half..=y + half;
        let pixels = rows.flat_map(|y| self.a.surroundings.row(y)[x - half..=x + half].iter().copied());
        let values: Vec<f64> = pixels.map(f64::from).collect();
        let moments = Moments::of(values.iter().copied());
        (moments.deviation() >= TEXTURED).then_some(Textured { at: center(middle), values, moments })
    }

    /// The largest correlation of a square with those around the place in b that the matches predict; `None` at a
    /// border.
    fn correlation(&self, square: &Textured) -> Option<f64> {
        let in_b = |point| self.overlap.point_in_b(point);
        let (place, shape) = (in_b(square.at)?, derivative(square.at, &in_b)?);
        let seen = seen(&self.b.surroundings, place, &shape)?;
        let shifts = 0..=2 * SEARCHED as usize;
        let all = shifts.clone().flat_map(|y| shifts.clone().map(move |x| [x, y]));
        all.map(|shift| square.correlation(&seen, shift)).max_by(f64::total_cmp)
    }
}

/// Squares of a picture along each axis.
fn squares(picture: &Raster<u8>) -> [usize; 2] {
    [picture.width(), picture.height()].map(|length| length.saturating_sub(SIDE) / SPACING_PX)
}

/// Which squares of a photograph hold a feature.
struct Occupied {
    /// Squares along each axis.
    count: [usize; 2],
    /// In rows.
    holds: Vec<bool>,
}

impl Occupied {
    fn new(features: &Features) -> Self {
        let count = squares(&features.surroundings);
        let mut occupied = Self { count, holds: vec![false; count[0] * count[1]] };
        for point in &features.points {
            if let Some(square) = occupied.square(point.position.into()) {
                occupied.holds[square] = true;
            }
        }
        occupied
    }

    fn holds(&self, point: Vector2<f64>) -> bool {
        self.square(point).is_some_and(|square| self.holds[square])
    }

    fn square(&self, point: Vector2<f64>) -> Option<usize> {
        let [column, row] = [0, 1].map(|axis| {
            let at = (point[axis] - f64::from(HALF)) / SPACING_PX as f64;
            (at >= 0.0 && at < self.count[axis] as f64).then_some(at as usize)
        });
        Some(row? * self.count[0] + column?)
    }
}

/// The middle of a pixel.
fn center(pixel: [usize; 2]) -> Vector2<f64> {
    Vector2::from(pixel.map(|at| at as f64 + 0.5))
}

/// Pixels along the side of a square ...
const SIDE: usize = 2 * HALF as usize + 1;
/// ... and of what is searched for it.
const SEEN_SIDE: usize = 2 * (HALF + SEARCHED) as usize + 1;

/// Gray values around a place of b, in rows of [`SEEN_SIDE`], each pixel of which comes to `shape` there; `None` where
/// they reach out of the picture.
fn seen(picture: &Raster<u8>, place: Vector2<f64>, shape: &Matrix2<f64>) -> Option<Vec<f64>> {
    let offsets = || (-(HALF + SEARCHED)..=HALF + SEARCHED).map(f64::from);
    let places = offsets().flat_map(|y| offsets().map(move |x| Vector2::new(x, y)));
    places.map(|offset| gray_at(picture, place + shape * offset)).collect()
}

/// Sums of gray values.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    sum: f64,
    squares: f64,
}

impl Moments {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        values.fold(Self::default(), |moments, value| Self {
            sum: moments.sum + value,
            squares: moments.squares + value * value,
        })
    }

    /// That of the values of a square.
    fn deviation(self) -> f64 {
        let count = (SIDE * SIDE) as f64;
        (self.squares / count - (self.sum / count).powi(2)).max(0.0).sqrt()
    }
}

/// A textured square of a.
struct Textured {
    /// Its middle, in a's pixels.
    at: Vector2<f64>,
    /// In rows.
    values: Vec<f64>,
    moments: Moments,
}

impl Textured {
    /// Its correlation with the square of `seen` that begins at a column and a row of it.
    fn correlation(&self, seen: &[f64], [x, y]: [usize; 2]) -> f64 {
        let count = (SIDE * SIDE) as f64;
        let (mut moments, mut product) = (Moments::default(), 0.0);
        for (row, own) in self.values.chunks_exact(SIDE).enumerate() {
            let start = (row + y) * SEEN_SIDE + x;
            for (own, other) in own.iter().zip(&seen[start..start + SIDE]) {
                moments.sum += other;
                moments.squares += other * other;
                product += own * other;
            }
        }
        let covariance = product / count - self.moments.sum * moments.sum / (count * count);
        covariance / (self.moments.deviation() * moments.deviation().max(CALM))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::geometry::Homography;
    use trueup_core::source::WorkingFrame;

    use super::*;
    use crate::features::FeaturePoint;

    const SIZE: usize = 240;

    /// A picture of blots 8 px large, drawn from `seed`, with a feature in every square.
    fn photograph(seed: u64) -> Features {
        let level = |x: usize, y: usize| {
            let mixed = (seed ^ ((x / 8 * 1009 + y / 8) as u64)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (mixed >> 56) as u8
        };
        let data = (0..SIZE * SIZE).map(|k| level(k % SIZE, k / SIZE)).collect();
        let points = (0..SIZE * SIZE / 64)
            .map(|k| FeaturePoint {
                position: [(k % (SIZE / 8) * 8) as f64, (k / (SIZE / 8) * 8) as f64],
                scale_px: 2.0,
                response: 9.0,
            })
            .collect();
        let surroundings = Raster::from_data(SIZE, SIZE, 1, data).expect("its size");
        Features { points, surroundings, ..Features::default() }
    }

    fn is_missing(a: &Features, b: &Features, in_overlap: usize) -> bool {
        resembling(a, b, |pair| pair.is_missing(in_overlap))
    }

    /// What is told of them where they are laid over each other.
    fn resembling(a: &Features, b: &Features, told: impl Fn(&Resemblance<'_>) -> bool) -> bool {
        let frame = WorkingFrame::new(SIZE, SIZE, 1e6);
        // Four pixels off what is true: within what is searched.
        let shift = Matrix3::new(1.0, 0.0, 4.0, 0.0, 1.0, -3.0, 0.0, 0.0, 1.0);
        let overlap = PredictedOverlap::new(Homography(shift), &frame, &frame).expect("regular");
        told(&Resemblance { a, b, overlap: &overlap })
    }

    #[test]
    fn photographs_that_look_alike_resemble_each_other_however_few_match() {
        let one = photograph(1);
        assert!(!is_missing(&one, &one, 0));
    }

    /// 240 px have nine squares of 24 px along a side, 81 in all, of whose middles the shift leads none out of the
    /// other photograph. 0.35 of them are 28.35 matches.
    #[test]
    fn photographs_of_other_things_do_not_unless_many_match() {
        let (one, other) = (photograph(1), photograph(2));
        assert!(is_missing(&one, &other, 0));
        assert!(is_missing(&one, &other, 28));
        assert!(!is_missing(&one, &other, 29));
    }

    /// A fourth of the 81 squares is 20.25 matches.
    #[test]
    fn what_looks_alike_is_confirmed_by_enough_matches() {
        let (one, other) = (photograph(1), photograph(2));
        let is_confirmed = |other: &Features, agreeing| resembling(&one, other, |pair| pair.is_confirmed(agreeing));
        assert!(is_confirmed(&one, 21) && !is_confirmed(&one, 20));
        assert!(!is_confirmed(&other, 21) && !is_confirmed(&other, 81));
        let without_features = Features { points: Vec::new(), ..photograph(1) };
        assert!(!is_confirmed(&without_features, 81));
    }

    #[test]
    fn where_no_features_or_no_pictures_are_nothing_is_told() {
        let (one, other) = (photograph(1), photograph(2));
        let without_features = Features { points: Vec::new(), ..photograph(1) };
        assert!(!is_missing(&without_features, &other, 0));
        let without_picture = |features: &Features| Features { surroundings: Raster::default(), ..features.clone() };
        assert!(!is_missing(&without_picture(&one), &other, 0));
        assert!(!is_missing(&one, &without_picture(&other), 0));
    }
}
