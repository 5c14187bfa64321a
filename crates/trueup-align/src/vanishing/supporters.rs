//! Segments that support an axis of a frame, weighed as the things that they are pieces of.
//!
//! The planes of all segments along an axis meet in it. Segments whose planes lie close together about it are pieces of
//! one thing, in however many photographs it is seen: the edges of a door frame, a row of windows, a trunk. They err
//! together, by as much as the thing is out of plumb, so that a thing of fifty pieces tells hardly more than one of
//! ten; and how far they scatter tells what the thing is. Those of a pillar point the same way to the noise of pixels,
//! those of a tree's branches do not, and many of the latter are not to outvote few of the former.
//!
//! # Source
//! Weighted least squares with one-way random effects (Searle, Casella and McCulloch, Variance Components, chapter 3):
//! a piece i of the thing k errs by `m_k + e_i`. Variances of the e are estimated from each thing's own pieces, that of
//! the m is given.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

/// Planes through an axis are of one thing where they lie within this of each other, degrees. From 1.25 to 5 the mean
/// error is the same within 4 %.
const THING_DEG: f64 = 2.5;
/// Standard deviation of a thing's pieces from its direction that is expected, pixels at their ends: where a line is
/// found.
pub(super) const EXPECTED_SCATTER_PX: f64 = 0.5;
/// How many pieces that expectation counts for. From 1 to 10 the mean error is the same within 2 %.
const EXPECTED_COUNT: f64 = 3.0;
/// Standard deviation of a built thing from its axis, and of level axes as wholes, about either axis across, degrees.
/// Reasoned: what is built is plumb and level to a few millimeters in a meter. From 0.1 to 0.3 the mean error is the
/// same within 5 %.
pub(crate) const BUILT_DEVIATION_DEG: f64 = 0.2;
/// A thing that leans by so many of its deviations counts for a quarter (Geman-McClure): it was not built along the
/// axis. With 3 the mean error is up to 3.5 % larger, with 5 up to 1 % smaller.
const LEANING_DEVIATIONS: f64 = 4.0;

/// A segment that supports an axis of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Supporter {
    /// The axis: a column of the frame.
    pub axis: usize,
    /// [`InterpretationPlanes::moments`](super::InterpretationPlanes), in the common frame.
    pub moment: Vector3<f64>,
    /// axis . moment / reach: how far the axis misses the segment's ends, in pixels.
    pub residual_px: f64,
    /// Half the segment's length, pixels: how far its ends are from its middle.
    pub half_length: f64,
    /// The segment's weight times that of the robust loss.
    pub weight: f64,
    /// See [`InterpretationPlanes::reach`](super::InterpretationPlanes).
    pub reach: f64,
}

/// What the pieces of one thing add up to.
#[derive(Debug, Clone, Copy, Default)]
struct Thing {
    count: f64,
    /// Of residuals, px^2.
    squares: f64,
    /// Of half lengths, px^2.
    levers: f64,
    /// Residuals times half lengths, with the sign that the first piece's plane would give them, px^2.
    drift: f64,
}

impl Thing {
    fn add(&mut self, one: &Supporter, sign: f64) {
        self.count += 1.0;
        self.squares += one.residual_px.powi(2);
        self.levers += one.half_length.powi(2);
        self.drift += sign * one.residual_px * one.half_length;
    }

    /// Factor on the weights of its pieces where the axis may be `coarse` times as far off as things are; 0 without
    /// any, as of most classes of a pencil.
    fn factor(&self, coarse: f64) -> f64 {
        if self.count == 0.0 {
            return 0.0;
        }
        let expected = EXPECTED_SCATTER_PX.powi(2);
        let variance = (EXPECTED_COUNT * expected + self.squares) / (EXPECTED_COUNT + self.count);
        // Of the mean direction of its pieces, rad^-2.
        let information = self.levers / variance;
        let plumb = BUILT_DEVIATION_DEG.to_radians().powi(2);
        let lean = self.drift / self.levers;
        let expected_lean = information.recip() + plumb * coarse.powi(2);
        let beyond = lean.powi(2) / (expected_lean * LEANING_DEVIATIONS.powi(2));
        expected / variance / (1.0 + information * plumb) / (1.0 + beyond).powi(2)
    }
}

/// The things along each axis: classes of pencil angles, and the same half a class farther, so that no thing lies on a
/// border of both.
#[derive(Debug)]
struct Things {
    classes: [Vec<Thing>; 2],
    of_each_axis: usize,
}

impl Things {
    fn new() -> Self {
        let of_each_axis = (180.0 / THING_DEG) as usize;
        Self { classes: std::array::from_fn(|_| vec![Thing::default(); 3 * of_each_axis]), of_each_axis }
    }

    /// Where a segment belongs in either set of classes, and the sign of its residual there: planes half a turn about
    /// the axis from each other are the same, with opposite normals.
    fn places(&self, one: &Supporter, frame: &Matrix3<f64>) -> [(usize, f64); 2] {
        let across = one.moment.dot(&frame.column((one.axis + 1) % 3));
        let along = one.moment.dot(&frame.column((one.axis + 2) % 3));
        let angle = across.atan2(along);
        let (angle, sign) = if angle < 0.0 { (angle + PI, -1.0) } else { (angle, 1.0) };
        let place = angle / PI * self.of_each_axis as f64;
        [0.0, 0.5].map(|shift| {
            // The cast saturates; an angle that is not a number is in the first class.
            let class = (place + shift) as usize;
            let is_beyond = class >= self.of_each_axis;
            let class = if is_beyond { 0 } else { class };
            (one.axis * self.of_each_axis + class, if is_beyond { -sign } else { sign })
        })
    }
}

