//! Places of matches, more exact than those of features, and whether matches can be believed: what surrounds the one is
//! found again around the other.

use std::sync::LazyLock;

use nalgebra::{Matrix2, Vector2};
use trueup_core::matches::PointMatch;
use trueup_core::raster::Raster;

use crate::gray::gray_at;

/// Radius of the window, in samples; those of the finest windows are pixels of photograph a.
const RADIUS: i32 = 5;
/// Deviation of the window's Gaussian weights, in samples.
const DEVIATION: f64 = 2.5;
/// Farthest that a match moves, in samples; what went farther is something else.
const FARTHEST: f64 = 2.0;
/// Steps at most.
const ROUNDS: usize = 10;
/// A step shorter than this is the last one, in samples.
const CONVERGED: f64 = 0.01;
/// A match keeps its place where the new one is less certain than this, by its standard deviation in samples: of places
/// in cut photographs (four rows of known cameras) those of features err by 0.45 px where that is 0.2, and the new ones
/// by 0.2.
const LARGEST_DEVIATION: f64 = 0.2;
/// Distance of the samples by which a match is confirmed, in scales of its feature: what told a large feature is not in
/// the finest window.
const SPACING_PER_SCALE: f64 = 0.5;

/// A match and how large its feature in photograph a is.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScaledMatch {
    pub(super) at: PointMatch,
    /// The feature's scale, in pixels of photograph a.
    pub(super) scale_px: f64,
}

/// Finds what surrounds points of photograph a again in photograph b.
pub(super) struct Refiner<'a> {
    /// The pictures around features of both photographs.
    pub(super) a: &'a Raster<u8>,
    pub(super) b: &'a Raster<u8>,
}

impl Refiner<'_> {
    /// The matches, those in b where what surrounds them in a is found again, if that is surer than what features tell.
    /// `b_from_a` tells the shape of the surroundings; where matches lie, these tell better.
    ///
    /// # Source
    /// Gauss-Newton steps on the differences of two windows, with those of the first linearized once: Baker and
    /// Matthews, Lucas-Kanade 20 years on, 2004 (inverse compositional); gain and offset of the light are fitted along.
    pub(super) fn refined(
        &self,
        mut matches: Vec<PointMatch>,
        b_from_a: impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
    ) -> Vec<PointMatch> {
        for one in &mut matches {
            if let Some(place) = self.found_again(one, 1.0, &b_from_a) {
                one.in_b = place.into();
            }
        }
        matches
    }

    /// How many of the matches have surroundings in a, as wide as their features are large, that are found again in b.
    pub(super) fn confirmed(
        &self,
        matches: &[ScaledMatch],
        b_from_a: impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
    ) -> usize {
        let spacing_px = |one: &ScaledMatch| (SPACING_PER_SCALE * one.scale_px).max(1.0);
        matches.iter().filter(|one| self.found_again(&one.at, spacing_px(one), &b_from_a).is_some()).count()
    }

    /// Whether the pictures of both photographs are known.
    pub(super) fn sees(&self) -> bool {
        [self.a, self.b].iter().all(|picture| !picture.data().is_empty())
    }

    /// Where in b a window of samples `spacing_px` apart around the match in a is found again.
    fn found_again(
        &self,
        one: &PointMatch,
        spacing_px: f64,
        b_from_a: &impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
    ) -> Option<Vector2<f64>> {
        let (in_a, start) = (Vector2::from(one.in_a), Vector2::from(one.in_b));
        let shape = derivative(in_a, b_from_a)? * spacing_px;
        let a_from_b = shape.try_inverse()?;
        let template = Template::of(self.a, in_a, spacing_px)?;
        let mut place = start;
        for _ in 0..ROUNDS {
            let seen = Window::of(self.b, place, &shape)?;
            let difference = template.difference(&seen)?;
            place -= shape * difference.step;
            if (a_from_b * (place - start)).norm() > FARTHEST {
                return None;
            }
            if difference.step.norm() < CONVERGED {
                return (difference.deviation <= LARGEST_DEVIATION).then_some(place);
            }
        }
        None
    }
}

/// How a map stretches and turns around a point.
pub(super) fn derivative(
    point: Vector2<f64>,
    map: &impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
) -> Option<Matrix2<f64>> {
    let [left, right, above, below] =
        [[-0.5, 0.0], [0.5, 0.0], [0.0, -0.5], [0.0, 0.5]].map(|[x, y]| map(point + Vector2::new(x, y)));
    Some(Matrix2::from_columns(&[right? - left?, below? - above?]))
}

