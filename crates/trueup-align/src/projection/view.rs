//! Where the viewer looks, what is shown, and on which projection.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Vector2};
use serde::{Deserialize, Serialize};
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z, wrap_angle};

use super::coverage::SphereCoverage;
use super::fitted::Fit;
use super::flat::{Flat, FlatKind};
use super::options::{Projection, ProjectionOptions};
use super::photograph::PosedPhotograph;
use super::seen::{Seen, smooth};

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
    /// The smallest and largest coordinates of the plane that are shown; `None`: what `half` reaches.
    pub shown: Option<[[f64; 2]; 2]>,
    /// Whether a full turn is shown: the plane's left and right ends are the same place.
    pub closed: bool,
}

/// Mean pitches, radians (35 and 50 degrees), between which photographs that look one way come to be shown looking
/// there: drawn level, they would be stretched beyond recognition.
const STEEP: [f64; 2] = [0.611, 0.873];
/// Lengths of the mean viewing direction between which photographs come to look one way: those that look all round have
/// no common pitch.
const ONE_WAY: [f64; 2] = [0.4, 0.6];
/// Root mean squares, radians (17 and 24 degrees), of how much verticals would lean in the middles of photographs that
/// are looked at steeply, between which they come to be drawn level all the same: side by side they are a panorama, and
/// looked at a fan.
const FANNED: [f64; 2] = [0.297, 0.419];
/// Angles from the horizon, radians (70 and 80 degrees), between which what photographs reach is too steep for being
/// drawn level.
const TOO_STEEP: [f64; 2] = [1.222, 1.396];
/// Half angle, radians (50 degrees), within which the whole view must lie to be turned towards a facade, and by how
/// much beyond it the turn ends (10 degrees).
const FACED: f64 = 0.873;
const FACED_FADE: f64 = 0.175;
/// A column of photographs is seen within so much to both sides (45 degrees), and from top to bottom over more than a
/// plane carries without stretching (95 degrees). Its middle is near the horizon (20 degrees), so that what is vertical
/// hardly leans in it, or it reaches so high or low (75 degrees) that no level view is of use.
const COLUMN_SIDE: f64 = 0.785;
const COLUMN_LENGTH: f64 = 1.66;
const COLUMN_MIDDLE: f64 = 0.349;
const COLUMN_HEIGHT: f64 = 1.309;
/// Angles from the horizon, radians (55 and 80 degrees), between which what a column reaches comes to lie so near to a
/// pole that its longitudes say nothing of the column's middle: a corner 80 degrees up lies six times as far aside as
/// it is wide.
const NEAR_POLE: [f64; 2] = [0.960, 1.396];

impl ProjectionView {
    /// The view that the options ask for.
    ///
    /// `dominant`: the scene's directions in the level world (columns), if lines guided the panorama. The viewer faces
    /// the horizontal one that is nearest to the photographs' middle (up to 45 degrees aside): always for full turns,
    /// whose middle is arbitrary, and for planes where nothing more is cut off or stretched by it; a cylinder looks the
    /// same wherever its middle is.
    pub fn choose(
        photographs: &[PosedPhotograph],
        dominant: Option<&Matrix3<f64>>,
        options: &ProjectionOptions,
    ) -> Self {
        let coverage = SphereCoverage::of(photographs);
        match named_kind(options.kind) {
            Some(kind) => Self::named(kind, &coverage, dominant, options),
            None if goes_round(&coverage, options) => {
                Self::named(FlatKind::Equirectangular, &coverage, dominant, options)
            }
            None => Self::fitting(photographs, &coverage, dominant, options),
        }
    }

