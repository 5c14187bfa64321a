//! Descriptors of many photographs in small groups of those that look alike, without comparing all with all.
//!
//! Each tree halves the descriptors by a hyperplane again and again. A hyperplane stands between two clusters of its
//! descriptors, so that it seldom parts two that are alike; where one tree parts them, another may not.
//!
//! # Source
//! Dasgupta and Freund, "Random projection trees and low dimensional manifolds" (2008); Silpa-Anan and Hartley,
//! "Optimised KD-trees for fast image descriptor matching" (2008), for several trees.
//!
//! # Departures
//! Directions are those between two clusters (k-means of a sample) instead of random ones: they part fewer neighbors.

use std::ops::Range;

use rand::RngExt;
use rayon::prelude::*;
use trueup_core::StageContext;
use trueup_core::options::StageOptions;

use super::PairingOptions;
use crate::features::{DESCRIPTOR_LENGTH, Descriptor};

/// Trees; each finds about half of the neighbors that there are among a million descriptors.
const TREES: u64 = 4;
/// Most descriptors of a group: more find more neighbors, in time proportional to them.
const LEAF: usize = 64;
/// Descriptors of a branch that its clusters are sought among.
const SAMPLE: usize = 64;
/// Rounds of k-means: the clusters need not be settled.
const ROUNDS: usize = 3;
/// Scale of cluster means, so that directions are whole numbers: projections are then the same on every machine.
const SCALE: i32 = 4;
/// Descriptors of which one thread finds the projections.
const PER_TASK: usize = 4096;

/// Groups of descriptors that look alike, by several trees. Descriptors are counted through all photographs.
pub(super) struct DescriptorForest {
    trees: Vec<Tree>,
    /// Where each group begins and ends, the same in every tree.
    groups: Vec<Range<usize>>,
}

/// One tree.
struct Tree {
    /// The descriptors, group by group.
    order: Vec<u32>,
}

type Direction = [i16; DESCRIPTOR_LENGTH];

impl DescriptorForest {
    /// The groups of `descriptors`.
    pub(super) fn new(descriptors: &[&Descriptor], context: &StageContext<'_>) -> Self {
        let mut groups = Vec::new();
        collect_groups(0..descriptors.len(), &mut groups);
        let tree = |tree: u64| {
            let mut order: Vec<u32> = (0..descriptors.len() as u32).collect();
            Branch { descriptors, context, tree, node: 1 }.part(&mut order);
            Tree { order }
        };
        Self { trees: (0..TREES).map(tree).collect(), groups }
    }

    /// The groups of all trees; each descriptor is in one of every tree.
    pub(super) fn groups(&self) -> Vec<&[u32]> {
        self.trees.iter().flat_map(|tree| self.groups.iter().map(|group| &tree.order[group.clone()])).collect()
    }
}

/// Where the groups of so many descriptors begin and end.
fn collect_groups(range: Range<usize>, groups: &mut Vec<Range<usize>>) {
    if range.len() <= LEAF {
        groups.push(range);
        return;
    }
    let middle = range.start + range.len() / 2;
    collect_groups(range.start..middle, groups);
    collect_groups(middle..range.end, groups);
}

/// A part of a tree.
#[derive(Clone, Copy)]
struct Branch<'a> {
    descriptors: &'a [&'a Descriptor],
    context: &'a StageContext<'a>,
    tree: u64,
    /// Its number in the tree: that of the root is 1, those of the halves of k are 2 k and 2 k + 1.
    node: u64,
}