/// A place of the window.
struct WindowPoint {
    /// From its middle, in samples.
    offset: Vector2<f64>,
    weight: f64,
}

/// The places of a window.
struct WindowPoints {
    /// Their weights come to 1.
    points: Vec<WindowPoint>,
    /// How many samples they are worth: what weights come to of which the largest is 1.
    samples: f64,
}

static WINDOW: LazyLock<WindowPoints> = LazyLock::new(|| {
    let across = -RADIUS..=RADIUS;
    let offsets = across.clone().flat_map(|y| across.clone().map(move |x| Vector2::new(f64::from(x), f64::from(y))));
    let point = |offset: Vector2<f64>| {
        let weight = (-offset.norm_squared() / (2.0 * DEVIATION.powi(2))).exp();
        WindowPoint { offset, weight }
    };
    let all: Vec<WindowPoint> = offsets.filter(|offset| offset.norm() <= f64::from(RADIUS)).map(point).collect();
    let samples: f64 = all.iter().map(|point| point.weight).sum();
    let points = all.into_iter().map(|point| WindowPoint { weight: point.weight / samples, ..point }).collect();
    WindowPoints { points, samples }
});

/// The values of a window, without their weighted mean.
struct Window {
    values: Vec<f64>,
    /// Weighted mean square.
    contrast: f64,
}

impl Window {
    /// The window around a place of a picture, each sample of which comes to `shape` there; `None` where it reaches out
    /// of it.
    fn of(picture: &Raster<u8>, place: Vector2<f64>, shape: &Matrix2<f64>) -> Option<Self> {
        let reach = |axis: usize| f64::from(RADIUS) * shape.row(axis).norm();
        let length = [picture.width(), picture.height()];
        // A comparison with NaN is false.
        let is_inside =
            |axis: usize| place[axis] - reach(axis) >= 0.5 && place[axis] + reach(axis) < length[axis] as f64 - 0.5;
        if !(is_inside(0) && is_inside(1)) {
            return None;
        }
        let points = &WINDOW.points;
        let mut values = Vec::with_capacity(points.len());
        for point in points {
            values.push(gray_at(picture, place + shape * point.offset)?);
        }
        let mean: f64 = values.iter().zip(points).map(|(value, point)| point.weight * value).sum();
        values.iter_mut().for_each(|value| *value -= mean);
        let contrast = values.iter().zip(points).map(|(value, point)| point.weight * value * value).sum();
        Some(Self { values, contrast })
    }

    fn product(&self, other: &Self) -> f64 {
        let both = self.values.iter().zip(&other.values).zip(WINDOW.points.iter());
        both.map(|((one, other), point)| point.weight * one * other).sum()
    }
}

/// The window in photograph a, and how it changes where it moves.
struct Template {
    window: Window,
    gradients: Vec<Vector2<f64>>,
    /// The inverse of the weighted sum of gradients times themselves.
    inverse: Matrix2<f64>,
    /// The least that a sample's way changes the window, whichever the direction: weighted mean square, gray levels per
    /// sample.
    least_change: f64,
}

/// How a window differs from a template.
struct Difference {
    /// How far it lies from where it is alike, in samples.
    step: Vector2<f64>,
    /// Standard deviation of the step by what is left of the difference.
    deviation: f64,
}

impl Template {
    /// Of samples `spacing_px` apart. `None` at the border, and where nothing tells a place in some direction.
    fn of(picture: &Raster<u8>, place: Vector2<f64>, spacing_px: f64) -> Option<Self> {
        let shape = Matrix2::from_diagonal_element(spacing_px);
        let window = Window::of(picture, place, &shape)?;
        let moved = |x: f64, y: f64| Window::of(picture, place + Vector2::new(x, y) * spacing_px, &shape);
        let [left, right, above, below] = [moved(-1.0, 0.0)?, moved(1.0, 0.0)?, moved(0.0, -1.0)?, moved(0.0, 1.0)?];
        let half = |one: f64, other: f64| (one - other) / 2.0;
        let gradients: Vec<Vector2<f64>> = (0..WINDOW.points.len())
            .map(|k| Vector2::new(half(right.values[k], left.values[k]), half(below.values[k], above.values[k])))
            .collect();
        let products =
            gradients.iter().zip(WINDOW.points.iter()).map(|(way, point)| point.weight * way * way.transpose());
        let sum: Matrix2<f64> = products.sum();
        let least_change = sum.symmetric_eigenvalues().min();
        Some(Self { window, gradients, inverse: sum.try_inverse()?, least_change })
    }