    /// The view on a projection that is asked for.
    fn named(
        kind: FlatKind,
        coverage: &SphereCoverage,
        dominant: Option<&Matrix3<f64>>,
        options: &ProjectionOptions,
    ) -> Self {
        let flat = Flat::named(kind, options.panini_distance);
        let facade = dominant.and_then(|dominant| nearest_facade(dominant, coverage.middle));
        let far = |yaw: f64| 0.5 * coverage.span + wrap_angle(yaw - coverage.middle).abs();
        let straight = match facade {
            Some(facade) if coverage.is_full_turn() || (!kind.turns() && far(facade) <= kind.comfortable()[0]) => {
                facade
            }
            _ => coverage.middle,
        };
        let [yaw, pitch, roll] = [options.yaw, options.pitch, options.roll].map(f64::to_radians);
        let steep = if kind.turns() { 0.0 } else { share_looked_at(coverage) * mean_pitch(coverage) };
        let straight = if steep == 0.0 { straight } else { coverage.forward_longitude() };
        let [width, height] = kind.comfortable();
        let width = if options.fov > 0.0 { 0.5 * options.fov.to_radians() } else { width };
        let closed = kind.turns() && coverage.is_full_turn() && width >= PI;
        let yaw = wrap_angle(straight + yaw);
        Self { flat, yaw, pitch: steep + pitch, roll, half: [width, height], shown: None, closed }
    }

    /// The view that suits photographs that do not go round: the straightest one without stretching, see [`Seen::fit`].
    fn fitting(
        photographs: &[PosedPhotograph],
        coverage: &SphereCoverage,
        dominant: Option<&Matrix3<f64>>,
        options: &ProjectionOptions,
    ) -> Self {
        let [yaw, pitch, roll] = [options.yaw, options.pitch, options.roll].map(f64::to_radians);
        let half_width = if options.fov > 0.0 { 0.5 * options.fov.to_radians() } else { PI };
        let looked_at = match share_looked_at(coverage) {
            0.0 => 0.0,
            share => share * (1.0 - fanned(photographs, coverage)),
        };
        let steep = looked_at * mean_pitch(coverage);
        // Longitudes at a pole say nothing of the middle.
        let aside = if coverage.shows_a_pole() { 1.0 } else { looked_at };
        let level_middle = coverage.middle + toward_facade(coverage, dominant);
        let straight = level_middle + aside * wrap_angle(coverage.forward_longitude() - level_middle);
        let looking = |straight: f64, level_pitch: f64| {
            let view = Self {
                flat: Flat::named(FlatKind::Perspective, 0.0),
                yaw: wrap_angle(straight + yaw),
                pitch: level_pitch + pitch,
                roll,
                half: [half_width, FRAC_PI_2],
                shown: None,
                closed: false,
            };
            let seen = Seen::of(photographs, &view.view_from_level(), half_width);
            (view, seen)
        };
        let (level_view, level) = looking(straight, 0.0);
        let [low, high] = level.elevations();
        let middle = 0.5 * (low + high);
        let is_column = high - low > COLUMN_LENGTH
            && (middle.abs() < COLUMN_MIDDLE || level.height() > COLUMN_HEIGHT)
            && level.turned().height() < COLUMN_SIDE;
        let (view, seen) = if is_column {
            // Beside the plane that it is looked at along, what is vertical converges: that plane goes through where
            // its photographs look.
            let aside = smooth(coverage.steepest(), NEAR_POLE);
            looking(straight + aside * wrap_angle(coverage.forward_longitude() - straight), middle)
        } else if steep == 0.0 {
            (level_view, level)
        } else {
            looking(straight, steep)
        };
        let fitted = |seen: &Seen| {
            let fit = seen.fit();
            (fit, seen.window(&Flat::fitted(fit)))
        };
        let (fit, shown) = match is_column {
            false => fitted(&seen),
            true => {
                let (fit, shown) = fitted(&seen.turned());
                (Fit { turned: true, ..fit }, shown.map(|corners| corners.map(|[x, y]| [y, x])))
            }
        };
        let flat = Flat::fitted(fit);
        let shown = shown.map(|[low, high]| {
            let reach = if options.fov > 0.0 { flat.reach([half_width, 0.0]).x } else { f64::INFINITY };
            if reach.is_finite() { [[-reach, low[1]], [reach, high[1]]] } else { [low, high] }
        });
        Self { flat, half: [seen.half_width(), seen.height()], shown, ..view }
    }

