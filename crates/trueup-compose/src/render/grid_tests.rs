//! Every pixel belongs to one cell of a deformed grid, and the cell's inverse returns to it.

use nalgebra::Vector2;
use proptest::prelude::*;

use crate::deformed_grid::DeformedGrid;
use crate::layout::Placed;
use crate::simd::{Positions, invert_row};
use crate::test_photographs::moved;

/// A moved photograph, every vertex of its mesh moved a little more.
fn jittered(jitter: &[f64]) -> Placed {
    let mut placed = moved(0, 120.0, 100.0, |p| [p.x + 10.0, p.y + 10.0]);
    for (index, vertex) in placed.mesh.target.iter_mut().enumerate() {
        vertex[0] += jitter[2 * index];
        vertex[1] += jitter[2 * index + 1];
    }
    placed
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn jittered_grids_have_no_holes_and_no_double_hits(jitter in prop::collection::vec(-6.0..6.0_f64, 2 * 7 * 6)) {
        let placed = jittered(&jitter);
        let grid = DeformedGrid::new(&placed.mesh, 1.0, true, 140, 120);
        let all: Vec<u32> = (0..grid.cells.len() as u32).collect();
        let (mut owner, mut runs) = (Vec::new(), Vec::new());
        for y in 0..120 {
            // Count the hits of every cell on its own: with no folds they must not overlap, nor leave a gap inside.
            let mut hits = [0; 140];
            for cell in &all {
                grid.runs(y, &[*cell], &mut owner, &mut runs);
                for run in &runs {
                    hits[run.columns.clone()].iter_mut().for_each(|hit| *hit += 1);
                }
            }
            prop_assert!(hits.iter().all(|&hit| hit <= 1), "row {} {:?}", y, hits);
            if (20..100).contains(&y) {
                prop_assert!(hits[20..120].iter().all(|&hit| hit == 1), "row {} {:?}", y, hits);
            }
        }
    }

    #[test]
    fn inverting_the_grid_returns_to_the_pixel(jitter in prop::collection::vec(-6.0..6.0_f64, 2 * 7 * 6)) {
        let placed = jittered(&jitter);
        let grid = DeformedGrid::new(&placed.mesh, 1.0, false, 140, 120);
        let all: Vec<u32> = (0..grid.cells.len() as u32).collect();
        let (mut owner, mut runs, mut positions) = (Vec::new(), Vec::new(), Positions::default());
        let mut places = 0;
        for y in (0..120).step_by(7) {
            grid.runs(y, &all, &mut owner, &mut runs);
            for run in &runs {
                positions.resize(run.columns.len());
                invert_row(&grid.cells[run.cell].inverse_along_row(y), run.columns.start, &mut positions);
                for (index, column) in run.columns.clone().enumerate() {
                    let source = Vector2::new(
                        f64::from(positions.column[index]) + 0.5 + f64::from(positions.fraction_x[index]),
                        f64::from(positions.row[index]) + 0.5 + f64::from(positions.fraction_y[index]),
                    );
                    let back = placed.mesh.warp(source);
                    let expected = Vector2::new(column as f64 + 0.5, y as f64 + 0.5);
                    prop_assert!((back - expected).norm() < 1e-4, "{} for {}", back, expected);
                    places += 1;
                }
            }
        }
        // Twelve rows lie wholly within the photograph, of 108 columns at least.
        prop_assert!(places >= 12 * 108, "{}", places);
    }
}
