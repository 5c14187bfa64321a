//! The view that suits: the straightest of a family of projections that stretches nothing beyond a limit.
//!
//! # Source
//! R. Carroll, M. Agrawala and A. Agarwala, "Optimizing content-preserving projections for wide-angle images" (2009):
//! what people want of a wide view is that lines stay straight and shapes are kept, which no projection does, and that
//! the compromise changes smoothly. Theirs is a mesh for every picture, under lines that the user marks; ours is the
//! one of [`Flat`]'s family in which verticals are always straight that bends the others least within a limit on
//! shapes, so that nothing has to be marked and one more photograph changes the view a little, not its kind. T. K.
//! Sharpless, B. Postle and D. M. German, "Pannini: a new projection for rendering wide angle perspective images"
//! (2010): the family's middle.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use super::coverage::samples;
use super::fitted::Fit;
use super::flat::Flat;
use super::photograph::PosedPhotograph;

/// How much longer than wide, or wider than long, something may be drawn: what a wide lens does to faces 48 degrees
/// from its middle, which people accept at the sides of a picture of about 95 degrees and not beyond.
const LARGEST_RATIO: f64 = 1.5;
/// How much larger than in the middle something may be drawn, as a length: what a plane does where it has that ratio,
/// the ratio to the power of 3/2.
const LARGEST_SIZE: f64 = 1.84;
/// How much more of both than on the cylinder, where these are larger already: far up and down. Sizes again to 3/2.
const MORE_RATIO: f64 = 1.2;
const MORE_SIZE: f64 = 1.31;
/// Share of the photographs' pixels that may be stretched beyond these: corners.
const BEYOND: f64 = 0.03;
/// Sizes beyond which a view by itself shows nothing more: as for the named projections, about three times the
/// middle's.
const SHOWN_SIZE: f64 = 3.0;
/// How much longer than wide a view by itself shows anything: beside a pole, 75 degrees up and more, what is drawn on a
/// cylinder becomes streaks.
const SHOWN_RATIO: f64 = 4.0;
/// Half angles, radians (80 and 180 degrees), between which sizes have to grow more and more even: what lies behind the
/// viewer is not the side of a view, and a turn whose ends meet must be even.
const EVENING: [f64; 2] = [1.396, PI];
/// Half angles, radians (120 and 180 degrees), between which heights go over to those of the sphere, which full turns
/// have.
const ROUNDING: [f64; 2] = [2.094, PI];
/// Pixels looked at along each side of a photograph.
const SAMPLES: usize = 17;
/// Directions whose stretch one task looks at.
const PER_TASK: usize = 256;
/// Steps of the search along the family.
const STEPS: usize = 100;

/// What the photographs show, as directions of the viewer.
pub(super) struct Seen {
    directions: Vec<Vector3<f64>>,
}

impl Seen {
    /// Evenly spread pixels of all photographs that lie within `half_width` radians of the middle.
    pub(super) fn of(photographs: &[PosedPhotograph], view_from_level: &Matrix3<f64>, half_width: f64) -> Self {
        let directions = photographs
            .iter()
            .flat_map(|photograph| samples(photograph, SAMPLES).map(|pixel| photograph.camera.world_direction(pixel)))
            .map(|direction| view_from_level * direction)
            .filter(|direction| direction.x.atan2(direction.z).abs() <= half_width);
        Self { directions: directions.collect() }
    }

    /// The same seen by a viewer who lies on the side: right is down.
    pub(super) fn turned(&self) -> Self {
        Self { directions: self.directions.iter().map(|direction| direction.yxz()).collect() }
    }

    /// The angle that all but a share of the pixels keep within.
    fn within(&self, angle: impl Fn(&Vector3<f64>) -> f64) -> f64 {
        quantile(self.directions.iter().map(|direction| angle(direction).abs()).collect())
    }

    /// Half of the horizontal angle.
    pub(super) fn half_width(&self) -> f64 {
        self.within(|direction| direction.x.atan2(direction.z))
    }

    /// The angle from the horizon.
    pub(super) fn height(&self) -> f64 {
        self.within(|direction| direction.y.atan2(direction.x.hypot(direction.z)))
    }

    /// The lowest and the highest elevation but for corners, upwards from straight ahead, over the zenith too.
    pub(super) fn elevations(&self) -> [f64; 2] {
        let elevations = || self.directions.iter().map(|direction| (-direction.y).atan2(direction.z));
        let high = quantile(elevations().collect());
        let low = -quantile(elevations().map(|elevation| -elevation).collect());
        [low, high]
    }

    /// The straightest of the family that keeps the limits; where none does, the straightest of those that exceed them
    /// least.
    pub(super) fn fit(&self) -> Fit {
        let half = self.half_width();
        let upright = upright_height(self.height()) * (1.0 - smooth(half, ROUNDING));
        let fit = |step: f64| Fit { round: 2.0 * step / STEPS as f64, upright, turned: false };
        let limits = self.limits(&Flat::fitted(fit(STEPS as f64)), 1.0 - smooth(half, EVENING));
        // From straight to round, no further than to the first that keeps the limits.
        let mut excess = Vec::new();
        for step in 0..=STEPS {
            excess.push(self.excess(&Flat::fitted(fit(step as f64)), &limits));
            if excess[step] <= 1.0 {
                break;
            }
        }
        let limit = excess.iter().copied().fold(f64::INFINITY, f64::min).max(1.0);
        let Some(first) = excess.iter().position(|&one| one <= limit).filter(|&first| first > 0) else {
            return fit(0.0);
        };
        // Where the limit is crossed between two steps, so that the view changes as smoothly as what is seen.
        let (before, after) = (excess[first - 1], excess[first]);
        let share = if before.is_finite() { (before - limit) / (before - after) } else { 1.0 };
        fit((first - 1) as f64 + share)
    }

