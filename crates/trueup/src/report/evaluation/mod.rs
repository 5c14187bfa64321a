//! How good a panorama is, against the exactly known truth of its photographs.

mod matches;
mod pixels;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use trueup_align::metrics::{
    self, Outside, Uprightness, best_rotation, folded_cells, mean_relative_turn, rectangle_rotation, relative_turns,
};
use trueup_compose::fusion::ExposureFusion;
use trueup_core::camera::Camera;
use trueup_core::geometry::wrap_angle;
use trueup_core::mesh::GridMesh;
use trueup_core::source::SourceImage;
use trueup_core::truth::{ImageTruth, Truth};
use trueup_core::{Error, Result, StageContext};
use trueup_io::decode::FilePhotographs;

use super::measures::{HUNDREDTHS, Measures};
use crate::pipeline::light::handed_out_in;
use crate::pipeline::photographs::handed_out;
use crate::project::read::{find_photograph, whole_grids};
use crate::project::record::{ImageRecord, Project};
pub use matches::{MatchEvaluation, PairMatchEvaluation, evaluate_matches};
pub use pixels::{PixelEvaluation, compare_overlaps, evaluate_pixels, scale_up_to};

/// The recorded photographs in the recorded light, to be read again from their files, of which the paths are tried as
/// by [`evaluate_pixels`].
///
/// # Errors
/// Those of [`find_photograph`].
fn photographs(
    project: &Project,
    records: &[&ImageRecord],
    project_folder: &Path,
    context: &StageContext,
) -> Result<FilePhotographs> {
    let options = &project.options.measure.source;
    let find = |record: &&ImageRecord| find_photograph(record, project_folder, options, context);
    let images = records.iter().map(find).collect::<Result<Vec<SourceImage>>>()?;
    let images = handed_out_in(images, project.light);
    let files = FilePhotographs::new(images.clone(), 0).fused_by(Arc::new(ExposureFusion));
    Ok(handed_out(files, &images, project.light, context))
}

/// A panorama measured against the truth. Angles in degrees.
///
/// Measured are the photographs that are used in the project and named in the truth, in the order of the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Photographs measured.
    pub used: usize,
    /// Photographs named in the truth.
    pub given: usize,
    /// Mean over the photographs of |angle of the photograph's middle to upright|: absolute, no reference takes part.
    pub upright_deg: f64,
    /// The largest such angle.
    pub upright_max_deg: f64,
    /// As `upright_deg`, from the direction that the photographs share.
    pub spread_deg: f64,
    /// The paper's GDIC (equation 14), with the first photograph as its reference, so that all methods share it.
    pub gdic_deg: f64,
    /// GDIC with the project's reference as its own; `None` if the truth does not name that photograph.
    pub gdic_reference_deg: Option<f64>,
    /// GDIC with each photograph's best-fitting similarity instead of its smallest rectangle: without the floor that
    /// strong perspective gives to GDIC.
    pub gdic_similarity_deg: f64,
    /// Mean error of the prior's rotations, relative to the first photograph: its quality before the mesh. `None` if
    /// the project holds no rotations.
    pub theta_error_deg: Option<f64>,
    /// The largest such error.
    pub theta_error_max_deg: Option<f64>,
    /// The paper's local distortion LD (equations 12 and 13), times 100: the largest over the photographs. Judged are
    /// cells whose center lies outside all other photographs.
    pub ld: f64,
    /// Mean over the photographs of the same.
    pub ld_mean: f64,
    /// As `ld`, of the cells whose four corners lie outside all other photographs, too: up to 7 % more.
    pub ld_corners: f64,
    /// Cells that are folded, in all photographs. LD leaves them out; figures with different counts do not compare.
    pub folds: usize,
    /// Root mean square distance in the panorama of the two places of what two photographs both show, in the
    /// photographs' own pixels; `None` if no photographs overlap or they were taken from different places.
    pub align_px: Option<f64>,
    /// What the panorama's measures state without the truth, beside it; `None` if the project holds no measures.
    pub stated: Option<StatedEvaluation>,
    /// Each photograph's own figures.
    #[serde(rename = "pictures")]
    pub photographs: Vec<PhotographEvaluation>,
}

/// How honest the measures are that need no truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StatedEvaluation {
    /// Photographs whose lean is stated with a 95 % interval.
    pub intervals: usize,
    /// Those of them whose true lean lies in it.
    pub holding: usize,
    /// Mean |true lean| of the photographs that the stated mean is over, beside `stated_upright_deg`.
    pub upright_deg: Option<f64>,
    /// The mean |lean| that the measures expect.
    pub stated_upright_deg: Option<f64>,
    /// The GDIC that the measures estimate, beside `gdic_reference_deg`.
    pub estimated_gdic_deg: Option<f64>,
}