/// Multiplies the weights of all supporters of a frame by what the things are worth that they are pieces of. `coarse`,
/// 1 at the end of a refinement, is how many times as far off the frame may be as things are: as long as it is, what
/// leans is not known.
pub(super) fn weigh_as_things(supporters: &mut [Supporter], frame: &Matrix3<f64>, coarse: f64) {
    let mut things = Things::new();
    let places: Vec<_> = supporters.iter().map(|one| things.places(one, frame)).collect();
    for (one, places) in supporters.iter().zip(&places) {
        for (classes, &(class, sign)) in things.classes.iter_mut().zip(places) {
            classes[class].add(one, sign);
        }
    }
    let factors = things.classes.map(|classes| classes.iter().map(|thing| thing.factor(coarse)).collect::<Vec<_>>());
    for (one, places) in supporters.iter_mut().zip(&places) {
        let both: f64 = factors.iter().zip(places).map(|(factors, &(class, _))| factors[class]).sum();
        one.weight *= 0.5 * both;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A piece of a line at `angle_deg` of the pencil about the first axis of the identity, 100 px long, whose ends the
    /// axis misses by `residual_px`.
    fn piece(angle_deg: f64, residual_px: f64) -> Supporter {
        let (across, along) = angle_deg.to_radians().sin_cos();
        let moment = Vector3::new(0.0, across, along);
        Supporter { axis: 0, moment, residual_px, half_length: 50.0, weight: 1.0, reach: 1.0 }
    }

    fn weights(pieces: &[Supporter], coarse: f64) -> Vec<f64> {
        let mut weighed = pieces.to_vec();
        weigh_as_things(&mut weighed, &Matrix3::identity(), coarse);
        weighed.iter().map(|one| one.weight).collect()
    }

    /// By hand: n pieces that all fit have a variance of 0.75 / (3 + n) px^2 and tell 2500 n (3 + n) / 0.75 rad^-2 of
    /// their direction; with 0.2 degrees, 1.2185e-5 rad^2, all of them together 82070 / (1 + 1 / x), x = 0.040616 n
    /// (3 + n): 45 % of that for five, 96 % for 22.
    #[test]
    fn a_thing_of_many_pieces_tells_no_more_than_how_plumb_it_is() {
        let told = |count: usize| {
            let pieces = vec![piece(40.0, 0.0); count];
            weights(&pieces, 1.0).iter().map(|weight| weight * 2500.0 / 0.25).sum::<f64>()
        };
        for (count, share) in [(5, 0.6190), (22, 0.9571)] {
            let expected = share * 82_070.0;
            assert!((told(count) / expected - 1.0).abs() < 2e-3, "{} of {count}", told(count) / 82_070.0);
        }
    }

    /// Pieces that scatter tell less than as many that point the same way, and a thing that leans as a whole less
    /// again, unless the axis may be as far off. By hand: of ten that fit, the variance is 0.75 / 13 = 0.0577 px^2, and
    /// 0.25 / 0.0577 / (1 + 5.28) = 0.690; of ten that are 2 px off, 40.75 / 13 = 3.135 px^2, and 0.25 / 3.135 / (1 +
    /// 0.0972) = 0.0727. A lean of 0.04 is 0.0016 / 16 / (1 / 7975 + 1.2185e-5) = 0.727 squared scales, and leaves 1 /
    /// 1.727^2 = 0.335; 0.811 where the axis may be eight times as far off.
    #[test]
    fn what_scatters_or_leans_counts_less() {
        let alternating = |one: usize| if one.is_multiple_of(2) { 2.0 } else { -2.0 };
        let [fits, scatters, leans] = [|_| 0.0, alternating, |_| 2.0]
            .map(|residual: fn(usize) -> f64| (0..10).map(|one| piece(40.0, residual(one))).collect::<Vec<_>>());
        let of = |pieces: &[Supporter], coarse: f64| weights(pieces, coarse)[0];
        let near = |value: f64, expected: f64| (value / expected - 1.0).abs() < 0.01;
        assert!(near(of(&fits, 1.0), 0.690) && near(of(&scatters, 1.0), 0.0727));
        assert!(near(of(&leans, 1.0), 0.0727 * 0.335) && near(of(&leans, 8.0), 0.0727 * 0.811));
    }

    /// A thing at the place where the pencil begins again is one thing: planes at 0.1 and 179.9 degrees have opposite
    /// normals, and a lean of one sign in both is none of the thing.
    #[test]
    fn the_pencil_has_no_seam() {
        let around = |middle: f64, signs: [f64; 2]| {
            let pieces: Vec<Supporter> = (0..10)
                .map(|one| {
                    let side = one % 2;
                    let (angle, sign) = if side == 0 {
                        (middle + 0.1, 1.0)
                    } else {
                        ((middle - 0.1).rem_euclid(180.0), if middle < 0.1 { -1.0 } else { 1.0 })
                    };
                    piece(angle, 2.0 * sign * signs[side])
                })
                .collect();
            weights(&pieces, 1.0)[0]
        };
        for signs in [[1.0, 1.0], [1.0, -1.0]] {
            let (seam, inside) = (around(0.0, signs), around(91.25, signs));
            assert!((seam / inside - 1.0).abs() < 0.5, "{seam} {inside}");
        }
        assert!(around(0.0, [1.0, 1.0]) < 0.9 * around(0.0, [1.0, -1.0]));
    }
}
