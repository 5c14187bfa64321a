//! Whether the photographs show something flat from places of their own: a scanned map, a mural, the ground from the
//! air.
//!
//! What rotating cameras explain, cameras before a plane explain as well: all from one place, with any plane. A flat
//! scene is therefore told by what rotating cameras do not explain, or explain by a lens that nobody has: moving
//! cameras look to them like rotating ones through an ever longer lens, since far things move across a picture without
//! being seen from aside.

use std::collections::BTreeMap;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::geometry::Homography;
use trueup_core::lines::LineSegment;
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::statistics::median_of;
use trueup_core::{Error, Result, StageContext};

use super::bundle::{COARSE_HUBER_PX, FINE_HUBER_PX};
use super::intrinsics::{FreeTerms, IntrinsicsModel, LensState, RADIAL, only_focal};
use super::observations::{MATCHES_PER_PAIR, Observations};
use super::options::{CameraOptions, FocalSharing, LensKind, SceneModel};
use super::plane_adjustment::{PlaneAdjustment, PlaneParameters};
use super::plane_camera::PlaneCamera;
use super::prior::CameraPrior;
use super::upright_plane::turn_by_lines;

/// Distance of a match, in working pixels, from which on it counts as wrong, and no more the farther it is.
const WRONG_PX: f64 = 10.0;
/// Distance up to which a match is explained, working pixels: a few times the error of a match.
const EXPLAINED_PX: f64 = 3.0;
/// Share of all matches that a plane explains where the scene is flat. What stands before a facade or lies on the
/// ground takes a few percent in every photograph.
const LEAST_EXPLAINED: f64 = 0.95;
/// The same of every single photograph.
const LEAST_EXPLAINED_OF_EACH: f64 = 0.85;
/// Share of all matches that homographies of each pair alone explain where a plane may explain [`LEAST_EXPLAINED`]:
/// what a plane carries from one photograph into another is a homography but for their lenses, which may bend a tenth
/// of the matches away.
const LEAST_EXPLAINED_PAIR_BY_PAIR: f64 = 0.85;
/// Times that rotating cameras' residual is that of the plane where it is clearly better.
const CLEARLY_BETTER: f64 = 2.0;
/// Root mean square residual of rotating cameras, in working pixels, that is more than noise.
const MORE_THAN_NOISE_PX: f64 = 1.5;
/// Fewer photographs do not tell a flat scene from a facade seen by a photographer who went a step aside, unless as
/// scans.
const FEWEST: usize = 3;
/// Focal length, in longer sides of the photograph, beyond which rotating cameras are not believed unless they record
/// it: a field of view of 7 degrees. Rows through such a lens are as flat as scans.
const LONGEST_BELIEVED: f64 = 8.0;
/// The same where a scanner would have taken the photographs as well: 19 degrees.
const LONGEST_BESIDE_SCANS: f64 = 3.0;
/// Times that the residual of scans may be that of rotating or tilted cameras, which have more to fit with: paper
/// curls, and lenses and tilts imitate that.
const AS_GOOD: f64 = 1.5;
/// Share of all matches that scans explain: less than any other plane, for the curl of the paper.
const LEAST_EXPLAINED_OF_SCANS: f64 = 0.75;
/// Largest difference of scale among scans, relative: a scanner has one resolution.
const ONE_SCALE: f64 = 0.02;
/// Focal lengths that refinement starts from where none is known, in longer sides: telephones, and what was enlarged.
const START_FOCALS: [f64; 2] = [0.9, 2.5];
/// A lens is kept where it lowers the sum of squares by so many times the matches' own mean square: five standard
/// deviations.
const LENS_SIGNIFICANCE: f64 = 25.0;
/// Fewer pairs do not tell of a lens.
const FEWEST_PAIRS_FOR_LENS: usize = 3;
/// Largest tilt of a camera from the plane's normal that is drawn, radians: 70 degrees.
const LARGEST_TILT: f64 = 1.22;

/// A plane and the cameras before it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlatScene {
    /// One per photograph. The plane's unit is about a working pixel; photographs stand upright on it in the mean.
    pub cameras: Vec<PlaneCamera>,
    /// Why the scene is taken for flat.
    pub evidence: FlatEvidence,
    /// Clockwise turn, radians, that lines on the plane ask for beyond what the photographs' own up and down say;
    /// `None` where they do not agree.
    #[serde(default)]
    pub turned_by_lines: Option<f64>,
}

