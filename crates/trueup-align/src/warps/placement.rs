//! The order in which pictures join a panorama, and where their matches lie in it by then.

use nalgebra::Vector2;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::WarpInput;
use super::homography::undetermined;

/// A picture that joins those already placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Step {
    /// The picture.
    pub picture: usize,
    /// The placed picture that it shares most matches with.
    pub parent: usize,
}

/// Points of a picture and where the placed pictures that see them too have them in the panorama.
#[derive(Debug, Default)]
pub(super) struct Anchored {
    /// In the picture, working pixels.
    pub points: Vec<Vector2<f64>>,
    /// In the panorama.
    pub places: Vec<Vector2<f64>>,
}

/// The pictures in the order in which they join the reference: always the one that shares most matches with those placed,
/// ties by index.
///
/// # Errors
/// [`trueup_core::Error::Unsolvable`] if a picture shares no match with the others.
pub(super) fn order(input: &WarpInput<'_>) -> Result<Vec<Step>> {
    let count = input.grids.len();
    let mut placed = vec![false; count];
    placed[input.reference] = true;
    let mut steps = Vec::with_capacity(count - 1);
    while steps.len() + 1 < count {
        let next = (0..count)
            .filter(|&picture| !placed[picture])
            .max_by_key(|&picture| (shared_with(input, picture, &placed).0, usize::MAX - picture));
        let Some(picture) = next else { break };
        let (matches, parent) = shared_with(input, picture, &placed);
        let parent = parent.filter(|_| matches > 0).ok_or_else(|| undetermined(input, picture))?;
        placed[picture] = true;
        steps.push(Step { picture, parent });
    }
    Ok(steps)
}

/// Places the pictures in [`order`], the reference undeformed: `join` makes the grid of each further one from its matches
/// with those placed, which it may move.
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
        let data = anchored(input, step.picture, &placed);
        placed[step.picture] = Some(join(step, &data, &mut placed)?);
    }
    placed.into_iter().enumerate().map(|(picture, mesh)| mesh.ok_or_else(|| undetermined(input, picture))).collect()
}

/// Matches of a picture with all placed ones, and the one among those that has most.
fn shared_with(input: &WarpInput<'_>, picture: usize, placed: &[bool]) -> (usize, Option<usize>) {
    let (mut sum, mut most, mut parent) = (0, 0, None);
    for (pair, other) in pairs_of(input, picture).filter(|&(_, other)| placed[other]) {
        let matches = pair.inliers.len();
        sum += matches;
        if matches > most {
            (most, parent) = (matches, Some(other));
        }
    }
    (sum, parent)
}

/// The pairs of a picture, each with the other picture.
fn pairs_of<'a>(input: &WarpInput<'a>, picture: usize) -> impl Iterator<Item = (&'a PairMatches, usize)> {
    let pairs = input.pairs.iter().filter(move |pair| pair.a == picture || pair.b == picture);
    pairs.map(move |pair| (pair, if pair.a == picture { pair.b } else { pair.a }))
}

/// The matches of a picture with the placed ones, at their places in the panorama.
pub(super) fn anchored(input: &WarpInput<'_>, picture: usize, placed: &[Option<GridMesh>]) -> Anchored {
    let mut anchored = Anchored::default();
    for (pair, other) in pairs_of(input, picture) {
        let Some(mesh) = &placed[other] else { continue };
        for one in &pair.inliers {
            let (here, there) = if pair.a == picture { (one.in_a, one.in_b) } else { (one.in_b, one.in_a) };
            anchored.points.push(here.into());
            anchored.places.push(mesh.warp(there.into()));
        }
    }
    anchored
}
