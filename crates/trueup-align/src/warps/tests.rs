//! Photographs with exactly known cameras, and what holds for every model.

use nalgebra::{Matrix2, Matrix3};
use trueup_core::Error;
use trueup_core::camera::Camera;
use trueup_core::geometry::rotation_about_y;
use trueup_core::lens::{LensTerms, PlacedLens};
use trueup_core::matches::{PairMatches, PairVerdict, PointMatch, PointMatches};
use trueup_core::source::WorkingFrame;

use super::*;

/// Width of the test photographs.
pub(super) const WIDTH: f64 = 800.0;
/// Height of the test photographs.
pub(super) const HEIGHT: f64 = 600.0;
const FOCAL_PX: f64 = 700.0;

/// A set of photographs with matches by their cameras.
pub(super) struct Example {
    pub cameras: Vec<Camera>,
    pub frames: Vec<WorkingFrame>,
    pub grids: Vec<GridMesh>,
    pub pairs: Vec<PairMatches>,
    pub names: Vec<String>,
    pub seeds: Vec<u64>,
    pub reference: usize,
}

impl Example {
    /// Cameras panned to these yaws in degrees; neighbors in the list overlap.
    pub(super) fn panned(yaws_deg: &[f64], reference: usize) -> Self {
        let turned = |yaw: &f64| Camera::new(FOCAL_PX, WIDTH, HEIGHT, &rotation_about_y(yaw.to_radians()).transpose());
        Self::new(yaws_deg.iter().map(turned).collect(), reference)
    }

    pub(super) fn new(cameras: Vec<Camera>, reference: usize) -> Self {
        let carry = |a: usize, b: usize, point| cameras[a].transfer(&cameras[b], point);
        let pairs = (1..cameras.len()).map(|b| matched(b - 1, b, |point| carry(b - 1, b, point))).collect();
        Self::with_pairs(cameras, pairs, reference)
    }

    pub(super) fn with_pairs(cameras: Vec<Camera>, pairs: Vec<PairMatches>, reference: usize) -> Self {
        let count = cameras.len();
        Self {
            cameras,
            frames: vec![WorkingFrame { width: WIDTH, height: HEIGHT, working_from_full: 1.0 }; count],
            grids: vec![GridMesh::regular(WIDTH, HEIGHT, 20.0); count],
            pairs,
            names: (0..count).map(|k| format!("{k}.jpg")).collect(),
            seeds: (0..count as u64).collect(),
            reference,
        }
    }

    /// The same photographs and matches counted from the other end.
    pub(super) fn reversed(&self) -> Self {
        let last = self.cameras.len() - 1;
        let swapped = |one: &PointMatch| PointMatch { in_a: one.in_b, in_b: one.in_a };
        let turned = |pair: &PairMatches| PairMatches {
            a: last - pair.b,
            b: last - pair.a,
            inliers: pair.inliers.iter().map(swapped).collect(),
            ..pair.clone()
        };
        let pairs = self.pairs.iter().rev().map(turned).collect();
        let mut reversed = Self::with_pairs(self.cameras.iter().rev().copied().collect(), pairs, last - self.reference);
        reversed.names = self.names.iter().rev().cloned().collect();
        reversed.seeds = self.seeds.iter().rev().copied().collect();
        reversed
    }

    pub(super) fn input(&self) -> WarpInput<'_> {
        WarpInput {
            cameras: &self.cameras,
            frames: &self.frames,
            grids: &self.grids,
            pairs: &self.pairs,
            match_grids: &self.grids,
            overlaps: &[],
            names: &self.names,
            seeds: &self.seeds,
            reference: self.reference,
            level_from_world: Matrix3::identity(),
            cut_yaw: None,
            turn: 0.0,
        }
    }

    pub(super) fn place(&self, model: WarpModel) -> Result<WarpedMesh> {
        self.place_with(model, &WarpOptions::default())
    }

    /// With other limits than those that a user meets.
    pub(super) fn place_within(&self, model: WarpModel, limits: &Limits) -> Result<WarpedMesh> {
        run_within(model, &self.input(), &WarpOptions::default(), limits, &StageContext::default())
    }

    pub(super) fn place_with(&self, model: WarpModel, options: &WarpOptions) -> Result<WarpedMesh> {
        run(model, &self.input(), options, &StageContext::default())
    }
}

/// Matches spread over the part of photograph a that `b_from_a` carries into photograph b.
pub(super) fn matched(a: usize, b: usize, b_from_a: impl Fn(Vector2<f64>) -> Option<Vector2<f64>>) -> PairMatches {
    let frame = WorkingFrame { width: WIDTH, height: HEIGHT, working_from_full: 1.0 };
    let inliers: Vec<PointMatch> = (0..1500)
        .map(|k| Vector2::new((f64::from(k) * 0.618).fract() * WIDTH, (f64::from(k) * 0.755).fract() * HEIGHT))
        .filter_map(|in_a| {
            let in_b = b_from_a(in_a)?;
            frame.contains(in_b.x, in_b.y).then(|| PointMatch { in_a: in_a.into(), in_b: in_b.into() })
        })
        .collect();
    let agreeing = inliers.len();
    PairMatches {
        a,
        b,
        putative: agreeing,
        in_overlap: agreeing,
        agreeing,
        needed: 15,
        verdict: PairVerdict::Joined,
        b_from_a: None,
        inliers: inliers.into(),
        elsewhere: PointMatches::default(),
    }
}

