//! How upright, straight and well aligned a panorama is, by its own lines and matches: what `stitch` records of every one.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_align::metrics::{
    self, MatchedPair, Outside, Straightness, Uprightness, VerticalLines, VerticalLinesInput, folded_cells,
    mean_relative_turn, rectangle_rotation,
};
use trueup_compose::layout::CanvasLayout;
use trueup_core::matches::PointMatch;
use trueup_core::mesh::GridMesh;

use crate::pipeline::align::Geometry;
use crate::pipeline::align::component::Component;

/// The paper prints LD in hundredths.
pub(crate) const HUNDREDTHS: f64 = 100.0;

/// Measures of a panorama that need no truth. Angles in degrees, positive clockwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Directions of the vertical lines; `None` if no photograph has enough of them.
    pub upright: Option<UprightMeasures>,
    /// Estimate of the paper's GDIC: each photograph's true direction is taken from its own vertical lines' vanishing
    /// direction. Over the photographs that are certain; `None` with fewer than two.
    pub estimated_gdic_deg: Option<f64>,
    /// How far apart matched points land; `None` without matches.
    pub reprojection: Option<ReprojectionMeasures>,
    /// How straight long lines are; `None` without long lines.
    pub long_lines: Option<LongLines>,
    /// The paper's local distortion LD, times 100: the largest over the photographs.
    pub ld: f64,
    /// Mean over the photographs of the same.
    pub ld_mean: f64,
    /// Cells that are folded, in all photographs.
    pub folds: usize,
    /// Each photograph's own figures, in the order of the photographs used.
    #[serde(rename = "pictures")]
    pub photographs: Vec<PhotographMeasures>,
}

/// Directions of the vertical lines in the panorama, over the photographs that have enough of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UprightMeasures {
    /// Mean over the photographs of |mean lean of the photograph's vertical lines|.
    pub mean_deg: f64,
    /// The largest such lean.
    pub max_deg: f64,
    /// Photographs that are certain.
    pub measured: usize,
}

/// Distances of matched points in the panorama, in the photographs' own pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReprojectionMeasures {
    /// Matches measured.
    pub matches: usize,
    /// Mean distance.
    pub mean_px: f64,
    /// Root mean square distance.
    pub rms_px: f64,
    /// 95 of 100 are not farther apart.
    pub percentile_95_px: f64,
}

/// How straight the long lines of the photographs are in the panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LongLines {
    /// Lines measured.
    pub lines: usize,
    /// Mean over the lines of their root mean square distance from straight, as a share of their length.
    pub mean_bend: f64,
    /// Lines that stray from straight by more than 0.003 of their length.
    pub bent: usize,
    /// The longest of those.
    pub longest_bent: Option<BentLine>,
}

/// A line that is not straight in the panorama.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BentLine {
    /// Path of the photograph.
    pub path: String,
    /// Its length in panorama pixels.
    pub length_px: f64,
    /// Its largest distance from straight in panorama pixels.
    pub off_px: f64,
}

/// What a photograph's vertical lines say of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhotographMeasures {
    /// Path of the photograph.
    pub path: String,
    /// Vertical lines found.
    pub vertical_lines: usize,
    /// Their mean lean in the panorama; `None` with fewer than two, or straight up or down.
    pub lean_deg: Option<f64>,
    /// Standard error of the lean.
    pub standard_error_deg: Option<f64>,
    /// Angle in the photograph from its down to the vertical, by the lines' vanishing direction.
    pub gamma_deg: Option<f64>,
    /// Whether there are enough lines, and they agree.
    pub certain: bool,
}

/// Measures a panorama whose grids lie on the canvas of `layout`.
pub(crate) fn run(component: &Component, geometry: &Geometry, layout: &CanvasLayout) -> Measures {
    let meshes: Vec<&GridMesh> = layout.placed.iter().map(|placed| &placed.mesh).collect();
    let period = layout.period.map(|columns| columns as f64);
    // The same grids over the working pictures, in whose pixels lines are.
    let working: Vec<GridMesh> = meshes
        .iter()
        .zip(&component.frames)
        .map(|(&mesh, frame)| GridMesh { width: frame.width, height: frame.height, ..mesh.clone() })
        .collect();
    let verticals = vertical_lines(component, geometry, &working);
    let certain: Vec<Option<VerticalLines>> =
        verticals.iter().map(|found| found.filter(|found| found.is_certain())).collect();
    let distortion = metrics::local_distortion(&working, Outside::Center, period);
    Measures {
        upright: upright(&certain),
        estimated_gdic_deg: estimated_inconsistency(&certain, &working, component.reference),
        reprojection: reprojection(component, geometry, &meshes, period),
        long_lines: long_lines(component, &working),
        ld: HUNDREDTHS * distortion.worst,
        ld_mean: HUNDREDTHS * distortion.mean,
        folds: working.iter().map(folded_cells).sum(),
        photographs: (0..working.len())
            .map(|k| PhotographMeasures {
                path: component.images[k].path.display().to_string(),
                vertical_lines: verticals[k].map_or(0, |found| found.lines),
                lean_deg: verticals[k].map(|found| found.lean.to_degrees()),
                standard_error_deg: verticals[k].map(|found| found.standard_error.to_degrees()),
                gamma_deg: verticals[k].map(|found| found.gamma.to_degrees()),
                certain: certain[k].is_some(),
            })
            .collect(),
    }
}

