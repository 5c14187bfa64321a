//! Noise on the vanishing directions of photographs, for the experiments on the robust scheme.

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use trueup_align::vanishing::{Triad, TriadOutcome};
use trueup_core::StageContext;
use trueup_core::geometry::rows_of;

/// Directions of photographs with each direction found, independently with probability `share` (0 to 1), replaced by
/// one drawn uniformly from the sphere; the others stay, so that the three of a photograph are no longer orthogonal.
///
/// The draws depend on the seed of `context` and the photograph's position. A larger share replaces the same directions
/// and more.
///
/// # Source
/// The noise of the paper's experiment on its robust scheme; the paper does not say how its noise is drawn.
pub(crate) fn with_random_directions(found: &[TriadOutcome], share: f64, context: &StageContext) -> Vec<TriadOutcome> {
    let noisy = |(subject, outcome): (u64, &TriadOutcome)| match outcome {
        TriadOutcome::Found(triad) => {
            let mut generator = context.generator("random directions", subject);
            TriadOutcome::Found(with_random_columns(triad, share, &mut generator))
        }
        TriadOutcome::Missing(why) => TriadOutcome::Missing(*why),
    };
    (0..).zip(found).map(noisy).collect()
}

fn with_random_columns(triad: &Triad, share: f64, generator: &mut impl Rng) -> Triad {
    let mut matrix = triad.matrix();
    for column in 0..3 {
        // Drawn whether used or not, so that a larger share replaces the same directions and more.
        let chance: f64 = generator.random();
        let (height, turn): (f64, f64) =
            (generator.random_range(-1.0..1.0), generator.random_range(0.0..std::f64::consts::TAU));
        if chance < share {
            let radius = (1.0 - height * height).sqrt();
            matrix.set_column(column, &Vector3::new(radius * turn.cos(), radius * turn.sin(), height));
        }
    }
    Triad { camera_from_triad: rows_of(&matrix), ..triad.clone() }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_align::vanishing::MissingTriad;

    use super::*;

    fn unturned() -> TriadOutcome {
        TriadOutcome::Found(Triad {
            camera_from_triad: rows_of(&Matrix3::identity()),
            quality: 1.0,
            line_counts: [9; 3],
            clusters: Vec::new(),
            covariance: rows_of(&Matrix3::zeros()),
            roll_sd: None,
        })
    }

    /// Of 3 x 400 directions a share of 0.25 is 300 in the mean with a standard deviation of 15; those replaced stay
    /// unit vectors, those of a smaller share are among those of a larger one.
    #[test]
    fn the_share_asked_for_is_replaced() {
        let found = vec![unturned(); 400];
        let replaced = |share: f64| -> Vec<bool> {
            let noisy = with_random_directions(&found, share, &StageContext::default());
            let of_photograph = |outcome: &TriadOutcome| {
                let matrix = outcome.triad().expect("still there").matrix();
                [0, 1, 2].map(|column| {
                    assert!((matrix.column(column).norm() - 1.0).abs() < 1e-12);
                    matrix.column(column) != Matrix3::identity().column(column)
                })
            };
            noisy.iter().flat_map(of_photograph).collect()
        };
        let (few, many) = (replaced(0.25), replaced(0.6));
        assert_eq!((few.len(), many.len()), (1200, 1200));
        let count = |list: &[bool]| list.iter().filter(|&&one| one).count();
        assert!((240..360).contains(&count(&few)), "{}", count(&few));
        assert!(few.iter().zip(&many).all(|(few, many)| !few || *many));
        assert_eq!((count(&replaced(0.0)), count(&replaced(1.0))), (0, 1200));
    }

    #[test]
    fn photographs_without_directions_have_none_afterwards() {
        let missing = TriadOutcome::Missing(MissingTriad::TooFewLines { found: 0, needed: 10 });
        let noisy = with_random_directions(std::slice::from_ref(&missing), 1.0, &StageContext::default());
        assert_eq!(noisy, [missing]);
    }
}