/// Largest distance between the places of matched points.
pub(super) fn misalignment(example: &Example, meshes: &[GridMesh]) -> f64 {
    example
        .pairs
        .iter()
        .flat_map(|pair| pair.inliers.iter().map(move |one| (pair, one)))
        .map(|(pair, one)| {
            (meshes[pair.a].warp(Vector2::from(one.in_a)) - meshes[pair.b].warp(Vector2::from(one.in_b))).norm()
        })
        .fold(0.0, f64::max)
}

#[test]
fn homographies_meet_and_leave_the_reference_in_place() {
    let example = Example::panned(&[-25.0, 0.0, 25.0], 1);
    for homographies in [HomographySource::Cameras, HomographySource::Pairs] {
        let options = WarpOptions { homographies, ..WarpOptions::default() };
        let placed = example.place_with(WarpModel::Homography, &options).expect("a narrow set");
        assert_eq!(placed.folds, 0);
        // What is left is the bilinear cell's distance from the homography.
        assert!(misalignment(&example, &placed.meshes) < 0.5, "{}", misalignment(&example, &placed.meshes));
        for vertex in 0..example.grids[1].len() {
            let apart = Vector2::from(placed.meshes[1].target[vertex]) - example.grids[1].source(vertex);
            assert!(apart.norm() < 1e-9);
        }
        // The center of the photograph panned by 25 degrees lies at f tan 25.
        let center = placed.meshes[2].warp(Vector2::new(WIDTH / 2.0, HEIGHT / 2.0));
        let expected = WIDTH / 2.0 + FOCAL_PX * 25_f64.to_radians().tan();
        assert!((center.x - expected).abs() < 0.1 && (center.y - HEIGHT / 2.0).abs() < 0.1, "{center}");
    }
}

/// A barrel of -4 % at the corners: what meets are the places where pinholes would show the matches.
#[test]
fn homographies_behind_a_lens_meet() {
    let terms = LensTerms { radial: [-0.1, 0.0, 0.0, 0.0], ..LensTerms::default() };
    let lens = PlacedLens { terms, center_px: [0.0; 2] };
    let pinholes = Example::panned(&[0.0, 20.0, 40.0], 1).cameras;
    let bent = Example::new(pinholes.into_iter().map(|camera| camera.through(&lens)).collect(), 1);
    for model in [WarpModel::Homography, WarpModel::Sphp, WarpModel::SphpFree, WarpModel::QuasiHomography] {
        let placed = bent.place(model).expect("narrow enough");
        let apart = |pair: &PairMatches| {
            let meshes = [&placed.meshes[pair.a], &placed.meshes[pair.b]];
            let of_match =
                move |one: &PointMatch| (meshes[0].warp(one.in_a.into()) - meshes[1].warp(one.in_b.into())).norm();
            pair.inliers.iter().map(of_match).fold(0.0, f64::max)
        };
        let farthest = bent.pairs.iter().map(apart).fold(0.0, f64::max);
        assert!(farthest < 0.5, "{model:?}: {farthest}");
    }
}

/// The derivative of the places where a pinhole would show the pixels of a photograph, against differences; a pinhole's
/// own stay.
#[test]
fn straightening_moves_as_its_derivative_says() {
    let terms = LensTerms { radial: [-0.1, 0.02, 0.0, 0.0], ..LensTerms::default() };
    let lens = PlacedLens { terms, center_px: [12.0, -7.0] };
    let cameras = Example::panned(&[0.0, 20.0], 0).cameras;
    let bent = Example::new(vec![cameras[0], cameras[1].through(&lens)], 0);
    let input = bent.input();
    for pixel in [[0.0, 0.0], [400.0, 300.0], [790.0, 20.0], [100.0, 580.0]].map(Vector2::from) {
        assert_eq!(input.straight_jacobian(0, pixel), Some(Matrix2::identity()));
        let jacobian = input.straight_jacobian(1, pixel).expect("seen");
        for axis in 0..2 {
            let mut step = Vector2::zeros();
            step[axis] = 1e-3;
            let difference = (input.straight(1, pixel + step) - input.straight(1, pixel - step)) / 2e-3;
            assert!((jacobian.column(axis) - difference).norm() < 1e-6, "{pixel} {axis}: {jacobian} {difference}");
        }
    }
}

