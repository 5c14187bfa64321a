//! The vertical that segments make probable where no direction of theirs is sure enough to guide.
//!
//! A few edges of a chart on a blank wall, a tower behind trees: too little for a frame of directions, and more than
//! nothing. Every vertical near the expected one is as probable as cameras, gravity and horizon have it, times what the
//! segments are as probable under it: a few of them stand upright, the others lie anyhow. The mean over all verticals
//! errs least; where segments point nowhere in particular it is the expected one.
//!
//! Level segments are not asked: all that lie along one slope err alike, and in nature most do.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Vector3};
use rayon::prelude::*;
use trueup_core::geometry::tangent_basis;

use super::level::CameraLevel;
use crate::vanishing::frame_search::{SEARCH_DEG, cone};
use crate::vanishing::joint::{LineVote, Sight};

/// Share of the segments that stand upright, for all that is known before they are seen. Reasoned; between 0.05 and 0.2
/// the same 62 cut sets without guiding lines lean alike to a tenth.
const UPRIGHT_SHARE: f64 = 0.1;
/// Scale of how far what stands upright leans, degrees.
const LEAN_DEG: f64 = 0.7;
/// The same of how far a segment's ends lie aside, working pixels.
const ENDS_PX: f64 = 0.5;
/// What a segment tells beside others: edges are found in pieces, and again in every photograph that shows them. Of
/// 0.15, 0.2, 0.3 and 0.33 the one under which the truth of ten cut sets with a few upright edges is the most probable.
const INDEPENDENT: f64 = 0.2;
/// Segments that are asked, shared out evenly among the photographs, the longest first.
const MAX_SEGMENTS: usize = 1200;
/// Step between verticals, degrees.
const STEP_DEG: f64 = 1.0;
/// Steps that a step is divided into around verticals that are not improbable, to either side.
const FINER: i32 = 2;
/// A vertical is improbable whose logarithm is so much smaller than that of the most probable one: all of them together
/// hardly count.
const IMPROBABLE: f64 = 12.0;

/// A vertical and how sure it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProbableVertical {
    /// Down in the common frame.
    pub down: Vector3<f64>,
    /// Covariance about its tangents, rad^2.
    pub covariance: Matrix2<f64>,
}

/// The mean of all verticals within [`SEARCH_DEG`] of what is known without lines. `None` without segments.
pub(super) fn probable_vertical(vote: &LineVote, level: &CameraLevel<'_>) -> Option<ProbableVertical> {
    let sights = vote.sights(MAX_SEGMENTS);
    if sights.is_empty() {
        return None;
    }
    let logarithm =
        |down: &Vector3<f64>| INDEPENDENT * log_likelihood(&sights, down) - 0.5 * level.deviations_to(down).powi(2);
    // How probable each vertical is beside the most probable one, as a logarithm.
    let beside_best = |verticals: &[Vector3<f64>]| -> Vec<f64> {
        let logarithms: Vec<f64> = verticals.par_iter().map(logarithm).collect();
        let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        logarithms.into_iter().map(|logarithm| logarithm - most).collect()
    };
    let coarse = cone(&level.down, SEARCH_DEG.to_radians(), STEP_DEG.to_radians());
    let probable = coarse.iter().zip(beside_best(&coarse)).filter(|(_, logarithm)| *logarithm > -IMPROBABLE);
    let fine: Vec<Vector3<f64>> = probable.flat_map(|(down, _)| around(down)).collect();
    let weights: Vec<f64> = beside_best(&fine).into_iter().map(f64::exp).collect();
    let sum: Vector3<f64> = fine.iter().zip(&weights).map(|(down, weight)| down * *weight).sum();
    let down = sum.try_normalize(f64::MIN_POSITIVE)?;
    let basis = tangent_basis(&down);
    let outer = |(one, weight): (&Vector3<f64>, &f64)| {
        let off = basis.tr_mul(one);
        off * off.transpose() * *weight
    };
    let resolution = (STEP_DEG.to_radians() / f64::from(2 * FINER + 1)).powi(2) / 12.0;
    let covariance = fine.iter().zip(&weights).map(outer).sum::<Matrix2<f64>>() / weights.iter().sum::<f64>()
        + Matrix2::identity() * resolution;
    let is_finite = covariance.iter().chain(down.iter()).all(|value| value.is_finite());
    is_finite.then_some(ProbableVertical { down, covariance })
}