impl FlatScene {
    /// The scene turned clockwise so that its lines lie along rows and columns, where they agree on how, and by `turn`,
    /// radians, beyond that. `lines` has the segments of every photograph.
    #[must_use]
    pub fn stood_upright(&self, lines: &[Vec<LineSegment>], turn: f64) -> Self {
        let turned_by_lines = turn_by_lines(&self.cameras, lines);
        let all = turned_by_lines.unwrap_or(0.0) + turn;
        Self { cameras: self.cameras.iter().map(|one| one.turned(all)).collect(), turned_by_lines, ..*self }
    }

    /// Pixels of the photographs per unit of the plane: the median.
    pub fn pixels_per_unit(&self) -> f64 {
        median_of(self.cameras.iter().map(PlaneCamera::pixels_per_unit)).unwrap_or_default()
    }
}

/// How well a plane and how well rotating cameras explain the matches.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FlatEvidence {
    /// Whether the user said that the scene is flat.
    pub told: bool,
    /// Share of the matches that the plane explains to 3 working pixels, 0 to 1.
    pub explained: f64,
    /// Root mean square residual of the matches on the plane, working pixels; none counts for more than 10.
    pub plane_rms_px: f64,
    /// The same of rotating cameras.
    pub rotating_rms_px: f64,
    /// Focal length that rotating cameras would need, in longer sides of the photographs: the median.
    pub rotating_focal: f64,
    /// Whether all cameras look at the plane straight on and at one scale, as a scanner does: their focal length cannot
    /// be told, and does not matter.
    pub straight_on: bool,
}

/// What flat scenes are looked for in.
pub(super) struct FlatInput<'a> {
    pub priors: &'a [CameraPrior],
    /// All joined pairs.
    pub pairs: &'a [PairMatches],
    /// The best rotating cameras.
    pub rotating: &'a [Camera],
    /// The photograph that the others are placed by.
    pub anchor: usize,
}

/// The plane, if the photographs show one from moving cameras, or the user says so.
///
/// # Errors
/// [`Error::NotApplicable`] if the user says so and no plane can be found; [`Error::Cancelled`].
pub(super) fn find(
    input: &FlatInput<'_>,
    options: &CameraOptions,
    context: &StageContext,
) -> Result<Option<FlatScene>> {
    let told = options.scene == SceneModel::Plane;
    if options.scene == SceneModel::Rotating {
        return Ok(None);
    }
    let rotating = Residuals::of(input, |from, to, pixel| input.rotating[from].transfer(&input.rotating[to], pixel));
    let relative = |(prior, camera): (&CameraPrior, &Camera)| camera.focal_px / prior.longer();
    let rotating_focal = median_of(input.priors.iter().zip(input.rotating).map(relative)).unwrap_or_default();
    let is_longer_than =
        |limit: f64| rotating_focal > limit && input.priors.iter().all(|prior| prior.focal_px.is_none());
    // The search takes longer than the rotating cameras: where nothing recorded holds their focal length, moving ones
    // would have drawn it out.
    let is_recorded = input.priors.iter().any(|prior| prior.focal_px.is_some());
    let is_bad = input.priors.len() >= FEWEST
        && rotating.rms_px > MORE_THAN_NOISE_PX
        && (is_recorded || is_longer_than(LONGEST_BESIDE_SCANS))
        && {
            let pair_by_pair = by_homographies(input);
            pair_by_pair.explained >= LEAST_EXPLAINED_PAIR_BY_PAIR
                && rotating.rms_px > CLEARLY_BETTER * pair_by_pair.rms_px
        };
    // From no place before a plane is more than half of all directions seen.
    let are_all_round = rotating.rms_px <= MORE_THAN_NOISE_PX && look_all_round(input.rotating);
    let may_be_scans = told || is_longer_than(LONGEST_BESIDE_SCANS);
    if !(told || is_bad || may_be_scans && !are_all_round) {
        return Ok(None);
    }
    let search = PlaneSearch::new(input, options, context);
    let of_plane =
        |cameras: &[PlaneCamera]| Residuals::of(input, |from, to, pixel| cameras[from].transfer(&cameras[to], pixel));
    let evidence = |plane: &Residuals, straight_on: bool| FlatEvidence {
        told,
        explained: plane.explained,
        plane_rms_px: plane.rms_px,
        rotating_rms_px: rotating.rms_px,
        rotating_focal,
        straight_on,
    };
    let are_scans = |plane: &Residuals| {
        let as_good_as_rotating = plane.rms_px <= AS_GOOD * rotating.rms_px;
        told || as_good_as_rotating && plane.explained >= LEAST_EXPLAINED_OF_SCANS
    };
    let scans = if may_be_scans { search.straight_on()? } else { None };
    let scans = scans.filter(|cameras| is_at_one_scale(cameras)).map(|cameras| (of_plane(&cameras), cameras));
    let scans = scans.filter(|(plane, _)| are_scans(plane));
    // Tilted cameras take the longest to find: not where they would be believed in no case.
    if scans.is_none() && !(told || is_bad || is_longer_than(LONGEST_BELIEVED)) {
        return Ok(None);
    }
    let tilted = search.tilted()?;
    let tilted = tilted.map(|cameras| (of_plane(&cameras), cameras));
    let as_good_as_tilted =
        |plane: &Residuals| tilted.as_ref().is_none_or(|(tilted, _)| plane.rms_px <= AS_GOOD * tilted.rms_px);
    if let Some((plane, cameras)) = scans.filter(|(plane, _)| as_good_as_tilted(plane)) {
        return Ok(Some(FlatScene { cameras, evidence: evidence(&plane, true), turned_by_lines: None }));
    }
    let Some((plane, cameras)) = tilted else {
        return refused(told, "no cameras before a plane explain the matches");
    };
    if !all_drawn(input, &cameras) {
        return refused(told, "a photograph looks along the plane that explains the matches best");
    }
    let is_explained = plane.explained >= LEAST_EXPLAINED && plane.least_explained >= LEAST_EXPLAINED_OF_EACH;
    let is_clear = rotating.rms_px > CLEARLY_BETTER * plane.rms_px && is_bad;
    let is_flat = told || is_explained && (is_clear || is_longer_than(LONGEST_BELIEVED));
    Ok(is_flat.then(|| FlatScene { cameras, evidence: evidence(&plane, false), turned_by_lines: None }))
}

