//! Pictures with exactly known cameras, and what holds for every model.

use trueup_core::geometry::rotation_about_y;
use trueup_core::matches::{PairVerdict, PointMatch};

use super::*;

/// Width of the test pictures.
pub(super) const WIDTH: f64 = 800.0;
/// Height of the test pictures.
pub(super) const HEIGHT: f64 = 600.0;
const FOCAL_PX: f64 = 700.0;

/// A set of pictures with matches by their cameras.
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
    /// Cameras panned to these yaws in degrees; neighbours in the list overlap.
    pub fn panned(yaws_deg: &[f64], reference: usize) -> Self {
        let turned = |yaw: &f64| Camera::new(FOCAL_PX, WIDTH, HEIGHT, &rotation_about_y(yaw.to_radians()).transpose());
        Self::new(yaws_deg.iter().map(turned).collect(), reference)
    }

    pub fn new(cameras: Vec<Camera>, reference: usize) -> Self {
        let carry = |a: usize, b: usize, point| cameras[a].transfer(&cameras[b], point);
        let pairs = (1..cameras.len()).map(|b| matched(b - 1, b, |point| carry(b - 1, b, point))).collect();
        Self::with_pairs(cameras, pairs, reference)
    }

    pub fn with_pairs(cameras: Vec<Camera>, pairs: Vec<PairMatches>, reference: usize) -> Self {
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

    pub fn input(&self) -> WarpInput<'_> {
        WarpInput {
            cameras: &self.cameras,
            frames: &self.frames,
            grids: &self.grids,
            pairs: &self.pairs,
            overlaps: &[],
            names: &self.names,
            seeds: &self.seeds,
            reference: self.reference,
            level_from_world: Matrix3::identity(),
            cut_yaw: None,
            turn: 0.0,
        }
    }

    pub fn place(&self, model: WarpModel) -> Result<WarpedMesh> {
        self.place_with(model, &WarpOptions::default())
    }

    pub fn place_with(&self, model: WarpModel, options: &WarpOptions) -> Result<WarpedMesh> {
        run(model, &self.input(), options, &StageContext::default())
    }
}

/// Matches spread over the part of picture a that `b_from_a` carries into picture b.
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
        inliers,
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
        // The centre of the picture panned by 25 degrees lies at f tan 25.
        let centre = placed.meshes[2].warp(Vector2::new(WIDTH / 2.0, HEIGHT / 2.0));
        let expected = WIDTH / 2.0 + FOCAL_PX * 25_f64.to_radians().tan();
        assert!((centre.x - expected).abs() < 0.1 && (centre.y - HEIGHT / 2.0).abs() < 0.1, "{centre}");
    }
}

#[test]
fn too_wide_a_field_of_view_is_refused_with_its_angle() {
    let example = Example::panned(&[0.0, 30.0, 60.0, 90.0], 0);
    for homographies in [HomographySource::Cameras, HomographySource::Pairs] {
        let options = WarpOptions { homographies, ..WarpOptions::default() };
        let error = example.place_with(WarpModel::Homography, &options).expect_err("a picture at 90 degrees");
        assert!(matches!(error, Error::NotApplicable { .. }), "{error}");
        let message = error.to_string();
        assert!(message.contains("method homography") && message.contains("3.jpg"), "{message}");
        // 90 degrees and half the picture's width, atan(400 / 700) = 29.7 degrees, lowered by the corner's height:
        // acos(-sin 29.7 cos 20.4) = 117.7 degrees.
        assert!(message.contains("reaches 118 degrees from the axis of 0.jpg"), "{message}");
    }
}