/// One photograph measured against the truth. Angles in degrees, positive clockwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhotographEvaluation {
    /// File name.
    pub file: String,
    /// By how much its middle is turned beyond upright; `None` where the panorama does not show that.
    pub upright_deg: Option<f64>,
    /// By how much the prior's rotation is wrong, relative to the first photograph.
    pub theta_error_deg: Option<f64>,
    /// By how much the vertical that the measures state its lean by is wrong, as drawn in its middle; `None` if they
    /// state none.
    pub lean_error_deg: Option<f64>,
}

/// A used photograph with its truth and its grid.
struct Known<'a> {
    record: &'a ImageRecord,
    truth: &'a ImageTruth,
}

/// Reads the truth of a set of photographs from a JSON file.
///
/// # Errors
/// [`Error::Io`] if it cannot be read; [`Error::Input`] if it is no truth, damaged, or impossible.
pub fn read_truth(path: &Path) -> Result<Truth> {
    let bytes = trueup_io::text::read(path).map_err(|error| Error::io("reading", path, error))?;
    let subject = path.display().to_string();
    let truth: Truth = serde_json::from_slice(&bytes).map_err(|error| {
        let reason = format!("not a truth file ({error})");
        Error::input(&subject, reason, "Give the truth.json that was written together with the photographs.")
    })?;
    truth.check(&subject)?;
    Ok(truth)
}

/// Measures a panorama against the truth. Photographs are matched by their file names.
///
/// ```
/// use trueup::{Inputs, StageContext, StitchOptions, Stitcher, evaluate, read_truth};
/// # let room = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
/// let truth = read_truth(&std::path::Path::new(room).join("truth.json"))?;
/// let (options, context) = (StitchOptions::default(), StageContext::default());
/// let aligned = Stitcher::new(&options, &context).align(&Inputs::new([room]))?;
/// let evaluation = evaluate(&aligned.alignments[0].project, &truth)?;
/// assert!(evaluation.used == 5 && evaluation.upright_deg < 0.5, "{} degrees", evaluation.upright_deg);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Input`] if the truth does not fit: it names none of the project's photographs, fewer than two of those
/// used, or one of another size, or two of the project's photographs have one name; if the truth is impossible; if the
/// project's grids are damaged.
pub fn evaluate(project: &Project, truth: &Truth) -> Result<Evaluation> {
    truth.check(&subject(truth))?;
    let known = match_photographs(project, truth)?;
    let records: Vec<&ImageRecord> = known.iter().map(|one| one.record).collect();
    let meshes = whole_grids(project, &records)?;
    let period = project.canvas.period();
    let gammas: Vec<f64> = known.iter().map(|one| one.truth.gamma_deg.to_radians()).collect();
    let reference = known.iter().position(|one| one.record.path == project.reference);

    let upright = Uprightness::against(&meshes, &gammas).ok_or_else(|| too_few(known.len()))?;
    let rectangles: Vec<f64> = meshes.iter().map(rectangle_rotation).collect();
    let similarities: Vec<f64> = meshes.iter().map(best_rotation).collect();
    let turn = |rotations: &[f64], reference| mean_relative_turn(rotations, &gammas, reference).map(f64::to_degrees);
    let thetas: Option<Vec<f64>> = records.iter().map(|record| Some(record.theta_deg?.to_radians())).collect();
    let theta_errors = thetas.as_ref().and_then(|thetas| relative_turns(thetas, &gammas, 0));
    let distortion = metrics::local_distortion(&meshes, Outside::Center, period);
    let true_leans: Vec<Option<f64>> =
        upright.photographs.iter().map(|&lean| Some(lean).filter(|lean| !lean.is_nan())).collect();
    let leans: Vec<Option<StatedLean>> =
        (0..known.len()).map(|k| StatedLean::of(project, &known[k], &meshes[k], true_leans[k]?)).collect();
    let photographs = (0..known.len()).map(|k| PhotographEvaluation {
        file: known[k].truth.file.clone(),
        upright_deg: true_leans[k].map(f64::to_degrees),
        theta_error_deg: theta_errors.as_ref().map(|errors| errors[k].to_degrees()),
        lean_error_deg: leans[k].map(|lean| lean.error_deg),
    });
    Ok(Evaluation {
        used: known.len(),
        given: truth.images.len(),
        upright_deg: upright.mean.to_degrees(),
        upright_max_deg: upright.largest.to_degrees(),
        spread_deg: upright.spread.to_degrees(),
        gdic_deg: turn(&rectangles, 0).ok_or_else(|| too_few(known.len()))?,
        gdic_reference_deg: reference.and_then(|reference| turn(&rectangles, reference)),
        gdic_similarity_deg: turn(&similarities, 0).ok_or_else(|| too_few(known.len()))?,
        theta_error_deg: thetas.as_ref().and_then(|thetas| turn(thetas, 0)),
        theta_error_max_deg: theta_errors.as_ref().map(|errors| largest(errors).to_degrees()),
        ld: HUNDREDTHS * distortion.worst,
        ld_mean: HUNDREDTHS * distortion.mean,
        ld_corners: HUNDREDTHS * metrics::local_distortion(&meshes, Outside::CenterAndCorners, period).worst,
        folds: meshes.iter().map(folded_cells).sum(),
        align_px: alignment(&known, &meshes, period),
        stated: project.measures.as_ref().map(|measures| stated(measures, &leans)),
        photographs: photographs.collect(),
    })
}

