//! The lens: how rays before a camera become places on its picture, before focal length and principal point.
//!
//! # Source
//! The rectilinear projection with D. C. Brown's radial and tangential terms ("Decentering distortion of lenses",
//! 1966); the equidistant projection with a polynomial of the angle for fisheyes (J. Kannala and S. S. Brandt, "A
//! generic camera model and calibration method for conventional, wide-angle, and fish-eye lenses", 2006).
//!
//! # Departures
//! A polynomial that bends light back towards the middle is not followed there: from where its slope has fallen to
//! `LEAST_SLOPE`, or at the farthest angle for which the polynomial is taken seriously, the radius grows straight on.
//! So every lens maps rays and places one to one, whatever an estimate of its terms may be on the way.

use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, SMatrix, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Slope of the distorted radius at which it goes straight on; lenses that are sold stay well above.
const LEAST_SLOPE: f64 = 0.2;
/// Farthest undistorted radius of a rectilinear lens up to which its polynomial holds: 80 degrees off the axis.
const FARTHEST_RECTILINEAR: f64 = 5.67;
/// The same of an equidistant one, radians: 120 degrees off the axis, beyond any lens.
const FARTHEST_EQUIDISTANT: f64 = 2.1;
/// Steps in which the radius is looked for where the slope falls too low.
const SLOPE_STEPS: usize = 128;

/// Which angles a lens without distortion keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LensProjection {
    /// Straight lines stay straight: the radius is the tangent of the angle from the axis.
    #[default]
    Rectilinear,
    /// The radius is the angle from the axis, as fisheyes nearly have it.
    Equidistant,
}

/// A lens, in units of the focal length.
///
/// With u the place of a ray by the projection alone and r = |u|, light falls at
/// `u (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y)`, u = (x,
/// y).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "LensTerms", into = "LensTerms")]
pub struct Lens {
    terms: LensTerms,
    /// Radius of u from which on the distorted radius goes straight on.
    limit: f64,
}

/// What a lens is made of; see [`Lens`] for the formula.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct LensTerms {
    /// The projection that the terms bend.
    pub projection: LensProjection,
    /// k1 to k4; negative ones make a barrel.
    #[serde(default)]
    pub radial: [f64; 4],
    /// p1 and p2.
    #[serde(default)]
    pub tangential: [f64; 2],
}

/// A lens before a photograph: what it is made of, and where its axis meets the picture.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PlacedLens {
    /// Projection, radial and tangential terms, in units of the focal length.
    #[serde(flatten)]
    pub terms: LensTerms,
    /// The principal point from the photograph's middle, in pixels of the photograph.
    pub center_px: [f64; 2],
}

impl PlacedLens {
    /// The same lens before the photograph enlarged by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { center_px: self.center_px.map(|part| part * factor), ..*self }
    }

    /// The same lens before the photograph turned clockwise by `quarters` of a turn. What a lens does aside turns with
    /// the picture: its center, and (p2, p1), which is a direction.
    #[must_use]
    pub fn turned(&self, quarters: u8) -> Self {
        let turn = |[x, y]: [f64; 2]| [-y, x];
        (0..quarters % 4).fold(*self, |lens, _| {
            let [p2, p1] = turn([lens.terms.tangential[1], lens.terms.tangential[0]]);
            let terms = LensTerms { tangential: [p1, p2], ..lens.terms };
            Self { terms, center_px: turn(lens.center_px) }
        })
    }
}

impl From<LensTerms> for Lens {
    fn from(terms: LensTerms) -> Self {
        Self::new(terms)
    }
}

impl From<Lens> for LensTerms {
    fn from(lens: Lens) -> Self {
        lens.terms
    }
}

impl Default for Lens {
    fn default() -> Self {
        Self::PINHOLE
    }
}

/// A lens that may be the right one, roughly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriedLens {
    /// What it does.
    pub lens: Lens,
    /// Focal length in longer sides of the photograph.
    pub relative_focal: f64,
}

