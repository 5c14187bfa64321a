//! The order in which photographs join a panorama, and where their matches lie in it by then.

use nalgebra::Vector2;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::homography::undetermined;
use super::input::WarpInput;

/// A photograph that joins those already placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Step {
    /// The photograph.
    pub photograph: usize,
    /// The placed photograph that it shares most matches with.
    pub parent: usize,
}

/// Points of a photograph and where the placed photographs that see them too have them in the panorama.
#[derive(Debug, Default)]
pub(super) struct Anchored {
    /// In the photograph, working pixels.
    pub points: Vec<Vector2<f64>>,
    /// In the panorama.
    pub places: Vec<Vector2<f64>>,
}

/// The photographs in the order in which they join the reference: always the one that shares most matches with those
/// placed, ties by index.
///
/// # Errors
/// [`trueup_core::Error::Unsolvable`] if a photograph shares no match with the others.
pub(super) fn order(input: &WarpInput<'_>) -> Result<Vec<Step>> {
    let count = input.grids.len();
    let mut placed = vec![false; count];
    placed[input.reference] = true;
    let mut steps = Vec::with_capacity(count - 1);
    while steps.len() + 1 < count {
        let next = (0..count)
            .filter(|&photograph| !placed[photograph])
            .max_by_key(|&photograph| (shared_with(input, photograph, &placed).0, usize::MAX - photograph));
        let Some(photograph) = next else { break };
        let (matches, parent) = shared_with(input, photograph, &placed);
        let parent = parent.filter(|_| matches > 0).ok_or_else(|| undetermined(input, photograph))?;
        placed[photograph] = true;
        steps.push(Step { photograph, parent });
    }
    Ok(steps)
}

/// Places the photographs in [`order`], the reference undeformed: `join` makes the grid of each further one from its
/// matches with those placed, which it may move.
///
/// # Errors
/// Those of [`order`] and of `join`; [`trueup_core::Error::Cancelled`].
pub(super) fn one_after_another(
    input: &WarpInput<'_>,
    context: &StageContext<'_>,
    mut join: impl FnMut(Step, &Anchored, &mut [Option<GridMesh>]) -> Result<GridMesh>,
) -> Result<Vec<GridMesh>> {
    let mut placed: Vec<Option<GridMesh>> = vec![None; input.grids.len()];
    placed[input.reference] = Some(input.grids[input.reference].clone());
    for step in order(input)? {
        context.check_cancelled()?;
        let data = anchored(input, step.photograph, &placed);
        placed[step.photograph] = Some(join(step, &data, &mut placed)?);
    }
    placed
        .into_iter()
        .enumerate()
        .map(|(photograph, mesh)| mesh.ok_or_else(|| undetermined(input, photograph)))
        .collect()
}

/// Matches of a photograph with all placed ones, and the one among those that has most.
fn shared_with(input: &WarpInput<'_>, photograph: usize, placed: &[bool]) -> (usize, Option<usize>) {
    let (mut sum, mut most, mut parent) = (0, 0, None);
    for (pair, other) in pairs_of(input, photograph).filter(|&(_, other)| placed[other]) {
        let matches = pair.inliers.len();
        sum += matches;
        if matches > most {
            (most, parent) = (matches, Some(other));
        }
    }
    (sum, parent)
}

/// The pairs of a photograph, each with the other photograph.
fn pairs_of<'a>(input: &WarpInput<'a>, photograph: usize) -> impl Iterator<Item = (&'a PairMatches, usize)> {
    let pairs = input.pairs.iter().filter(move |pair| pair.a == photograph || pair.b == photograph);
    pairs.map(move |pair| (pair, if pair.a == photograph { pair.b } else { pair.a }))
}

/// The matches of a photograph with the placed ones, at their places in the panorama.
pub(super) fn anchored(input: &WarpInput<'_>, photograph: usize, placed: &[Option<GridMesh>]) -> Anchored {
    let mut anchored = Anchored::default();
    for (pair, other) in pairs_of(input, photograph) {
        let Some(mesh) = &placed[other] else { continue };
        for one in &pair.inliers {
            let (here, there) = if pair.a == photograph { (one.in_a, one.in_b) } else { (one.in_b, one.in_a) };
            anchored.points.push(here.into());
            anchored.places.push(mesh.warp(there.into()));
        }
    }
    anchored
}