/// How far matches land from where a homography of each pair alone puts them: as near as any plane can bring them, but
/// for a lens.
fn by_homographies(input: &FlatInput<'_>) -> Residuals {
    let of_pair = |pair: &PairMatches| {
        let points = |point: fn(&PointMatch) -> [f64; 2]| -> Vec<Vector2<f64>> {
            pair.inliers.iter().map(|one| Vector2::from(point(one))).collect()
        };
        let b_from_a = Homography::fit(&points(|one| one.in_a), &points(|one| one.in_b), None)?;
        Some([((pair.a, pair.b), b_from_a), ((pair.b, pair.a), b_from_a.inverse()?)])
    };
    let homographies: BTreeMap<(usize, usize), Homography> = input.pairs.iter().filter_map(of_pair).flatten().collect();
    Residuals::of(input, |from, to, pixel| Some(homographies.get(&(from, to))?.apply(pixel)))
}

/// Whether there is no direction within 90 degrees of which all cameras look, or hardly one.
///
/// # Source
/// Rosenblatt's perceptron (1958): a direction that all are within 90 degrees of, with a margin m in the cosine, is
/// found in 1 / m^2 corrections.
fn look_all_round(cameras: &[Camera]) -> bool {
    const CORRECTIONS: usize = 200;
    let forward: Vec<Vector3<f64>> = cameras.iter().map(Camera::forward).collect();
    let mut middle: Vector3<f64> = forward.iter().sum();
    for _ in 0..CORRECTIONS {
        let aside = |one: &&Vector3<f64>| one.dot(&middle);
        let Some(worst) = forward.iter().min_by(|one, other| aside(one).total_cmp(&aside(other))) else { return false };
        if aside(&worst) > 0.0 {
            return false;
        }
        middle += worst;
    }
    true
}

/// Whether the cameras have one resolution on the plane.
fn is_at_one_scale(cameras: &[PlaneCamera]) -> bool {
    let scales = cameras.iter().map(PlaneCamera::pixels_per_unit);
    let (least, most) = scales.fold((f64::INFINITY, 0.0_f64), |(least, most), one| (least.min(one), most.max(one)));
    most <= least * (1.0 + ONE_SCALE)
}

