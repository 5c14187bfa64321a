//! The base: how each picture's grid would lie if only the prior were asked.
//!
//! The similarity energies compare every grid edge with the base, so the base decides which shape is free of cost.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

trueup_core::choice! {
    /// The shape that the similarity prior asks of each picture.
    pub enum BaseShape {
        /// The picture on the level sphere, unrolled; nearly a similarity around the picture's centre.
        Sphere = "sphere",
        /// The picture on the level sphere, unrolled so that shapes stay similar everywhere (Mercator).
        Mercator = "mercator",
        /// A similarity of the whole picture, as published.
        Similarity = "similarity",
    }
}

/// What the prior wants of one picture.
#[derive(Debug, Clone, Copy)]
pub struct WantedSimilarity {
    /// Scale s_i.
    pub scale: f64,
    /// Clockwise rotation theta_i in radians.
    pub theta: f64,
}

/// The base grid of one picture, in panorama units, up to translation: the undeformed `grid` on the level sphere, turned
/// and scaled about the picture's centre so that its similarity there is `wanted`.
///
/// A picture that reaches within 20 degrees of a pole cannot be unrolled; it gets the plain similarity.
///
/// # Departures
/// The published prior is one similarity per picture. Pictures that look up cannot follow it: their overlaps meet along
/// meridians that converge, and the compromise tilts every picture's own verticals. The sphere's own shape satisfies the
/// overlaps and the prior at once; where the view is narrow or level it differs little from the similarity.
pub fn base_grid(
    shape: BaseShape,
    camera: &Camera,
    grid: &GridMesh,
    level_from_world: &Matrix3<f64>,
    wanted: WantedSimilarity,
) -> Vec<Vector2<f64>> {
    let similarity = Vector2::new(wanted.theta.cos(), wanted.theta.sin()) * wanted.scale;
    let plain = || (0..grid.len()).map(|vertex| product(similarity, grid.source(vertex))).collect();
    if shape == BaseShape::Similarity {
        return plain();
    }
    let level_from_camera = level_from_world * camera.rotation().transpose();
    let forward: Vector3<f64> = level_from_camera.column(2).into_owned();
    let project = |vertex: usize| {
        let ray = level_from_camera * camera.bearing(grid.source(vertex));
        unrolled(shape, &ray, &forward)
    };
    let Some(unrolled) = (0..grid.len()).map(project).collect::<Option<Vec<_>>>() else { return plain() };
    let at_centre = derivative_at_centre(shape, &level_from_camera, camera.focal_px);
    let turn = product(similarity, Vector2::new(at_centre.x, -at_centre.y)) / at_centre.norm_squared();
    unrolled.into_iter().map(|place| product(turn, place)).collect()
}

/// Longitude relative to `forward` and (projected) latitude of a ray; `None` near the poles.
fn unrolled(shape: BaseShape, ray: &Vector3<f64>, forward: &Vector3<f64>) -> Option<Vector2<f64>> {
    /// Sine of the largest latitude that is unrolled, 70 degrees.
    const STEEPEST: f64 = 0.94;
    let horizontal = ray.x.hypot(ray.z);
    let sine = ray.y / ray.norm();
    if sine.abs() > STEEPEST || forward.y.abs() > STEEPEST {
        return None;
    }
    let longitude = (ray.x * forward.z - ray.z * forward.x).atan2(ray.x * forward.x + ray.z * forward.z);
    let latitude = match shape {
        BaseShape::Mercator => (ray.y / horizontal).asinh(),
        _ => ray.y.atan2(horizontal),
    };
    Some(Vector2::new(longitude, latitude))
}

/// The similarity closest to the projection's derivative at the picture's centre, per pixel.
fn derivative_at_centre(shape: BaseShape, level_from_camera: &Matrix3<f64>, focal_px: f64) -> Vector2<f64> {
    let forward: Vector3<f64> = level_from_camera.column(2).into_owned();
    let horizontal = forward.x.hypot(forward.z);
    let east = Vector3::new(forward.z, 0.0, -forward.x) / horizontal;
    let south = forward.cross(&east);
    let (east_scale, south_scale) = match shape {
        BaseShape::Mercator => (1.0 / horizontal, 1.0 / horizontal),
        _ => (1.0 / horizontal, 1.0),
    };
    let derivative = |axis: usize| {
        let step = level_from_camera.column(axis) / focal_px;
        Vector2::new(step.dot(&east) * east_scale, step.dot(&south) * south_scale)
    };
    let (dx, dy) = (derivative(0), derivative(1));
    Vector2::new(0.5 * (dx.x + dy.y), 0.5 * (dx.y - dy.x))
}

/// a b of complex numbers.
fn product(a: Vector2<f64>, b: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    fn camera(yaw: f64, pitch: f64, roll: f64) -> Camera {
        let world_from_camera = rotation_about_y(yaw) * rotation_about_x(pitch) * rotation_about_z(roll);
        Camera::new(700.0, 800.0, 600.0, &world_from_camera.transpose())
    }

    /// The base's direction at the centre, from finite differences over one small grid, must be upright.
    #[test]
    fn a_picture_turned_by_its_roll_stands_upright_at_the_centre() {
        let grid = GridMesh::regular(800.0, 600.0, 2.0);
        for shape in [BaseShape::Sphere, BaseShape::Mercator] {
            let camera = camera(0.7, -0.4, 0.2);
            let wanted = WantedSimilarity { scale: 1.5, theta: 0.2 };
            let base = base_grid(shape, &camera, &grid, &Matrix3::identity(), wanted);
            // Down in the picture is (sin roll, cos roll) where the camera's roll is 0.2.
            let centre = grid.columns * (grid.rows / 2) + grid.columns / 2;
            let down = Vector2::new(0.2_f64.sin(), 0.2_f64.cos());
            let by_x = (base[centre + 1] - base[centre - 1]) / (2.0 * grid.cell_width());
            let by_y = (base[centre + grid.columns] - base[centre - grid.columns]) / (2.0 * grid.cell_height());
            let moved = by_x * down.x + by_y * down.y;
            assert!((moved.x / moved.y).abs() < 1e-4, "{shape:?}: {moved}");
        }
    }

    #[test]
    fn pictures_near_a_pole_get_the_plain_similarity() {
        let grid = GridMesh::regular(800.0, 600.0, 40.0);
        let wanted = WantedSimilarity { scale: 1.0, theta: 0.0 };
        let base = base_grid(BaseShape::Sphere, &camera(0.0, -1.3, 0.0), &grid, &Matrix3::identity(), wanted);
        assert!((base[grid.len() - 1] - grid.source(grid.len() - 1)).norm() < 1e-9);
    }
}