/// The lenses worth trying where nothing is known: pinholes and barrels of 37 to 103 degrees across, and fisheyes of 72
/// to 220 degrees, each neighbor a few pixels from the next.
pub fn tried_lenses() -> Vec<TriedLens> {
    /// k1 of the rectilinear ones: none, that of a wide lens, that of an action camera.
    const RECTILINEAR_K1: [f64; 3] = [0.0, -0.12, -0.25];
    const RECTILINEAR_FOCAL: [f64; 2] = [0.4, 1.5];
    const EQUIDISTANT_FOCAL: [f64; 2] = [0.26, 0.8];
    const FOCAL_STEP: f64 = 1.15;
    let of = |projection, k1: f64, [shortest, longest]: [f64; 2]| {
        let lens = Lens::new(LensTerms { projection, radial: [k1, 0.0, 0.0, 0.0], tangential: [0.0; 2] });
        // The cast saturates, and the quotient is small.
        let count = ((longest / shortest).ln() / FOCAL_STEP.ln()).ceil() as i32;
        (0..=count).map(move |step| TriedLens { lens, relative_focal: shortest * FOCAL_STEP.powi(step) })
    };
    let rectilinear = RECTILINEAR_K1.iter().flat_map(|&k1| of(LensProjection::Rectilinear, k1, RECTILINEAR_FOCAL));
    rectilinear.chain(of(LensProjection::Equidistant, 0.0, EQUIDISTANT_FOCAL)).collect()
}

/// How the place of a ray moves with the ray and with the lens; see [`Lens::derivatives`].
#[derive(Debug, Clone, Copy)]
pub struct LensDerivatives {
    /// The place itself.
    pub place: Vector2<f64>,
    /// By the ray's three entries.
    pub by_ray: Matrix2x3<f64>,
    /// By k1 to k4.
    pub by_radial: Matrix2x4<f64>,
    /// By p1 and p2.
    pub by_tangential: Matrix2<f64>,
}

impl Lens {
    /// The lens that bends nothing.
    pub const PINHOLE: Self = Self {
        terms: LensTerms { projection: LensProjection::Rectilinear, radial: [0.0; 4], tangential: [0.0; 2] },
        limit: f64::INFINITY,
    };

    /// The lens of these terms; those that are not finite count as 0.
    pub fn new(terms: LensTerms) -> Self {
        let finite = |term: f64| if term.is_finite() { term } else { 0.0 };
        let terms = LensTerms {
            radial: terms.radial.map(finite),
            tangential: terms.tangential.map(finite),
            projection: terms.projection,
        };
        let limit = if terms.radial == [0.0; 4] { f64::INFINITY } else { limit(&terms) };
        Self { terms, limit }
    }

    /// What it is made of.
    pub fn terms(&self) -> LensTerms {
        self.terms
    }

    /// Whether it bends nothing.
    pub fn is_pinhole(&self) -> bool {
        self.terms == Self::PINHOLE.terms
    }

    /// Whether it is a fisheye: an equidistant lens.
    pub fn is_fisheye(&self) -> bool {
        self.terms.projection == LensProjection::Equidistant
    }

    /// Where the light of a ray (x right, y down, z forward, any length) falls; `None` where none of it does: behind a
    /// rectilinear lens, or straight from behind.
    pub fn place(&self, ray: Vector3<f64>) -> Option<Vector2<f64>> {
        self.terms.projection.place(ray).map(|undistorted| self.distorted(undistorted))
    }

    /// The ray whose light falls at a place: of depth 1 for a rectilinear lens, of length 1 for an equidistant one.
    pub fn ray(&self, place: Vector2<f64>) -> Vector3<f64> {
        self.terms.projection.ray(self.undistorted(place))
    }

    /// The place of a ray, and how it moves with ray and lens; `None` as [`Self::place`].
    pub fn derivatives(&self, ray: Vector3<f64>) -> Option<LensDerivatives> {
        let undistorted = self.terms.projection.place(ray)?;
        let [x, y] = undistorted.into();
        let square = undistorted.norm_squared();
        let held = square.min(self.limit * self.limit);
        let powers = [1, 2, 3, 4].map(|power| held.powi(power));
        let (place, by_undistorted) = self.distorted_and_slope(undistorted);
        Some(LensDerivatives {
            place,
            by_ray: by_undistorted * self.terms.projection.by_ray(ray, undistorted),
            by_radial: undistorted * SMatrix::<f64, 1, 4>::from_row_slice(&powers),
            by_tangential: Matrix2::new(2.0 * x * y, square + 2.0 * x * x, square + 2.0 * y * y, 2.0 * x * y),
        })
    }

    /// How the place of a ray moves with the ray's three entries; `None` as [`Self::place`].
    pub fn by_ray(&self, ray: Vector3<f64>) -> Option<Matrix2x3<f64>> {
        let undistorted = self.terms.projection.place(ray)?;
        Some(self.distorted_and_slope(undistorted).1 * self.terms.projection.by_ray(ray, undistorted))
    }

