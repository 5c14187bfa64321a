//! Solving the mesh of a row of photographs: 60 grids of 21 x 16 vertices are 40,320 unknowns.

use divan::Bencher;
use trueup_align::match_points::OverlapWarp;
use trueup_align::mesh::{self, BaseMap, MeshInput, MeshOptions};
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::geometry::rotation_about_y;
use trueup_core::mesh::GridMesh;

const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 600.0;
/// Radians between neighbors: a third of the view is shared.
const STEP: f64 = 0.7;

fn main() {
    divan::main();
}

/// The grid of photograph `from` in its neighbor, `direction` +1 or -1.
fn warp(grid: &GridMesh, from: usize, direction: f64) -> OverlapWarp {
    let camera = |yaw: f64| Camera::new(700.0, WIDTH, HEIGHT, &rotation_about_y(yaw).transpose());
    let (here, there) = (camera(0.0), camera(direction * STEP));
    let vertices = (0..grid.len())
        .map(|vertex| {
            let place = here.transfer(&there, grid.source(vertex))?;
            ((0.0..=WIDTH).contains(&place.x) && (0.0..=HEIGHT).contains(&place.y)).then_some(place.into())
        })
        .collect();
    let to = if direction > 0.0 { from + 1 } else { from - 1 };
    OverlapWarp { from, to, vertices }
}

#[divan::bench(args = [10, 60])]
fn solve(bencher: Bencher, photographs: usize) {
    let grids = vec![GridMesh::regular(WIDTH, HEIGHT, 40.0); photographs];
    let warps: Vec<OverlapWarp> =
        (0..photographs - 1).flat_map(|k| [warp(&grids[k], k, 1.0), warp(&grids[k + 1], k + 1, -1.0)]).collect();
    let bases: Vec<BaseMap> = (0..photographs).map(|k| BaseMap::similarity(1.0, 0.02 * (k as f64).sin())).collect();
    let options = MeshOptions::default();
    let input = MeshInput { grids: &grids, warps: &warps, bases: &bases, reference: 0, closure: None, structure: None };
    bencher.bench(|| mesh::run(&input, &options, &StageContext::default()).expect("solvable"));
}
