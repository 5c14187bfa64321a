//! How far each photograph looks aside so that matches meet.

use nalgebra::Vector2;
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

use super::super::alignment::overlap_cells;
use super::super::complex::product;
use super::super::normal_equations::{CarriedVertex, NormalEquations, solved_grids};
use super::super::options::MeshOptions;
use super::super::similarity::{PRIOR_SLOPE, SimilarityEnergy};
use super::super::solver::MeshSolver;
use super::input::ByCamerasInput;
use crate::match_points::OverlapWarp;

/// By how many of its own pixels each vertex of a photograph's grid looks aside.
///
/// The energies are those of the mesh, taken of the deviation from the photograph's own pixels: match points coincide,
/// neighborhoods turn and scale together, and turn and scale stay what the camera says. Nothing is unrolled, so that
/// poles and full turns are places like any other.
///
/// # Source
/// H.-Y. Shum and R. Szeliski, "Construction and refinement of panoramic mosaics with global and local alignment"
/// (2000), section 5, for corrections as steps in each photograph's own plane; the energies of Chen and Chuang (2016),
/// section 3, in place of their averages.
#[derive(Debug)]
pub(super) struct CameraCorrections {
    /// One for each photograph: its undeformed grid with the steps as targets, bilinear between the vertices.
    steps: Vec<GridMesh>,
    /// Relative gradient of the energy at the solution.
    pub relative_gradient: f64,
}

/// Pull of every vertex to where its camera sees it, as a share of that of a match point: fixes what matches leave
/// open, a common turn of all photographs, and is not felt beside a match.
const REST_WEIGHT: f64 = 0.05;
/// Times the equations are solved; the photographs' maps into each other are linear to a hundredth of a pixel over the
/// steps that are left after the first.
const ROUNDS: usize = 3;

impl CameraCorrections {
    /// The corrections that minimize the energies; `None` if there are none.
    pub(super) fn find(input: &ByCamerasInput, options: &MeshOptions) -> Option<Self> {
        let still = |grid: &GridMesh| GridMesh { target: vec![[0.0; 2]; grid.len()], ..grid.clone() };
        let mut corrections = Self { steps: input.grids.iter().map(still).collect(), relative_gradient: 0.0 };
        let mut solver = MeshSolver::default();
        for _ in 0..ROUNDS {
            let mut equations = shape_energy(input, options);
            corrections.add_matches(input, options.alignment_weight.powi(2), &mut equations);
            let solution = solver.solve(equations)?;
            if !solution.coordinates.iter().all(|coordinate| coordinate.is_finite()) {
                return None;
            }
            corrections.steps = solved_grids(input.grids, &solution.coordinates);
            corrections.relative_gradient = solution.relative_gradient;
        }
        Some(corrections)
    }

    /// How far aside a pixel of a photograph looks.
    pub(super) fn aside(&self, photograph: usize, pixel: Vector2<f64>) -> Vector2<f64> {
        self.steps[photograph].warp(pixel)
    }

    /// The longest step, working pixels.
    pub(super) fn largest_px(&self) -> f64 {
        let steps = self.steps.iter().flat_map(|steps| &steps.target);
        steps.map(|&step| Vector2::from(step).norm()).fold(0.0, f64::max)
    }

    /// Root mean square distance of match points, in pixels of the photograph whose vertex each is; 0 without any.
    pub(super) fn misfit_px(&self, input: &ByCamerasInput) -> f64 {
        let misfit = |point: CarriedPoint| {
            let carried = point.carried(input, self)?;
            let vertex = input.grids[point.from].source(point.vertex);
            Some((vertex + self.aside(point.from, vertex) - carried.place).norm_squared())
        };
        root_mean(points(input.warps).filter_map(misfit))
    }

