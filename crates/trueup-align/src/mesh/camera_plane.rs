//! Where the cameras' directions lie on a plane: longitude and latitude.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::geometry::wrap_angle;

use crate::projection::{ParallaxShift, PosedPhotograph};

/// A plane of longitudes and latitudes of the level world on which grids lie.
///
/// Photographs lie in one piece: their longitudes are counted from that of their middle, and may go on beyond half a
/// turn. Around a pole, cells are torn, whose corners lie up to a turn apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraPlane {
    /// Longitude of x = 0 but for `origin`, radians to the right of straight ahead.
    pub yaw: f64,
    /// Units of the plane per radian.
    pub units_per_radian: f64,
    /// Longitude from `yaw` and latitude, downwards, of the plane's (0, 0), radians.
    pub origin: [f64; 2],
}

impl CameraPlane {
    /// The same plane after `(place - origin) * scale`.
    pub fn moved(&self, origin: [f64; 2], scale: f64) -> Self {
        let at = |axis: usize| self.origin[axis] + origin[axis] / self.units_per_radian;
        Self { units_per_radian: self.units_per_radian * scale, origin: [at(0), at(1)], ..*self }
    }

    /// Whether it is a plane at all, however it was read.
    pub fn is_sound(&self) -> bool {
        let numbers = [self.yaw, self.units_per_radian, self.origin[0], self.origin[1]];
        numbers.iter().all(|number| number.is_finite()) && self.units_per_radian > 0.0
    }

    /// The place of a direction of any length, its longitude within half a turn of `middle`, a longitude from `yaw`.
    pub(super) fn place(&self, direction: Vector3<f64>, middle: f64) -> Vector2<f64> {
        let longitude = middle + wrap_angle(direction.x.atan2(direction.z) - self.yaw - middle);
        let latitude = direction.y.atan2(direction.x.hypot(direction.z));
        (Vector2::new(longitude, latitude) - Vector2::from(self.origin)) * self.units_per_radian
    }

    /// The unit direction of a place.
    pub fn direction(&self, place: Vector2<f64>) -> Vector3<f64> {
        let angles = place / self.units_per_radian + Vector2::from(self.origin);
        let (longitude, latitude) = (angles.x + self.yaw, angles.y);
        Vector3::new(latitude.cos() * longitude.sin(), latitude.sin(), latitude.cos() * longitude.cos())
    }

    /// How far each vertex of a photograph whose grid lies on this plane looks aside.
    pub fn shift(&self, photograph: &PosedPhotograph) -> ParallaxShift {
        let PosedPhotograph { camera, mesh } = photograph;
        let aside = (0..mesh.len()).map(|vertex| {
            let drawn = self.direction(Vector2::from(mesh.target[vertex]));
            let seen = camera.project(camera.rotation() * drawn);
            seen.map_or(Vector2::zeros(), |seen| seen - mesh.source(vertex))
        });
        ParallaxShift { aside: aside.collect() }
    }
}
