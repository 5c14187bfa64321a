//! Normal equations of the mesh, assembled block by block.

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;

use super::cell_pair::{CellPair, CellPairs, MEMBERS};
use super::complex::conjugate_product;
use super::metric::Metric;

/// Largest distance, in grid steps along an axis, of two vertices that one energy row couples.
const REACH: usize = 3;
/// Vertices within that distance along an axis.
const SPAN: usize = 2 * REACH + 1;
/// Couplings of a vertex with itself and with vertices before it in row-major order.
const SLOTS: usize = (REACH + 1) * SPAN;

/// Coefficient of a vertex in a residual, as the complex factor c + i s acting on x + i y: the rotation-scaling
/// [[c, -s], [s, c]]. All energies of the grid are linear in this sense.
pub(super) type Coefficient = Vector2<f64>;

/// A 2 x 2 block [[a, b], [c, d]] of the normal matrix, row-major.
type Block = [f64; 4];

/// Couplings of one vertex with others, each of which occurs once.
#[derive(Debug, Clone, Default)]
struct Couplings {
    /// The others, in the order in which they were met.
    vertices: Vec<u32>,
    blocks: Vec<Block>,
}

impl Couplings {
    fn add(&mut self, vertex: u32, block: Block) {
        match self.vertices.iter().position(|&known| known == vertex) {
            Some(known) => add_to(&mut self.blocks[known], block),
            None => {
                self.vertices.push(vertex);
                self.blocks.push(block);
            }
        }
    }
}

fn add_to(sum: &mut Block, block: Block) {
    for (sum, value) in sum.iter_mut().zip(block) {
        *sum += value;
    }
}

/// A block of the normal matrix with its row and its column, vertices both; the row is not before the column.
pub(super) type PlacedBlock = (u32, u32, Block);

/// A^T A and A^T b of a least-squares problem in the vertices of several grids.
///
/// Unknown 2 v is the x and 2 v + 1 the y coordinate of vertex v, vertices numbered through all grids, row-major in
/// each. Couplings of near vertices of a grid live in tables; those farther apart, or between grids, in lists.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations {
    /// First vertex of every grid, and the total at the end.
    first: Vec<usize>,
    columns: Vec<usize>,
    inside: Vec<[Block; SLOTS]>,
    /// For every vertex its couplings with earlier ones that are not in the tables.
    between: Vec<Couplings>,
    pub right: Vec<f64>,
    pub border: Option<Border>,
}

/// What [`NormalEquations`] come to: all that solving them takes, in a fifth of the memory.
#[derive(Debug)]
pub(super) struct AssembledEquations {
    /// As [`NormalEquations::blocks`] has them.
    pub blocks: Vec<PlacedBlock>,
    pub right: Vec<f64>,
    pub border: Option<Border>,
}

/// The last row and column of the normal equations: those of one more unknown, the length of a full turn, that couples
/// with vertices anywhere.
#[derive(Debug, Clone)]
pub(super) struct Border {
    /// The couplings with all other unknowns.
    pub couplings: Vec<f64>,
    /// The coupling with itself.
    pub own: f64,
    /// The right side.
    pub right: f64,
}

/// A vertex by its grid and its index there, with its weight in a sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WeightedVertex {
    /// The grid.
    pub photograph: usize,
    /// The vertex.
    pub vertex: usize,
    /// The factor.
    pub weight: f64,
}

/// A sum over vertices of one grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct GridSum<'a> {
    /// The grid.
    pub photograph: usize,
    /// Vertices with their weights; each occurs once.
    pub members: &'a [(usize, f64)],
}

/// A vertex of one grid that is to lie where a sum over vertices of another does, after that was turned and scaled.
#[derive(Debug, Clone, Copy)]
pub(super) struct CarriedVertex<'a> {
    /// The grid and the vertex.
    pub from: [usize; 2],
    /// The other grid.
    pub to: usize,
    /// Vertices of it with their weights; each occurs once.
    pub members: &'a [(usize, f64)],
    /// Turns and scales the sum.
    pub factor: Coefficient,
    /// What is added to it.
    pub value: Vector2<f64>,
    /// How much the residual's square counts.
    pub squared_weight: f64,
}

impl NormalEquations {
    /// Empty equations for the vertices of `grids`.
    pub(super) fn new(grids: &[GridMesh]) -> Self {
        let mut first = vec![0];
        for grid in grids {
            first.push(first[first.len() - 1] + grid.len());
        }
        let vertices = first[grids.len()];
        Self {
            first,
            columns: grids.iter().map(|grid| grid.columns).collect(),
            inside: vec![[[0.0; 4]; SLOTS]; vertices],
            between: vec![Couplings::default(); vertices],
            right: vec![0.0; 2 * vertices],
            border: None,
        }
    }

    /// Number of scalar unknowns, without the length of a full turn.
    pub(super) fn unknowns(&self) -> usize {
        self.right.len()
    }

