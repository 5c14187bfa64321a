//! Pixels of one photograph's cell that are to meet pixels of another's: their equations, summed.

use std::collections::BTreeMap;

use nalgebra::Vector2;

use super::metric::Metric;

/// Vertices of one cell in each photograph.
pub(super) const MEMBERS: usize = 8;
/// Unordered couplings of them.
const COUPLINGS: usize = MEMBERS * (MEMBERS + 1) / 2;

/// Sums of the normal equations of many residuals over the same eight vertices: those of the first photograph's cell
/// (top left, top right, bottom right, bottom left), then those of the second's.
///
/// They are summed here first because the large matrix is far away, in memory and in look-ups.
#[derive(Debug, Clone)]
pub(super) struct CellPair {
    /// The first vertex of each cell, numbered within its grid.
    pub first: [u32; 2],
    /// The entries xx, xy and yy of the couplings, each the lower triangle row by row.
    couplings: [[f64; COUPLINGS]; 3],
    /// x and y of the right side.
    right: [[f64; MEMBERS]; 2],
}

impl CellPair {
    /// No equations yet between the cells with these first vertices.
    pub(super) fn new(first: [u32; 2]) -> Self {
        Self { first, couplings: [[0.0; COUPLINGS]; 3], right: [[0.0; MEMBERS]; 2] }
    }

    /// Adds the square of (sum of the vertices by their `shares`) - value, weighed by `metric`, of which `pull` is the
    /// metric times the value.
    pub(super) fn add(&mut self, shares: &[f64; MEMBERS], metric: Metric, pull: Vector2<f64>) {
        let mut products = [0.0; COUPLINGS];
        let mut coupling = 0;
        for (k, share) in shares.iter().enumerate() {
            for other in &shares[..=k] {
                products[coupling] = share * other;
                coupling += 1;
            }
        }
        for (sums, weight) in self.couplings.iter_mut().zip([metric.xx, metric.xy, metric.yy]) {
            for (sum, product) in sums.iter_mut().zip(&products) {
                *sum += product * weight;
            }
        }
        for (sums, pull) in self.right.iter_mut().zip([pull.x, pull.y]) {
            for (sum, share) in sums.iter_mut().zip(shares) {
                *sum += share * pull;
            }
        }
    }

    /// The couplings of the vertices with themselves and with those before them, row by row.
    pub(super) fn couplings(&self) -> impl Iterator<Item = Metric> + '_ {
        let [xx, xy, yy] = &self.couplings;
        (0..COUPLINGS).map(|coupling| Metric { xx: xx[coupling], xy: xy[coupling], yy: yy[coupling] })
    }

    /// The right side of a vertex.
    pub(super) fn pull(&self, member: usize) -> Vector2<f64> {
        Vector2::new(self.right[0][member], self.right[1][member])
    }
}

/// The cell pairs of two photographs that have equations.
#[derive(Debug)]
pub(super) struct CellPairs {
    /// The photographs.
    pub photographs: [usize; 2],
    /// In the order in which they were met.
    pairs: Vec<CellPair>,
    /// Where among them each is, by first vertices.
    positions: BTreeMap<[u32; 2], usize>,
    last: usize,
}

impl CellPairs {
    /// None yet.
    pub(super) fn between(photographs: [usize; 2]) -> Self {
        Self { photographs, pairs: Vec::new(), positions: BTreeMap::new(), last: 0 }
    }

    /// The pair of the cells with these first vertices.
    pub(super) fn of(&mut self, first: [u32; 2]) -> &mut CellPair {
        let Self { pairs, positions, last, .. } = self;
        if pairs.get(*last).is_none_or(|pair| pair.first != first) {
            *last = *positions.entry(first).or_insert_with(|| {
                pairs.push(CellPair::new(first));
                pairs.len() - 1
            });
        }
        &mut pairs[*last]
    }

    /// All of them.
    pub(super) fn iter(&self) -> impl Iterator<Item = &CellPair> {
        self.pairs.iter()
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::mesh::GridMesh;

    use super::super::normal_equations::{NormalEquations, WeightedVertex};
    use super::*;

    #[test]
    fn every_pair_is_there_once_in_the_order_of_first_need() {
        let mut pairs = CellPairs::between([4, 2]);
        for first in [[5, 1], [5, 1], [0, 9], [5, 1], [5, 2]] {
            assert_eq!(pairs.of(first).first, first);
        }
        assert_eq!(pairs.iter().map(|pair| pair.first).collect::<Vec<_>>(), [[5, 1], [0, 9], [5, 2]]);
    }

    #[test]
    fn summed_first_the_equations_are_the_same() {
        let grids = vec![GridMesh::regular(120.0, 80.0, 40.0); 2];
        let shares = [[0.1, 0.2, 0.3, 0.4, -0.4, -0.3, -0.2, -0.1], [0.7, 0.1, 0.0, 0.2, -0.3, -0.3, -0.2, -0.2]];
        let metrics = [Metric::isotropic(2.0), Metric::along(Vector2::new(0.6, 0.8), 5.0)];
        let values = [Vector2::new(1.0, -2.0), Vector2::new(0.5, 3.0)];
        let columns = grids[0].columns;
        let corners = |first: usize| [first, first + 1, first + columns + 1, first + columns];
        let (here, there) = (corners(1), corners(columns));
        let (mut summed, mut one_by_one) = (NormalEquations::new(&grids), NormalEquations::new(&grids));
        let mut pairs = CellPairs::between([0, 1]);
        for ((shares, metric), value) in shares.iter().zip(metrics).zip(values) {
            pairs.of([here[0] as u32, there[0] as u32]).add(shares, metric, metric.apply(value));
            let members: [WeightedVertex; MEMBERS] = std::array::from_fn(|k| {
                let vertex = if k < 4 { here[k] } else { there[k - 4] };
                WeightedVertex { photograph: k / 4, vertex, weight: shares[k] }
            });
            one_by_one.add_sum(&members, metric, value);
        }
        summed.add_cell_pairs(&pairs);
        let (summed_blocks, blocks) = (summed.blocks(), one_by_one.blocks());
        assert_eq!(summed_blocks.len(), blocks.len());
        for (one, other) in summed_blocks.iter().zip(&blocks) {
            assert_eq!((one.0, one.1), (other.0, other.1));
            assert!(one.2.iter().zip(other.2).all(|(one, other)| (one - other).abs() < 1e-12));
        }
        assert!(summed.right.iter().zip(&one_by_one.right).all(|(one, other)| (one - other).abs() < 1e-12));
    }
}
