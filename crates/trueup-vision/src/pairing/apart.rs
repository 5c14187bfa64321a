//! Which photographs are looked at again that are apart after matching.

use std::collections::BTreeSet;

use super::{Likeness, PairingOptions, all_pairs, ordered};

/// Photographs after matching.
#[derive(Debug, Clone, Copy)]
pub struct Apart<'a> {
    /// Which of them are joined, the largest group first; a photograph that is joined to no other is a group of its
    /// own.
    pub groups: &'a [Vec<usize>],
    /// Whether each takes part.
    pub usable: &'a [bool],
    /// The only pairs that are looked at, if there are any.
    pub wished: &'a [(usize, usize)],
    /// The pairs that were looked at again, the smaller index first.
    pub tried: &'a BTreeSet<(usize, usize)>,
}

impl Apart<'_> {
    /// The group of each photograph.
    fn group_of(&self) -> Vec<usize> {
        let mut group_of = vec![0; self.usable.len()];
        for (number, group) in self.groups.iter().enumerate() {
            for &member in group {
                if let Some(group_of) = group_of.get_mut(member) {
                    *group_of = number;
                }
            }
        }
        group_of
    }

    /// Whether both photographs of a pair, the smaller index first, take part, belong to different groups and were not
    /// tried.
    pub fn is_apart(&self) -> impl Fn(&(usize, usize)) -> bool + '_ {
        let group_of = self.group_of();
        move |&(a, b)| {
            b < self.usable.len()
                && [a, b].iter().all(|&one| self.usable[one])
                && group_of[a] != group_of[b]
                && !self.tried.contains(&(a, b))
        }
    }

    /// Whether any photograph that takes part is outside of the largest group.
    pub fn is_any_outside(&self) -> bool {
        self.groups.iter().skip(1).flatten().any(|&one| self.usable.get(one) == Some(&true))
    }
}

/// The pairs that might join photographs outside of the largest group to others, the smaller index first, ascending:
/// all of them where all pairs are matched, or those wished for; else, of each photograph, those that it looks most
/// like and that were taken next to it. `likeness` is asked how they look like each other then.
///
/// # Errors
/// Those of `likeness`.
pub fn pairs_apart<'a, E>(
    apart: &Apart<'_>,
    options: &PairingOptions,
    likeness: impl FnOnce() -> Result<&'a Likeness, E>,
) -> Result<Vec<(usize, usize)>, E> {
    if !apart.is_any_outside() {
        return Ok(Vec::new());
    }
    let (count, group_of) = (apart.usable.len(), apart.group_of());
    let is_apart = apart.is_apart();
    if !apart.wished.is_empty() {
        let wished: BTreeSet<(usize, usize)> = apart.wished.iter().map(|&(a, b)| ordered(a, b)).collect();
        return Ok(wished.into_iter().filter(&is_apart).collect());
    }
    if count <= options.exhaustive_up_to {
        return Ok(all_pairs(count).into_iter().filter(&is_apart).collect());
    }
    let Likeness(alike) = likeness()?;
    let mut pairs = BTreeSet::new();
    for one in (0..count).filter(|&one| group_of[one] != 0) {
        let others = alike.get(one).into_iter().flatten().map(|&other| ordered(one, other));
        pairs.extend(others.filter(&is_apart).take(options.neighbors));
        if options.consecutive {
            let next = [one.checked_sub(1), one.checked_add(1)];
            pairs.extend(next.into_iter().flatten().map(|other| ordered(one, other)).filter(&is_apart));
        }
    }
    Ok(pairs.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said where looks are asked for that need not be.
    #[derive(Debug, PartialEq)]
    struct Unasked;

    fn pairs(
        groups: &[Vec<usize>],
        usable: &[bool],
        tried: &[(usize, usize)],
        options: &PairingOptions,
        alike: Vec<Vec<usize>>,
    ) -> Vec<(usize, usize)> {
        let (tried, alike) = (tried.iter().copied().collect(), Likeness(alike));
        let apart = Apart { groups, usable, wished: &[], tried: &tried };
        pairs_apart(&apart, options, || Ok::<_, Unasked>(&alike)).expect("no error")
    }

    #[test]
    fn of_few_photographs_all_that_are_apart_are_looked_at() {
        let options = PairingOptions::default();
        let groups = [vec![0, 2, 4], vec![1], vec![3]];
        let usable = [true; 5];
        let all = [(0, 1), (0, 3), (1, 2), (1, 3), (1, 4), (2, 3), (3, 4)];
        assert_eq!(pairs(&groups, &usable, &[], &options, Vec::new()), all);
        assert_eq!(pairs(&groups, &usable, &all, &options, Vec::new()), []);
        let without_three = [true, true, true, false, true];
        assert_eq!(pairs(&groups, &without_three, &[(0, 1)], &options, Vec::new()), [(1, 2), (1, 4)]);
    }

    #[test]
    fn what_is_joined_is_not_asked_how_it_looks() {
        let options = PairingOptions { exhaustive_up_to: 0, ..PairingOptions::default() };
        let (groups, tried) = ([vec![0, 1], vec![2]], BTreeSet::new());
        let apart = Apart { groups: &groups, usable: &[true, true, false], wished: &[], tried: &tried };
        let found = pairs_apart(&apart, &options, || Err(Unasked));
        assert_eq!(found, Ok(Vec::new()));
    }

    #[test]
    fn of_wished_pairs_those_that_are_apart() {
        let (groups, tried) = ([vec![0, 1], vec![2], vec![3]], BTreeSet::new());
        let wished = [(1, 0), (2, 1), (2, 0)];
        let apart = Apart { groups: &groups, usable: &[true; 4], wished: &wished, tried: &tried };
        let found = pairs_apart(&apart, &PairingOptions::default(), || Err(Unasked));
        assert_eq!(found, Ok(vec![(0, 2), (1, 2)]));
    }

    #[test]
    fn of_many_those_that_look_alike_and_neighbors() {
        let options = PairingOptions { exhaustive_up_to: 2, neighbors: 2, ..PairingOptions::default() };
        let groups = [vec![0, 1, 2, 5], vec![3, 6], vec![4]];
        let alike = vec![vec![], vec![], vec![], vec![6, 0, 1, 2], vec![5], vec![], vec![9, 5]];
        let found = pairs(&groups, &[true; 7], &[(0, 3)], &options, alike);
        // Of 3: not 6 of its own group, nor 0, which was tried; 1 and 2 by their looks, 2 and 4 beside it.
        assert_eq!(found, [(1, 3), (2, 3), (3, 4), (4, 5), (5, 6)]);
    }
}