    /// Adds |sum_m coefficient_m v_m - value|^2 for vertices `members` of grid `photograph`, each of which occurs once.
    pub(super) fn add_inside(&mut self, photograph: usize, members: &[(usize, Coefficient)], value: Vector2<f64>) {
        let first = self.first[photograph];
        for &(m, factor_m) in members {
            let gradient = conjugate_product(factor_m, value);
            self.right[2 * (first + m)] += gradient.x;
            self.right[2 * (first + m) + 1] += gradient.y;
            for &(n, factor_n) in members {
                if n <= m {
                    let product = conjugate_product(factor_m, factor_n);
                    self.add_block_inside(photograph, m, n, [product.x, -product.y, product.y, product.x]);
                }
            }
        }
    }

    /// Adds squared_weight |sum_m weight_m v_m - value|^2, the sum over both of `sums`, which are of different grids.
    pub(super) fn add_between(&mut self, sums: &[GridSum; 2], value: Vector2<f64>, squared_weight: f64) {
        for &GridSum { photograph, members } in sums {
            for &(m, weight_m) in members {
                let unknown = 2 * (self.first[photograph] + m);
                self.right[unknown] += squared_weight * weight_m * value.x;
                self.right[unknown + 1] += squared_weight * weight_m * value.y;
                for &(n, weight_n) in members {
                    if n <= m {
                        let product = squared_weight * weight_m * weight_n;
                        self.add_block_inside(photograph, m, n, [product, 0.0, 0.0, product]);
                    }
                }
            }
        }
        let [first, second] = sums;
        for &(m, weight_m) in first.members {
            for &(n, weight_n) in second.members {
                let product = squared_weight * weight_m * weight_n;
                let (one, other) = (self.first[first.photograph] + m, self.first[second.photograph] + n);
                self.couple(one, other, [product, 0.0, 0.0, product]);
            }
        }
    }

    /// Adds squared_weight |v - factor sum_m weight_m v_m - value|^2 for a vertex v and `members` of different grids.
    pub(super) fn add_carried(&mut self, carried: &CarriedVertex) {
        let CarriedVertex { from: [photograph, vertex], to, members, factor, value, squared_weight } = *carried;
        self.add_right(photograph, vertex, value * squared_weight);
        self.add_block_inside(photograph, vertex, vertex, [squared_weight, 0.0, 0.0, squared_weight]);
        let back = -conjugate_product(factor, value) * squared_weight;
        let one = self.first[photograph] + vertex;
        for &(m, weight_m) in members {
            self.add_right(to, m, back * weight_m);
            for &(n, weight_n) in members {
                if n <= m {
                    let product = squared_weight * factor.norm_squared() * weight_m * weight_n;
                    self.add_block_inside(to, m, n, [product, 0.0, 0.0, product]);
                }
            }
            let other = self.first[to] + m;
            let turned = factor * (-squared_weight * weight_m);
            // The row is the later vertex; seen from there the other turns the opposite way.
            let sine = if one > other { turned.y } else { -turned.y };
            self.couple(one, other, [turned.x, -sine, sine, turned.x]);
        }
    }

    /// Makes the length of a full turn, P, an unknown and adds what it contributes to
    /// squared_weight |sum_m weight_m v_m - (turns P, 0) - value|^2 beyond the same without P (see
    /// [`Self::add_between`]).
    pub(super) fn add_period(&mut self, sums: &[GridSum; 2], turns: f64, value: f64, squared_weight: f64) {
        let unknowns = self.unknowns();
        let border = self.border.get_or_insert_with(|| Border { couplings: vec![0.0; unknowns], own: 0.0, right: 0.0 });
        for &GridSum { photograph, members } in sums {
            for &(m, weight) in members {
                border.couplings[2 * (self.first[photograph] + m)] -= squared_weight * turns * weight;
            }
        }
        border.own += squared_weight * turns * turns;
        border.right -= squared_weight * turns * value;
    }

    /// Adds weight |v - source place|^2 for the first vertex of grid `photograph`, whose source is (0, 0).
    pub(super) fn anchor(&mut self, photograph: usize, weight: f64) {
        self.add_block_inside(photograph, 0, 0, [weight, 0.0, 0.0, weight]);
    }

    /// Adds |sum_m weight_m v_m - value|^2, weighed by `metric`, for any vertices; a vertex may occur more than once.
    pub(super) fn add_sum(&mut self, members: &[WeightedVertex], metric: Metric, value: Vector2<f64>) {
        let pull = metric.apply(value);
        for (position, one) in members.iter().enumerate() {
            self.add_right(one.photograph, one.vertex, pull * one.weight);
            for (earlier, other) in members[..=position].iter().enumerate() {
                self.add_coupling(one, other, earlier == position, metric.block(one.weight * other.weight));
            }
        }
    }

    /// Adds the equations of pixels of two different grids.
    pub(super) fn add_cell_pairs(&mut self, pairs: &CellPairs) {
        pairs.iter().for_each(|pair| self.add_cell_pair(pairs.photographs, pair));
    }