fn refused(told: bool, reason: &str) -> Result<Option<FlatScene>> {
    match told {
        false => Ok(None),
        true => Err(Error::not_applicable(
            "cameras.scene = plane",
            reason,
            "Leave cameras.scene to auto, or give photographs that look at the plane within 70 degrees of straight on.",
        )),
    }
}

/// Whether every photograph shows the plane all over.
fn all_drawn(input: &FlatInput<'_>, cameras: &[PlaneCamera]) -> bool {
    cameras.iter().zip(input.priors).all(|(camera, prior)| {
        let (width, height) = (prior.frame.width, prior.frame.height);
        let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
        camera.tilt() < LARGEST_TILT && corners.iter().all(|&corner| camera.place(Vector2::from(corner)).is_some())
    })
}

/// The search for the cameras before a plane that explain the matches best.
struct PlaneSearch<'a> {
    input: &'a FlatInput<'a>,
    observations: Observations,
    model: IntrinsicsModel,
    options: &'a CameraOptions,
    context: &'a StageContext<'a>,
}

impl<'a> PlaneSearch<'a> {
    fn new(input: &'a FlatInput<'a>, options: &'a CameraOptions, context: &'a StageContext<'a>) -> Self {
        let used: Vec<&PairMatches> = input.pairs.iter().collect();
        let observations = Observations::choose(input.priors, &used, MATCHES_PER_PAIR);
        let model = match options.focal_sharing {
            FocalSharing::PerPicture => IntrinsicsModel::per_photograph(input.priors.len()),
            FocalSharing::Auto | FocalSharing::Shared => IntrinsicsModel::shared(input.priors),
        };
        Self { input, observations, model, options, context }
    }

    /// The problem from a focal length in longer sides, for photographs of which none is known.
    fn problem(&self, start: f64, may_tilt: bool) -> PlaneAdjustment<'_> {
        let priors = self.input.priors;
        let focal_px =
            |prior: &CameraPrior| prior.believable_focal_px(prior.focal_px.unwrap_or(start * prior.longer()));
        PlaneAdjustment {
            priors,
            observations: &self.observations,
            start_focal_px: priors.iter().map(focal_px).collect(),
            focal_sd: priors.iter().map(|prior| prior.focal_sd(self.options)).collect(),
            anchor: self.input.anchor,
            may_tilt,
        }
    }

    fn lenses(&self) -> Vec<LensState> {
        let priors = self.input.priors;
        priors.iter().map(|prior| prior.lens.map(LensState::from).unwrap_or_default()).collect()
    }

    /// Cameras that look at the plane straight on, as a scanner does; their focal length is the usual one.
    fn straight_on(&self) -> Result<Option<Vec<PlaneCamera>>> {
        let problem = self.problem(START_FOCALS[0], false);
        let fixed = IntrinsicsModel::fixed(self.input.priors.len());
        let Some(start) = problem.straight_on(self.lenses()) else { return Ok(None) };
        let fine = problem.minimize(start, &fixed, FINE_HUBER_PX, self.context)?;
        Ok(finished(&fine.cameras(self.input.priors)))
    }

    /// Cameras that look at the plane as they like.
    fn tilted(&self) -> Result<Option<Vec<PlaneCamera>>> {
        let priors = self.input.priors;
        let all_known = priors.iter().all(|prior| prior.focal_px.is_some());
        let starts = if all_known { &START_FOCALS[..1] } else { &START_FOCALS[..] };
        let mut best: Option<(f64, PlaneAdjustment, PlaneParameters)> = None;
        for &start in starts {
            let problem = self.problem(start, true);
            let Some(straight_on) = problem.straight_on(self.lenses()) else { continue };
            let coarse = problem.minimize(straight_on, &self.model, COARSE_HUBER_PX, self.context)?;
            let cost = problem.cost(&coarse, &self.model, FINE_HUBER_PX);
            if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                best = Some((cost, problem, coarse));
            }
        }
        let Some((_, problem, coarse)) = best else { return Ok(None) };
        let fine = problem.minimize(coarse, &self.model, FINE_HUBER_PX, self.context)?;
        let with_lens = self.with_lens(&problem, &fine)?;
        Ok(finished(&with_lens.unwrap_or(fine).cameras(priors)))
    }

    /// The state with a radial term of every lens, if the matches are sure of it.
    fn with_lens(&self, problem: &PlaneAdjustment, without: &PlaneParameters) -> Result<Option<PlaneParameters>> {
        let priors = problem.priors;
        let may_bend = matches!(self.options.kind_of_lens(), LensKind::Auto | LensKind::Rectilinear);
        let is_told = priors.iter().any(|prior| prior.lens.is_some());
        let is_shared = self.options.focal_sharing != FocalSharing::PerPicture;
        if !may_bend || is_told || !is_shared || problem.observations.pairs.len() < FEWEST_PAIRS_FOR_LENS {
            return Ok(None);
        }
        let groups: Vec<usize> = priors.iter().map(|prior| prior.camera_group).collect();
        let mut free: FreeTerms = only_focal();
        free[RADIAL] = true;
        let count = groups.iter().max().map_or(0, |last| last + 1);
        let bending = IntrinsicsModel::grouped(&groups, &vec![free; count]);
        let with = problem.minimize(without.clone(), &bending, FINE_HUBER_PX, self.context)?;
        let matches: usize = problem.observations.pairs.iter().map(|pair| pair.matches.len()).sum();
        let before = problem.cost(without, &self.model, FINE_HUBER_PX);
        let after = problem.cost(&with, &bending, FINE_HUBER_PX);
        // The square of a match's distance: its two directions say the same twice.
        let mean_square = after / matches.max(1) as f64;
        Ok((before - after > LENS_SIGNIFICANCE * mean_square).then_some(with))
    }
}

