//! Which grids a canvas can be laid out from.

use trueup_core::mesh::GridLines;
use trueup_core::options::StageOptions;
use trueup_core::{Error, Result};

use super::canvas::Placed;
use super::options::CanvasOptions;

/// Refuses grids no later step could walk.
pub(crate) fn check_mesh(placed: &Placed) -> Result<()> {
    let mesh = &placed.mesh;
    let subject = || format!("photograph {}", placed.photograph);
    let whole = mesh.rows >= 2
        && mesh.columns >= 2
        && mesh.rows.checked_mul(mesh.columns) == Some(mesh.target.len())
        && mesh.width >= 1.0
        && mesh.height >= 1.0
        && mesh.width.max(mesh.height).is_finite();
    if !whole {
        return Err(Error::input(
            subject(),
            format!(
                "a grid of {} x {} with {} vertices over {} x {} px is not one",
                mesh.rows,
                mesh.columns,
                mesh.target.len(),
                mesh.width,
                mesh.height
            ),
            "Give rows * columns vertices, at least 2 x 2, over a photograph of at least one pixel.",
        ));
    }
    let lined = |lines: &GridLines| {
        let ascending = |lines: &[f64], count: usize| {
            lines.len() == count
                && lines[0] == 0.0
                && lines[count - 1] == 1.0
                && lines.windows(2).all(|pair| pair[0] < pair[1])
        };
        ascending(&lines.columns, mesh.columns) && ascending(&lines.rows, mesh.rows)
    };
    if !mesh.lines.as_ref().is_none_or(lined) {
        return Err(Error::input(
            subject(),
            "the lines of its grid do not ascend from 0 to 1",
            "Give one share for every column and row of vertices.",
        ));
    }
    let infinite = mesh.target.iter().any(|vertex| {
        vertex.iter().any(|coordinate| coordinate.is_infinite()) || vertex[0].is_nan() != vertex[1].is_nan()
    });
    if infinite || mesh.whole_cells().next().is_none() {
        return Err(Error::unsolvable(
            CanvasOptions::STAGE,
            subject(),
            if infinite { "its grid has vertices that are not finite" } else { "its grid has no cell that is whole" },
            "Leave this photograph out, or choose another method or projection.",
        ));
    }
    Ok(())
}