    /// Factor of the radius r by the radial terms, slope and curvature of the distorted radius.
    fn radial(&self, r: f64) -> Radial {
        let inside = Radial::of(&self.terms.radial, r.min(self.limit));
        if r <= self.limit {
            return inside;
        }
        let factor = (inside.factor * self.limit + inside.slope * (r - self.limit)) / r;
        Radial { factor, slope: inside.slope, curvature: 0.0 }
    }

    fn distorted(&self, undistorted: Vector2<f64>) -> Vector2<f64> {
        undistorted * self.radial(undistorted.norm()).factor + self.aside(undistorted)
    }

    /// What the tangential terms add.
    fn aside(&self, undistorted: Vector2<f64>) -> Vector2<f64> {
        let ([x, y], [p1, p2]) = (undistorted.into(), self.terms.tangential);
        let square = undistorted.norm_squared();
        Vector2::new(2.0 * p1 * x * y + p2 * (square + 2.0 * x * x), p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y)
    }

    /// [`Self::distorted`] and its derivative.
    fn distorted_and_slope(&self, undistorted: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let ([x, y], [p1, p2]) = (undistorted.into(), self.terms.tangential);
        let r = undistorted.norm();
        let Radial { factor, slope, .. } = self.radial(r);
        let outward = if r > 0.0 { undistorted / r } else { Vector2::zeros() };
        let radial = Matrix2::identity() * factor + outward * outward.transpose() * (slope - factor);
        let cross = 2.0 * (p1 * x + p2 * y);
        let aside = Matrix2::new(2.0 * p1 * y + 6.0 * p2 * x, cross, cross, 6.0 * p1 * y + 2.0 * p2 * x);
        (undistorted * factor + self.aside(undistorted), radial + aside)
    }

    /// A radius near the one that is distorted to `wanted`: the first terms of the inverse's series, where they change
    /// it by little.
    fn roughly_undistorted(&self, wanted: f64) -> f64 {
        /// Share of the radius.
        const LITTLE: f64 = 0.3;
        let ([k1, k2, k3, _], square) = (self.terms.radial, wanted * wanted);
        let third = 8.0 * k1 * k2 - 12.0 * k1 * k1 * k1 - k3;
        let change = square * (-k1 + square * (3.0 * k1 * k1 - k2 + square * third));
        if change.abs() < LITTLE { wanted * (1.0 + change) } else { wanted }
    }

    /// The inverse of [`Self::distorted`]: first of the radius, by Halley's method, then of the place, by Newton's.
    fn undistorted(&self, place: Vector2<f64>) -> Vector2<f64> {
        const MOST_STEPS: usize = 30;
        // The error after one of Newton's steps is about the square of the step.
        const NEARLY_SETTLED: f64 = 1e-8;
        // After one of Halley's about its cube.
        const NEARLY_SETTLED_RADIUS: f64 = 2e-6;
        /// Where tangential terms move the place by more than that, and are sought from there.
        const ROUGHLY_SETTLED: f64 = 1e-3;
        let wanted = place.norm();
        let is_radial = self.terms.tangential == [0.0; 2];
        if wanted == 0.0 && is_radial || !wanted.is_finite() {
            return place;
        }
        let settled = if is_radial { NEARLY_SETTLED_RADIUS } else { ROUGHLY_SETTLED };
        // The radius grows with a slope of at least LEAST_SLOPE, so that a bracket exists and can be kept.
        let (mut low, mut high, mut r) = (0.0, f64::INFINITY, self.roughly_undistorted(wanted));
        for _ in 0..2 * MOST_STEPS {
            let Radial { factor, slope, curvature } = self.radial(r);
            let excess = r * factor - wanted;
            if excess == 0.0 {
                break;
            }
            if excess > 0.0 {
                high = r
            } else {
                low = r
            }
            let step = r - 2.0 * excess * slope / (2.0 * slope * slope - excess * curvature);
            let inside = step > low && step < high;
            let next = if inside { step } else { 0.5 * (low + high.min(2.0 * low + 1.0)) };
            let is_settled = inside && (next - r).abs() <= settled * (1.0 + r);
            r = next;
            if is_settled {
                break;
            }
        }
        let mut undistorted = if wanted > 0.0 { place * (r / wanted) } else { place };
        if is_radial {
            return undistorted;
        }
        undistorted -= self.aside(undistorted) / self.radial(r).factor;
        for _ in 0..MOST_STEPS {
            let (reached, slope) = self.distorted_and_slope(undistorted);
            let Some(inverse) = slope.try_inverse() else { break };
            let step = inverse * (place - reached);
            undistorted += step;
            if step.norm() <= NEARLY_SETTLED * (1.0 + undistorted.norm()) {
                break;
            }
        }
        undistorted
    }
}

