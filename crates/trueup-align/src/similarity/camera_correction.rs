//! What the segments of a photograph say against its camera: turns of single cameras.
//!
//! With parallax the matches of an overlap turn cameras by a fraction of a degree, a little differently at every
//! overlap. The vertical and horizontal segments of a photograph feel no parallax. Once the scene's frame is known,
//! every camera is turned so that its own segments point to the frame's directions, as far as its overlaps allow: both
//! are weighed by what they leave uncertain.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup_core::camera::Camera;
use trueup_core::geometry::{exp_rotation, nearest_rotation};
use trueup_core::matches::PairMatches;

use super::turn_equations::{RelativeCertainty, TurnEquations};
use crate::vanishing::joint::{AxisWeights, LineVote, scales};

/// Where there is parallax, a relative rotation absorbs most of it: the mean of the reciprocal depths of an overlap,
/// which acts like a rotation about the photograph's axes, is several times their spread, which is what remains to be
/// seen.
const ABSORBED_ACROSS: f64 = 4.0;
/// The same for the rotation about the viewing direction, which parallax resembles less.
const ABSORBED_ALONG: f64 = 1.5;

/// What the segments of one photograph together leave uncertain, as if each erred alone by this much. Working pixels.
const LINE_ERROR_PX: f64 = 0.5;
/// Least error of an overlap's relative rotation, working pixels; where the matches show parallax, that counts.
const MIN_OVERLAP_ERROR_PX: f64 = 0.1;

/// The certainty of every overlap from how its matches deviate from where the cameras put them.
///
/// Independent errors of matches average out; parallax moves whole regions together and is all the more wrong about the
/// rotation for it.
pub(super) fn relative_certainties(cameras: &[Camera], edges: &[PairMatches]) -> Vec<RelativeCertainty> {
    edges
        .iter()
        .map(|edge| {
            let (a, b) = (&cameras[edge.a], &cameras[edge.b]);
            let Variance { noise, parallax } = Deviations::of(a, b, edge).variance();
            let focal_px = 0.5 * (a.focal_px + b.focal_px);
            let about = |absorbed: f64| {
                let variance = noise + absorbed.powi(2) * parallax;
                focal_px.powi(2) / variance.max(MIN_OVERLAP_ERROR_PX.powi(2))
            };
            let in_camera = Vector3::new(about(ABSORBED_ACROSS), about(ABSORBED_ACROSS), about(ABSORBED_ALONG));
            let rotation = a.rotation();
            let information = rotation.tr_mul(&Matrix3::from_diagonal(&in_camera)) * rotation;
            RelativeCertainty { i: edge.a, j: edge.b, information }
        })
        .collect()
}

/// Mean squared deviations of an overlap, in square pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Variance {
    /// What independent errors of the matches leave in their mean.
    noise: f64,
    /// What whole regions deviate by together.
    parallax: f64,
}

/// The deviations of an overlap's matches from the cameras, summed per region of the first photograph.
struct Deviations {
    /// Number and sum of the deviations of every region.
    regions: Vec<(usize, Vector2<f64>)>,
    /// Sum of all squared deviations.
    squares: f64,
}

impl Deviations {
    /// Regions along each side of a photograph.
    const REGIONS: usize = 8;

    fn of(a: &Camera, b: &Camera, edge: &PairMatches) -> Self {
        let region = |position: f64, middle: f64| {
            (position / (2.0 * middle) * Self::REGIONS as f64).clamp(0.0, (Self::REGIONS - 1) as f64) as usize
        };
        let mut deviations = Self { regions: vec![(0, Vector2::zeros()); Self::REGIONS * Self::REGIONS], squares: 0.0 };
        for one in &edge.inliers {
            let Some(place) = a.transfer(b, Vector2::from(one.in_a)) else { continue };
            let deviation = Vector2::from(one.in_b) - place;
            let (column, row) = (region(one.in_a[0], a.principal_point[0]), region(one.in_a[1], a.principal_point[1]));
            let (count, sum) = &mut deviations.regions[row * Self::REGIONS + column];
            *count += 1;
            *sum += deviation;
            deviations.squares += deviation.norm_squared();
        }
        deviations
    }