    /// What each direction may be stretched to: all, or more than the family's `cylinder` does to its height, where
    /// that is more. With a `share` of it only: 1 for views, 0 for turns, which are to be as even as the cylinder.
    fn limits(&self, cylinder: &Flat, share: f64) -> Vec<Stretch> {
        let part = |limit: f64| 1.0 + (limit - 1.0) * share;
        let limits = self.directions.par_iter().with_min_len(PER_TASK).map(|direction| {
            let ahead = Vector3::new(0.0, direction.y, direction.x.hypot(direction.z));
            let by_height = stretch(cylinder, &ahead).unwrap_or(Stretch { ratio: 1.0, size: 1.0 });
            Stretch {
                ratio: part(LARGEST_RATIO).max(by_height.ratio * part(MORE_RATIO)),
                size: part(LARGEST_SIZE).max(by_height.size * part(MORE_SIZE)),
            }
        });
        limits.collect()
    }

    /// By which factor the limits are exceeded by what is stretched most; infinite where it cannot be drawn.
    fn excess(&self, flat: &Flat, limits: &[Stretch]) -> f64 {
        let seen = self.directions.par_iter().with_min_len(PER_TASK).zip(limits).map(|(direction, limit)| {
            stretch(flat, direction)
                .map_or(f64::INFINITY, |stretch| (stretch.ratio / limit.ratio).max(stretch.size / limit.size))
        });
        quantile(seen.collect())
    }

    /// The smallest and largest coordinates on the plane of what is not stretched too much to be shown.
    pub(super) fn window(&self, flat: &Flat) -> Option<[[f64; 2]; 2]> {
        /// Beyond the samples, as a share of the window: what lies between them, bulging.
        const ASIDE: f64 = 0.02;
        let places = self.directions.iter().filter_map(|direction| {
            let shown = stretch(flat, direction)
                .is_some_and(|stretch| stretch.size <= SHOWN_SIZE && stretch.ratio <= SHOWN_RATIO);
            flat.place(*direction).filter(|_| shown)
        });
        let (low, high) = places.fold(None, |all: Option<(Vector2<f64>, Vector2<f64>)>, place| {
            Some(all.map_or((place, place), |(low, high)| (low.inf(&place), high.sup(&place))))
        })?;
        let aside = ASIDE * (high - low);
        Some([(low - aside).into(), (high + aside).into()])
    }
}

/// How something is drawn.
struct Stretch {
    /// Its longer side over its shorter one, at least 1, if it is round.
    ratio: f64,
    /// Its size relative to the middle's, as a length.
    size: f64,
}

/// What a projection does around a direction; `None` where it has no place.
fn stretch(flat: &Flat, direction: &Vector3<f64>) -> Option<Stretch> {
    /// Radians.
    const STEP: f64 = 1e-4;
    let aside = if direction.y.abs() < 0.9 { Vector3::y() } else { Vector3::x() };
    let right = aside.cross(direction).try_normalize(f64::MIN_POSITIVE)?;
    let along = |axis: Vector3<f64>| {
        let [from, to] = [-STEP, STEP].map(|step| flat.place(direction + axis * step));
        Some((to? - from?) / (2.0 * STEP))
    };
    let derivative = Matrix2::from_columns(&[along(right)?, along(direction.cross(&right))?]);
    let values = derivative.singular_values();
    let ratio = values.max() / values.min();
    let size = values.product().sqrt();
    (ratio.is_finite() && size.is_finite()).then_some(Stretch { ratio, size })
}

/// What all but [`BEYOND`] of the values do not exceed; infinite without any.
fn quantile(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    // The cast saturates.
    values.get(((1.0 - BEYOND) * last as f64).round() as usize).copied().unwrap_or(f64::INFINITY)
}

/// Which share of latitudes the tangent is taken of, see [`super::fitted::Fit`], so that in the middle column what lies
/// `height` radians from the horizon keeps the limits: 1, a plane's and a cylinder's heights, up to 48 degrees, 0, the
/// sphere's own, from 73 degrees on, where widths alone are too large.
fn upright_height(height: f64) -> f64 {
    let wider = 1.0 / height.min(FRAC_PI_2).cos().max(f64::MIN_POSITIVE);
    let stretched = (LARGEST_SIZE.powi(2) / wider).min(LARGEST_RATIO * wider);
    if stretched <= 1.0 {
        return 0.0;
    }
    ((1.0 / stretched.sqrt()).acos() / height.max(f64::MIN_POSITIVE)).min(1.0)
}

/// 0 below the first value, 1 above the second, smooth between.
pub(crate) fn smooth(value: f64, [from, to]: [f64; 2]) -> f64 {
    let share = ((value - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
