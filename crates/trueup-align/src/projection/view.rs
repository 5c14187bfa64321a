//! Where the viewer looks, what is shown, and on which projection.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z, wrap_angle};

use super::coverage::SphereCoverage;
use super::flat::{Flat, FlatKind};
use super::options::{Projection, ProjectionOptions};
use super::photograph::PosedPhotograph;

/// A projection, where it looks, and how far it is shown. Angles in radians.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProjectionView {
    /// The projection.
    pub flat: Flat,
    /// Turn to the right from straight ahead in the level world.
    pub yaw: f64,
    /// Turn upwards.
    pub pitch: f64,
    /// Clockwise turn.
    pub roll: f64,
    /// Half of the horizontal and of the vertical angle that may be shown.
    pub half: [f64; 2],
    /// Whether a full turn is shown: the plane's left and right ends are the same place.
    pub closed: bool,
}

/// Mean pitch in radians (40 degrees) from which photographs that look one way are shown looking there: drawn upright,
/// they would be stretched beyond recognition. The mesh's sphere is tilted from there, too.
const STEEP: f64 = 0.7;
/// Length of the mean viewing direction below which the photographs look all round and have no such pitch.
const ONE_WAY: f64 = 0.5;

impl ProjectionView {
    /// The view that the options ask for.
    ///
    /// `dominant`: the scene's directions in the level world (columns), if lines guided the panorama. The viewer faces
    /// the horizontal one that is nearest to the photographs' middle (up to 45 degrees aside): always for full turns,
    /// whose middle is arbitrary, and for planes where nothing more is cut off by it; a cylinder looks the same
    /// wherever its middle is.
    pub fn choose(
        photographs: &[PosedPhotograph],
        dominant: Option<&Matrix3<f64>>,
        options: &ProjectionOptions,
    ) -> Self {
        let coverage = SphereCoverage::of(photographs);
        let kind = flat_kind(&coverage, options);
        let flat = Flat { kind, panini_distance: options.panini_distance };
        let facade = dominant.and_then(|dominant| nearest_facade(dominant, coverage.middle));
        let far = |yaw: f64| 0.5 * coverage.span + wrap_angle(yaw - coverage.middle).abs();
        let straight = match facade {
            Some(facade) if coverage.is_full_turn() || (!kind.turns() && far(facade) <= kind.comfortable()[0]) => {
                facade
            }
            _ => coverage.middle,
        };
        let one_way = coverage.forward.norm() >= ONE_WAY;
        let forward_pitch = (-coverage.forward.y).atan2(coverage.forward.x.hypot(coverage.forward.z));
        let steep = !kind.turns() && one_way && forward_pitch.abs() > STEEP;
        let [yaw, pitch, roll] = [options.yaw, options.pitch, options.roll].map(f64::to_radians);
        let (straight, level) = match steep {
            true => (coverage.forward.x.atan2(coverage.forward.z), forward_pitch),
            false => (straight, 0.0),
        };
        let [width, height] = kind.comfortable();
        let width = if options.fov > 0.0 { 0.5 * options.fov.to_radians() } else { width };
        let closed = kind.turns() && coverage.is_full_turn() && width >= std::f64::consts::PI;
        Self { flat, yaw: wrap_angle(straight + yaw), pitch: level + pitch, roll, half: [width, height], closed }
    }

    /// The rotation from the level world to the viewer.
    pub fn view_from_level(&self) -> Matrix3<f64> {
        let level_from_view = rotation_about_y(self.yaw) * rotation_about_x(self.pitch) * rotation_about_z(self.roll);
        level_from_view.transpose()
    }
}

/// The horizontal dominant direction nearest to the longitude `middle`, as a longitude.
fn nearest_facade(dominant: &Matrix3<f64>, middle: f64) -> Option<f64> {
    /// Sine of the steepest direction that counts as horizontal, 30 degrees: one of the three is the vertical.
    const HORIZONTAL: f64 = 0.5;
    let longitudes = dominant
        .column_iter()
        .filter(|direction| direction.y.abs() < HORIZONTAL)
        .flat_map(|direction| [direction.x.atan2(direction.z), (-direction.x).atan2(-direction.z)]);
    longitudes.min_by(|one, other| wrap_angle(one - middle).abs().total_cmp(&wrap_angle(other - middle).abs()))
}

