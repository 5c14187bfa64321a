//! A family of projections from the plane over Panini's and the cylinder to longitude and latitude.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Which of the family. Verticals are straight in all of them, and upright.
///
/// A direction of longitude l and latitude p (down) lies at x = s sin l and, before heights are compressed, at y = s
/// tan p. Up to `round` = 1, s = (d + 1) / (d + cos l) with d = `round`: Panini's projection of that distance, of which
/// 0 is the plane. Beyond, x = tan(k l) / k and y = tan p cos(k l)^(-1/k) with k = 1 - `round` / 2, which for k = 1/2
/// is Panini's of distance 1 and for k = 0 the cylinder. Then y becomes tan(u atan y) / u with u = `upright`: itself
/// for 1, and for 0, on the cylinder, the latitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// From the plane (0) over Panini's projection (1) to the cylinder (2).
    pub round: f64,
    /// How heights grow: from the sphere's, evenly (0), to the plane's and the cylinder's, as the tangent (1).
    pub upright: f64,
    /// Whether all that is meant of columns and heights is turned by a quarter: horizontals are straight.
    pub turned: bool,
}

impl Default for Fit {
    fn default() -> Self {
        Self { round: 0.0, upright: 1.0, turned: false }
    }
}

/// Sine below which a direction is too near the place where a projection has no end.
pub(super) const NEAREST: f64 = 1e-3;
/// Factors below which the limit of the formulas is meant.
const NONE: f64 = 1e-6;

impl Fit {
    /// The place of a unit direction; `None` where there is none.
    pub(super) fn place(&self, direction: &Vector3<f64>) -> Option<Vector2<f64>> {
        if self.turned {
            return Self { turned: false, ..*self }.place(&direction.yxz()).map(|place| place.yx());
        }
        let level = direction.x.hypot(direction.z);
        if level <= NEAREST {
            return None;
        }
        let longitude = direction.x.atan2(direction.z);
        let column = self.column(longitude)?;
        let tangent = column.scale * direction.y / level;
        let y = match self.upright > NONE {
            true => (self.upright * tangent.atan()).tan() / self.upright,
            false => tangent.atan(),
        };
        Some(Vector2::new(column.x, if self.upright == 1.0 { tangent } else { y }))
    }

    /// Whether the projection shows all longitudes and ends behind the viewer: what lies there on both sides of the
    /// cut, at half a turn, is as far apart on the plane as can be.
    pub(super) fn is_cut_behind(&self) -> bool {
        self.turn_share() < 0.5
    }

    /// The longitude of a direction as the projection counts it.
    pub(super) fn longitude(&self, direction: &Vector3<f64>) -> f64 {
        let across = if self.turned { direction.y } else { direction.x };
        across.atan2(direction.z)
    }

    fn column(&self, longitude: f64) -> Option<Column> {
        let k = self.turn_share();
        if k >= 0.5 {
            let (d, cosine) = (self.round, longitude.cos());
            let depth = d + cosine;
            // Beyond its own cosine the plane folds back.
            let shown = depth > NEAREST && 1.0 + d * cosine > NEAREST;
            let scale = (d + 1.0) / depth;
            return shown.then(|| Column { x: scale * longitude.sin(), scale });
        }
        if k <= NONE {
            return Some(Column { x: longitude, scale: 1.0 });
        }
        let cosine = (k * longitude).cos();
        (cosine > NEAREST).then(|| Column { x: (k * longitude).tan() / k, scale: cosine.powf(-1.0 / k) })
    }

    /// k of the formula beyond Panini's.
    fn turn_share(&self) -> f64 {
        1.0 - self.round / 2.0
    }

    /// The unit direction of a place; `None` if none goes there.
    pub(super) fn direction(&self, place: Vector2<f64>) -> Option<Vector3<f64>> {
        use std::f64::consts::{FRAC_PI_2, PI};
        if self.turned {
            return Self { turned: false, ..*self }.direction(place.yx()).map(|direction| direction.yxz());
        }
        let k = self.turn_share();
        let longitude = match k {
            k if k >= 0.5 => panini_longitude(place.x, self.round)?,
            k if k <= NONE => place.x,
            k => (k * place.x).atan() / k,
        };
        let angle = match self.upright > NONE {
            true => (self.upright * place.y).atan() / self.upright,
            false => place.y,
        };
        let scale = self.column(longitude)?.scale;
        let found = longitude.abs() <= PI && angle.abs() < FRAC_PI_2;
        found.then(|| Vector3::new(longitude.sin(), angle.tan() / scale, longitude.cos()).normalize())
    }
}

/// One longitude on the plane.
struct Column {
    x: f64,
    /// By how much heights are larger than on the cylinder.
    scale: f64,
}

/// The longitude of a place of Panini's projection of distance `d`.
pub(super) fn panini_longitude(x: f64, d: f64) -> Option<f64> {
    let k = (x / (d + 1.0)).powi(2);
    let root = (k * d).powi(2) - (k + 1.0) * (k * d * d - 1.0);
    let cosine = (root.max(0.0).sqrt() - k * d) / (k + 1.0);
    let scale = (d + 1.0) / (d + cosine);
    (root >= 0.0 && scale > 0.0).then(|| (x / scale).atan2(cosine))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    fn toward(longitude: f64, latitude: f64) -> Vector3<f64> {
        Vector3::new(latitude.cos() * longitude.sin(), latitude.sin(), latitude.cos() * longitude.cos())
    }

    /// A turned one does to heights what the others do to widths.
    #[test]
    fn a_turned_one_keeps_horizontals() {
        let fit = Fit { round: 2.0, upright: 1.0, turned: true };
        // A horizontal line in front, one high: y is its elevation wherever it goes, and x its distance over the
        // radius.
        for x in [-0.7, 0.0, 1.3] {
            let place = fit.place(&Vector3::new(x, 1.0, 1.0).normalize()).expect("shown");
            assert!((place - Vector2::new(x / 2_f64.sqrt(), PI / 4.0)).norm() < 1e-12, "{place}");
        }
    }

    proptest! {
        #[test]
        fn directions_come_back(
            round in 0.0..2.0_f64, upright in 0.0..1.0_f64, turned: bool,
            longitude in -1.4..1.4_f64, latitude in -1.3..1.3_f64,
        ) {
            let fit = Fit { round, upright, turned };
            let direction = toward(longitude, latitude);
            if let Some(place) = fit.place(&direction).filter(|place| place.norm() < 50.0) {
                let back = fit.direction(place).expect("on the plane");
                prop_assert!(back.angle(&direction) < 1e-6, "{}", back);
            }
        }

        /// Whatever is high on one vertical stays on it.
        #[test]
        fn verticals_are_straight_and_upright(
            round in 0.0..2.0_f64, upright in 0.0..1.0_f64, longitude in -1.5..1.5_f64, height in -2.0..2.0_f64,
        ) {
            let fit = Fit { round, upright, turned: false };
            let foot = Vector3::new(longitude.sin(), 0.0, longitude.cos());
            let top = (foot + Vector3::new(0.0, height, 0.0)).normalize();
            if let (Some(foot), Some(top)) = (fit.place(&foot), fit.place(&top)) {
                prop_assert!((foot.x - top.x).abs() < 1e-9 * (1.0 + foot.x.abs()));
            }
        }
    }
}
