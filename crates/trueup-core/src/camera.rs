//! The camera of one photograph: the one place where rays become pixels and pixels rays.

use nalgebra::{Matrix2x3, Matrix3, Matrix3x2, SMatrix, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::geometry::{matrix_from_rows, rows_of};
use crate::lens::{Lens, LensDerivatives, PlacedLens};

/// A rotating camera: square pixels, no skew, and a lens, which may be a pinhole.
///
/// Bearings are in the camera frame (x right, y down, z forward); a pinhole's are `(u - c_x, v - c_y, f)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Focal length in pixels of the frame the camera belongs to (working pixels inside the pipeline).
    pub focal_px: f64,
    /// Principal point in the same pixels.
    pub principal_point: [f64; 2],
    /// Rows of the rotation from world to camera, the paper's R_i.
    pub camera_from_world: [[f64; 3]; 3],
    /// What the lens does, in units of the focal length.
    #[serde(default, skip_serializing_if = "Lens::is_pinhole")]
    pub lens: Lens,
}

/// Unknowns of a camera beside its rotation, in this order: ln focal length, principal point (x, y), k1 to k4, p1, p2.
pub const INTRINSICS: usize = 9;

/// How the pixel of a bearing moves.
#[derive(Debug, Clone, Copy)]
pub struct ProjectionDerivatives {
    /// The pixel itself.
    pub pixel: Vector2<f64>,
    /// By the bearing's three entries.
    pub by_bearing: Matrix2x3<f64>,
    /// By the [`INTRINSICS`].
    pub by_intrinsics: SMatrix<f64, 2, INTRINSICS>,
}

impl ProjectionDerivatives {
    /// How the bearing of the pixel moves with the pixel: the least change that does it.
    pub fn bearing_by_pixel(&self) -> Option<Matrix3x2<f64>> {
        let by_bearing = &self.by_bearing;
        (by_bearing * by_bearing.transpose()).try_inverse().map(|inverse| by_bearing.transpose() * inverse)
    }
}

impl Camera {
    /// A pinhole camera of focal length `focal_px` looking at the center of a `width` x `height` photograph.
    pub fn new(focal_px: f64, width: f64, height: f64, camera_from_world: &Matrix3<f64>) -> Self {
        Self {
            focal_px,
            principal_point: [width / 2.0, height / 2.0],
            camera_from_world: rows_of(camera_from_world),
            lens: Lens::PINHOLE,
        }
    }

    /// This camera, which looks at the photograph's middle, with a lens put on.
    pub fn through(self, lens: &PlacedLens) -> Self {
        let [middle_x, middle_y] = self.principal_point;
        let principal_point = [middle_x + lens.center_px[0], middle_y + lens.center_px[1]];
        Self { lens: Lens::new(lens.terms), principal_point, ..self }
    }

    /// The same camera of the same photograph in pixels of which `factor` are one of the present ones.
    pub fn scaled(&self, factor: f64) -> Self {
        let principal_point = self.principal_point.map(|coordinate| coordinate * factor);
        Self { focal_px: self.focal_px * factor, principal_point, ..*self }
    }

    /// The rotation from world to camera.
    pub fn rotation(&self) -> Matrix3<f64> {
        matrix_from_rows(&self.camera_from_world)
    }

    /// The unit direction in the world that the camera looks in: its z axis.
    pub fn forward(&self) -> Vector3<f64> {
        self.rotation().row(2).transpose()
    }

    /// Replaces the rotation from world to camera.
    pub fn set_rotation(&mut self, camera_from_world: &Matrix3<f64>) {
        self.camera_from_world = rows_of(camera_from_world);
    }

    /// The bearing of a pixel in the camera frame: z = 1 (not normalized), or of length 1 for a fisheye.
    pub fn bearing(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        let bearing = Vector3::new(
            (pixel.x - self.principal_point[0]) / self.focal_px,
            (pixel.y - self.principal_point[1]) / self.focal_px,
            1.0,
        );
        if self.lens.is_pinhole() { bearing } else { self.lens.ray(bearing.xy()) }
    }

