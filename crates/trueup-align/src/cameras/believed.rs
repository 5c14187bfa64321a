//! Which pairs cameras are found from: all but those that contradict the others, or, where these are many, what the
//! strongest of them confirm.

use trueup_core::Result;
use trueup_core::camera::Camera;
use trueup_core::matches::PairMatches;

use super::contradictions::contradicting_pairs;
use super::observations;
use super::solution::{Solution, graph_of};
use super::transfer::CameraTransfer;

/// Share of all agreeing matches in the pairs set aside beyond which it is asked whether the wrong ones are. Of cut
/// sets without false overlaps it is 0.02 at most, of most that false overlaps turn wrong 0.05 and more.
const MUCH_SET_ASIDE: f64 = 0.02;
/// The same share beyond which a warning says so, of the pairs that are set aside in the end. Of cut sets whose cameras
/// are right without anything that repeats it is 0.02 at most.
pub(super) const MUCH_AGAINST: f64 = 0.05;
/// How many more agreeing matches cameras from the strongest pairs on have to confirm to be believed instead, relative:
/// what parallax sets aside here or there is no more.
const MORE_CONFIRMED: f64 = 0.02;
/// Times that pairs are taken back, at most. Mostly the first takes all.
const MOST_ROUNDS: usize = 3;

/// Cameras, and what they are found from.
pub(super) struct Believed {
    pub(super) solution: Solution,
    /// Positions of the pairs that contradict the others, ascending: the cameras are found without them.
    pub(super) contradicting: Vec<usize>,
    /// The residuals of all pairs by which these were told.
    pub(super) told_rms_px: Vec<f64>,
}

/// The pairs of a component, and how cameras are found from some.
pub(super) struct Belief<'a> {
    pub(super) photographs: usize,
    pub(super) pairs: &'a [PairMatches],
    pub(super) anchor: usize,
    /// Largest residual of a pair that the cameras confirm.
    pub(super) max_rms_px: f64,
    /// Finds the cameras from the pairs at these positions, which connect all photographs.
    pub(super) solve: &'a dyn Fn(&[usize]) -> Result<Solution>,
}

impl Belief<'_> {
    /// The cameras that most of what agrees confirms.
    ///
    /// All pairs together tell which of them contradict the others, the worst first. False ones that are many or large
    /// spoil the cameras that they are measured against, so that true ones go and they stay. Where much was set aside,
    /// the cameras are therefore also found from the strongest pairs alone, and those that agree are taken back.
    pub(super) fn best(&self) -> Result<Believed> {
        let all: Vec<usize> = (0..self.pairs.len()).collect();
        let found = self.of_all(&all)?;
        let support = |positions: &[usize]| support(self.pairs, positions.iter().copied()) as f64;
        if support(&found.contradicting) <= MUCH_SET_ASIDE * support(&all) {
            return Ok(found);
        }
        let other = self.of_strongest(&all)?;
        // The residuals that told the other's contradictions are those of its cameras.
        let by_other = self.confirmed(&other.told_rms_px) as f64;
        let confirmed = self.confirmed(&self.residuals(&found.solution.by_matches)) as f64;
        Ok(if by_other > (1.0 + MORE_CONFIRMED) * confirmed { other } else { found })
    }

    fn of_all(&self, all: &[usize]) -> Result<Believed> {
        let solution = (self.solve)(all)?;
        // A false overlap spoils the cameras as parallax does: with focal lengths that are expected it would show less.
        let told_rms_px = self.residuals(&solution.by_matches);
        let contradicting = self.contradicting(&solution, &told_rms_px);
        let solution = if contradicting.is_empty() { solution } else { (self.solve)(&without(all, &contradicting))? };
        Ok(Believed { solution, contradicting, told_rms_px })
    }

    fn of_strongest(&self, all: &[usize]) -> Result<Believed> {
        let mut active = self.strongest();
        let mut solution = (self.solve)(&active)?;
        let mut told_rms_px = self.residuals(&solution.by_matches);
        for _ in 0..MOST_ROUNDS {
            let next = without(all, &self.contradicting(&solution, &told_rms_px));
            if next == active {
                break;
            }
            active = next;
            solution = (self.solve)(&active)?;
            told_rms_px = self.residuals(&solution.by_matches);
        }
        Ok(Believed { solution, contradicting: without(all, &active), told_rms_px })
    }

    /// The pairs of the spanning tree of most agreeing matches, ascending.
    fn strongest(&self) -> Vec<usize> {
        let photographs: Vec<usize> = (0..self.photographs).collect();
        let tree = graph_of(self.photographs, self.pairs.iter()).spanning_tree(&photographs, self.anchor);
        let is_step = |pair: &PairMatches| {
            tree.iter().any(|step| [(step.parent, step.child), (step.child, step.parent)].contains(&(pair.a, pair.b)))
        };
        (0..self.pairs.len()).filter(|&position| is_step(&self.pairs[position])).collect()
    }

    fn contradicting(&self, solution: &Solution, rms_px: &[f64]) -> Vec<usize> {
        contradicting_pairs(&solution.by_matches, self.pairs, rms_px, self.max_rms_px)
    }

    /// The root mean square residual of each pair with these cameras, working pixels.
    pub(super) fn residuals(&self, cameras: &[Camera]) -> Vec<f64> {
        let transfer = |from: usize, to: usize| CameraTransfer::Rotating(&cameras[from], &cameras[to]);
        self.pairs.iter().map(|pair| observations::pair_rms(transfer, pair)).collect()
    }

    /// Agreeing matches of the pairs that cameras with these residuals confirm.
    fn confirmed(&self, rms_px: &[f64]) -> usize {
        support(self.pairs, (0..rms_px.len()).filter(|&pair| rms_px[pair] <= self.max_rms_px))
    }
}

/// Agreeing matches of the pairs at these positions.
pub(super) fn support(pairs: &[PairMatches], positions: impl IntoIterator<Item = usize>) -> usize {
    positions.into_iter().map(|position| pairs[position].agreeing).sum()
}

/// Those of `all`, ascending, that are not among `others`, ascending.
fn without(all: &[usize], others: &[usize]) -> Vec<usize> {
    all.iter().copied().filter(|position| others.binary_search(position).is_err()).collect()
}
