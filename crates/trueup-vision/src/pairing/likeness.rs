//! Which photographs look alike: those whose features are each other's neighbors.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::options::StageOptions;
use trueup_core::{Result, StageContext};

use super::PairingOptions;
use super::forest::DescriptorForest;
use crate::features::{Descriptor, Features};
use crate::matching::squared_distance;

/// Strongest features of each photograph that take part.
const COMPARED_FEATURES: usize = 1000;
/// Distance of two descriptors from which they say nothing, squared; that of a descriptor from the nearest one of another scene
/// is about as large. (Descriptors have a length of 512.)
const UNLIKE: u32 = 350 * 350;
/// Photographs for which a feature votes: the nearest. A place is seldom seen in more.
const VOTED_FOR: usize = 16;
/// Votes of a feature that is the same in both photographs.
const FULL_VOTE: u32 = 256;
/// Photographs listed as like one, the most alike.
const LISTED: usize = 256;

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
/// Brown and Lowe (2007), sections 2 and 3.1: a feature's nearest neighbors among those of all photographs, found by trees.
///
/// # Departures
/// More neighbors than their 4 are taken, and weighed: photographs may overlap many others.
pub fn likeness(features: &[Features], context: &StageContext<'_>) -> Result<Likeness> {
    for (index, features) in features.iter().enumerate() {
        features.check(index)?;
    }
    let ballot = Ballot::new(features, context);
    context.check_cancelled()?;
    context.progress().begin(PairingOptions::STAGE, features.len() as u64);
    let alike: Result<Vec<Vec<usize>>> = (0..features.len())
        .into_par_iter()
        .map_init(
            || Count::new(features.len()),
            |count, photograph| {
                context.check_cancelled()?;
                let alike = ballot.most_alike(photograph, count);
                context.progress().advance(PairingOptions::STAGE, 1);
                Ok(alike)
            },
        )
        .collect();
    context.progress().finish(PairingOptions::STAGE);
    Ok(Likeness(alike?))
}

/// The features that vote.
struct Ballot<'a> {
    descriptors: Vec<&'a Descriptor>,
    /// The photograph of each.
    photograph_of: Vec<u32>,
    /// The first descriptor of every photograph, and their number at the end.
    first: Vec<usize>,
    forest: DescriptorForest,
}

/// Votes that are being counted.
struct Count {
    votes: Vec<u32>,
    /// Photographs with votes.
    voted: Vec<u32>,
}

impl Count {
    fn new(photographs: usize) -> Self {
        Self { votes: vec![0; photographs], voted: Vec::new() }
    }

    fn add(&mut self, photograph: u32, votes: u32) {
        let sum = &mut self.votes[photograph as usize];
        if *sum == 0 {
            self.voted.push(photograph);
        }
        *sum += votes;
    }

    /// The photographs with most votes, which are counted anew from here on.
    fn winners(&mut self) -> Vec<usize> {
        self.voted.sort_unstable_by_key(|&photograph| (u32::MAX - self.votes[photograph as usize], photograph));
        let winners = self.voted.iter().take(LISTED).map(|&photograph| photograph as usize).collect();
        for photograph in self.voted.drain(..) {
            self.votes[photograph as usize] = 0;
        }
        winners
    }
}

impl<'a> Ballot<'a> {
    fn new(features: &'a [Features], context: &StageContext<'_>) -> Self {
        let (mut descriptors, mut photograph_of, mut first) = (Vec::new(), Vec::new(), vec![0]);
        for (photograph, features) in features.iter().enumerate() {
            let strongest = features.descriptor_points.partition_point(|&point| (point as usize) < COMPARED_FEATURES);
            descriptors.extend(&features.descriptors[..strongest]);
            photograph_of.resize(descriptors.len(), photograph as u32);
            first.push(descriptors.len());
        }
        let forest = DescriptorForest::new(&descriptors, context);
        Self { descriptors, photograph_of, first, forest }
    }

    /// Those that a photograph's features vote for.
    fn most_alike(&self, photograph: usize, count: &mut Count) -> Vec<usize> {
        let mut near: Vec<(u32, u32)> = Vec::new();
        for voter in self.first[photograph]..self.first[photograph + 1] {
            for group in self.forest.groups_of(voter) {
                self.neighbors(voter, group, &mut near);
                vote(&near, count);
            }
        }
        count.winners()
    }

    /// The nearest feature of each other photograph in a group: squared distance and photograph, the nearest first.
    fn neighbors(&self, voter: usize, group: &[u32], near: &mut Vec<(u32, u32)>) {
        near.clear();
        let own = self.photograph_of[voter];
        for &member in group {
            let photograph = self.photograph_of[member as usize];
            if photograph != own {
                let squared_distance = squared_distance(self.descriptors[voter], self.descriptors[member as usize]);
                if squared_distance < UNLIKE {
                    near.push((squared_distance, photograph));
                }
            }
        }
        near.sort_unstable_by_key(|&(squared_distance, photograph)| (photograph, squared_distance));
        near.dedup_by_key(|(_, photograph)| *photograph);
        near.sort_unstable();
    }
}

/// One feature's votes for the photographs of its nearest neighbors.
fn vote(near: &[(u32, u32)], count: &mut Count) {
    let background = near.get(VOTED_FOR).map_or(UNLIKE, |&(squared_distance, _)| squared_distance).max(1);
    for &(squared_distance, photograph) in &near[..near.len().min(VOTED_FOR)] {
        // At most 2^17 by 2^8.
        let votes = (background - squared_distance) * FULL_VOTE / background;
        if votes > 0 {
            count.add(photograph, votes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearer_photographs_get_more_votes_and_far_ones_none() {
        let mut count = Count::new(40);
        vote(&[(0, 7), (UNLIKE / 2, 3), (UNLIKE - 1, 5)], &mut count);
        assert_eq!((count.votes[7], count.votes[3], count.votes[5]), (256, 128, 0));
        assert_eq!(count.winners(), [7, 3]);
        assert_eq!(count.votes, [0; 40]);
        // The seventeenth sets the standard.
        let near: Vec<(u32, u32)> = (0..20).map(|k| (if k < 16 { 100 } else { 400 }, k)).collect();
        vote(&near, &mut count);
        assert!((0..16).all(|k| count.votes[k] == 192) && (16..40).all(|k| count.votes[k] == 0));
    }
}
