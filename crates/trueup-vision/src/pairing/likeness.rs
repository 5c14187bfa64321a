//! Which photographs look alike: those whose features are each other's neighbors.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::options::StageOptions;
use trueup_core::{Result, StageContext};

use super::PairingOptions;
use super::forest::DescriptorForest;
use crate::features::{Descriptor, FeatureSource};
use crate::matching::squared_distances;

/// Strongest features of each photograph that take part.
const COMPARED_FEATURES: usize = 1000;
/// Distance of two descriptors from which they say nothing, squared; that of a descriptor from the nearest one of
/// another scene is about as large. (Descriptors have a length of 512.)
const UNLIKE: u32 = 350 * 350;
/// Photographs for which a feature votes: the nearest. A place is seldom seen in more.
const VOTED_FOR: usize = 16;
/// Votes of a feature that is the same in both photographs.
const FULL_VOTE: u32 = 256;
/// Photographs listed as like one, the most alike.
const LISTED: usize = 256;
/// Counts of votes that are kept at a time, 4 bytes each: for all of 4096 photographs.
const COUNTS: usize = 1 << 24;
/// Groups that one thread takes at a time.
const GROUPS_PER_TASK: usize = 64;

/// For each photograph the others that look like it, the most alike first.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Likeness(pub(super) Vec<Vec<usize>>);

/// How often photographs look alike, by votes of their strongest features: each votes for the photographs that hold its
/// nearest neighbors, the more the nearer these are, in comparison with the first photograph that it does not vote for.
///
/// # Errors
/// [`trueup_core::Error::Input`] if features contradict themselves; [`trueup_core::Error::Cancelled`].
///
/// # Source
/// Brown and Lowe (2007), sections 2 and 3.1: a feature's nearest neighbors among those of all photographs, found by
/// trees.
///
/// # Departures
/// More neighbors than their 4 are taken, and weighed: photographs may overlap many others.
pub fn likeness(features: &dyn FeatureSource, context: &StageContext<'_>) -> Result<Likeness> {
    let photographs = features.photographs();
    let strongest: Vec<Cow<[Descriptor]>> =
        (0..photographs).into_par_iter().map(|index| strongest_of(features, index)).collect::<Result<_>>()?;
    let ballot = Ballot::new(&strongest, context);
    let groups = ballot.forest.groups();
    // Voters are counted so many photographs at a time.
    let counted_at_once = (COUNTS / photographs.max(1)).max(1);
    let passes = photographs.div_ceil(counted_at_once) as u64;
    context.progress().begin(PairingOptions::STAGE, passes * groups.len() as u64);
    let mut alike = Vec::with_capacity(photographs);
    for first in (0..photographs).step_by(counted_at_once) {
        let voting = first..(first + counted_at_once).min(photographs);
        let votes: Vec<AtomicU32> = (0..voting.len() * photographs).map(|_| AtomicU32::new(0)).collect();
        groups.par_chunks(GROUPS_PER_TASK).try_for_each(|groups| {
            context.check_cancelled()?;
            let mut scratch = Scratch::default();
            groups.iter().for_each(|group| ballot.vote(group, &voting, &votes, &mut scratch));
            context.progress().advance(PairingOptions::STAGE, groups.len() as u64);
            Ok(())
        })?;
        alike.par_extend(votes.par_chunks(photographs).map(winners));
    }
    context.progress().finish(PairingOptions::STAGE);
    Ok(Likeness(alike))
}

/// The descriptors of a photograph's strongest features.
fn strongest_of(source: &dyn FeatureSource, photograph: usize) -> Result<Cow<'_, [Descriptor]>> {
    let features = source.features(photograph)?;
    features.check(photograph)?;
    let count = features.descriptor_points.partition_point(|&point| (point as usize) < COMPARED_FEATURES);
    Ok(match features {
        Cow::Borrowed(features) => Cow::Borrowed(&features.descriptors[..count]),
        // Not the others' room.
        Cow::Owned(features) => Cow::Owned(features.descriptors[..count].to_vec()),
    })
}

/// The features that vote.
struct Ballot<'a> {
    descriptors: Vec<&'a Descriptor>,
    /// The photograph of each.
    photograph_of: Vec<u32>,
    forest: DescriptorForest,
}

/// Room for what is known of one voter at a time.
#[derive(Default)]
struct Scratch {
    distances: Vec<u32>,
    /// Squared distance and photograph.
    near: Vec<(u32, u32)>,
}