    /// Analysis of variance: within the regions there is noise alone, between them noise and parallax. Without matches
    /// nothing speaks against the cameras.
    fn variance(&self) -> Variance {
        let populated = || self.regions.iter().filter(|(count, _)| *count > 0);
        let matches: usize = populated().map(|(count, _)| count).sum();
        let regions = populated().count();
        if matches == 0 {
            return Variance { noise: 0.0, parallax: 0.0 };
        }
        let explained: f64 = populated().map(|(count, sum)| sum.norm_squared() / *count as f64).sum();
        let noise = match matches > regions {
            true => (self.squares - explained).max(0.0) / (matches - regions) as f64,
            false => 0.0,
        };
        let parallax = (explained - regions as f64 * noise).max(0.0) / matches as f64;
        Variance { noise: noise / matches as f64, parallax }
    }
}

/// Largest turn of two overlapping cameras against each other that segments are believed about, degrees: as much as a
/// camera shows that moved by 20 cm, as at the end of an arm, before what is 3 m away (reasoned). What parallax leaves
/// open may be more; but furniture stands askew in rooms, and its edges are level, too.
const MOST_TURN_DEG: f64 = 4.0;

/// Which segments of a photograph are heard about its camera's turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Heard {
    All,
    Upright,
    None,
}

impl Heard {
    /// Fewer of them; `None` is none already.
    fn fewer(self) -> Option<Self> {
        match self {
            Self::All => Some(Self::Upright),
            Self::Upright => Some(Self::None),
            Self::None => None,
        }
    }
}

/// The rotations with the turns that the segments ask for. The common frame stays; `frame`'s columns are the scene's
/// directions in it.
///
/// Of a camera that would be turned against one that it overlaps by more than [`MOST_TURN_DEG`], the level segments are
/// not heard, nor the upright ones if it still is.
pub(super) fn corrected_rotations(
    rotations: &[Matrix3<f64>],
    certainties: &[RelativeCertainty],
    vote: &LineVote,
    frame: &Matrix3<f64>,
    axis_weights: AxisWeights,
) -> Vec<Matrix3<f64>> {
    let mut heard = vec![Heard::All; rotations.len()];
    loop {
        let asked = |index: usize, rotation: &Matrix3<f64>, scale: f64| match heard[index] {
            Heard::All => vote.turn_equations(index, rotation, frame, axis_weights, scale),
            Heard::Upright => vote.turn_equations(index, rotation, frame, axis_weights.upright_alone(), scale),
            Heard::None => (Matrix3::zeros(), Vector3::zeros()),
        };
        let Some(turns) = turns(rotations, certainties, asked) else { return rotations.to_vec() };
        let mut is_less = false;
        for photograph in turned_too_far(&turns, certainties) {
            if let Some(fewer) = heard[photograph].fewer() {
                heard[photograph] = fewer;
                is_less = true;
            }
        }
        if !is_less {
            let turned =
                |(rotation, turn): (&Matrix3<f64>, &Vector3<f64>)| nearest_rotation(&(rotation * exp_rotation(turn)));
            return rotations.iter().zip(&turns).map(turned).collect();
        }
    }
}

