//! Cameras against meshes, on photographs whose cameras are known.

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::geometry::{rotation_about_x, rotation_about_y};
use trueup_core::mesh::GridMesh;

use super::super::camera_plane::CameraPlane;
use super::super::{BaseMap, MeshInput, run};
use super::*;
use crate::match_points::OverlapWarp;

const FOCAL_PX: f64 = 350.0;
const SIZE: [f64; 2] = [400.0, 300.0];

/// A photograph of 59 by 46 degrees, turned right and up.
fn camera(yaw_deg: f64, pitch_deg: f64) -> Camera {
    let level_from_camera = rotation_about_y(yaw_deg.to_radians()) * rotation_about_x(pitch_deg.to_radians());
    Camera::new(FOCAL_PX, SIZE[0], SIZE[1], &level_from_camera.transpose())
}

/// Photographs with all their overlaps; whose match points are moved by `moved` in the pairs of the last photograph.
struct Scene {
    cameras: Vec<Camera>,
    grids: Vec<GridMesh>,
    warps: Vec<OverlapWarp>,
}

impl Scene {
    fn new(cameras: Vec<Camera>, moved: [f64; 2]) -> Self {
        let grids = vec![GridMesh::regular(SIZE[0], SIZE[1], 50.0); cameras.len()];
        let last = cameras.len() - 1;
        let carried = |from: usize, to: usize| {
            let sign = f64::from(u8::from(to == last)) - f64::from(u8::from(from == last));
            let place = |vertex: usize| {
                let place = cameras[from].transfer(&cameras[to], grids[from].source(vertex))?;
                let place = place + Vector2::from(moved) * sign;
                (0..2).all(|axis| (0.0..=SIZE[axis]).contains(&place[axis])).then_some(place.into())
            };
            OverlapWarp { from, to, vertices: (0..grids[from].len()).map(place).collect() }
        };
        let pairs = (0..cameras.len()).flat_map(|from| (0..cameras.len()).map(move |to| [from, to]));
        let warps = pairs.filter(|[from, to]| from != to).map(|[from, to]| carried(from, to));
        let warps = warps.filter(|warp| warp.vertices.iter().any(Option::is_some)).collect();
        Self { cameras, grids, warps }
    }

    fn input<'a>(&'a self, severed: &'a [(usize, usize)]) -> ByCamerasInput<'a> {
        ByCamerasInput {
            grids: &self.grids,
            cameras: &self.cameras,
            warps: &self.warps,
            severed,
            dominant: None,
            units_per_radian: FOCAL_PX,
        }
    }

    /// The mesh over the level sphere, of overlaps that do not lie across the cut.
    fn mesh(&self, severed: &[(usize, usize)]) -> WarpedMesh {
        let options = MeshOptions::default();
        let bases: Vec<BaseMap> = self
            .cameras
            .iter()
            .zip(&self.grids)
            .map(|(camera, grid)| BaseMap::on_level_sphere(camera, grid, FOCAL_PX, &options))
            .collect();
        let is_within = |warp: &&OverlapWarp| !severed.contains(&(warp.from.min(warp.to), warp.from.max(warp.to)));
        let warps: Vec<OverlapWarp> = self.warps.iter().filter(is_within).cloned().collect();
        let (grids, closure, structure) = (&self.grids, None, None);
        let input = MeshInput { grids, warps: &warps, bases: &bases, reference: 0, closure, structure };
        run(&input, &options, &StageContext::default()).expect("solvable").into_warped()
    }

    fn drawn(&self, severed: &[(usize, usize)], context: &StageContext) -> Option<WarpedMesh> {
        let mesh = self.mesh(severed);
        unless_worse(&mesh, &self.input(severed), &MeshOptions::default(), context).expect("not cancelled")
    }
}

/// Three rows all round, the zenith and the nadir; and the pairs across the longitude behind.
fn sphere() -> (Scene, Vec<(usize, usize)>) {
    let rows = [50.0, 0.0, -50.0].map(|pitch| (0..10).map(move |k| camera(36.0 * f64::from(k) - 170.0, pitch)));
    let cameras: Vec<Camera> = rows.into_iter().flatten().chain([camera(10.0, 88.0), camera(0.0, -89.0)]).collect();
    let scene = Scene::new(cameras, [0.0; 2]);
    let yaw = |k: usize| scene.cameras[k].forward();
    let is_across = |one: usize, other: usize| {
        let [one, other] = [one, other].map(|k| yaw(k).x.atan2(yaw(k).z));
        (one - other).abs() > PI
    };
    let pairs = scene.warps.iter().map(|warp| (warp.from, warp.to)).filter(|&(from, to)| from < to);
    let severed: Vec<(usize, usize)> = pairs.filter(|&(from, to)| is_across(from, to)).collect();
    (scene, severed)
}

