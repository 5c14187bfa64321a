//! The global similarity prior in three dimensions: straightened cameras, corrected where an overlap contradicts them.

use nalgebra::{Matrix3, Vector3};

use super::edge_range::allowed_turns;
use super::input::PriorInput;
use super::upright::{Upright, rolls};
use super::weighted_solve::{DataTerm, solve_unit_vectors};

/// Residual weight that ties the reference to its straightened roll.
const REFERENCE_WEIGHT: f64 = 1e4;

/// The turns of the published prior; `down` is the vertical that straightening finds, in the cameras' world.
///
/// The reference keeps its roll. Every edge asks for the difference of the rolls with residual weight 10 if its overlap
/// allows that turn, and for the turn of least line distortion with weight 1 if not. Where all overlaps agree with the
/// cameras every photograph keeps its roll, whatever the reference; otherwise the reference decides which photographs
/// give way.
///
/// # Source
/// Chen and Chuang, Natural Image Stitching with the Global Similarity Prior (2016), section 4 (the 3D method).
///
/// # Departures
/// The turn that the user wants is added to all photographs afterwards. See `edge_range` for how the turn of least line
/// distortion is measured.
pub(super) fn upright(input: &PriorInput<'_>, rotations: &[Matrix3<f64>], down: Vector3<f64>) -> Upright {
    let rolls = rolls(&down, rotations);
    let turns = allowed_turns(input, &rolls);
    let index = input.reference;
    let anchor = DataTerm { index, angle: rolls[index], weight: REFERENCE_WEIGHT * REFERENCE_WEIGHT };
    let theta = match solve_unit_vectors(rolls.len(), &[anchor], &turns) {
        Some(vectors) => vectors.iter().map(|[u, v]| v.atan2(*u)).collect(),
        // Some photograph is joined to none.
        None => rolls,
    };
    Upright { down, theta, rotations: rotations.to_vec() }
}
