//! How alike the photographs look where two of them lie on the panorama.

use std::path::Path;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_align::metrics::{OverlapMeasures, OverlapPixels, mean_over_overlaps};
use trueup_compose::layout::{CanvasLayout, Placed};
use trueup_compose::render::{self, Layer, RenderInput};
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result, StageContext};

use super::photographs;
use crate::project::read::{recorded_corrections, whole_grids};
use crate::project::record::{Canvas, ImageRecord, Project};

/// Progress is reported as this.
const STAGE: &str = "comparing";
/// Overlaps of fewer pixels, without their border, are passed over.
const MIN_OVERLAP_PX: usize = 100;
/// Most pixels that the photographs' bounding boxes on the canvas may have together; each takes five bytes.
const MAX_LAYER_PX: f64 = 40e6;

/// How alike photographs look where they overlap on the panorama, means over the overlapping pairs weighted by their
/// overlaps' size.
///
/// Gray values (Rec. 601 luma) go from 0 to 255, after the exposures were evened out as in the panorama.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PixelEvaluation {
    /// Size of the canvas that was compared on, relative to the panorama's. The figures depend on it.
    pub scale: f64,
    /// Overlapping pairs compared.
    pub pairs: usize,
    /// Pixels compared, over all pairs.
    pub pixels: usize,
    /// Root mean square of 1 - NCC over windows of 3 x 3 pixels.
    pub ncc_rmse: f64,
    /// Mean square of the same.
    pub ncc_mse: f64,
    /// Mean square difference of gray values.
    pub intensity_mse: f64,
    /// Peak signal to noise ratio after evening out each pair's brightness, decibels; `None` if all are equal.
    pub psnr_db: Option<f64>,
    /// Structural similarity after the same; `None` if all overlaps are narrower than its windows.
    pub ssim: Option<f64>,
}

/// Compares the photographs of a panorama, read again from their files, where they overlap.
///
/// Paths are tried as recorded, then beside `project_folder`, first with their folders and then without. Parallel work
/// runs on the current thread pool; memory for the layers is bounded by reducing the canvas.
///
/// # Errors
/// [`Error::Input`] if a photograph is not found, is not the one that was stitched, cannot be read, or if the grids are
/// damaged; [`Error::Unsolvable`] if no overlap has anything to compare; [`Error::Options`]; [`Error::Cancelled`].
pub fn evaluate_pixels(project: &Project, project_folder: &Path, context: &StageContext) -> Result<PixelEvaluation> {
    project.options.validate()?;
    let records: Vec<&ImageRecord> = project.used_images().collect();
    let photographs = photographs(project, &records, project_folder, context)?;
    let meshes = whole_grids(project, &records)?;
    let scale = scale(&meshes, project.options.run.measures.canvas_pixels);
    let positions: Vec<usize> = (0..records.len()).collect();
    compare_overlaps(project, &photographs, &positions, scale, context)
}

/// The largest scale up to `wanted` that a panorama can be compared at, relative to its own size.
///
/// # Errors
/// [`Error::Input`] if the project's grids are damaged.
pub fn scale_up_to(project: &Project, wanted: f64) -> Result<f64> {
    let records: Vec<&ImageRecord> = project.used_images().collect();
    Ok(wanted.min(layers_scale(&whole_grids(project, &records)?)))
}