impl LensProjection {
    fn place(self, ray: Vector3<f64>) -> Option<Vector2<f64>> {
        /// Sine of the smallest angle from the plane of a rectilinear lens, or from straight behind.
        const MIN_SINE: f64 = 1e-6;
        let across = ray.xy().norm();
        match self {
            Self::Rectilinear => (ray.z > MIN_SINE * ray.norm()).then(|| ray.xy() / ray.z),
            Self::Equidistant if ray.z > 0.0 && across <= MIN_SINE * ray.z => Some(ray.xy() / ray.z),
            Self::Equidistant => (across > MIN_SINE * ray.norm()).then(|| ray.xy() * (across.atan2(ray.z) / across)),
        }
    }

    fn ray(self, undistorted: Vector2<f64>) -> Vector3<f64> {
        match self {
            Self::Rectilinear => undistorted.push(1.0),
            Self::Equidistant => {
                let angle = undistorted.norm().min(std::f64::consts::PI);
                let share = if angle > 0.0 { angle.sin() / undistorted.norm() } else { 1.0 };
                (undistorted * share).push(angle.cos())
            }
        }
    }

    /// The derivative of [`Self::place`] by the ray, given the place.
    fn by_ray(self, ray: Vector3<f64>, place: Vector2<f64>) -> Matrix2x3<f64> {
        /// Angle from the axis, radians, below which an equidistant lens is a rectilinear one to rounding.
        const SMALL: f64 = 1e-6;
        let across = ray.xy().norm();
        if self == Self::Rectilinear || (ray.z > 0.0 && across < SMALL * ray.z) {
            return Matrix2x3::new(1.0, 0.0, -place.x, 0.0, 1.0, -place.y) / ray.z;
        }
        let outward = ray.xy() / across;
        let square = ray.norm_squared();
        let along = Matrix2::identity() * (place.norm() / across);
        let radially = outward * outward.transpose() * (ray.z / square - place.norm() / across);
        let plane = along + radially;
        let by_depth = outward * (-across / square);
        Matrix2x3::new(plane[(0, 0)], plane[(0, 1)], by_depth.x, plane[(1, 0)], plane[(1, 1)], by_depth.y)
    }

    fn farthest(self) -> f64 {
        match self {
            Self::Rectilinear => FARTHEST_RECTILINEAR,
            Self::Equidistant => FARTHEST_EQUIDISTANT,
        }
    }
}

/// What radial terms make of a radius.
#[derive(Debug, Clone, Copy)]
struct Radial {
    /// Distorted over undistorted radius.
    factor: f64,
    /// Derivative of the distorted by the undistorted radius.
    slope: f64,
    /// Derivative of the slope.
    curvature: f64,
}

impl Radial {
    fn of(terms: &[f64; 4], r: f64) -> Self {
        let square = r * r;
        let [k1, k2, k3, k4] = *terms;
        Self {
            factor: 1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4))),
            slope: 1.0 + square * (3.0 * k1 + square * (5.0 * k2 + square * (7.0 * k3 + square * 9.0 * k4))),
            curvature: r * (6.0 * k1 + square * (20.0 * k2 + square * (42.0 * k3 + square * 72.0 * k4))),
        }
    }
}

/// The radius from which on a lens goes straight on.
fn limit(terms: &LensTerms) -> f64 {
    const HALVINGS: usize = 40;
    let farthest = terms.projection.farthest();
    let falls = |r: f64| Radial::of(&terms.radial, r).slope < LEAST_SLOPE;
    let at = |step: usize| farthest * step as f64 / SLOPE_STEPS as f64;
    let Some(first) = (1..=SLOPE_STEPS).find(|&step| falls(at(step))) else { return farthest };
    let (mut inside, mut outside) = (at(first - 1), at(first));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if falls(middle) { outside = middle } else { inside = middle }
    }
    inside
}

#[cfg(test)]
#[path = "lens_tests.rs"]
mod tests;
