//! The photographs on a sphere, a cylinder or a plane around straightened cameras, as AutoStitch has them.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::geometry::wrap_angle;
use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result};

use super::input::WarpInput;
use super::limits::{MIN_DEPTH, refuse};
use super::options::WarpModel;
use super::options::{AutostitchSurface, WarpOptions};
use crate::mesh::divided;

/// Places every photograph by its camera alone.
///
/// The longitude origin is the sum of the viewing directions. A photograph that straddles the cut opposite to it stays
/// whole, on its center's side; where the photographs go all the way round, the cut is the one that the overlaps were
/// cut at.
///
/// # Source
/// Brown and Lowe, "Automatic panoramic image stitching using invariant features" (2007), sections 4 and 5; Szeliski,
/// "Image alignment and stitching: a tutorial" (2006), section 6.1 for the projections.
pub(super) fn place(input: &WarpInput<'_>, options: &WarpOptions) -> Result<Vec<GridMesh>> {
    let origin = input.cut_yaw.map_or(0.0, |cut| cut + PI);
    let radius = input.cameras[input.reference].focal_px;
    (0..input.grids.len()).map(|photograph| OnSurface { input, options, photograph, origin, radius }.place()).collect()
}

/// Length of a full turn in panorama units, where the photographs go all the way round a sphere or a cylinder and stay
/// level.
pub(super) fn period(model: WarpModel, input: &WarpInput<'_>, options: &WarpOptions) -> Option<f64> {
    let unrolled = model == WarpModel::Autostitch && options.surface != AutostitchSurface::Plane;
    (unrolled && input.cut_yaw.is_some() && input.turn == 0.0).then(|| TAU * input.cameras[input.reference].focal_px)
}

/// One photograph on the surface.
struct OnSurface<'a> {
    input: &'a WarpInput<'a>,
    options: &'a WarpOptions,
    photograph: usize,
    /// Longitude that the panorama's middle looks in, radians.
    origin: f64,
    /// Panorama units per radian.
    radius: f64,
}

impl OnSurface<'_> {
    fn place(&self) -> Result<GridMesh> {
        match self.options.surface {
            AutostitchSurface::Plane => self.on_plane(),
            AutostitchSurface::Spherical | AutostitchSurface::Cylindrical => self.unrolled(),
        }
    }

    /// The direction of a pixel in the level world, unit length.
    fn direction(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        self.input.level_from_world * self.input.cameras[self.photograph].world_direction(pixel)
    }

    fn on_plane(&self) -> Result<GridMesh> {
        let ahead: Matrix3<f64> = trueup_core::geometry::rotation_about_y(self.origin).transpose();
        let grid = &self.input.grids[self.photograph];
        let place = |vertex: usize| {
            let direction = ahead * self.direction(grid.source(vertex));
            (direction.z > MIN_DEPTH)
                .then(|| [self.radius * direction.x / direction.z, self.radius * direction.y / direction.z])
        };
        let target: Option<Vec<[f64; 2]>> = (0..grid.len()).map(place).collect();
        let target = target.ok_or_else(|| self.refuse("does not lie in front of the panorama's plane"))?;
        Ok(GridMesh { target, ..grid.clone() })
    }

    fn unrolled(&self) -> Result<GridMesh> {
        /// Longitude across a cell above which the grid is divided: 0.1 rad bends by 0.1^2 / 8 of the radius, 1 px.
        const LONGEST_STEP: f64 = 0.1;
        /// Finest division: what needs more lies at the pole.
        const FINEST: usize = 16;
        let mut factor = 1;
        loop {
            let grid = divided(&self.input.grids[self.photograph], factor);
            let directions: Vec<Vector3<f64>> = (0..grid.len()).map(|k| self.direction(grid.source(k))).collect();
            let longitudes = self.longitudes(&grid, &directions)?;
            if factor < FINEST && longest_step(&grid, &longitudes) > LONGEST_STEP {
                factor *= 2;
                continue;
            }
            let heights: Option<Vec<f64>> = directions.iter().map(|direction| self.height(direction)).collect();
            let heights = heights.ok_or_else(|| self.refuse("reaches the cylinder's pole"))?;
            let target = longitudes.iter().zip(heights).map(|(x, y)| [self.radius * x, self.radius * y]).collect();
            return Ok(GridMesh { target, ..grid });
        }
    }

    /// Latitude, or height on the cylinder; `None` at the cylinder's poles.
    fn height(&self, direction: &Vector3<f64>) -> Option<f64> {
        let level = direction.x.hypot(direction.z);
        match self.options.surface {
            AutostitchSurface::Cylindrical => (level > MIN_DEPTH).then(|| direction.y / level),
            _ => Some(direction.y.atan2(level)),
        }
    }

    /// Longitudes of all vertices from the origin, without a jump: along the middle row from its middle, then up and
    /// down every column.
    fn longitudes(&self, grid: &GridMesh, directions: &[Vector3<f64>]) -> Result<Vec<f64>> {
        let wrapped = |vertex: usize| directions[vertex].x.atan2(directions[vertex].z) - self.origin;
        let mut longitudes = vec![0.0; grid.len()];
        let (middle_row, middle_column) = (grid.rows / 2, grid.columns / 2);
        let index = |row: usize, column: usize| row * grid.columns + column;
        let center = index(middle_row, middle_column);
        longitudes[center] = wrap_angle(wrapped(center));
        let follow = |longitudes: &mut Vec<f64>, from: usize, to: usize| {
            longitudes[to] = longitudes[from] + wrap_angle(wrapped(to) - longitudes[from]);
        };
        for column in middle_column + 1..grid.columns {
            follow(&mut longitudes, index(middle_row, column - 1), index(middle_row, column));
        }
        for column in (0..middle_column).rev() {
            follow(&mut longitudes, index(middle_row, column + 1), index(middle_row, column));
        }
        for column in 0..grid.columns {
            for row in middle_row + 1..grid.rows {
                follow(&mut longitudes, index(row - 1, column), index(row, column));
            }
            for row in (0..middle_row).rev() {
                follow(&mut longitudes, index(row + 1, column), index(row, column));
            }
        }
        // Around a pole the two ways round meet a full turn apart.
        if longest_step(grid, &longitudes) > PI {
            return Err(self.refuse("covers a pole of the panorama, which cannot be unrolled"));
        }
        Ok(longitudes)
    }

    fn refuse(&self, reason: &str) -> Error {
        let frame = &self.input.frames[self.photograph];
        let axis = self.direction(Vector2::new(frame.width / 2.0, frame.height / 2.0));
        let pitch = -axis.y.asin().to_degrees();
        let reason =
            format!("{reason} (it looks {:.0} degrees {})", pitch.abs(), if pitch < 0.0 { "down" } else { "up" });
        refuse(WarpModel::Autostitch, self.input, self.photograph, &reason)
    }
}