/// Compares the used photographs of a project, which are at `positions` of `photographs`, where they overlap, at a
/// scale relative to the panorama's size.
///
/// # Errors
/// As [`evaluate_pixels`].
pub fn compare_overlaps(
    project: &Project,
    photographs: &dyn PhotographSource,
    positions: &[usize],
    scale: f64,
    context: &StageContext,
) -> Result<PixelEvaluation> {
    let records: Vec<&ImageRecord> = project.used_images().collect();
    let layout = layout(whole_grids(project, &records)?, positions, project.canvas, scale);
    let corrections = recorded_corrections(project, &records)?;

    let input = RenderInput { layout: &layout, corrections: &corrections, photographs };
    context.progress().begin(STAGE, records.len() as u64);
    let layers: Vec<Layer> = (0..records.len())
        .into_par_iter()
        .map(|position| {
            context.check_cancelled()?;
            let layer = render::layer(&input, position, &project.options.compose.render)?;
            context.progress().advance(STAGE, 1);
            Ok(layer)
        })
        .collect::<Result<_>>()?;
    context.progress().finish(STAGE);

    let pairs: Vec<(usize, usize)> =
        (0..layers.len()).flat_map(|a| (a + 1..layers.len()).map(move |b| (a, b))).collect();
    let measured: Vec<OverlapMeasures> = pairs
        .par_iter()
        .map(|&(a, b)| {
            context.check_cancelled()?;
            Ok(compare(&layers[a], &layers[b], layout.period).filter(|one| one.pixels >= MIN_OVERLAP_PX))
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    let mean = mean_over_overlaps(&measured).ok_or_else(|| {
        Error::unsolvable(
            STAGE,
            format!("{} photographs", records.len()),
            "no two of them overlap with anything to compare",
            "Measure a panorama of overlapping photographs.",
        )
    })?;
    Ok(PixelEvaluation {
        scale,
        pairs: measured.len(),
        pixels: mean.pixels,
        ncc_rmse: mean.ncc_rmse,
        ncc_mse: mean.ncc_mse,
        intensity_mse: mean.intensity_mse,
        psnr_db: mean.psnr_db,
        ssim: mean.ssim,
    })
}

/// The largest scale, at most 1, that keeps the canvas within `canvas_pixels` and the layers within their limit.
fn scale(meshes: &[GridMesh], canvas_pixels: f64) -> f64 {
    let (low, high) = bounds(meshes);
    let canvas = (canvas_pixels / (high - low).product()).sqrt();
    canvas.min(layers_scale(meshes)).min(1.0)
}

/// The largest scale that keeps the layers within their limit.
fn layers_scale(meshes: &[GridMesh]) -> f64 {
    let area = |mesh: &GridMesh| {
        let (low, high) = mesh.bounds();
        (high - low).product()
    };
    (MAX_LAYER_PX / meshes.iter().map(area).sum::<f64>()).sqrt()
}

fn bounds(meshes: &[GridMesh]) -> (nalgebra::Vector2<f64>, nalgebra::Vector2<f64>) {
    let all = meshes.iter().map(GridMesh::bounds);
    all.reduce(|all, one| (all.0.inf(&one.0), all.1.sup(&one.1))).unwrap_or_default()
}

/// The grids of the photographs at `positions` on a canvas of this scale, relative to the panorama's.
fn layout(meshes: Vec<GridMesh>, positions: &[usize], panorama: Canvas, scale: f64) -> CanvasLayout {
    let (low, high) = bounds(&meshes);
    let period = panorama.full_turn.then(|| (panorama.width as f64 * scale).round().max(1.0));
    // A turn is a whole number of pixels.
    let scale_x = period.map_or(scale, |period| period / panorama.width as f64);
    let placed = positions.iter().zip(meshes).map(|(&photograph, mut mesh)| {
        for vertex in &mut mesh.target {
            *vertex = [(vertex[0] - low.x) * scale_x, (vertex[1] - low.y) * scale];
        }
        Placed { photograph, mesh }
    });
    // The casts saturate.
    let side = |length: f64| (length * scale).ceil().max(1.0) as usize;
    CanvasLayout {
        width: period.map_or(side(high.x - low.x), |period| period as usize),
        height: side(high.y - low.y),
        canvas_from_target: scale,
        origin: [0.0; 2],
        placed: placed.collect(),
        period: period.map(|period| period as usize),
    }
}

/// Two layers where their boxes overlap; on a cylinder where they overlap most, turns apart or not.
fn compare(a: &Layer, b: &Layer, period: Option<usize>) -> Option<OverlapMeasures> {
    let turn = period.unwrap_or(0);
    let places = [[0, 0], [turn, 0], [0, turn]];
    let overlap = |[a_by, b_by]: &[usize; 2]| {
        let end = |layer: &Layer, by: usize| layer.left + by + layer.gray.width();
        end(a, *a_by).min(end(b, *b_by)).saturating_sub((a.left + a_by).max(b.left + b_by))
    };
    let [a_by, b_by] = *places.iter().rev().max_by_key(|place| overlap(place))?;
    let (left, top) = ((a.left + a_by).max(b.left + b_by), a.top.max(b.top));
    let end = |layer: &Layer, by: usize| [layer.left + by + layer.gray.width(), layer.top + layer.gray.height()];
    let (end_a, end_b) = (end(a, a_by), end(b, b_by));
    let width = end_a[0].min(end_b[0]).checked_sub(left).filter(|&width| width > 0)?;
    let height = end_a[1].min(end_b[1]).checked_sub(top).filter(|&height| height > 0)?;
    let of_a = [left - a.left - a_by, top - a.top];
    let of_b = [left - b.left - b_by, top - b.top];
    let mut covered = cut(&a.covered, of_a, width, height);
    let other = cut(&b.covered, of_b, width, height);
    for (covered, other) in covered.data_mut().iter_mut().zip(other.data()) {
        *covered &= other;
    }
    let (gray_a, gray_b) = (cut(&a.gray, of_a, width, height), cut(&b.gray, of_b, width, height));
    OverlapPixels { a: &gray_a, b: &gray_b, covered: &covered }.measure()
}

/// A box of a raster of one channel.
fn cut<T: Copy + Default>(raster: &Raster<T>, [left, top]: [usize; 2], width: usize, height: usize) -> Raster<T> {
    let mut cut = Raster::new(width, height, 1);
    for y in 0..height {
        cut.row_mut(y).copy_from_slice(&raster.row(top + y)[left..left + width]);
    }
    cut
}