/// The cameras with the plane turned so that photographs stand upright on it in the mean; `None` if one is nowhere.
fn finished(cameras: &[PlaneCamera]) -> Option<Vec<PlaneCamera>> {
    let is_finite = |one: &PlaneCamera| {
        one.distance.is_finite() && one.distance > 0.0 && one.camera.rotation().iter().all(|entry| entry.is_finite())
    };
    cameras.iter().all(is_finite).then(|| upright_in_the_mean(cameras))
}

/// The plane turned so that what is up in the photographs is up on it, in the mean.
fn upright_in_the_mean(cameras: &[PlaneCamera]) -> Vec<PlaneCamera> {
    let (sine, cosine) = cameras
        .iter()
        .map(PlaneCamera::roll)
        .fold((0.0, 0.0), |(sine, cosine), roll| (sine + roll.sin(), cosine + roll.cos()));
    cameras.iter().map(|camera| camera.turned(-sine.atan2(cosine))).collect()
}

/// How far matches land from where cameras put them.
struct Residuals {
    /// Root mean square of all, none for more than [`WRONG_PX`].
    rms_px: f64,
    /// Share up to [`EXPLAINED_PX`].
    explained: f64,
    /// The same in the photograph that has the smallest.
    least_explained: f64,
}

impl Residuals {
    /// Of all matches, in the worse direction, by where `transfer` carries a pixel from one photograph to another.
    fn of(input: &FlatInput<'_>, transfer: impl Fn(usize, usize, Vector2<f64>) -> Option<Vector2<f64>>) -> Self {
        /// Matches of a photograph, and those of them that are explained.
        #[derive(Clone, Copy, Default)]
        struct Count {
            all: usize,
            explained: usize,
        }
        impl Count {
            fn add(&mut self, is_explained: bool) {
                self.all += 1;
                self.explained += usize::from(is_explained);
            }

            fn share(self) -> f64 {
                self.explained as f64 / self.all.max(1) as f64
            }
        }
        let (mut squares, mut overall) = (0.0, Count::default());
        let mut of_each = vec![Count::default(); input.priors.len()];
        for pair in input.pairs {
            for one in &pair.inliers {
                let (a, b) = (Vector2::from(one.in_a), Vector2::from(one.in_b));
                let apart = |from: usize, to: usize, source: Vector2<f64>, target: Vector2<f64>| {
                    transfer(from, to, source).map_or(f64::INFINITY, |place| (place - target).norm())
                };
                let worse = apart(pair.a, pair.b, a, b).max(apart(pair.b, pair.a, b, a));
                squares += worse.min(WRONG_PX).powi(2);
                let is_explained = worse <= EXPLAINED_PX;
                overall.add(is_explained);
                of_each[pair.a].add(is_explained);
                of_each[pair.b].add(is_explained);
            }
        }
        Self {
            rms_px: (squares / overall.all.max(1) as f64).sqrt(),
            explained: overall.share(),
            least_explained: of_each.into_iter().map(Count::share).fold(1.0, f64::min),
        }
    }
}

#[cfg(test)]
#[path = "flat_scene_tests.rs"]
mod tests;
