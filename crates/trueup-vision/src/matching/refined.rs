//! Places of matches, more exact than those of features: what surrounds the one is found again around the other.

use std::sync::LazyLock;

use nalgebra::{Matrix2, Vector2};
use trueup_core::matches::PointMatch;
use trueup_core::raster::Raster;

use crate::gray::gray_at;

/// Radius of the window, in pixels of photograph a.
const RADIUS_PX: i32 = 5;
/// Deviation of the window's Gaussian weights, in pixels of photograph a.
const DEVIATION_PX: f64 = 2.5;
/// Farthest that a match moves, in pixels of photograph a; what went farther is something else.
const FARTHEST_PX: f64 = 2.0;
/// Steps at most.
const ROUNDS: usize = 10;
/// A step shorter than this is the last one, in pixels of photograph a.
const CONVERGED_PX: f64 = 0.01;
/// A match keeps its place where the new one is less certain than this, by its standard deviation in pixels of photograph a: of places in cut
/// photographs (four rows of known cameras) those of features err by 0.45 px where that is 0.2, and the new ones by 0.2.
const LARGEST_DEVIATION_PX: f64 = 0.2;

/// Finds what surrounds points of photograph a again in photograph b.
pub(super) struct Refiner<'a> {
    /// The pictures around features of both photographs.
    pub(super) a: &'a Raster<u8>,
    pub(super) b: &'a Raster<u8>,
}

/// Matches that were placed anew.
pub(super) struct Refined {
    /// All of them, in their order.
    pub(super) matches: Vec<PointMatch>,
    /// How many have surroundings in a that were found again in b; the others are where they were.
    pub(super) found_again: usize,
}

impl Refiner<'_> {
    /// The matches, those in b where what surrounds them in a is found again, if that is surer than what features tell. `b_from_a` tells the shape of
    /// the surroundings; where matches lie, these tell better.
    ///
    /// # Source
    /// Gauss-Newton steps on the differences of two windows, with those of the first linearized once: Baker and Matthews, Lucas-Kanade 20 years on,
    /// 2004 (inverse compositional); gain and offset of the light are fitted along.
    pub(super) fn refined(
        &self,
        matches: Vec<PointMatch>,
        b_from_a: impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
    ) -> Refined {
        let mut refined = Refined { matches, found_again: 0 };
        for one in &mut refined.matches {
            if let Some(place) = self.found_again(one, &b_from_a) {
                one.in_b = place.into();
                refined.found_again += 1;
            }
        }
        refined
    }

    fn found_again(
        &self,
        one: &PointMatch,
        b_from_a: &impl Fn(Vector2<f64>) -> Option<Vector2<f64>>,
    ) -> Option<Vector2<f64>> {
        let (in_a, start) = (Vector2::from(one.in_a), Vector2::from(one.in_b));
        let shape = derivative(in_a, b_from_a)?;
        let a_from_b = shape.try_inverse()?;
        let template = Template::of(self.a, in_a)?;
        let mut place = start;
        for _ in 0..ROUNDS {
            let seen = Window::of(self.b, place, &shape)?;
            let difference = template.difference(&seen)?;
            place -= shape * difference.step;
            if (a_from_b * (place - start)).norm() > FARTHEST_PX {
                return None;
            }
            if difference.step.norm() < CONVERGED_PX {
                return (difference.deviation_px <= LARGEST_DEVIATION_PX).then_some(place);
            }
        }
        None
    }
}

/// How a map stretches and turns around a point.
fn derivative(point: Vector2<f64>, map: &impl Fn(Vector2<f64>) -> Option<Vector2<f64>>) -> Option<Matrix2<f64>> {
    let [left, right, above, below] =
        [[-0.5, 0.0], [0.5, 0.0], [0.0, -0.5], [0.0, 0.5]].map(|[x, y]| map(point + Vector2::new(x, y)));
    Some(Matrix2::from_columns(&[right? - left?, below? - above?]))
}

/// A place of the window.
struct WindowPoint {
    /// From its middle, in pixels of photograph a.
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
    let across = -RADIUS_PX..=RADIUS_PX;
    let offsets = across.clone().flat_map(|y| across.clone().map(move |x| Vector2::new(f64::from(x), f64::from(y))));
    let point = |offset: Vector2<f64>| {
        let weight = (-offset.norm_squared() / (2.0 * DEVIATION_PX.powi(2))).exp();
        WindowPoint { offset, weight }
    };
    let all: Vec<WindowPoint> = offsets.filter(|offset| offset.norm() <= f64::from(RADIUS_PX)).map(point).collect();
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
    /// The window around a place of a picture, of this shape; `None` where it reaches out of it.
    fn of(picture: &Raster<u8>, place: Vector2<f64>, shape: &Matrix2<f64>) -> Option<Self> {
        let reach = |axis: usize| f64::from(RADIUS_PX) * shape.row(axis).norm();
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
    /// The least that a pixel's way changes the window, whichever the direction: weighted mean square, gray levels per pixel.
    least_change: f64,
}

/// How a window differs from a template.
struct Difference {
    /// How far it lies from where it is alike, in pixels of photograph a.
    step: Vector2<f64>,
    /// Standard deviation of the step by what is left of the difference.
    deviation_px: f64,
}

impl Template {
    /// `None` at the border, and where nothing tells a place in some direction.
    fn of(picture: &Raster<u8>, place: Vector2<f64>) -> Option<Self> {
        let identity = Matrix2::identity();
        let window = Window::of(picture, place, &identity)?;
        let moved = |x: f64, y: f64| Window::of(picture, place + Vector2::new(x, y), &identity);
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
        let deviation_px = (square / (WINDOW.samples * self.least_change)).sqrt();
        Some(Difference { step: self.inverse * change, deviation_px })
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

    /// Photograph b is turned by 20 degrees, drawn larger by a tenth and exposed otherwise. Matches that are off by up to a pixel come to a 20th.
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
            let found = refiner.refined(vec![one], |point| Some(b_from_a(point))).matches.remove(0);
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
        // An edge tells its place across alone; a flat one, a border and an unknown picture nothing; another scene something else.
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
            assert_eq!(Refiner { a, b }.refined(vec![one], Some).matches, [one]);
        }
        let one = PointMatch { in_a: middle, in_b: [f64::NAN, 3.0] };
        let kept = Refiner { a: &waves, b: &waves }.refined(vec![one], Some).matches.remove(0);
        assert!(kept.in_b[0].is_nan());
        let one = PointMatch { in_a: middle, in_b: middle };
        assert_eq!(Refiner { a: &waves, b: &waves }.refined(vec![one], |_| None).matches, [one]);
    }
}
