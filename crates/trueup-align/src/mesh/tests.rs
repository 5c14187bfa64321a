//! Whole-stage tests on synthetic grids.

use nalgebra::Matrix3;
use proptest::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::geometry::{rotation_about_y, rotation_about_z};
use trueup_core::mesh::GridMesh;

use super::problem::MeshProblem;
use super::similarity::PUBLISHED_CELL_PX;
use super::solver::MeshSolver;
use super::warped_mesh::count_folds;
use super::*;
use crate::match_points::OverlapWarp;

/// Rotation of the similarity that maps a grid best onto its target, in degrees.
fn rotation_deg(mesh: &GridMesh) -> f64 {
    crate::metrics::best_rotation(mesh).to_degrees()
}

/// Two 400 x 300 photographs 20 degrees apart, rolled by 5 and 17 degrees, as in the numeric check of the
/// specification.
fn two_photographs() -> (Vec<GridMesh>, Vec<OverlapWarp>) {
    let camera = |yaw: f64, roll: f64| {
        let world_from_camera = rotation_about_y(yaw.to_radians()) * rotation_about_z(roll.to_radians());
        Camera::new(400.0, 400.0, 300.0, &world_from_camera.transpose())
    };
    let cameras = [camera(0.0, 5.0), camera(20.0, 17.0)];
    let grids = vec![GridMesh::regular(400.0, 300.0, 50.0); 2];
    let warps = [(0, 1), (1, 0)]
        .map(|(from, to)| OverlapWarp {
            from,
            to,
            vertices: (0..grids[0].len())
                .map(|vertex| {
                    let place = cameras[from].transfer(&cameras[to], grids[from].source(vertex))?;
                    ((0.0..=400.0).contains(&place.x) && (0.0..=300.0).contains(&place.y)).then_some(place.into())
                })
                .collect(),
        })
        .to_vec();
    (grids, warps)
}

fn options() -> MeshOptions {
    MeshOptions { cell_px: PUBLISHED_CELL_PX, subdivision: 1, ..MeshOptions::default() }
}

/// The plain mesh with a prior of the same weight everywhere.
fn run_evenly(grids: &[GridMesh], warps: &[OverlapWarp], bases: &[BaseMap], reference: usize) -> WarpedMesh {
    let places: Vec<Vec<Vector2<f64>>> = bases.iter().zip(grids).map(|(base, grid)| base.places(grid)).collect();
    let alignment = AlignmentEnergy::new(grids, warps, bases, &places);
    let (options, context) = (options(), StageContext::default());
    let input = MeshInput { grids, warps, bases, reference, closure: None, structure: None };
    let layout = Layout::new(&input, places, alignment, &[], &options);
    let problem = MeshProblem { prior_slope: 0.0, ..layout.problem(&input, &options, &context) };
    let solved = problem.solve(&mut MeshSolver::default(), problem.equations()).expect("solvable");
    problem.warped(&solved)
}

fn solve(thetas_deg: [f64; 2]) -> WarpedMesh {
    let (grids, warps) = two_photographs();
    let bases = [0, 1].map(|k| BaseMap::similarity(1.0, thetas_deg[k].to_radians()));
    run_evenly(&grids, &warps, &bases, 0)
}

/// Expected values: numeric check 11 of the specification (5.13, 16.95 degrees; 0.306 px mean residual).
#[test]
fn two_rolled_photographs_turn_by_their_rolls() {
    let warped = solve([5.0, 17.0]);
    let rotations = [rotation_deg(&warped.meshes[0]), rotation_deg(&warped.meshes[1])];
    assert!((rotations[0] - 5.13).abs() < 0.02 && (rotations[1] - 16.95).abs() < 0.02, "{rotations:?}");
    assert!(warped.alignment_rms < 0.6);
    assert_eq!(warped.folds, 0);
}

/// With the opposite sign the prior fights the alignment: the recovered rotations are far from what was asked.
#[test]
fn the_sign_of_theta_matters() {
    let warped = solve([-5.0, -17.0]);
    assert!((rotation_deg(&warped.meshes[0]) + 14.29).abs() < 0.05);
    assert!((rotation_deg(&warped.meshes[1]) + 7.66).abs() < 0.05);
}

#[test]
fn the_gradient_vanishes_at_the_solution() {
    assert!(solve([5.0, 17.0]).relative_gradient < 1e-9);
}

#[test]
fn parts_without_match_points_are_anchored_each() {
    let grids = vec![GridMesh::regular(200.0, 100.0, 50.0); 2];
    let bases = [BaseMap::similarity(1.0, 0.0), BaseMap::similarity(2.0, 0.0)];
    let warped = run_evenly(&grids, &[], &bases, 1);
    let (low, high) = warped.meshes[1].bounds();
    assert!((high - low - Vector2::new(400.0, 200.0)).norm() < 1e-6);
}

#[test]
fn a_turned_over_cell_is_counted() {
    let mut mesh = GridMesh::regular(100.0, 100.0, 50.0);
    assert_eq!(count_folds(&mesh), 0);
    mesh.target[4] = [200.0, 50.0];
    assert!(count_folds(&mesh) > 0);
}

proptest! {
    /// A photograph alone takes exactly the similarity it is asked for.
    #[test]
    fn a_single_photograph_is_an_exact_similarity(scale in 0.3..3.0_f64, theta in -3.0..3.0_f64) {
        let grid = GridMesh::regular(330.0, 250.0, 40.0);
        let base = BaseMap::similarity(scale, theta);
        let warped = run_evenly(std::slice::from_ref(&grid), &[], &[base], 0);
        let turn = rotation_about_z(theta);
        let similarity: Matrix3<f64> = turn * scale;
        for vertex in 0..grid.len() {
            let source = grid.source(vertex);
            let wanted = similarity.fixed_view::<2, 2>(0, 0) * source;
            prop_assert!((Vector2::from(warped.meshes[0].target[vertex]) - wanted).norm() < 1e-6);
        }
    }
}