impl<'a> Ballot<'a> {
    /// Of the strongest descriptors of every photograph.
    fn new(strongest: &'a [Cow<[Descriptor]>], context: &StageContext<'_>) -> Self {
        let count = strongest.iter().map(|of_one| of_one.len()).sum();
        let (mut descriptors, mut photograph_of) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (photograph, strongest) in strongest.iter().enumerate() {
            descriptors.extend(strongest.iter());
            photograph_of.resize(descriptors.len(), photograph as u32);
        }
        let forest = DescriptorForest::new(&descriptors, context);
        Self { descriptors, photograph_of, forest }
    }

    /// Adds what those of a group vote that are of the photographs `voting`, for each of which `votes` counts the votes
    /// for every photograph. Numbers are added, so that the order of the groups does not matter.
    fn vote(&self, group: &[u32], voting: &Range<usize>, votes: &[AtomicU32], scratch: &mut Scratch) {
        let Scratch { distances, near } = scratch;
        let photographs = votes.len() / voting.len().max(1);
        for &voter in group {
            let own = self.photograph_of[voter as usize];
            if !voting.contains(&(own as usize)) {
                continue;
            }
            squared_distances(self.descriptors[voter as usize], &self.descriptors, group, distances);
            let of_other = |(&member, &squared_distance): (&u32, &u32)| {
                let photograph = self.photograph_of[member as usize];
                (photograph != own && squared_distance < UNLIKE).then_some((squared_distance, photograph))
            };
            near.clear();
            near.extend(group.iter().zip(distances.iter()).filter_map(of_other));
            nearest_of_each(near);
            let row = &votes[(own as usize - voting.start) * photographs..][..photographs];
            for (photograph, votes) in votes_for(near) {
                row[photograph as usize].fetch_add(votes, Ordering::Relaxed);
            }
        }
    }
}

/// Leaves of squared distances and their photographs the nearest of each photograph, the nearest first, and of these as
/// many as [`votes_for`] looks at.
fn nearest_of_each(near: &mut Vec<(u32, u32)>) {
    near.sort_unstable();
    let mut kept = 0;
    for at in 0..near.len() {
        let photograph = near[at].1;
        if near[..kept].iter().all(|&(_, known)| known != photograph) {
            near[kept] = near[at];
            kept += 1;
            if kept > VOTED_FOR {
                break;
            }
        }
    }
    near.truncate(kept);
}

/// One feature's votes for the photographs of its nearest neighbors, which are given the nearest first.
fn votes_for(near: &[(u32, u32)]) -> impl Iterator<Item = (u32, u32)> {
    let background = near.get(VOTED_FOR).map_or(UNLIKE, |&(squared_distance, _)| squared_distance).max(1);
    // At most 2^17 by 2^8.
    let votes = move |&(squared_distance, photograph): &(u32, u32)| {
        (photograph, (background - squared_distance) * FULL_VOTE / background)
    };
    near[..near.len().min(VOTED_FOR)].iter().map(votes)
}

/// The photographs with most votes, and with any, the first of equals first.
fn winners(votes: &[AtomicU32]) -> Vec<usize> {
    let mut voted: Vec<(u32, usize)> =
        votes.iter().enumerate().map(|(photograph, votes)| (votes.load(Ordering::Relaxed), photograph)).collect();
    voted.retain(|&(votes, _)| votes > 0);
    voted.sort_unstable_by_key(|&(votes, photograph)| (u32::MAX - votes, photograph));
    voted.into_iter().take(LISTED).map(|(_, photograph)| photograph).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearer_photographs_get_more_votes_and_far_ones_none() {
        let votes: Vec<(u32, u32)> = votes_for(&[(0, 7), (UNLIKE / 2, 3), (UNLIKE - 1, 5)]).collect();
        assert_eq!(votes, [(7, 256), (3, 128), (5, 0)]);
        // The seventeenth sets the standard.
        let near: Vec<(u32, u32)> = (0..20).map(|k| (if k < 16 { 100 } else { 400 }, k)).collect();
        let votes: Vec<(u32, u32)> = votes_for(&near).collect();
        assert_eq!(votes, (0..16).map(|k| (k, 192)).collect::<Vec<_>>());
    }

    #[test]
    fn a_photograph_is_voted_for_by_the_nearest_of_its_features() {
        let mut near = vec![(9, 1), (4, 2), (3, 1), (4, 0), (8, 2)];
        nearest_of_each(&mut near);
        assert_eq!(near, [(3, 1), (4, 0), (4, 2)]);
        let mut many: Vec<(u32, u32)> = (0..60).map(|k| (100 + k, k % 30)).collect();
        nearest_of_each(&mut many);
        assert_eq!(many, (0..17).map(|k| (100 + k, k)).collect::<Vec<_>>());
    }

    #[test]
    fn who_has_more_votes_wins_and_of_equals_the_first() {
        let votes = [0, 5, 7, 0, 5].map(AtomicU32::new);
        assert_eq!(winners(&votes), [2, 1, 4]);
    }
}
