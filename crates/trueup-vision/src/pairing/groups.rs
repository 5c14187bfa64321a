//! Groups of photographs that hang together, while they are being joined.

/// Disjoint sets of photographs.
///
/// # Source
/// Tarjan, "Efficiency of a good but not linear set union algorithm" (1975).
#[derive(Debug)]
pub(super) struct Groups {
    /// A photograph of the same group, smaller or the same: the group's label.
    parent: Vec<usize>,
}

impl Groups {
    /// So many photographs, each by itself.
    pub(super) fn new(photographs: usize) -> Self {
        Self { parent: (0..photographs).collect() }
    }

    /// Makes one group of those of two photographs.
    pub(super) fn join(&mut self, one: usize, other: usize) {
        let [one, other] = [one, other].map(|photograph| {
            let label = self.label(photograph);
            self.parent[photograph] = label;
            label
        });
        self.parent[one.max(other)] = one.min(other);
    }

    fn label(&self, mut photograph: usize) -> usize {
        while self.parent[photograph] != photograph {
            photograph = self.parent[photograph];
        }
        photograph
    }

    /// Each photograph's group, named by its smallest member.
    pub(super) fn labels(&self) -> Vec<usize> {
        (0..self.parent.len()).map(|photograph| self.label(photograph)).collect()
    }

    /// The group of most photographs, of equals the first; 0 if there are no photographs.
    pub(super) fn largest(&self) -> usize {
        let labels = self.labels();
        let mut sizes = vec![0_usize; labels.len()];
        labels.iter().for_each(|&label| sizes[label] += 1);
        (0..sizes.len()).min_by_key(|&label| (usize::MAX - sizes[label], label)).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_named_by_their_smallest_member() {
        let mut groups = Groups::new(6);
        assert_eq!(groups.largest(), 0);
        groups.join(5, 3);
        groups.join(1, 4);
        groups.join(4, 3);
        groups.join(1, 5);
        assert_eq!(groups.labels(), [0, 1, 2, 1, 1, 1]);
        assert_eq!(groups.largest(), 1);
        assert_eq!(Groups::new(0).largest(), 0);
    }
}
