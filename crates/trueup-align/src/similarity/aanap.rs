//! AANAP's turns on the mesh: of every pair the similarity that turns least.

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::StageContext;
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::options::StageOptions;

use super::input::PriorInput;
use super::options::SimilarityOptions;
use super::upright::Upright;
use super::weighted_solve::{DataTerm, TurnTerm, solve_unit_vectors};
use crate::plane_similarity::{MatchedPoints, similarity_of_least_turn};

/// Residual weight that keeps the reference as it was taken.
const REFERENCE_WEIGHT: f64 = 1e4;

/// The turns that AANAP's similarities mean, the reference unturned; `down` is the vertical that straightening finds,
/// in the cameras' world.
///
/// # Source
/// Lin et al., "Adaptive as-natural-as-possible image stitching" (2015), section 3.2: of the similarities of all planes
/// that the matches of a pair lie on, the one of least rotation.
///
/// # Departures
/// The method is for pairs. The paper of VPG compares with an implementation of its own on up to 72 photographs, and
/// says that it shares a mesh deformation framework with GSP and VPG. So here the turns of all pairs meet in least
/// squares, as GSP's do, each pair weighing the same, and the mesh does the rest.
pub(super) fn upright(
    input: &PriorInput<'_>,
    rotations: &[Matrix3<f64>],
    down: Vector3<f64>,
    context: &StageContext<'_>,
) -> Upright {
    let turns: Vec<TurnTerm> =
        input.edges.par_iter().enumerate().filter_map(|(index, edge)| least_turn(edge, index, context)).collect();
    let anchor = DataTerm { index: input.reference, angle: 0.0, weight: REFERENCE_WEIGHT * REFERENCE_WEIGHT };
    let theta = match solve_unit_vectors(rotations.len(), &[anchor], &turns) {
        Some(vectors) => vectors.iter().map(|[u, v]| v.atan2(*u)).collect(),
        // Some photograph is joined to none.
        None => vec![0.0; rotations.len()],
    };
    Upright { down, theta, rotations: rotations.to_vec() }
}

/// theta_b - theta_a: what the similarity turns from a to b has to be turned back. `None` without four matches that
/// determine one.
fn least_turn(edge: &PairMatches, index: usize, context: &StageContext<'_>) -> Option<TurnTerm> {
    let side = |of: fn(&PointMatch) -> [f64; 2]| -> Vec<Vector2<f64>> {
        edge.inliers.iter().map(|one| Vector2::from(of(one))).collect()
    };
    let (points, places) = (side(|one| one.in_a), side(|one| one.in_b));
    let mut generator = context.generator(SimilarityOptions::STAGE, index as u64);
    let similarity = similarity_of_least_turn(MatchedPoints { points: &points, places: &places }, &mut generator)?;
    let turn = -similarity[(1, 0)].atan2(similarity[(0, 0)]);
    Some(TurnTerm { i: edge.a, j: edge.b, turn, weight: 1.0 })
}

#[cfg(test)]
mod tests {
    use trueup_core::camera::Camera;
    use trueup_core::source::WorkingFrame;

    use super::super::synthetic::{FOCAL_PX, SIZE, joined};
    use super::super::tests::missing;
    use super::super::{PriorMethod, SimilarityPrior, run};
    use super::*;
    use crate::vanishing::VanishingOptions;

    /// 180 matches of which 100 are turned by the first angle from a to b, in degrees, and 80 by the second.
    fn pair(a: usize, b: usize, turns_deg: [f64; 2]) -> PairMatches {
        let inliers = (0..180).map(|k| {
            let (x, y) = ((f64::from(k) * 0.618).fract() * SIZE.0, (f64::from(k) * 0.755).fract() * SIZE.1);
            let near = usize::from(k >= 100);
            let (sine, cosine) = turns_deg[near].to_radians().sin_cos();
            let place = [cosine * x - sine * y - 300.0, sine * x + cosine * y - 400.0 * near as f64];
            PointMatch { in_a: [x, y], in_b: place }
        });
        joined(a, b, inliers.collect())
    }

    fn theta_deg(count: usize, edges: &[PairMatches], reference: usize) -> Vec<f64> {
        let rolled = Camera::new(FOCAL_PX, SIZE.0, SIZE.1, &Matrix3::identity());
        let (cameras, triads, lines) = (vec![rolled; count], vec![missing(); count], vec![Vec::new(); count]);
        let frames = vec![WorkingFrame { width: SIZE.0, height: SIZE.1, working_from_full: 1.0 }; count];
        let vanishing = VanishingOptions::default();
        let input = PriorInput {
            method: PriorMethod::Aanap,
            cameras: &cameras,
            triads: &triads,
            lines: &lines,
            frames: &frames,
            gravity: &[],
            shown: &[],
            edges,
            overlaps: &[],
            cell_px: 40.0,
            vanishing: &vanishing,
            turn: 0.0,
            reference,
        };
        let prior: SimilarityPrior =
            run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("well-formed");
        prior.theta.iter().map(|theta| theta.to_degrees()).collect()
    }

    /// Photographs are turned back by what the plane of least turn turns them, one after the other from the reference.
    #[test]
    fn the_least_turns_add_up_from_the_reference() {
        let edges = [pair(0, 1, [9.0, 4.0]), pair(1, 2, [-3.0, 8.0])];
        for (reference, expected) in [(0, [0.0, -4.0, -1.0]), (2, [1.0, -3.0, 0.0])] {
            for (found, expected) in theta_deg(3, &edges, reference).iter().zip(expected) {
                assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
            }
        }
    }

    /// Around a loop that does not close, the pairs give way alike: 4 + 4 + 4 = 12 degrees are 0 between equals.
    #[test]
    fn a_loop_shares_what_does_not_close() {
        let edges = [pair(0, 1, [4.0, 4.0]), pair(1, 2, [4.0, 4.0]), pair(0, 2, [-4.0, -4.0])];
        // Unit vectors are averaged, not angles: 0.007 degrees are left.
        for found in theta_deg(3, &edges, 0) {
            assert!(found.abs() < 0.02, "{found}");
        }
    }

    #[test]
    fn photographs_that_nothing_joins_stay_as_taken() {
        assert_eq!(theta_deg(2, &[], 0), [0.0, 0.0]);
    }
}
