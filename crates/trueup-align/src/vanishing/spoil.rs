//! Noise on the vanishing directions, for experiments.

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use trueup_core::geometry::rows_of;

use super::triad::TriadOutcome;

/// Replaces each direction of a triad, independently with probability `share`, by one drawn uniformly from the sphere;
/// the others stay, so that the triad is no longer orthogonal.
///
/// # Source
/// The noise of the paper's experiment on its robust scheme; the paper does not say how its noise is drawn.
pub fn spoil(outcome: &mut TriadOutcome, share: f64, generator: &mut impl Rng) {
    let TriadOutcome::Found(triad) = outcome else { return };
    let mut matrix = triad.matrix();
    for column in 0..3 {
        // Drawn whether used or not, so that a larger share spoils the same directions and more.
        let chance: f64 = generator.random();
        let (height, turn): (f64, f64) =
            (generator.random_range(-1.0..1.0), generator.random_range(0.0..std::f64::consts::TAU));
        if chance < share {
            let radius = (1.0 - height * height).sqrt();
            matrix.set_column(column, &Vector3::new(radius * turn.cos(), radius * turn.sin(), height));
        }
    }
    triad.camera_from_triad = rows_of(&matrix);
}