    fn add_cell_pair(&mut self, photographs: [usize; 2], pair: &CellPair) {
        let members: [WeightedVertex; MEMBERS] = std::array::from_fn(|k| {
            let photograph = photographs[k / 4];
            let columns = self.columns[photograph];
            let vertex = pair.first[k / 4] as usize + [0, 1, columns + 1, columns][k % 4];
            WeightedVertex { photograph, vertex, weight: 1.0 }
        });
        let mut couplings = pair.couplings();
        for (position, one) in members.iter().enumerate() {
            self.add_right(one.photograph, one.vertex, pair.pull(position));
            for (earlier, (other, metric)) in members[..=position].iter().zip(&mut couplings).enumerate() {
                self.add_coupling(one, other, earlier == position, metric.block(1.0));
            }
        }
    }

    fn add_right(&mut self, photograph: usize, vertex: usize, pull: Vector2<f64>) {
        let unknown = 2 * (self.first[photograph] + vertex);
        self.right[unknown] += pull.x;
        self.right[unknown + 1] += pull.y;
    }

    /// Adds a symmetric block for an unordered pair of members. Two different members that are the same vertex couple
    /// in both orders.
    fn add_coupling(&mut self, one: &WeightedVertex, other: &WeightedVertex, same_member: bool, block: Block) {
        if one.photograph != other.photograph {
            let (m, n) = (self.first[one.photograph] + one.vertex, self.first[other.photograph] + other.vertex);
            self.couple(m, n, block);
            return;
        }
        let (low, high) = (one.vertex.min(other.vertex), one.vertex.max(other.vertex));
        let times = if low == high && !same_member { 2.0 } else { 1.0 };
        self.add_block_inside(one.photograph, high, low, block.map(|entry| times * entry));
    }

    /// Adds a block for two vertices, numbered through all grids, to the list of the later one, whose row it is.
    fn couple(&mut self, one: usize, other: usize, block: Block) {
        self.between[one.max(other)].add(one.min(other) as u32, block);
    }

    /// Adds a block for vertices m >= n of a grid: to the table if they are near each other, else to the lists.
    fn add_block_inside(&mut self, photograph: usize, m: usize, n: usize, block: Block) {
        let first = self.first[photograph];
        // Vertices are fewer than 2^32; short numbers are divided faster.
        let columns = self.columns[photograph] as u32;
        let [(m_row, m_column), (n_row, n_column)] = [m, n].map(|vertex| {
            let vertex = vertex as u32;
            ((vertex / columns) as usize, (vertex % columns) as usize)
        });
        if m_row - n_row > REACH || m_column.abs_diff(n_column) > REACH {
            self.couple(first + m, first + n, block);
            return;
        }
        let slot = (m_row - n_row) * SPAN + (m_column + REACH - n_column);
        add_to(&mut self.inside[first + m][slot], block);
    }

    /// All blocks, sorted by column, then row.
    pub(super) fn blocks(&self) -> Vec<PlacedBlock> {
        let between: usize = self.between.iter().map(|couplings| couplings.vertices.len()).sum();
        let mut blocks = Vec::with_capacity(self.inside.len() * SLOTS / 2 + between);
        for (photograph, &columns) in self.columns.iter().enumerate() {
            for vertex in self.first[photograph]..self.first[photograph + 1] {
                for (slot, block) in self.inside[vertex].iter().enumerate() {
                    if *block != [0.0; 4] {
                        let back = (slot / SPAN) * columns + slot % SPAN;
                        blocks.push((vertex as u32, (vertex + REACH - back) as u32, *block));
                    }
                }
                let Couplings { vertices, blocks: between } = &self.between[vertex];
                let between = vertices.iter().zip(between);
                blocks.extend(between.map(|(&column, &block)| (vertex as u32, column, block)));
            }
        }
        by_column(&blocks, self.inside.len())
    }

    /// The equations without the tables that they were added up in.
    pub(super) fn assembled(self) -> AssembledEquations {
        AssembledEquations { blocks: self.blocks(), right: self.right, border: self.border }
    }
}

/// The `grids` with a solution, x and y of all of their vertices in turn, as their targets.
pub(super) fn solved_grids(grids: &[GridMesh], solution: &[f64]) -> Vec<GridMesh> {
    let (mut places, _) = solution.as_chunks::<2>();
    let mut of_grid = |grid: &GridMesh| {
        let (own, rest) = places.split_at(grid.len());
        places = rest;
        GridMesh { target: own.to_vec(), ..grid.clone() }
    };
    grids.iter().map(&mut of_grid).collect()
}

/// Blocks in the order of their columns, in their given order within a column (counting sort). They are listed by
/// rising row: so each column comes out sorted.
fn by_column(blocks: &[PlacedBlock], columns: usize) -> Vec<PlacedBlock> {
    let mut next = vec![0_usize; columns + 1];
    for block in blocks {
        next[block.1 as usize + 1] += 1;
    }
    for column in 0..columns {
        next[column + 1] += next[column];
    }
    let mut sorted = vec![(0, 0, [0.0; 4]); blocks.len()];
    for block in blocks {
        let place = &mut next[block.1 as usize];
        sorted[*place] = *block;
        *place += 1;
    }
    sorted
}

#[cfg(test)]
#[path = "normal_equations_tests.rs"]
mod tests;