#[test]
fn too_wide_a_field_of_view_is_refused_with_its_angle() {
    let example = Example::panned(&[0.0, 30.0, 60.0, 90.0], 0);
    for homographies in [HomographySource::Cameras, HomographySource::Pairs] {
        let options = WarpOptions { homographies, ..WarpOptions::default() };
        let error = example.place_with(WarpModel::Homography, &options).expect_err("a photograph at 90 degrees");
        assert!(matches!(error, Error::NotApplicable { .. }), "{error}");
        let message = error.to_string();
        assert!(message.contains("method homography") && message.contains("3.jpg"), "{message}");
        // 90 degrees and half the photograph's width, atan(400 / 700) = 29.7 degrees, lowered by the corner's height:
        // acos(-sin 29.7 cos 20.4) = 117.7 degrees.
        assert!(message.contains("reaches 118 degrees from the axis of 0.jpg"), "{message}");
    }
}

/// Every model; what is asked of each below holds for all.
fn models() -> impl Iterator<Item = WarpModel> {
    WarpModel::NAMES.iter().map(|name| WarpModel::named(name).expect("a declared name"))
}

/// A pair that differs by a turn and a shift has nothing to be distorted for.
#[test]
fn models_by_matches_keep_a_similar_pair_rigid() {
    let (sine, cosine) = 0.1_f64.sin_cos();
    let turned = |point: Vector2<f64>| {
        Some(Vector2::new(cosine * point.x - sine * point.y - 350.0, sine * point.x + cosine * point.y + 10.0))
    };
    let cameras = Example::panned(&[0.0, 28.0], 0).cameras;
    let example = Example::with_pairs(cameras, vec![matched(0, 1, turned)], 0);
    let options = WarpOptions { homographies: HomographySource::Pairs, ..WarpOptions::default() };
    for model in models().filter(|model| *model != WarpModel::Autostitch) {
        let placed = example.place_with(model, &options).expect("a pair");
        assert_eq!(placed.folds, 0, "{model:?}");
        assert!(misalignment(&example, &placed.meshes) < 1e-2, "{model:?}");
        for (mesh, grid) in placed.meshes.iter().zip(&example.grids) {
            let first = Vector2::from(mesh.target[0]);
            for vertex in 0..mesh.len() {
                let (far, own) = ((Vector2::from(mesh.target[vertex]) - first).norm(), grid.source(vertex).norm());
                assert!((far - own).abs() < 1e-2, "{model:?}: {far} for {own} px");
            }
        }
    }
}

#[test]
fn models_on_planes_refuse_what_lies_behind_them_and_others_place_it() {
    let refused = |error: Error, model: WarpModel| {
        assert!(matches!(error, Error::NotApplicable { .. }), "{model:?}: {error}");
        assert!(error.to_string().contains(" degrees from the axis of 0.jpg"), "{model:?}: {error}");
    };
    let example = Example::panned(&[0.0, 30.0, 60.0, 90.0], 0);
    for model in models() {
        match (model, example.place(model)) {
            (WarpModel::Homography | WarpModel::Apap, Err(error)) => refused(error, model),
            (WarpModel::Homography | WarpModel::Apap, Ok(_)) => panic!("{model:?} places a photograph at 90 degrees"),
            (_, placed) => assert_eq!(placed.expect("not on the plane of 0.jpg").folds, 0, "{model:?}"),
        }
    }
    // Two planes that see each other show less than 90 + 90 + 90 degrees.
    let wider = Example::panned(&(0..9).map(|k| f64::from(k) * 30.0).collect::<Vec<_>>(), 0);
    for model in [WarpModel::Sphp, WarpModel::SphpFree] {
        refused(wider.place(model).expect_err("240 degrees and a photograph"), model);
    }
}

#[test]
fn photographs_that_grow_or_reach_beyond_the_limits_are_refused_by_every_model() {
    let example = Example::panned(&[0.0, 25.0, 50.0], 0);
    for model in models() {
        let near = Limits { max_reach: 1.0, ..LIMITS };
        let error = example.place_within(model, &near).expect_err("reaches 1.5 diagonals").to_string();
        assert!(error.contains("diagonals of the reference away") && error.contains("degrees"), "{model:?}: {error}");
    }
    // Pair by pair the quasi-homography grows too: eight photographs to one side are too many.
    let long = Example::panned(&(0..9).map(|k| f64::from(k) * 28.0).collect::<Vec<_>>(), 0);
    let error = long.place(WarpModel::QuasiHomography).expect_err("224 degrees from the reference").to_string();
    assert!(error.contains("times as large as the reference") || error.contains("diagonals"), "{error}");
}

#[test]
fn threads_change_no_vertex_and_the_order_of_the_photographs_hardly_any() {
    let example = Example::panned(&[-20.0, 0.0, 28.0], 1);
    let reversed = example.reversed();
    for model in models() {
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| example.place(model)).expect("a narrow set")
        };
        let one = with_threads(1);
        assert_eq!(one, with_threads(3), "{model:?}");
        let other = reversed.place(model).expect("a narrow set");
        for (mesh, same) in one.meshes.iter().zip(other.meshes.iter().rev()) {
            for (vertex, moved) in mesh.target.iter().zip(&same.target) {
                let apart = (Vector2::from(*vertex) - Vector2::from(*moved)).norm();
                assert!(apart < 0.05, "{model:?}: {apart} px");
            }
        }
    }
}
