//! Grids read back from a project file.

use trueup_core::mesh::GridMesh;
use trueup_core::{Error, Result};

use crate::project::{ImageRecord, MeshRecord};

/// The grids of used pictures over the original photographs.
///
/// # Errors
/// [`Error::Input`] if one is missing or damaged.
pub(crate) fn used_grids(records: &[&ImageRecord]) -> Result<Vec<GridMesh>> {
    records.iter().map(|record| grid(record)).collect()
}

/// The grid of one used picture over the original photograph.
///
/// # Errors
/// [`Error::Input`] if it is missing or damaged.
pub(crate) fn grid(record: &ImageRecord) -> Result<GridMesh> {
    let damaged = |reason: String| {
        Error::input(&record.path, reason, "Give a project file as `trueup stitch --project` wrote it.")
    };
    let mesh = record.mesh.as_ref().ok_or_else(|| damaged("the project holds no grid of it".to_owned()))?;
    let (width, height) = (record.width as f64, record.height as f64);
    if !is_whole(mesh) || record.width == 0 || record.height == 0 {
        return Err(damaged(format!(
            "its grid of {} x {} with {} vertices over {} x {} px is damaged",
            mesh.rows,
            mesh.cols,
            mesh.target.len(),
            record.width,
            record.height
        )));
    }
    Ok(GridMesh { rows: mesh.rows, columns: mesh.cols, width, height, target: mesh.target.clone(), lines: None })
}

fn is_whole(mesh: &MeshRecord) -> bool {
    mesh.rows >= 2
        && mesh.cols >= 2
        && mesh.rows.checked_mul(mesh.cols) == Some(mesh.target.len())
        && mesh.target.iter().flatten().all(|coordinate| coordinate.is_finite())
}