/// Of every two overlapping photographs that are turned against each other by more than [`MOST_TURN_DEG`] the one that
/// is turned more, each once.
fn turned_too_far(turns: &[Vector3<f64>], certainties: &[RelativeCertainty]) -> Vec<usize> {
    let too_far = |one: &&RelativeCertainty| (turns[one.i] - turns[one.j]).norm() > MOST_TURN_DEG.to_radians();
    let more = |one: &RelativeCertainty| if turns[one.j].norm() > turns[one.i].norm() { one.j } else { one.i };
    let mut found: Vec<usize> = certainties.iter().filter(too_far).map(more).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The turns that the segments ask for; `None` where they cannot be told. `asked`: the normal matrix and the gradient
/// of what the segments of a photograph say of its rotation, at a scale of the loss.
///
/// Minimizes sum over segments of weight (Geman-McClure) (residual / [`LINE_ERROR_PX`])^2 plus sum over overlaps of
/// (w_i - w_j)^T information (w_i - w_j) over turns w_i in the common frame whose mean is zero ([`TurnEquations`]), by
/// reweighted Gauss-Newton steps from a coarse to a fine scale of the loss. A turn of all cameras together is not
/// sought: `frame` is the segments' own choice for these.
fn turns(
    rotations: &[Matrix3<f64>],
    certainties: &[RelativeCertainty],
    asked: impl Fn(usize, &Matrix3<f64>, f64) -> (Matrix3<f64>, Vector3<f64>),
) -> Option<Vec<Vector3<f64>>> {
    let mut turns = vec![Vector3::<f64>::zeros(); rotations.len()];
    let line_information = LINE_ERROR_PX.powi(-2);
    for scale in scales() {
        let equations: Vec<(Matrix3<f64>, Vector3<f64>)> = rotations
            .iter()
            .zip(&turns)
            .enumerate()
            .map(|(index, (rotation, turn))| {
                let turned = rotation * exp_rotation(turn);
                let (normal, gradient) = asked(index, &turned, scale);
                // The residual is linearized at the present turn; the unknown is the whole turn.
                (normal * line_information, (normal * turn - gradient) * line_information)
            })
            .collect();
        let (normals, right): (Vec<_>, Vec<_>) = equations.into_iter().unzip();
        turns = TurnEquations::new(&normals, certainties)?.solve(&right);
    }
    turns.iter().all(|turn| turn.iter().all(|value| value.is_finite())).then_some(turns)
}

/// Covariance of every camera's own turn in the common frame, rad^2: what its segments and its overlaps leave open of
/// the turns of [`corrected_rotations`], for rotations that these have corrected. `None` where nothing can be told.
pub(super) fn turn_covariances(
    rotations: &[Matrix3<f64>],
    certainties: &[RelativeCertainty],
    vote: &LineVote,
    frame: &Matrix3<f64>,
    axis_weights: AxisWeights,
) -> Option<Vec<Matrix3<f64>>> {
    let scale = scales().last()?;
    let normal = |(index, rotation): (usize, &Matrix3<f64>)| {
        let (normal, _) = vote.turn_equations(index, rotation, frame, axis_weights, scale);
        normal * LINE_ERROR_PX.powi(-2)
    };
    let normals: Vec<Matrix3<f64>> = rotations.iter().enumerate().map(normal).collect();
    Some(TurnEquations::new(&normals, certainties)?.covariances())
}

#[cfg(test)]
mod tests {
    use trueup_core::matches::PointMatch;

    use super::super::options::SimilarityOptions;
    use super::super::synthetic::{FOCAL_PX, SIZE, Sweep, SyntheticScene, World, joined};
    use super::super::tests::with_lines;
    use super::*;

    fn still() -> Camera {
        Camera::new(FOCAL_PX, SIZE.0, SIZE.1, &Matrix3::identity())
    }

    /// Matches of two equal cameras that deviate as `deviation` says of each of 8 x 8 regions, twice in each.
    fn pair(deviation: impl Fn(usize, usize) -> f64) -> PairMatches {
        let mut matches = Vec::new();
        for region in 0..64 {
            let in_a = [(f64::from(region % 8) + 0.5) * SIZE.0 / 8.0, (f64::from(region / 8) + 0.5) * SIZE.1 / 8.0];
            for turn in 0..2 {
                matches.push(PointMatch { in_a, in_b: [in_a[0] + deviation(region as usize, turn), in_a[1]] });
            }
        }
        joined(0, 1, matches)
    }

    /// By hand: regions that deviate by 2 px to alternating sides have a variance of 4 square pixels and no noise;
    /// matches that deviate by 2 px to alternating sides inside every region have 128 x 4 square pixels on 64 degrees
    /// of freedom, 8, over 128 matches.
    #[test]
    fn regions_show_parallax_and_their_insides_show_noise() {
        let camera = still();
        let sign = |number: usize| if number.is_multiple_of(2) { 2.0 } else { -2.0 };
        let of = |pair: &PairMatches| Deviations::of(&camera, &camera, pair).variance();
        let together = of(&pair(|region, _| sign(region)));
        assert!((together.parallax - 4.0).abs() < 1e-9 && together.noise.abs() < 1e-9, "{together:?}");
        let apart = of(&pair(|_, turn| sign(turn)));
        assert!(apart.parallax.abs() < 1e-9 && (apart.noise - 8.0 / 128.0).abs() < 1e-9, "{apart:?}");
        assert_eq!(of(&joined(0, 1, Vec::new())), Variance { noise: 0.0, parallax: 0.0 });
    }

    /// A sweep whose overlaps hold matches at their true places.
    fn sweep(camera_noise_deg: f64) -> SyntheticScene {
        let world = World::Manhattan { noise_deg: 1.0, bad_share: 0.0 };
        let mut scene = with_lines(SyntheticScene::new(Sweep::default(), world, camera_noise_deg, 21), 20, 0.3);
        let truth: Vec<Camera> = scene
            .world_from_camera
            .iter()
            .map(|world_from_camera| Camera::new(FOCAL_PX, SIZE.0, SIZE.1, &world_from_camera.transpose()))
            .collect();
        for edge in &mut scene.edges {
            for place in 0..400 {
                let in_a = [f64::from(place % 20) * SIZE.0 / 20.0, f64::from(place / 20) * SIZE.1 / 20.0];
                let Some(there) = truth[edge.a].transfer(&truth[edge.b], Vector2::from(in_a)) else { continue };
                if (0.0..SIZE.0).contains(&there.x) && (0.0..SIZE.1).contains(&there.y) {
                    edge.inliers.push(PointMatch { in_a, in_b: there.into() });
                }
            }
        }
        scene
    }

    fn largest(values: &[f64]) -> f64 {
        values.iter().copied().fold(0.0, f64::max)
    }

    #[test]
    fn segments_correct_cameras_that_their_overlaps_contradict() {
        let scene = sweep(0.5);
        let errors = |camera_correction: bool| {
            let options = SimilarityOptions { camera_correction, ..SimilarityOptions::default() };
            largest(&scene.errors_deg(&scene.prior(&options)))
        };
        let (corrected, given) = (errors(true), errors(false));
        assert!(given > 0.5 && corrected < 0.2, "{corrected} and {given} degrees");
    }

    /// All segments of one photograph are turned by half a degree against what its overlaps know for certain.
    #[test]
    fn segments_do_not_turn_cameras_that_overlaps_are_sure_of() {
        let mut scene = sweep(0.0);
        let (sine, cosine) = 0.5_f64.to_radians().sin_cos();
        let center = Vector2::new(SIZE.0, SIZE.1) / 2.0;
        for line in &mut scene.lines[3] {
            for end in [&mut line.start, &mut line.end] {
                let from = Vector2::from(*end) - center;
                *end = (center + Vector2::new(cosine * from.x - sine * from.y, sine * from.x + cosine * from.y)).into();
            }
        }
        let errors = scene.errors_deg(&scene.prior(&SimilarityOptions::default()));
        assert!(largest(&errors) < 0.15, "{errors:?}");
    }

    /// Of overlaps (0, 1) and (1, 2) the first is turned by 3 degrees, the second by 5, most of it the third
    /// photograph's.
    #[test]
    fn of_two_cameras_turned_too_far_the_one_that_is_turned_more_is_named() {
        let turns = [-1.0_f64, 2.0, -3.0].map(|degrees| Vector3::new(0.0, degrees.to_radians(), 0.0));
        let overlap = |i, j| RelativeCertainty { i, j, information: Matrix3::identity() };
        assert_eq!(turned_too_far(&turns, &[overlap(0, 1), overlap(1, 2)]), [2]);
        assert_eq!(turned_too_far(&turns, &[overlap(0, 1)]), [0_usize; 0]);
    }
}
