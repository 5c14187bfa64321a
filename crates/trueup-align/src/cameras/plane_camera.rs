//! A camera that looks at a plane from a place of its own.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::geometry::{roll_from_down, rotation_about_z};

/// A camera before the plane z = 0: x to the right on it, y down, z away from the photographer.
///
/// Where it stands is told by where its optical axis meets the plane, and from how far: a photograph that is turned
/// about that point keeps its middle, and one taken straight on from farther away by a longer lens is the same.
///
/// # Source
/// Hartley and Zisserman, Multiple View Geometry, section 8.1.1: `image_from_plane = K [r1 r2 t]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlaneCamera {
    /// Focal length, lens and the rotation from the plane's frame to the camera.
    pub camera: Camera,
    /// Where the optical axis meets the plane, in its units.
    pub axis_point: [f64; 2],
    /// How far that is from the camera along the axis, in the plane's units; positive.
    pub distance: f64,
}

impl PlaneCamera {
    /// Smallest cosine of the angle between a ray and the plane's normal at which the ray is believed to meet the
    /// plane: 84 degrees.
    const GRAZING: f64 = 0.1;

    /// The place on the plane, from the camera, in the camera's frame.
    pub(super) fn seen(&self, place: Vector2<f64>) -> Vector3<f64> {
        let from_axis = place - Vector2::from(self.axis_point);
        self.camera.rotation() * from_axis.push(0.0) + Vector3::new(0.0, 0.0, self.distance)
    }

    /// The pixel of a place on the plane; `None` behind the camera.
    pub fn pixel(&self, place: Vector2<f64>) -> Option<Vector2<f64>> {
        self.camera.project(self.seen(place))
    }

    /// The place on the plane that a pixel shows; `None` where it looks past the plane, or along it.
    pub fn place(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        let plane_from_camera = self.camera.rotation().transpose();
        let ray = plane_from_camera * self.camera.bearing(pixel);
        let axis = plane_from_camera.column(2);
        if ray.z < Self::GRAZING * ray.norm() || axis.z <= 0.0 {
            return None;
        }
        let along_ray = self.distance * axis.z / ray.z;
        Some(Vector2::from(self.axis_point) + ray.xy() * along_ray - axis.xy() * self.distance)
    }

    /// Where the pixel of this camera appears in `other`, as both see the plane.
    pub fn transfer(&self, other: &Self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        other.pixel(self.place(pixel)?)
    }

    /// How the pixel of a place moves with the place.
    pub(super) fn pixel_by_place(&self, by_bearing: &Matrix2x3<f64>) -> Matrix2<f64> {
        by_bearing * self.camera.rotation().fixed_columns::<2>(0)
    }

    /// Where the camera stands, in the plane's units: before the plane, so that z is negative.
    pub fn center(&self) -> Vector3<f64> {
        Vector2::from(self.axis_point).push(0.0) - self.camera.forward() * self.distance
    }

    /// Pixels per unit of the plane along the optical axis, were the camera straight before it.
    pub fn pixels_per_unit(&self) -> f64 {
        self.camera.focal_px / self.distance
    }

    /// Angle between the optical axis and the plane's normal, radians.
    pub fn tilt(&self) -> f64 {
        self.camera.forward().z.clamp(-1.0, 1.0).acos()
    }

    /// Clockwise turn in radians that stands the photograph's own up and down along the plane's.
    pub fn roll(&self) -> f64 {
        roll_from_down(&self.camera.rotation().column(1).into_owned())
    }

    /// The same camera before the plane turned clockwise, as it is seen, by `angle` radians about its origin.
    #[must_use]
    pub fn turned(&self, angle: f64) -> Self {
        let turned_from_plane: Matrix3<f64> = rotation_about_z(angle);
        let mut camera = self.camera;
        camera.set_rotation(&(self.camera.rotation() * turned_from_plane.transpose()));
        let axis_point = turned_from_plane * Vector2::from(self.axis_point).push(0.0);
        Self { camera, axis_point: [axis_point.x, axis_point.y], ..*self }
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y};

    use super::*;

    /// Focal length 1000 px, straight before the plane at a distance of 500 units: two pixels a unit.
    fn straight() -> PlaneCamera {
        let camera = Camera::new(1000.0, 800.0, 600.0, &Matrix3::identity());
        PlaneCamera { camera, axis_point: [70.0, -20.0], distance: 500.0 }
    }

    #[test]
    fn straight_before_the_plane_a_photograph_is_a_scaled_copy() {
        let place = straight().place(Vector2::new(500.0, 300.0)).expect("in front");
        assert!((place - Vector2::new(120.0, -20.0)).norm() < 1e-9);
        assert!((straight().pixel(place).expect("in front") - Vector2::new(500.0, 300.0)).norm() < 1e-9);
        assert!((straight().pixels_per_unit() - 2.0).abs() < 1e-12);
    }

    /// Turned by atan(3/4) about the vertical, its axis is 4/5 of its length before the plane: 400 units away, 300
    /// aside. Straight ahead of the camera's own place, 3/4 of the focal length from the middle, is that foot.
    #[test]
    fn a_tilted_camera_sees_its_own_foot_where_its_tilt_says() {
        let world_from_camera = rotation_about_y((0.75_f64).atan());
        let mut tilted = straight();
        tilted.camera.set_rotation(&world_from_camera.transpose());
        let foot = tilted.pixel(Vector2::new(70.0 - 300.0, -20.0)).expect("in front");
        assert!((foot - Vector2::new(400.0 - 750.0, 300.0)).norm() < 1e-9, "{foot}");
        assert!((tilted.center() - Vector3::new(-230.0, -20.0, -400.0)).norm() < 1e-9, "{}", tilted.center());
        assert!((tilted.tilt() - (0.75_f64).atan()).abs() < 1e-12);
        assert!(tilted.place(Vector2::new(400.0 + 1000.0 / 0.75, 300.0)).is_none(), "looks along the plane");
    }

    #[test]
    fn what_one_camera_sees_the_other_sees_where_the_plane_shows_it() {
        let mut other = PlaneCamera { axis_point: [10.0, 40.0], distance: 700.0, ..straight() };
        other.camera.set_rotation(&(rotation_about_x(0.2) * rotation_about_y(-0.1)));
        let pixel = Vector2::new(300.0, 200.0);
        let carried = straight().transfer(&other, pixel).expect("in front");
        assert!((other.transfer(&straight(), carried).expect("in front") - pixel).norm() < 1e-8);
    }

    #[test]
    fn a_turned_plane_takes_its_cameras_with_it() {
        let camera = straight();
        let turned = camera.turned(0.3);
        assert!((turned.roll() - camera.roll() - 0.3).abs() < 1e-12, "{}", turned.roll());
        let pixel = Vector2::new(100.0, 500.0);
        let (before, after) = (camera.place(pixel).expect("seen"), turned.place(pixel).expect("seen"));
        let expected = Vector2::new(
            before.x * 0.3_f64.cos() - before.y * 0.3_f64.sin(),
            before.x * 0.3_f64.sin() + before.y * 0.3_f64.cos(),
        );
        assert!((after - expected).norm() < 1e-9);
    }
}