    /// The pixel of a bearing in the camera frame; `None` behind the camera or within 1e-6 of its plane, and for a
    /// fisheye within 1e-6 of straight behind.
    pub fn project(&self, bearing: Vector3<f64>) -> Option<Vector2<f64>> {
        const MIN_DEPTH: f64 = 1e-6;
        if !self.lens.is_pinhole() {
            let place = self.lens.place(bearing)?;
            return Some(place * self.focal_px + Vector2::from(self.principal_point));
        }
        (bearing.z > MIN_DEPTH * bearing.norm()).then(|| {
            Vector2::new(
                self.focal_px * bearing.x / bearing.z + self.principal_point[0],
                self.focal_px * bearing.y / bearing.z + self.principal_point[1],
            )
        })
    }

    /// The pixel of a bearing and how it moves; `None` as [`Self::project`].
    pub fn projection_derivatives(&self, bearing: Vector3<f64>) -> Option<ProjectionDerivatives> {
        let LensDerivatives { place, by_ray, by_radial, by_tangential } = self.lens.derivatives(bearing)?;
        let mut by_intrinsics = SMatrix::<f64, 2, INTRINSICS>::zeros();
        by_intrinsics.fixed_columns_mut::<1>(0).copy_from(&(place * self.focal_px));
        by_intrinsics.fixed_columns_mut::<2>(1).fill_with_identity();
        by_intrinsics.fixed_columns_mut::<4>(3).copy_from(&(by_radial * self.focal_px));
        by_intrinsics.fixed_columns_mut::<2>(7).copy_from(&(by_tangential * self.focal_px));
        let pixel = place * self.focal_px + Vector2::from(self.principal_point);
        Some(ProjectionDerivatives { pixel, by_bearing: by_ray * self.focal_px, by_intrinsics })
    }

    /// How the pixel of a bearing moves with the bearing's three entries: [`Self::projection_derivatives`] without the
    /// intrinsics.
    pub fn projection_by_bearing(&self, bearing: Vector3<f64>) -> Option<Matrix2x3<f64>> {
        Some(self.lens.by_ray(bearing)? * self.focal_px)
    }

    /// How far the bearing of `pixel` moves, to first order, as the pixel moves by `step`.
    pub fn bearing_change(&self, pixel: Vector2<f64>, step: Vector2<f64>) -> Vector3<f64> {
        if self.lens.is_pinhole() {
            return (step / self.focal_px).push(0.0);
        }
        let derivatives = self.projection_derivatives(self.bearing(pixel));
        let by_pixel = derivatives.and_then(|derivatives| derivatives.bearing_by_pixel());
        by_pixel.map_or(Vector3::zeros(), |by_pixel| by_pixel * step)
    }

    /// The direction in the world of a pixel, unit length.
    pub fn world_direction(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        (self.rotation().transpose() * self.bearing(pixel)).normalize()
    }

    /// Whether a picture of `size` (width and height, pixels) shows a direction of the world.
    ///
    /// Terms of a lens that are large far beside its picture may carry a direction back into it, to a pixel that looks
    /// elsewhere: such a direction is not shown.
    pub fn shows(&self, world_direction: Vector3<f64>, size: [f64; 2]) -> bool {
        /// Radians by which rounding may turn a direction there and back.
        const SAME: f64 = 1e-3;
        let inside = |pixel: &Vector2<f64>| (0..2).all(|axis| (0.0..=size[axis]).contains(&pixel[axis]));
        let pixel = self.project(self.rotation() * world_direction).filter(inside);
        pixel.is_some_and(|pixel| self.world_direction(pixel).angle(&world_direction) < SAME)
    }

