//! Which pairs of photographs are worth matching.
//!
//! All pairs of few photographs. Of many, first those whose features are each other's neighbors among those of all
//! photographs (`likeness`, `forest`), and consecutive ones; then those that the homographies of verified pairs predict
//! to overlap (`growth`); at last, what might join photographs that are still apart (`groups`). Those that stay apart
//! are looked at again (`apart`). The number of pairs grows with that of the photographs, not with its square.

mod apart;
mod forest;
mod groups;
mod growth;
mod likeness;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use trueup_core::Result;
use trueup_core::matches::PairMatches;
use trueup_core::options::StageOptions;
use trueup_core::source::WorkingFrame;

use crate::features::FeatureSource;
use groups::Groups;
use growth::VerifiedOverlaps;

pub use apart::{Apart, pairs_apart};
pub use likeness::{Likeness, likeness};

/// Overlaps of a photograph, in multiples of `pairing.neighbors`, from which no more are looked for: they tell nothing
/// new.
const PARTNERS_PER_NEIGHBOR: usize = 6;
/// Pairs tried to join what is apart, at most, as a part of those that all photographs propose of their neighbors.
const JOINING_SHARE: f64 = 0.5;

trueup_core::options! {
    /// Which pairs of photographs are matched.
    pub struct PairingOptions("pairing") {
        /// All pairs are matched of at most so many photographs; of more, those that look alike, and those that
        /// overlaps found predict. Raise it if photographs that overlap are left out of a large panorama: the time
        /// grows with the square.
        exhaustive_up_to: usize = 8, between(0.0, 100000.0), "photographs", basic;
        /// For every photograph, the neighbors proposed by their looks; up to six times as many are found from there.
        /// Raise it for photographs of many rows, each of which overlaps many others.
        neighbors: usize = 5, between(1.0, 1000.0), "photographs";
        /// Whether photographs that follow one another are proposed whatever they look like. Turn it off if their order
        /// says nothing of where they were taken.
        consecutive: bool = true, Allowed::Any, "";
    }
}

/// Proposes pairs to match, in rounds: each builds on what the one before verified.
///
/// # Source
/// Brown and Lowe (2007), section 3.1; growth along verified overlaps is that of incremental reconstruction (Agarwal,
/// Snavely and others, "Building Rome in a day", 2009, section 4.2: query expansion).
///
/// # Departures
/// Brown and Lowe take the 6 neighbors with most matches; we take 5 to begin with, propose consecutive photographs,
/// which photographers overlap, and let overlaps found predict the others.
#[derive(Debug)]
pub struct Proposals<'a> {
    frames: &'a [WorkingFrame],
    options: &'a PairingOptions,
    /// Whether each photograph has features.
    featured: Vec<bool>,
    /// `None` where all pairs are proposed.
    likeness: Option<Likeness>,
    tried: BTreeSet<(usize, usize)>,
    overlaps: VerifiedOverlaps,
    groups: Groups,
    /// Pairs that may still be tried to join what is apart.
    joining_left: usize,
}

impl<'a> Proposals<'a> {
    /// Of photographs with these features and frames, which are as many; `likeness` is asked how they look like each
    /// other where not all pairs are proposed.
    ///
    /// # Errors
    /// [`trueup_core::Error::Options`]; those of `likeness`.
    pub fn new(
        features: &dyn FeatureSource,
        frames: &'a [WorkingFrame],
        options: &'a PairingOptions,
        likeness: impl FnOnce() -> Result<Likeness>,
    ) -> Result<Self> {
        options.check()?;
        let count = features.photographs();
        let likeness = if count <= options.exhaustive_up_to { None } else { Some(likeness()?) };
        // A photograph that was not there when the looks were compared looks like no other.
        let likeness = likeness.map(|Likeness(mut alike)| {
            alike.resize(count, Vec::new());
            alike.iter_mut().for_each(|others| others.retain(|&other| other < count));
            Likeness(alike)
        });
        Ok(Self {
            frames,
            options,
            featured: (0..count).map(|photograph| features.has_features(photograph)).collect(),
            likeness,
            tried: BTreeSet::new(),
            overlaps: VerifiedOverlaps::default(),
            groups: Groups::new(count),
            joining_left: (JOINING_SHARE * (count * options.neighbors) as f64) as usize,
        })
    }

    /// The pairs to match next, the smaller index first, ascending, none that was proposed before; `matched` are those
    /// of the round before. None when nothing more is worth it.
    pub fn next(&mut self, matched: &[PairMatches]) -> Vec<(usize, usize)> {
        for pair in matched.iter().filter(|pair| pair.verdict.is_joined()) {
            self.groups.join(pair.a, pair.b);
        }
        let first = self.tried.is_empty();
        let mut pairs = match &self.likeness {
            None if first => all_pairs(self.featured.len()),
            None => Vec::new(),
            Some(likeness) if first => self.first_round(likeness),
            Some(likeness) => {
                let most = PARTNERS_PER_NEIGHBOR * self.options.neighbors;
                let grown = self.overlaps.grow(matched, self.frames, &self.tried, most);
                if grown.is_empty() {
                    let joining = self.joining(likeness);
                    self.joining_left -= joining.len();
                    joining
                } else {
                    grown
                }
            }
        };
        pairs.sort_unstable();
        pairs.dedup();
        self.tried.extend(&pairs);
        pairs
    }

    /// The photographs that look most alike, and consecutive ones.
    fn first_round(&self, likeness: &Likeness) -> Vec<(usize, usize)> {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for (photograph, alike) in likeness.0.iter().enumerate() {
            pairs.extend(alike.iter().take(self.options.neighbors).map(|&other| ordered(photograph, other)));
        }
        if self.options.consecutive {
            pairs.extend((1..self.featured.len()).map(|next| (next - 1, next)));
        }
        pairs
    }

    /// Pairs that might join a photograph outside of the largest group to one of another group.
    fn joining(&self, likeness: &Likeness) -> Vec<(usize, usize)> {
        let group_of = self.groups.labels();
        let largest = self.groups.largest();
        let outside = (0..group_of.len()).filter(|&one| self.featured[one] && group_of[one] != largest);
        let candidates: Vec<Vec<(usize, usize)>> = outside
            .map(|one| {
                let is_apart = |&other: &usize| {
                    self.featured[other]
                        && group_of[other] != group_of[one]
                        && !self.tried.contains(&ordered(one, other))
                };
                let others = likeness.0[one].iter().copied().filter(is_apart);
                // What does not look alike is tried last.
                let rest = (0..group_of.len()).filter(is_apart).filter(|other| !likeness.0[one].contains(other));
                others.chain(rest).take(self.options.neighbors).map(|other| ordered(one, other)).collect()
            })
            .collect();
        let mut pairs = BTreeSet::new();
        // The likeliest of each first, so that what may be tried is shared.
        for turn in 0..self.options.neighbors {
            for pair in candidates.iter().filter_map(|candidates| candidates.get(turn)) {
                if pairs.len() < self.joining_left {
                    pairs.insert(*pair);
                }
            }
        }
        pairs.into_iter().collect()
    }
}

fn ordered(one: usize, other: usize) -> (usize, usize) {
    (one.min(other), one.max(other))
}

fn all_pairs(count: usize) -> Vec<(usize, usize)> {
    (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b))).collect()
}