/// The largest difference of longitude between neighbors of the grid.
fn longest_step(grid: &GridMesh, longitudes: &[f64]) -> f64 {
    let mut longest: f64 = 0.0;
    for vertex in 0..grid.len() {
        let right = (vertex % grid.columns + 1 < grid.columns).then(|| vertex + 1);
        let below = (vertex + grid.columns < grid.len()).then(|| vertex + grid.columns);
        for neighbor in [right, below].into_iter().flatten() {
            longest = longest.max((longitudes[neighbor] - longitudes[vertex]).abs());
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use trueup_core::camera::Camera;
    use trueup_core::geometry::{rotation_about_x, rotation_about_y};

    use super::super::tests::{Example, HEIGHT, WIDTH, misalignment};
    use super::*;

    fn with(surface: AutostitchSurface) -> WarpOptions {
        WarpOptions { surface, ..WarpOptions::default() }
    }

    #[test]
    fn every_surface_places_a_photograph_where_its_camera_looks() {
        let example = Example::panned(&[-20.0, 20.0], 0);
        let yaw = 20_f64.to_radians();
        for (surface, expected) in [
            (AutostitchSurface::Spherical, yaw),
            (AutostitchSurface::Cylindrical, yaw),
            (AutostitchSurface::Plane, yaw.tan()),
        ] {
            let placed = example.place_with(WarpModel::Autostitch, &with(surface)).expect("a pair");
            assert_eq!(placed.folds, 0);
            assert!(misalignment(&example, &placed.meshes) < 0.5);
            let center = placed.meshes[1].warp(Vector2::new(WIDTH / 2.0, HEIGHT / 2.0));
            assert!((center - Vector2::new(700.0 * expected, 0.0)).norm() < 0.2, "{surface:?}: {center}");
        }
    }

    #[test]
    fn a_full_turn_is_as_wide_as_a_turn_and_its_straddling_photograph_stays_whole() {
        let yaws: Vec<f64> = (0..15).map(|k| f64::from(k) * 24.0).collect();
        let mut example = Example::panned(&yaws, 0);
        example.pairs.clear();
        let placed = example.place(WarpModel::Autostitch).expect("a turn");
        assert_eq!(placed.folds, 0);
        let widths = placed.meshes.iter().map(|mesh| mesh.bounds()).map(|(low, high)| high.x - low.x);
        let own = 2.0 * 700.0 * (400_f64 / 700.0).atan();
        assert!(widths.clone().all(|width| (width - own).abs() < 1.0), "{:?}", widths.collect::<Vec<_>>());
        // Fourteen steps of 24 degrees and one photograph's own width.
        let low = placed.meshes.iter().map(|mesh| mesh.bounds().0.x).fold(f64::INFINITY, f64::min);
        let high = placed.meshes.iter().map(|mesh| mesh.bounds().1.x).fold(f64::NEG_INFINITY, f64::max);
        assert!((high - low - own - 700.0 * 336_f64.to_radians()).abs() < 1.0);
    }

    #[test]
    fn a_photograph_near_a_pole_is_placed_and_one_that_covers_it_is_refused() {
        let looking_up = |pitch_deg: f64| {
            let world_from_camera = rotation_about_y(0.3) * rotation_about_x(pitch_deg.to_radians());
            let level = Camera::new(700.0, WIDTH, HEIGHT, &rotation_about_y(0.3).transpose());
            let steep = Camera::new(700.0, WIDTH, HEIGHT, &world_from_camera.transpose());
            let mut example = Example::with_pairs(vec![level, steep], Vec::new(), 0);
            example.names[1] = "sky.jpg".to_owned();
            example.place(WarpModel::Autostitch)
        };
        let placed = looking_up(60.0).expect("ends below the zenith");
        assert_eq!(placed.folds, 0);
        assert!(placed.meshes[1].len() > placed.meshes[0].len(), "cells are divided where meridians converge");
        let error = looking_up(85.0).expect_err("covers the zenith").to_string();
        assert!(error.contains("sky.jpg covers a pole") && error.contains("85 degrees up"), "{error}");
    }
}