fn vertical_lines(component: &Component, geometry: &Geometry, working: &[GridMesh]) -> Vec<Option<VerticalLines>> {
    let down = geometry.prior.level_from_world().row(1).transpose();
    (0..working.len())
        .into_par_iter()
        .map(|k| {
            let camera = &geometry.cameras.cameras[k];
            let photograph = VerticalLinesInput {
                lines: &component.lines[k],
                frame: &component.frames[k],
                camera,
                expected_down: camera.rotation() * down,
            };
            metrics::vertical_lines(&photograph, &working[k])
        })
        .collect()
}

fn upright(certain: &[Option<VerticalLines>]) -> Option<UprightMeasures> {
    let leans: Vec<f64> = certain.iter().flatten().map(|found| found.lean).collect();
    let measured = leans.len();
    let all = Uprightness::of(leans)?;
    Some(UprightMeasures { mean_deg: all.mean.to_degrees(), max_deg: all.largest.to_degrees(), measured })
}

/// GDIC over the photographs that are certain, with the reference among them or else the first.
fn estimated_inconsistency(certain: &[Option<VerticalLines>], meshes: &[GridMesh], reference: usize) -> Option<f64> {
    let known: Vec<(usize, f64)> =
        certain.iter().enumerate().filter_map(|(k, found)| Some((k, found.as_ref()?.gamma))).collect();
    let rotations: Vec<f64> = known.iter().map(|&(k, _)| rectangle_rotation(&meshes[k])).collect();
    let gammas: Vec<f64> = known.iter().map(|&(_, gamma)| gamma).collect();
    let reference = known.iter().position(|&(k, _)| k == reference).unwrap_or(0);
    mean_relative_turn(&rotations, &gammas, reference).map(f64::to_degrees)
}

fn reprojection(
    component: &Component,
    geometry: &Geometry,
    meshes: &[&GridMesh],
    period: Option<f64>,
) -> Option<ReprojectionMeasures> {
    let pairs: Vec<MatchedPair> = geometry
        .coinciding
        .iter()
        .map(|pair| {
            let full = |point: [f64; 2], photograph: usize| {
                point.map(|coordinate| coordinate / component.frames[photograph].working_from_full)
            };
            let matches = pair
                .inliers
                .iter()
                .map(|one| PointMatch { in_a: full(one.in_a, pair.a), in_b: full(one.in_b, pair.b) })
                .collect();
            MatchedPair { a: meshes[pair.a], b: meshes[pair.b], matches }
        })
        .collect();
    let found = metrics::reprojection(&pairs, period)?;
    Some(ReprojectionMeasures {
        matches: found.matches,
        mean_px: found.mean_px,
        rms_px: found.rms_px,
        percentile_95_px: found.percentile_95_px,
    })
}

fn long_lines(component: &Component, working: &[GridMesh]) -> Option<LongLines> {
    let measured: Vec<(usize, Straightness)> = (0..working.len())
        .flat_map(|k| {
            let shortest = metrics::LONG_LINE_DIAGONAL * component.frames[k].diagonal();
            let long = component.lines[k].iter().filter(move |line| line.length() >= shortest);
            long.filter_map(move |line| Some((k, Straightness::of(line, &working[k], metrics::LINE_STEP_PX)?)))
        })
        .collect();
    let bent: Vec<&(usize, Straightness)> = measured.iter().filter(|(_, line)| line.is_bent()).collect();
    let longest = bent.iter().max_by(|one, two| one.1.length_px.total_cmp(&two.1.length_px));
    let mean = measured.iter().map(|(_, line)| line.rms_px / line.length_px).sum::<f64>() / measured.len() as f64;
    (!measured.is_empty()).then(|| LongLines {
        lines: measured.len(),
        mean_bend: mean,
        bent: bent.len(),
        longest_bent: longest.map(|(k, line)| BentLine {
            path: component.images[*k].path.display().to_string(),
            length_px: line.length_px,
            off_px: line.largest_px,
        }),
    })
}
