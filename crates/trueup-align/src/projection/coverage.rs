//! What part of the sphere photographs cover.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector2, Vector3};

use super::photograph::PosedPhotograph;
use crate::horizon::{Longitudes, SAMPLES, goes_round_horizon, spread_pixels};

/// The directions that photographs cover, in the level world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SphereCoverage {
    /// Longitude of the middle of what is covered, radians to the right of straight ahead; 0 for a full turn.
    pub middle: f64,
    /// Longitudes covered, radians; a turn where there is no gap.
    pub span: f64,
    /// Lowest and highest latitude in radians, positive downwards.
    pub latitudes: [f64; 2],
    /// Whether photographs show directions near the horizon at every longitude.
    pub goes_round_horizon: bool,
    /// Sum of the viewing directions over their number: short where the photographs look all round.
    pub forward: Vector3<f64>,
}

impl SphereCoverage {
    pub(super) fn of(photographs: &[PosedPhotograph]) -> Self {
        let mut longitudes = Longitudes::none();
        let mut latitudes = [f64::INFINITY, f64::NEG_INFINITY];
        let mut forward = Vector3::zeros();
        for photograph in photographs {
            let directions: Vec<Vector3<f64>> =
                samples(photograph, SAMPLES).map(|pixel| photograph.camera.world_direction(pixel)).collect();
            let ahead = photograph.camera.forward();
            forward += ahead / photographs.len() as f64;
            for direction in &directions {
                let latitude = direction.y.asin();
                latitudes = [latitudes[0].min(latitude), latitudes[1].max(latitude)];
            }
            let poles = [-1.0, 1.0].map(|down| shows(photograph, Vector3::new(0.0, down, 0.0)));
            for (pole, latitude) in poles.iter().zip([-PI / 2.0, PI / 2.0]) {
                if *pole {
                    latitudes = [latitudes[0].min(latitude), latitudes[1].max(latitude)];
                }
            }
            if poles.contains(&true) {
                longitudes = Longitudes::all();
                continue;
            }
            longitudes.cover(ahead, directions.iter());
        }
        let (span, middle) = longitudes.span_and_middle();
        let sized = photographs.iter().map(|one| (&one.camera, [one.mesh.width, one.mesh.height]));
        let goes_round_horizon = goes_round_horizon(sized, &Matrix3::identity());
        Self { middle, span, latitudes, goes_round_horizon, forward }
    }

    pub(super) fn is_full_turn(&self) -> bool {
        self.span >= TAU
    }

    /// Whether a photograph shows the zenith or the nadir.
    pub(super) fn shows_a_pole(&self) -> bool {
        self.steepest() >= PI / 2.0
    }

    /// The longitude of the mean viewing direction.
    pub(super) fn forward_longitude(&self) -> f64 {
        self.forward.x.atan2(self.forward.z)
    }

    /// The largest angle from the horizon, radians.
    pub(super) fn steepest(&self) -> f64 {
        self.latitudes[0].abs().max(self.latitudes[1].abs())
    }
}

/// Pixels spread over a photograph, so many along each side, its border included.
pub(crate) fn samples(photograph: &PosedPhotograph, count: usize) -> impl Iterator<Item = Vector2<f64>> + use<> {
    spread_pixels(Vector2::new(photograph.mesh.width, photograph.mesh.height), count)
}

/// The largest angle from the horizon of `frame` (from the level world) that a photograph reaches, radians.
pub(crate) fn steepest(photograph: &PosedPhotograph, frame: &Matrix3<f64>) -> f64 {
    let down = frame.row(1).transpose();
    if shows(photograph, down) || shows(photograph, -down) {
        return PI / 2.0;
    }
    let angle = |pixel: Vector2<f64>| photograph.camera.world_direction(pixel).dot(&down).clamp(-1.0, 1.0).asin().abs();
    samples(photograph, SAMPLES).map(angle).fold(0.0, f64::max)
}

/// Whether a photograph shows a direction of the level world.
pub(super) fn shows(photograph: &PosedPhotograph, direction: Vector3<f64>) -> bool {
    photograph.camera.shows(direction, [photograph.mesh.width, photograph.mesh.height])
}

#[cfg(test)]
pub(super) mod tests {
    use trueup_core::camera::Camera;
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, wrap_angle};
    use trueup_core::mesh::GridMesh;

    use super::*;

    /// A photograph of 800 x 600 pixels and focal length 700 (59.5 x 46.4 degrees).
    pub(in super::super) fn photograph(yaw_deg: f64, pitch_deg: f64) -> PosedPhotograph {
        let level_from_camera = rotation_about_y(yaw_deg.to_radians()) * rotation_about_x(pitch_deg.to_radians());
        PosedPhotograph {
            camera: Camera::new(700.0, 800.0, 600.0, &level_from_camera.transpose()),
            mesh: GridMesh::regular(800.0, 600.0, 20.0),
        }
    }

    #[test]
    fn a_row_is_as_wide_as_its_steps_and_one_photograph() {
        let row: Vec<PosedPhotograph> = [150.0, 180.0, 210.0].map(|yaw| photograph(yaw, 0.0)).to_vec();
        let coverage = SphereCoverage::of(&row);
        let own = 2.0 * (400_f64 / 700.0).atan();
        assert!((coverage.span - own - 60_f64.to_radians()).abs() < 0.02, "{coverage:?}");
        assert!(wrap_angle(coverage.middle - PI).abs() < 0.01);
        assert!((coverage.steepest() - (300_f64 / 700.0).atan()).abs() < 0.01);
        assert!(!coverage.is_full_turn());
    }

    #[test]
    fn a_turn_has_no_gap_and_a_pole_is_all_round() {
        let turn: Vec<PosedPhotograph> = (0..8).map(|k| photograph(45.0 * f64::from(k), 0.0)).collect();
        assert!(SphereCoverage::of(&turn).is_full_turn() && SphereCoverage::of(&turn).steepest() < 0.5);
        assert!(!SphereCoverage::of(&turn[..7]).is_full_turn());
        let sky = SphereCoverage::of(&[photograph(0.0, 80.0)]);
        assert!(sky.is_full_turn() && sky.latitudes[0] == -PI / 2.0);
    }
}