/// Verticals that fill the step around one.
fn around(down: &Vector3<f64>) -> impl Iterator<Item = Vector3<f64>> + use<> {
    let (down, basis) = (*down, tangent_basis(down));
    let step = STEP_DEG.to_radians() / f64::from(2 * FINER + 1);
    let aside = move |count: i32| f64::from(count) * step;
    (-FINER..=FINER).flat_map(move |across| {
        (-FINER..=FINER)
            .map(move |along| (down + basis.column(0) * aside(across) + basis.column(1) * aside(along)).normalize())
    })
}

/// The logarithm of how much more probable the segments' leans are if the vertical is `down` than if they lie anyhow.
///
/// The lean is the angle in the picture between a segment and the vertical at its middle, which lies anywhere in half a
/// turn. Of those that stand upright it has Student's t distribution with three degrees of freedom: now and then one
/// leans far.
fn log_likelihood(sights: &[Sight], down: &Vector3<f64>) -> f64 {
    /// Factors of moderate size that a number holds the product of: a logarithm for each would take most of the time.
    const PRODUCTS: usize = 64;
    let ratio = |sight: &Sight| {
        let scale = LEAN_DEG.to_radians().hypot(ENDS_PX / sight.length_px);
        // The square of the lean's sine. Toward the vertical itself everything is upright, and a quotient of zeros is
        // no number: `min` has 1.
        let square = (sight.normal.dot(down).powi(2) / (1.0 - sight.toward.dot(down).powi(2))).min(1.0);
        let density = 2.0 / (PI * scale) / (1.0 + square / (scale * scale)).powi(2);
        1.0 - UPRIGHT_SHARE + UPRIGHT_SHARE * PI * density
    };
    sights.chunks(PRODUCTS).map(|some| some.iter().map(ratio).product::<f64>().ln()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A segment of 100 px straight ahead that leans by so many degrees from y.
    fn sight(lean_deg: f64) -> Sight {
        let (sine, cosine) = lean_deg.to_radians().sin_cos();
        Sight { normal: Vector3::new(cosine, sine, 0.0), toward: Vector3::z(), length_px: 100.0 }
    }

    /// By hand: the scale is the root of (0.7 degrees)^2 + (0.5 / 100)^2, 0.013201. An upright segment is 0.9 + 0.1 x 2
    /// / 0.013201 = 16.05 times as probable, one that leans by 2 degrees 0.9 + 15.15 / (1 + 0.001218 / 0.00017427)^2 =
    /// 1.1374 times, a level one 0.9 times.
    #[test]
    fn a_segment_tells_by_how_far_it_leans() {
        for (lean_deg, expected) in [(0.0, 16.05_f64), (2.0, 1.1374), (90.0, 0.9)] {
            let found = log_likelihood(&[sight(lean_deg)], &Vector3::y());
            assert!((found - expected.ln()).abs() < 1e-3, "{found} of {lean_deg}");
        }
        let many = vec![sight(0.0); 1000];
        assert!(
            (log_likelihood(&many, &Vector3::y()) - 1000.0 * log_likelihood(&many[..1], &Vector3::y())).abs() < 1e-6
        );
        // Toward the zenith all is upright.
        let above = Sight { toward: Vector3::y(), ..sight(90.0) };
        assert!(log_likelihood(&[above], &Vector3::y()).is_finite());
    }

    /// 25 steps of a fifth of a degree that fill one of a degree.
    #[test]
    fn finer_verticals_fill_a_step() {
        let fine: Vec<Vector3<f64>> = around(&Vector3::y()).collect();
        let degrees = |one: &Vector3<f64>| one.angle(&Vector3::y()).to_degrees();
        assert_eq!(fine.len(), 25);
        assert!((fine.iter().map(degrees).fold(0.0, f64::max) - 0.4 * 2_f64.sqrt()).abs() < 1e-4);
        assert_eq!(fine.iter().filter(|one| degrees(one) < 0.01).count(), 1);
    }
}
