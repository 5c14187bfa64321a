//! Coarser grids of very many photographs, so that memory does not grow faster than their number.
//!
//! The factor of a mesh takes some ten kilobytes a vertex, and more the more there are: of 1000 photographs on usual
//! grids gigabytes.

use trueup_core::mesh::GridMesh;

use super::options::MeshOptions;

/// Vertices of all grids together beyond which they are made coarser: of 180 photographs of the working size on usual
/// cells, whose factor takes half a gigabyte.
const MOST_VERTICES: f64 = 60_000.0;

/// The same of lattices of steps, whose equations couple x and y: a factor is twice as large for a vertex.
const MOST_STEPS: f64 = MOST_VERTICES / 2.0;

/// Times that cells are to be as wide as usual, where they would have so many `vertices` then: 1 of up to `most`.
fn coarsening(vertices: usize, most: f64) -> f64 {
    (vertices as f64 / most).sqrt().max(1.0)
}

/// Times that the cells of lattices of steps are to be as wide as usual, where they would have so many `vertices` then.
pub(crate) fn coarsening_of_steps(vertices: usize) -> f64 {
    coarsening(vertices, MOST_STEPS)
}

/// The largest side of a cell on photographs of these sizes (width and height, working pixels): as `options` say; where
/// usual cells would have more than some 60,000 vertices in all, as many times more as bounds these.
pub fn cell_px(sizes: impl Iterator<Item = [f64; 2]>, options: &MeshOptions) -> f64 {
    let usual = MeshOptions::default().cell_px;
    let vertices = sizes.map(|[width, height]| GridMesh::regular(width, height, usual).len()).sum();
    options.cell_px * coarsening(vertices, MOST_VERTICES)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 336 vertices of each of 800 x 600 px. 714 such photographs would have 239,904, four times as many as
    /// allowed: cells twice as wide.
    #[test]
    fn cells_grow_with_the_root_of_the_number_of_photographs() {
        let cell = |photographs: usize, cell_px: f64| {
            let options = MeshOptions { cell_px, ..MeshOptions::default() };
            super::cell_px(std::iter::repeat_n([800.0, 600.0], photographs), &options)
        };
        assert_eq!((cell(0, 40.0), cell(178, 40.0), cell(178, 10.0)), (40.0, 40.0, 10.0));
        assert_eq!((coarsening_of_steps(30_000), coarsening_of_steps(120_000)), (1.0, 2.0));
        assert!((cell(714, 40.0) - 80.0).abs() < 0.1 && (cell(714, 10.0) - 20.0).abs() < 0.03);
    }
}