    /// `None` for a window that shows nothing alike.
    fn difference(&self, seen: &Window) -> Option<Difference> {
        let gain = self.window.product(seen) / seen.contrast;
        if gain.is_nan() || gain <= 0.0 {
            return None;
        }
        let (mut change, mut square) = (Vector2::zeros(), 0.0);
        let values = seen.values.iter().zip(&self.window.values);
        for ((point, gradient), (seen, own)) in WINDOW.points.iter().zip(&self.gradients).zip(values) {
            let left = gain * seen - own;
            change += point.weight * left * gradient;
            square += point.weight * left * left;
        }
        let deviation = (square / (WINDOW.samples * self.least_change)).sqrt();
        Some(Difference { step: self.inverse * change, deviation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of waves that are not alike along any way shorter than the window's reach, of a scene's places.
    fn picture(light: impl Fn(f64) -> f64, scene_from_picture: impl Fn(Vector2<f64>) -> Vector2<f64>) -> Raster<u8> {
        let (width, height) = (60, 50);
        let value = |k: usize| {
            let place = scene_from_picture(Vector2::new((k % width) as f64 + 0.5, (k / width) as f64 + 0.5));
            let waves = (0.7 * place.x + 0.2 * place.y).sin()
                + (0.4 * place.x - 0.8 * place.y).sin()
                + (0.13 * place.x * place.y / 9.0).sin();
            light(100.0 + 25.0 * waves).round() as u8
        };
        Raster::from_data(width, height, 1, (0..width * height).map(value).collect()).expect("as many")
    }

    /// Photograph b is turned by 20 degrees, drawn larger by a tenth and exposed otherwise. Matches that are off by up
    /// to a pixel come to a 20th.
    #[test]
    fn a_match_is_found_where_it_is_whatever_the_turn_and_the_light() {
        let turn = nalgebra::Rotation2::new(20_f64.to_radians());
        let b_from_a = |point: Vector2<f64>| turn * (point - Vector2::new(30.0, 25.0)) * 1.1 + Vector2::new(30.3, 24.6);
        let a_from_b =
            |point: Vector2<f64>| turn.inverse() * (point - Vector2::new(30.3, 24.6)) / 1.1 + Vector2::new(30.0, 25.0);
        let (a, b) = (picture(|level| level, |place| place), picture(|level| 0.7 * level + 20.0, a_from_b));
        let refiner = Refiner { a: &a, b: &b };
        let mut moved = 0;
        for k in 0..20 {
            let in_a = Vector2::new(20.3 + f64::from(k), 18.7 + f64::from(7 * k % 13));
            let off = Vector2::new(f64::from(k % 5) - 2.0, f64::from(k % 3) - 1.0) * 0.45;
            let truth = b_from_a(in_a);
            let one = PointMatch { in_a: in_a.into(), in_b: (truth + off).into() };
            let found = refiner.refined(vec![one], |point| Some(b_from_a(point))).remove(0);
            assert_eq!(found.in_a, one.in_a);
            if found != one {
                moved += 1;
                assert!((Vector2::from(found.in_b) - truth).norm() < 0.05, "{k}: {found:?}, {truth}");
            }
        }
        assert!(moved >= 16, "{moved}");
    }

    #[test]
    fn where_nothing_tells_a_place_a_match_stays() {
        let waves = picture(|level| level, |place| place);
        // An edge tells its place across alone; a flat one, a border and an unknown picture nothing; another scene
        // something else.
        let edge = picture(|level| level, |place| Vector2::new(place.x, 0.0));
        let flat = picture(|_| 90.0, |place| place);
        let other = picture(|level| level, |place| Vector2::new(2.3 * place.y + 400.0, 1.7 * place.x));
        let middle = [30.2, 25.1];
        let nothing = Raster::default();
        for (a, b, in_a) in [
            (&edge, &edge, middle),
            (&flat, &flat, middle),
            (&flat, &waves, middle),
            (&waves, &flat, middle),
            (&waves, &waves, [3.0, 25.0]),
            (&nothing, &nothing, middle),
            (&waves, &other, middle),
        ] {
            let one = PointMatch { in_a, in_b: [in_a[0] + 0.6, in_a[1] - 0.3] };
            assert_eq!(Refiner { a, b }.refined(vec![one], Some), [one]);
        }
        let one = PointMatch { in_a: middle, in_b: [f64::NAN, 3.0] };
        let kept = Refiner { a: &waves, b: &waves }.refined(vec![one], Some).remove(0);
        assert!(kept.in_b[0].is_nan());
        let one = PointMatch { in_a: middle, in_b: middle };
        assert_eq!(Refiner { a: &waves, b: &waves }.refined(vec![one], |_| None), [one]);
    }
}