/// What the measures state of a photograph's lean, and what is true.
#[derive(Debug, Clone, Copy)]
struct StatedLean {
    error_deg: f64,
    /// Half of the stated interval.
    within_deg: Option<f64>,
    certain: bool,
    true_deg: f64,
}

impl StatedLean {
    /// Leans are stated where vertical lines are, the truth's is in the photograph's middle: there the two verticals
    /// are compared, which lean alike elsewhere.
    fn of(project: &Project, known: &Known, mesh: &GridMesh, true_lean: f64) -> Option<Self> {
        let photographs = &project.measures.as_ref()?.photographs;
        let one = photographs.iter().find(|one| one.path == known.record.path)?;
        one.lean_deg?;
        let stated = mesh.lean_in_the_middle(one.gamma_deg?.to_radians());
        let error_deg = wrap_angle(stated - true_lean).to_degrees();
        Some(Self { error_deg, within_deg: one.within_deg, certain: one.certain, true_deg: true_lean.to_degrees() })
    }
}

/// The measures of a panorama beside what is true of it.
fn stated(measures: &Measures, leans: &[Option<StatedLean>]) -> StatedEvaluation {
    let intervals = || leans.iter().flatten().filter_map(|lean| Some((lean.error_deg.abs(), lean.within_deg?)));
    let certain: Vec<f64> =
        leans.iter().flatten().filter(|lean| lean.certain).map(|lean| lean.true_deg.abs()).collect();
    let mean = certain.iter().sum::<f64>() / certain.len() as f64;
    StatedEvaluation {
        intervals: intervals().count(),
        holding: intervals().filter(|(error, within)| error <= within).count(),
        upright_deg: (!certain.is_empty()).then_some(mean),
        stated_upright_deg: measures.upright.map(|upright| upright.mean_deg),
        estimated_gdic_deg: measures.estimated_gdic_deg,
    }
}

fn subject(truth: &Truth) -> String {
    format!("the truth of {}", truth.source)
}

fn largest(angles: &[f64]) -> f64 {
    angles.iter().fold(0.0, |largest, &angle| largest.max(wrap_angle(angle).abs()))
}

/// The used photographs that the truth names, in its order.
fn match_photographs<'a>(project: &'a Project, truth: &'a Truth) -> Result<Vec<Known<'a>>> {
    let used: Vec<&ImageRecord> = project.used_images().collect();
    let mut known = Vec::new();
    for one in &truth.images {
        let mut named = used.iter().filter(|record| record.file_name() == one.file);
        let Some(&record) = named.next() else { continue };
        if named.next().is_some() {
            return Err(Error::input(
                &one.file,
                "the project uses two photographs of this name, and a truth tells photographs apart by their names alone",
                "Stitch photographs with different names.",
            ));
        }
        if (record.width, record.height) != (one.width, one.height) {
            let reason = format!(
                "the project has it at {} x {} px, the truth at {} x {} px",
                record.width, record.height, one.width, one.height
            );
            return Err(Error::input(&one.file, reason, "Give the truth of the very photographs that were stitched."));
        }
        known.push(Known { record, truth: one });
    }
    match known.len() {
        0 => Err(Error::input(
            subject(truth),
            format!("it names none of the {} photographs that the project uses", used.len()),
            "Give the truth of the photographs that were stitched; photographs are told apart by their file names.",
        )),
        1 => Err(too_few(1)),
        _ => Ok(known),
    }
}

fn too_few(count: usize) -> Error {
    Error::input(
        "the truth",
        format!("of the photographs it names, the project uses {count}, and it takes two to compare"),
        "Give a project of at least two photographs of the set.",
    )
}

/// [`metrics::true_alignment`] where all photographs share one center of projection.
fn alignment(known: &[Known], meshes: &[GridMesh], period: Option<f64>) -> Option<f64> {
    if known.iter().any(|one| one.truth.center != known[0].truth.center) {
        return None;
    }
    let cameras: Vec<Camera> = known.iter().map(|one| one.truth.camera()).collect();
    metrics::true_alignment(meshes, &cameras, period)
}