    /// The smallest and largest coordinates of the plane that are shown, and `margin` radians beyond.
    pub fn window(&self, margin: f64) -> [Vector2<f64>; 2] {
        /// On the plane, a radian is at most about so long where a fitted view still shows something.
        const LONGEST: f64 = 4.0;
        match self.shown {
            Some([low, high]) => {
                let aside = Vector2::repeat(LONGEST * margin);
                [Vector2::from(low) - aside, Vector2::from(high) + aside]
            }
            None => {
                let reach = self.flat.reach(self.half.map(|half| half + margin));
                [-reach, reach]
            }
        }
    }

    /// The rotation from the level world to the viewer.
    pub fn view_from_level(&self) -> Matrix3<f64> {
        let level_from_view = rotation_about_y(self.yaw) * rotation_about_x(self.pitch) * rotation_about_z(self.roll);
        level_from_view.transpose()
    }
}

/// The projection asked for; `None` if it is to be chosen.
fn named_kind(projection: Projection) -> Option<FlatKind> {
    match projection {
        Projection::Equirectangular => Some(FlatKind::Equirectangular),
        Projection::Cylindrical => Some(FlatKind::Cylindrical),
        Projection::Perspective => Some(FlatKind::Perspective),
        Projection::Mercator => Some(FlatKind::Mercator),
        Projection::Panini => Some(FlatKind::Panini),
        Projection::Stereographic => Some(FlatKind::Stereographic),
        Projection::Mesh | Projection::Auto => None,
    }
}

/// Whether the panorama is one for viewers of spherical panoramas: photographs all around, and no narrower view asked
/// for. Photographs that look one way and show a pole have all longitudes, too, and do not go round, unless they show
/// the horizon all around: those of a drone look down in the mean, and around as well.
fn goes_round(coverage: &SphereCoverage, options: &ProjectionOptions) -> bool {
    let is_wanted = options.fov == 0.0 || options.fov >= 360.0;
    let looks_at_a_pole = coverage.shows_a_pole() && smooth(coverage.forward.norm(), ONE_WAY) >= 0.5;
    is_wanted && coverage.is_full_turn() && (coverage.goes_round_horizon || !looks_at_a_pole)
}

/// How far up photographs look in the mean.
fn mean_pitch(coverage: &SphereCoverage) -> f64 {
    let forward = coverage.forward;
    (-forward.y).atan2(forward.x.hypot(forward.z))
}

/// How much of the way up photographs are looked at that look one way and steeply: 0 where they are drawn level, 1 all
/// of it.
fn share_looked_at(coverage: &SphereCoverage) -> f64 {
    smooth(mean_pitch(coverage).abs(), STEEP) * smooth(coverage.forward.norm(), ONE_WAY)
}

/// How much photographs that are looked at steeply would be a fan that can be drawn level: 0 not at all, 1 wholly.
///
/// # Source
/// What lies a longitude aside of the middle of a conic projection leans by that times the sine of the latitude that
/// touches the cone (J. P. Snyder, "Map projections: a working manual" (1987), section 14).
fn fanned(photographs: &[PosedPhotograph], coverage: &SphereCoverage) -> f64 {
    let middle = coverage.forward_longitude();
    let aside = |photograph: &PosedPhotograph| {
        let forward = photograph.camera.forward();
        wrap_angle(forward.x.atan2(forward.z) - middle).powi(2)
    };
    let mean_square = photographs.iter().map(aside).sum::<f64>() / photographs.len().max(1) as f64;
    let sine = coverage.forward.try_normalize(f64::MIN_POSITIVE).map_or(0.0, |forward| forward.y.abs());
    let fan = smooth(mean_square.sqrt() * sine, FANNED);
    if fan == 0.0 {
        return 0.0;
    }
    let height = Seen::of(photographs, &Matrix3::identity(), PI).height();
    fan * (1.0 - smooth(height, TOO_STEEP))
}

/// By how much the viewer turns from the photographs' middle to face the nearest facade: wholly if all is still within
/// [`FACED`], less and less beyond.
fn toward_facade(coverage: &SphereCoverage, dominant: Option<&Matrix3<f64>>) -> f64 {
    let Some(facade) = dominant.and_then(|dominant| nearest_facade(dominant, coverage.middle)) else { return 0.0 };
    let turn = wrap_angle(facade - coverage.middle);
    turn * (1.0 - smooth(0.5 * coverage.span + turn.abs(), [FACED, FACED + FACED_FADE]))
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
