//! The alignment energy E_a: match points of overlapping photographs fall on each other.

use std::collections::BTreeMap;

use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::base::BaseMap;
use super::closure::Closure;
use super::normal_equations::{GridSum, NormalEquations};
use crate::match_points::OverlapWarp;

/// A grid vertex of one photograph and its place in another.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MatchPoint {
    /// The photograph whose vertex it is.
    from: usize,
    /// The vertex.
    vertex: usize,
    /// The other photograph.
    to: usize,
    /// The place in it, in working pixels.
    place: [f64; 2],
    /// How far the other photograph's base is, at that place, from its bilinear interpolation.
    sag: [f64; 2],
    /// Turns by which the vertex lies to the right of the place: 0 but across the cut of a full turn.
    turns: f64,
}

impl MatchPoint {
    /// From where the other photograph has it to where its own has it, in the deformed `meshes`.
    fn distance(&self, meshes: &[GridMesh]) -> Vector2<f64> {
        let vertex = Vector2::from(meshes[self.from].target[self.vertex]);
        vertex - meshes[self.to].warp(Vector2::from(self.place)) - Vector2::from(self.sag)
    }
}

/// Sum over match points of |phi_from(vertex) - phi_to(place)|^2; paper equation for E_a.
///
/// # Departures
/// Across the cut of a full turn the two places are to lie one period, an unknown length, apart in x.
///
/// phi is bilinear in the deviation from the base, not in the vertices themselves; with a base that is a similarity the
/// two are the same. Otherwise the bilinear chords of two curved grids would pull on each other.
#[derive(Debug, Clone)]
pub(super) struct AlignmentEnergy {
    points: Vec<MatchPoint>,
}

impl AlignmentEnergy {
    /// The match points of all warps. `places` are the bases' places of the grids' vertices.
    pub(super) fn new(
        grids: &[GridMesh],
        warps: &[OverlapWarp],
        bases: &[BaseMap],
        places: &[Vec<Vector2<f64>>],
    ) -> Self {
        let within = Closure { warps, turns: &[], expected: 0.0 };
        let mut energy = Self { points: Vec::new() };
        energy.join(&within, grids, bases, places);
        energy
    }

    /// Takes in the match points of `closure`.
    pub(super) fn join(
        &mut self,
        closure: &Closure,
        grids: &[GridMesh],
        bases: &[BaseMap],
        places: &[Vec<Vector2<f64>>],
    ) {
        let turns = closure.turns.iter().copied().chain(std::iter::repeat(0.0));
        let points = closure.warps.iter().zip(turns).flat_map(|(warp, turns)| {
            warp.vertices.iter().take(grids[warp.from].len()).enumerate().filter_map(move |(vertex, place)| {
                let to = warp.to;
                place.map(|place| {
                    let sag = bases[to].sag(&grids[to], &places[to], Vector2::from(place)).into();
                    MatchPoint { from: warp.from, vertex, to, place, sag, turns }
                })
            })
        });
        self.points.extend(points);
    }

    /// For every match point across the cut of a full turn, the way from its place at the left end to that at the
    /// right.
    pub(super) fn apart(&self, meshes: &[GridMesh]) -> Vec<Vector2<f64>> {
        let across = self.points.iter().filter(|point| point.turns != 0.0);
        across.map(|point| point.distance(meshes) * point.turns).collect()
    }

    /// The grids moved as wholes, photograph `reference` not at all, until their match points meet as well as they then
    /// can, those across the cut of a full turn aside; `None` if the others leave a photograph's place open.
    pub(super) fn shifted(&self, meshes: &[GridMesh], reference: usize) -> Option<Vec<GridMesh>> {
        let mut couplings: BTreeMap<(usize, usize), f64> = (0..meshes.len()).map(|k| ((k, k), 0.0)).collect();
        let mut right = faer::Mat::<f64>::zeros(meshes.len(), 2);
        let mut couple = |column: usize, row: usize, value: f64| {
            *couplings.entry((column, row)).or_default() += value;
        };
        couple(reference, reference, 1.0);
        for point in self.points.iter().filter(|point| point.turns == 0.0 && point.from != point.to) {
            let (from, to, apart) = (point.from, point.to, point.distance(meshes));
            couple(from, from, 1.0);
            couple(to, to, 1.0);
            couple(from.min(to), from.max(to), -1.0);
            for axis in 0..2 {
                right[(from, axis)] -= apart[axis];
                right[(to, axis)] += apart[axis];
            }
        }
        let lower: Vec<Triplet<usize, usize, f64>> =
            couplings.into_iter().map(|((column, row), value)| Triplet::new(row, column, value)).collect();
        let matrix = SparseColMat::try_new_from_triplets(meshes.len(), meshes.len(), &lower).ok()?;
        let shifts = matrix.sp_cholesky(faer::Side::Lower).ok()?.solve(&right);
        let shifted = meshes.iter().enumerate().map(|(k, mesh)| {
            let by = [shifts[(k, 0)], shifts[(k, 1)]];
            let target = mesh.target.iter().map(|place| [place[0] + by[0], place[1] + by[1]]).collect();
            GridMesh { target, ..mesh.clone() }
        });
        Some(shifted.collect())
    }

    /// Adds the energy, each match point weighted by `weight` squared.
    pub(super) fn add(&self, weight: f64, equations: &mut NormalEquations, grids: &[GridMesh]) {
        for point in &self.points {
            let (corners, shares) = grids[point.to].bilinear(Vector2::from(point.place));
            let to: [(usize, f64); 4] = std::array::from_fn(|k| (corners[k], -shares[k]));
            let value = Vector2::from(point.sag);
            let from = [(point.vertex, 1.0)];
            let sums =
                [GridSum { photograph: point.from, members: &from }, GridSum { photograph: point.to, members: &to }];
            equations.add_between(&sums, value, weight * weight);
            if point.turns != 0.0 {
                equations.add_period(&sums, point.turns, value.x, weight * weight);
            }
        }
    }

    /// See [`overlap_cells`].
    pub(super) fn overlap_cells(&self, grids: &[GridMesh]) -> Vec<Vec<bool>> {
        overlap_cells(grids, self.points.iter().map(|point| [point.from, point.vertex]))
    }

    /// Root mean square distance of the two places of a match point in the deformed `meshes`, across a full turn's cut
    /// modulo `period`; 0 without match points.
    pub(super) fn rms(&self, meshes: &[GridMesh], period: Option<f64>) -> f64 {
        let turn = Vector2::new(period.unwrap_or(0.0), 0.0);
        let squares = self.points.iter().map(|point| (point.distance(meshes) - turn * point.turns).norm_squared());
        (squares.sum::<f64>() / self.points.len().max(1) as f64).sqrt()
    }
}

/// For every photograph and grid cell (row-major), whether one of `carried`, photographs and their vertices, lies in
/// it: a vertex carried elsewhere counts for the cell to its lower right.
pub(super) fn overlap_cells(grids: &[GridMesh], carried: impl Iterator<Item = [usize; 2]>) -> Vec<Vec<bool>> {
    let mut cells: Vec<Vec<bool>> =
        grids.iter().map(|grid| vec![false; (grid.rows - 1) * (grid.columns - 1)]).collect();
    for [photograph, vertex] in carried {
        let grid = &grids[photograph];
        let row = (vertex / grid.columns).min(grid.rows - 2);
        let column = (vertex % grid.columns).min(grid.columns - 2);
        cells[photograph][row * (grid.columns - 1) + column] = true;
    }
    cells
}