    /// Where the pixel of this camera appears in `other`, both at one place: `K_j R_j R_i^T K_i^-1`.
    pub fn transfer(&self, other: &Self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        other.project(other.rotation() * (self.rotation().transpose() * self.bearing(pixel)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation_about_y;
    use crate::lens::{LensProjection, LensTerms};

    #[test]
    fn a_pan_moves_the_center_by_focal_times_tangent() {
        let first = Camera::new(500.0, 640.0, 480.0, &Matrix3::identity());
        // Turning the camera to the right (camera_from_world = pan^T) moves the old center to the left.
        let pan = rotation_about_y(0.2);
        let second = Camera::new(500.0, 640.0, 480.0, &pan.transpose());
        let moved = first.transfer(&second, Vector2::new(320.0, 240.0)).expect("in front");
        assert!((moved.x - (320.0 - 500.0 * 0.2_f64.tan())).abs() < 1e-9);
        assert!((moved.y - 240.0).abs() < 1e-9);
    }

    /// By hand: at depth 1, x = 0.2 falls at 0.2 (1 - 0.1 * 0.04) = 0.1992, times 500, from a center at 320 + 6.
    #[test]
    fn a_lens_is_put_on_with_its_center() {
        let terms = LensTerms { radial: [-0.1, 0.0, 0.0, 0.0], ..LensTerms::default() };
        let pinhole = Camera::new(500.0, 640.0, 480.0, &Matrix3::identity());
        let camera = pinhole.through(&PlacedLens { terms, center_px: [6.0, -4.0] });
        let place = camera.project(Vector3::new(0.2, 0.0, 1.0)).expect("in front");
        assert!((place - Vector2::new(326.0 + 99.6, 236.0)).norm() < 1e-9, "{place}");
        assert_eq!(pinhole.through(&PlacedLens::default()), pinhole);
    }

    /// Against differences over steps of a millionth, with all terms of a lens, and of a fisheye.
    #[test]
    fn pixels_move_with_bearings_as_the_derivatives_say() {
        for projection in [LensProjection::Rectilinear, LensProjection::Equidistant] {
            let terms = LensTerms { projection, radial: [-0.1, 0.02, 0.0, 0.0], tangential: [0.003, -0.002] };
            let mut camera = Camera::new(500.0, 640.0, 480.0, &Matrix3::identity());
            camera.lens = Lens::new(terms);
            let bearing = Vector3::new(0.3, -0.2, 1.1);
            let found = camera.projection_by_bearing(bearing).expect("in front");
            for axis in 0..3 {
                let step = Vector3::ith(axis, 1e-6);
                let [before, after] =
                    [bearing - step, bearing + step].map(|bearing| camera.project(bearing).expect("in front"));
                assert!((found.column(axis) - (after - before) / 2e-6).norm() < 1e-5, "{projection:?} {found}");
            }
        }
        let pinhole = Camera::new(500.0, 640.0, 480.0, &Matrix3::identity());
        assert!(pinhole.projection_by_bearing(Vector3::new(0.0, 0.0, -1.0)).is_none());
    }

    #[test]
    fn points_behind_do_not_project() {
        let camera = Camera::new(500.0, 640.0, 480.0, &Matrix3::identity());
        assert!(camera.project(Vector3::new(0.0, 0.0, -1.0)).is_none());
        assert!(camera.project(Vector3::new(1.0, 0.0, 0.0)).is_none());
    }

    /// A decentered lens, as one was found for a phone, folds directions nearly at right angles to its axis back into
    /// the picture.
    #[test]
    fn what_a_lens_folds_back_is_not_shown() {
        let terms = LensTerms {
            projection: LensProjection::Rectilinear,
            radial: [0.26, -0.316, 0.0, 0.0],
            tangential: [0.016, -0.002],
        };
        let mut camera = Camera::new(1481.0, 1224.0, 1632.0, &Matrix3::identity());
        camera.lens = Lens::new(terms);
        let size = [1224.0, 1632.0];
        let (mut folded, mut shown) = (0, 0);
        for (step, around) in (1..900).flat_map(|step| (0..60).map(move |around| (step, around))) {
            let (aside, around) = ((0.1 * f64::from(step)).to_radians(), (6.0 * f64::from(around)).to_radians());
            let direction = Vector3::new(aside.sin() * around.cos(), aside.sin() * around.sin(), aside.cos());
            let pixel = camera.project(direction);
            let is_inside = pixel.is_some_and(|one| (0..2).all(|axis| (0.0..=size[axis]).contains(&one[axis])));
            // Half the diagonal of the picture is 35 degrees.
            let is_far = aside > 0.8;
            folded += usize::from(is_inside && is_far);
            shown += usize::from(camera.shows(direction, size));
            assert_eq!(camera.shows(direction, size), is_inside && !is_far, "{direction}");
        }
        assert!(folded > 0 && shown > 1000, "{folded} {shown}");
    }
}