/// The projection asked for, or the one that suits.
///
/// A plane is what one wide lens would have drawn, and people are used to its stretching up to about 100 degrees.
/// Panini's keeps verticals and the lines into the depth straight up to about 180; beyond, the far sides grow too
/// large, while a cylinder stays even, up to where nobody sees it as one view any more. Full turns belong to viewers of
/// spherical panoramas, and what reaches more than 45 degrees up or down (several rows) is stretched by all of these.
fn flat_kind(coverage: &SphereCoverage, options: &ProjectionOptions) -> FlatKind {
    /// Degrees across.
    const PERSPECTIVE: f64 = 100.0;
    const PANINI: f64 = 180.0;
    const CYLINDRICAL: f64 = 220.0;
    /// Degrees up or down.
    const HIGH: f64 = 45.0;
    let across = match options.fov > 0.0 {
        true => options.fov.min(coverage.span.to_degrees()),
        false => coverage.span.to_degrees(),
    };
    let high = coverage.steepest().to_degrees() > HIGH;
    match options.kind {
        Projection::Equirectangular => FlatKind::Equirectangular,
        Projection::Cylindrical => FlatKind::Cylindrical,
        Projection::Perspective => FlatKind::Perspective,
        Projection::Mercator => FlatKind::Mercator,
        Projection::Panini => FlatKind::Panini,
        Projection::Stereographic => FlatKind::Stereographic,
        Projection::Mesh | Projection::Auto => match across {
            _ if high || across > CYLINDRICAL => FlatKind::Equirectangular,
            _ if across > PANINI => FlatKind::Cylindrical,
            _ if across > PERSPECTIVE => FlatKind::Panini,
            _ => FlatKind::Perspective,
        },
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::coverage::tests::photograph;
    use super::*;

    fn row(count: u32, pitch_deg: f64) -> Vec<PosedPhotograph> {
        (0..count).map(|k| photograph(30.0 * (f64::from(k) - 0.5 * f64::from(count - 1)), pitch_deg)).collect()
    }

    fn kind(photographs: &[PosedPhotograph]) -> FlatKind {
        let options = ProjectionOptions { kind: Projection::Auto, ..ProjectionOptions::default() };
        ProjectionView::choose(photographs, None, &options).flat.kind
    }

    #[test]
    fn the_angle_of_view_chooses() {
        assert_eq!(kind(&row(2, 0.0)), FlatKind::Perspective);
        assert_eq!(kind(&row(4, 0.0)), FlatKind::Panini);
        assert_eq!(kind(&row(6, 0.0)), FlatKind::Cylindrical);
        assert_eq!(kind(&row(12, 0.0)), FlatKind::Equirectangular);
        assert_eq!(kind(&[row(2, 0.0), row(2, 35.0)].concat()), FlatKind::Equirectangular);
    }

    /// Facades at 20 and 110 degrees: a narrow panorama faces the nearer one, a wide plane keeps to its middle, since
    /// its far side would be cut.
    #[test]
    fn the_viewer_faces_the_nearest_facade() {
        let dominant = rotation_about_y(20_f64.to_radians());
        let faced = |photographs: &[PosedPhotograph], kind: Projection| {
            let options = ProjectionOptions { kind, ..ProjectionOptions::default() };
            ProjectionView::choose(photographs, Some(&dominant), &options).yaw.to_degrees()
        };
        assert!((faced(&row(1, 0.0), Projection::Perspective) - 20.0).abs() < 1e-6);
        assert!(faced(&row(3, 0.0), Projection::Perspective).abs() < 0.5);
        assert!(faced(&row(3, 0.0), Projection::Cylindrical).abs() < 0.5);
        assert!((faced(&row(12, 0.0), Projection::Equirectangular) - 20.0).abs() < 1e-6);
        assert!(ProjectionView::choose(&row(1, 0.0), None, &ProjectionOptions::default()).yaw.abs() < 0.01);
    }

    /// Yaw turns right, pitch up, roll clockwise: the direction to the right, above, and at the viewer's right hand.
    #[test]
    fn the_viewer_turns_as_asked() {
        let options = |yaw: f64, pitch: f64, roll: f64| ProjectionOptions {
            kind: Projection::Perspective,
            yaw,
            pitch,
            roll,
            ..ProjectionOptions::default()
        };
        let seen = |options: ProjectionOptions, direction: Vector3<f64>| {
            ProjectionView::choose(&row(1, 0.0), None, &options).view_from_level() * direction
        };
        let right = Vector3::new(0.5, 0.0, 0.75_f64.sqrt());
        assert!((seen(options(30.0, 0.0, 0.0), right) - Vector3::z()).norm() < 1e-2);
        let above = Vector3::new(0.0, -0.5, 0.75_f64.sqrt());
        assert!((seen(options(0.0, 30.0, 0.0), above) - Vector3::z()).norm() < 1e-2);
        // Rolled clockwise by a quarter, the viewer's right hand points down.
        assert!((seen(options(0.0, 0.0, 90.0), Vector3::y()) - Vector3::x()).norm() < 1e-2);
    }

    #[test]
    fn photographs_of_a_ceiling_are_looked_up_at() {
        let options = ProjectionOptions { kind: Projection::Perspective, ..ProjectionOptions::default() };
        let view = ProjectionView::choose(&[photograph(0.0, 80.0), photograph(10.0, 80.0)], None, &options);
        assert!((view.pitch.to_degrees() - 80.0).abs() < 0.5, "{view:?}");
        assert!(ProjectionView::choose(&row(2, 30.0), None, &options).pitch == 0.0);
    }
}