/// No plane has a whole sphere: the cameras draw it, poles and all, and it closes.
#[test]
fn a_whole_sphere_is_drawn_by_the_cameras() {
    let (scene, severed) = sphere();
    let context = StageContext::default();
    let drawn = scene.drawn(&severed, &context).expect("the mesh has no poles");
    assert!((drawn.period.expect("a full turn") - TAU * FOCAL_PX).abs() < 1e-9);
    assert!(drawn.alignment_rms < 1e-6, "{}", drawn.alignment_rms);
    let plane = drawn.by_cameras.expect("by the cameras");
    for (camera, mesh) in scene.cameras.iter().zip(&drawn.meshes) {
        for vertex in 0..mesh.len() {
            let seen = plane.direction(Vector2::from(mesh.target[vertex]));
            assert!(seen.angle(&camera.world_direction(mesh.source(vertex))) < 1e-6);
        }
    }
    let findings = context.findings();
    assert_eq!((findings.len(), findings[0].code.as_str()), (1, "drawn-by-cameras"));
    assert!(findings[0].message.contains("2 photographs look at a pole"), "{}", findings[0].message);
}

/// What a plane has room for stays the mesh's.
#[test]
fn rows_stay_with_the_mesh() {
    let rows: Vec<Camera> =
        [-20.0, 0.0, 22.0].iter().flat_map(|&pitch| (0..5).map(move |k| camera(28.0 * f64::from(k), pitch))).collect();
    let context = StageContext::default();
    assert_eq!(Scene::new(rows, [0.0; 2]).drawn(&[], &context), None);
    assert!(context.findings().is_empty());
}

/// Matches that all say the same of an overlap are met, within the photographs' reach; nothing moves far from it.
#[test]
fn corrections_follow_the_matches_and_end_with_them() {
    let scene = Scene::new(vec![camera(0.0, 80.0), camera(30.0, 78.0), camera(0.0, 40.0)], [3.0, -2.0]);
    let input = scene.input(&[]);
    let before = Evidence::of(&scene.mesh(&[]), &input).cameras_px;
    let corrections = CameraCorrections::find(&input, &MeshOptions::default()).expect("solvable");
    let after = corrections.misfit_px(&input);
    assert!(before > 1.0 && after < 0.25 * before, "{before} {after}");
    assert!(corrections.largest_px() < 2.0 * 13_f64.sqrt(), "{}", corrections.largest_px());
}

/// A mesh that somebody bent is worse than its cameras; that the cameras disagree with all matches speaks against them.
#[test]
fn the_better_one_is_measured() {
    let row: Vec<Camera> = (0..4).map(|k| camera(30.0 * f64::from(k), 0.0)).collect();
    let scene = Scene::new(row, [0.0; 2]);
    let mut mesh = scene.mesh(&[]);
    let judge = |mesh: &WarpedMesh, scene: &Scene| {
        unless_worse(mesh, &scene.input(&[]), &MeshOptions::default(), &StageContext::default()).expect("not cancelled")
    };
    assert_eq!(judge(&mesh, &scene), None);
    for vertex in &mut mesh.meshes[3].target {
        let along = vertex[0] / 100.0;
        vertex[1] += along * along;
    }
    let drawn = judge(&mesh, &scene).expect("it leans and is apart");
    assert!(drawn.alignment_rms < 1e-6 && drawn.period.is_none());
}

proptest! {
    #[test]
    fn directions_have_places(
        longitude in -3.1..3.1_f64,
        latitude in -1.5..1.5_f64,
        yaw in -3.0..3.0_f64,
        origin in prop::array::uniform2(-500.0..500.0_f64),
    ) {
        let plane = CameraPlane { yaw, units_per_radian: 300.0, origin: [0.1, -0.2] };
        let direction = Vector3::new(latitude.cos() * longitude.sin(), latitude.sin(), latitude.cos() * longitude.cos());
        let place = plane.place(direction, 0.0);
        prop_assert!((plane.direction(place) - direction).norm() < 1e-12);
        let moved = plane.moved(origin, 2.0);
        prop_assert!(moved.is_sound());
        prop_assert!((moved.direction((place - Vector2::from(origin)) * 2.0) - direction).norm() < 1e-9);
    }
}