impl Branch<'_> {
    /// Sorts the members into groups.
    fn part(self, members: &mut [u32]) {
        if members.len() <= LEAF {
            return;
        }
        let direction = self.direction(members);
        let project = |&member: &u32| (projection(&direction, self.descriptors[member as usize]), member);
        let mut projected: Vec<(i32, u32)> = members.par_iter().with_min_len(PER_TASK).map(project).collect();
        let middle = projected.len() / 2;
        projected.select_nth_unstable(middle);
        // In the order of their numbers, so that the sample does not depend on how the halves were found.
        let (low, high) = members.split_at_mut(middle);
        for (half, projected) in [(&mut *low, &projected[..middle]), (&mut *high, &projected[middle..])] {
            half.iter_mut().zip(projected).for_each(|(member, &(_, found))| *member = found);
            half.sort_unstable();
        }
        let [first, second] = [self.half(0), self.half(1)];
        rayon::join(|| first.part(low), || second.part(high));
    }

    fn half(self, side: u64) -> Self {
        Self { node: 2 * self.node + side, ..self }
    }

    /// The direction between two clusters of a sample of the members.
    fn direction(self, members: &[u32]) -> Direction {
        let mut generator = self.context.generator(PairingOptions::STAGE, self.tree << 48 | self.node);
        let mut draw = || self.descriptors[members[generator.random_range(0..members.len())] as usize];
        let sample: Vec<&Descriptor> = (0..SAMPLE).map(|_| draw()).collect();
        let mut centers = [sample[0], sample[1]].map(|one| one.map(|entry| SCALE * i32::from(entry)));
        for _ in 0..ROUNDS {
            let (mut sums, mut counts) = ([[0_i32; DESCRIPTOR_LENGTH]; 2], [0; 2]);
            for descriptor in &sample {
                let [to_first, to_second] = centers.each_ref().map(|center| squared_distance_to(center, descriptor));
                let cluster = usize::from(to_second < to_first);
                counts[cluster] += 1;
                sums[cluster].iter_mut().zip(*descriptor).for_each(|(sum, &entry)| *sum += i32::from(entry));
            }
            for ((center, sum), count) in centers.iter_mut().zip(&sums).zip(counts) {
                if count > 0 {
                    *center = sum.map(|sum| SCALE * sum / count);
                }
            }
        }
        let [first, second] = centers;
        std::array::from_fn(|entry| (second[entry] - first[entry]) as i16)
    }
}

/// At most 128 * 1020 * 255.
fn projection(direction: &Direction, descriptor: &Descriptor) -> i32 {
    let product = |(&along, &entry): (&i16, &u8)| i32::from(along).wrapping_mul(i32::from(i16::from(entry)));
    direction.iter().zip(descriptor).map(product).fold(0, i32::wrapping_add)
}

/// The squared distance of a descriptor from a cluster's middle, scaled.
fn squared_distance_to(center: &[i32; DESCRIPTOR_LENGTH], descriptor: &Descriptor) -> i64 {
    let differences = center.iter().zip(descriptor).map(|(&center, &entry)| center - SCALE * i32::from(entry));
    differences.map(|difference| i64::from(difference * difference)).sum()
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;

    fn random_descriptors(count: usize) -> Vec<Descriptor> {
        let mut generator = StageContext::default().generator("test", 0);
        let mut descriptors = vec![[0; DESCRIPTOR_LENGTH]; count];
        descriptors.iter_mut().for_each(|descriptor| generator.fill_bytes(descriptor));
        descriptors
    }

    /// The groups of a descriptor.
    fn groups_of(forest: &DescriptorForest, descriptor: u32) -> Vec<&[u32]> {
        forest.groups().into_iter().filter(|group| group.contains(&descriptor)).collect()
    }

    #[test]
    fn every_descriptor_is_in_one_group_of_each_tree_with_its_equals() {
        let mut descriptors = random_descriptors(500);
        // Ten times the same.
        for copy in 1..10 {
            descriptors[50 * copy] = descriptors[0];
        }
        let forest = DescriptorForest::new(&descriptors.iter().collect::<Vec<_>>(), &StageContext::default());
        for descriptor in 0..500 {
            let groups = groups_of(&forest, descriptor);
            assert_eq!(groups.len(), TREES as usize);
            assert!(groups.iter().all(|group| group.len() <= LEAF));
        }
        for tree in &forest.trees {
            let mut order = tree.order.clone();
            order.sort_unstable();
            assert!(order.into_iter().eq(0..500));
        }
        // A median may part equals in a tree, hardly in all.
        let met = groups_of(&forest, 0).iter().any(|group| group.contains(&50));
        assert!(met);
    }

    #[test]
    fn descriptors_that_differ_little_mostly_meet() {
        let mut descriptors = random_descriptors(1000);
        let alike: Vec<Descriptor> = descriptors.iter().map(|one| one.map(|entry| entry ^ 0x0f)).collect();
        descriptors.extend(alike);
        let forest = DescriptorForest::new(&descriptors.iter().collect::<Vec<_>>(), &StageContext::default());
        let meet = |one: u32| groups_of(&forest, one).iter().any(|group| group.contains(&(one + 1000)));
        let met = (0..1000).filter(|&one| meet(one)).count();
        assert!(met > 900, "{met} of 1000");
    }

    #[test]
    fn no_descriptors_make_an_empty_forest() {
        let forest = DescriptorForest::new(&[], &StageContext::default());
        assert!(forest.trees.iter().all(|tree| tree.order.is_empty()));
    }
}