    fn add_matches(&self, input: &ByCamerasInput, squared_weight: f64, equations: &mut NormalEquations) {
        for point in points(input.warps) {
            let Some(carried) = point.carried(input, self) else { continue };
            let (corners, shares) = input.grids[point.to].bilinear(point.place);
            let members: [(usize, f64); 4] = std::array::from_fn(|k| (corners[k], shares[k]));
            let vertex = input.grids[point.from].source(point.vertex);
            let already = product(carried.factor, self.aside(point.to, point.place));
            equations.add_carried(&CarriedVertex {
                from: [point.from, point.vertex],
                to: point.to,
                members: &members,
                factor: carried.factor,
                value: carried.place - vertex - already,
                squared_weight,
            });
        }
    }
}

/// What keeps photographs as their cameras see them.
fn shape_energy(input: &ByCamerasInput, options: &MeshOptions) -> NormalEquations {
    let mut equations = NormalEquations::new(input.grids);
    let overlaps = overlap_cells(input.grids, points(input.warps).map(|point| [point.from, point.vertex]));
    for (photograph, (grid, overlap)) in input.grids.iter().zip(&overlaps).enumerate() {
        let still = vec![Vector2::zeros(); grid.len()];
        SimilarityEnergy::new(grid, &still, overlap, options, PRIOR_SLOPE).add(photograph, &mut equations);
        for vertex in 0..grid.len() {
            let pull = [(vertex, Vector2::new(REST_WEIGHT, 0.0))];
            equations.add_inside(photograph, &pull, Vector2::zeros());
        }
    }
    equations
}

/// A grid vertex of one photograph and its place in another.
#[derive(Debug, Clone, Copy)]
pub(super) struct CarriedPoint {
    pub from: usize,
    pub vertex: usize,
    pub to: usize,
    pub place: Vector2<f64>,
}

/// What one camera has at a place, as another would see it.
pub(in super::super) struct Carried {
    /// Where, in the other's photograph.
    pub place: Vector2<f64>,
    /// How it moves as the place does: the nearest similarity, as a complex factor.
    pub factor: Vector2<f64>,
}

/// What `there` has at the pixel `seen`, as `here` would see it; `None` where it does not.
pub(in super::super) fn carried(there: &Camera, here: &Camera, seen: Vector2<f64>) -> Option<Carried> {
    let at = |x: f64, y: f64| there.transfer(here, seen + Vector2::new(x, y));
    let dx = at(0.5, 0.0)? - at(-0.5, 0.0)?;
    let dy = at(0.0, 0.5)? - at(0.0, -0.5)?;
    Some(Carried { place: at(0.0, 0.0)?, factor: Vector2::new(dx.x + dy.y, dx.y - dy.x) / 2.0 })
}

/// All match points.
pub(super) fn points(warps: &[OverlapWarp]) -> impl Iterator<Item = CarriedPoint> + '_ {
    warps.iter().flat_map(|warp| {
        let places = warp.vertices.iter().enumerate();
        places.filter_map(|(vertex, place)| {
            Some(CarriedPoint { from: warp.from, vertex, to: warp.to, place: Vector2::from((*place)?) })
        })
    })
}

impl CarriedPoint {
    fn carried(&self, input: &ByCamerasInput, corrections: &CameraCorrections) -> Option<Carried> {
        let seen = self.place + corrections.aside(self.to, self.place);
        carried(&input.cameras[self.to], &input.cameras[self.from], seen)
    }

    /// How far apart the cameras alone have the two, in pixels of the vertex's photograph.
    pub(super) fn camera_misfit(&self, input: &ByCamerasInput) -> Option<f64> {
        let place = input.cameras[self.to].transfer(&input.cameras[self.from], self.place)?;
        Some((place - input.grids[self.from].source(self.vertex)).norm_squared())
    }
}

/// The root of the mean of squares; 0 without any.
pub(super) fn root_mean(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0_usize), |(sum, count), square| (sum + square, count + 1));
    (sum / count.max(1) as f64).sqrt()
}
