//! Normal equations of bundle adjustment, sparse: a photograph's unknowns meet only those of the photographs that
//! overlap it.

use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{Argsort, Pair, SparseColMat, SymbolicSparseColMat};
use trueup_core::{Error, Result};

use super::pair_cost::{Columns, PairTerm};

/// Which unknowns meet, and the order in which they are eliminated: found once for many equations.
pub(super) struct NormalPattern<const LOCAL: usize> {
    /// The unknowns of every pair.
    columns: Vec<Columns<LOCAL>>,
    lower: SymbolicSparseColMat<usize>,
    /// Where the entries go in the order in which they are listed: the diagonal, then pair by pair.
    places: Argsort<usize>,
    elimination: SymbolicLlt<usize>,
}

/// J^T J and J^T r of the data and of what holds single unknowns.
pub(super) struct NormalEquations {
    /// The lower triangle; each column begins with its diagonal.
    lower: SparseColMat<usize, f64>,
    elimination: SymbolicLlt<usize>,
    pub gradient: faer::Mat<f64>,
}

/// A residual that holds one unknown near where it is expected.
pub(super) struct Pull {
    pub column: usize,
    pub residual: f64,
    /// Its derivative by the unknown.
    pub slope: f64,
}

impl Pull {
    /// Of an unknown so far from where it is expected, within `sd`.
    pub(super) fn new(column: usize, distance: f64, sd: f64) -> Self {
        Self { column, residual: distance / sd, slope: 1.0 / sd }
    }
}

/// An entry of the lower triangle that a pair contributes to.
struct Entry {
    local: (usize, usize),
    row: usize,
    column: usize,
}

fn entries<const LOCAL: usize>(columns: &Columns<LOCAL>) -> impl Iterator<Item = Entry> {
    let entry = |(local_row, local_column): (usize, usize)| {
        let (row, column) = (columns[local_row]?, columns[local_column]?);
        (row >= column).then_some(Entry { local: (local_row, local_column), row, column })
    };
    (0..LOCAL * LOCAL).map(|local| (local / LOCAL, local % LOCAL)).filter_map(entry)
}

impl<const LOCAL: usize> NormalPattern<LOCAL> {
    /// Of so many unknowns, of which each pair has these.
    ///
    /// # Errors
    /// [`Error::Unsolvable`] if memory does not suffice.
    pub(super) fn new(unknowns: usize, columns: Vec<Columns<LOCAL>>) -> Result<Self> {
        let diagonal = (0..unknowns).map(|k| Pair::new(k, k));
        let of_pairs = columns.iter().flat_map(entries).map(|entry| Pair::new(entry.row, entry.column));
        let entries: Vec<Pair<usize, usize>> = diagonal.chain(of_pairs).collect();
        let found = SymbolicSparseColMat::try_new_from_indices(unknowns, unknowns, &entries).ok();
        let ordered = found.and_then(|(lower, places)| {
            let elimination = SymbolicLlt::try_new(lower.as_ref(), faer::Side::Lower).ok()?;
            Some((lower, places, elimination))
        });
        let Some((lower, places, elimination)) = ordered else {
            return Err(Error::unsolvable(
                "cameras",
                format!("{} overlaps", columns.len()),
                "their equations do not fit into memory",
                "Stitch fewer photographs at once.",
            ));
        };
        Ok(Self { columns, lower, places, elimination })
    }

    /// The equations of the pairs' `terms` and of `pulls`; `None` if memory does not suffice.
    pub(super) fn equations(&self, terms: &[PairTerm<LOCAL>], pulls: &[Pull]) -> Option<NormalEquations> {
        let unknowns = self.lower.ncols();
        let mut values = vec![0.0; unknowns];
        let mut gradient = faer::Mat::<f64>::zeros(unknowns, 1);
        for (columns, term) in self.columns.iter().zip(terms) {
            values.extend(entries(columns).map(|entry| term.normal[entry.local]));
            for (local, column) in columns.iter().enumerate() {
                if let Some(column) = *column {
                    gradient[(column, 0)] += term.gradient[local];
                }
            }
        }
        for &Pull { column, residual, slope } in pulls {
            values[column] += slope * slope;
            gradient[(column, 0)] += slope * residual;
        }
        let lower = SparseColMat::new_from_argsort(self.lower.clone(), &self.places, &values).ok()?;
        Some(NormalEquations { lower, elimination: self.elimination.clone(), gradient })
    }
}

impl NormalEquations {
    /// The Cholesky factor of N + damping diag N, with 1 on the diagonal for unknowns without any data, which then stay
    /// where they are; `None` if it is not positive definite.
    pub(super) fn factor(&self, damping: f64) -> Option<Llt<usize, f64>> {
        let mut damped = self.lower.clone();
        for k in 0..damped.ncols() {
            let place = damped.col_ptr()[k];
            let diagonal = &mut damped.val_mut()[place];
            *diagonal = if *diagonal > 0.0 { *diagonal * (1.0 + damping) } else { 1.0 };
        }
        Llt::try_new_with_symbolic(self.elimination.clone(), damped.as_ref(), faer::Side::Lower).ok()
    }
}

#[cfg(test)]
mod tests {
    use faer::linalg::solvers::Solve;
    use nalgebra::{DMatrix, DVector, SMatrix, SVector};

    use super::*;

    /// Three pairs of four unknowns each, the second of which is common to all, against dense elimination.
    #[test]
    fn solutions_are_those_of_the_dense_system() {
        let columns: Vec<Columns<4>> = vec![
            [Some(0), Some(5), None, Some(1)],
            [Some(1), Some(5), Some(2), Some(5)],
            [Some(4), Some(5), Some(0), Some(2)],
        ];
        let root = |seed: usize| {
            SMatrix::<f64, 4, 4>::from_fn(|row, column| ((row * 5 + column * 3 + seed * 7) % 11) as f64 - 4.0)
        };
        let terms: Vec<PairTerm<4>> = (0..3)
            .map(|seed| PairTerm {
                normal: root(seed).transpose() * root(seed),
                gradient: SVector::from_fn(|row, _| (row + seed) as f64 - 2.0),
            })
            .collect();
        // Unknown 3 is in no pair.
        let pulls = [Pull::new(5, 0.5, 0.25)];
        let (mut normal, mut gradient) = (DMatrix::<f64>::zeros(6, 6), DVector::<f64>::zeros(6));
        for (columns, term) in columns.iter().zip(&terms) {
            for (row, at_row) in columns.iter().enumerate() {
                let Some(at_row) = *at_row else { continue };
                gradient[at_row] += term.gradient[row];
                for (column, at_column) in columns.iter().enumerate() {
                    if let Some(at_column) = *at_column {
                        normal[(at_row, at_column)] += term.normal[(row, column)];
                    }
                }
            }
        }
        normal[(5, 5)] += 16.0;
        gradient[5] += 8.0;
        normal[(3, 3)] = 1.0;
        let damping = 0.5;
        (0..6).filter(|&k| k != 3).for_each(|k| normal[(k, k)] *= 1.0 + damping);
        let expected = normal.cholesky().expect("positive definite").solve(&-&gradient);
        let pattern = NormalPattern::new(6, columns).expect("little memory");
        let equations = pattern.equations(&terms, &pulls).expect("little memory");
        let found = equations.factor(damping).expect("positive definite").solve(-&equations.gradient);
        for k in 0..6 {
            assert!((found[(k, 0)] - expected[k]).abs() < 1e-12, "{k}: {} {}", found[(k, 0)], expected[k]);
        }
    }
}
