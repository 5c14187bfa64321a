//! How far apart what two photographs show alike lies in the panorama, whether or not the panorama was aligned by it.

use std::path::Path;

use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_align::cameras::USUAL_FOCAL;
use trueup_align::metrics::{MatchedPair, may_overlap, panorama_distances};
use trueup_core::camera::Camera;
use trueup_core::geometry::rows_of;
use trueup_core::matches::PointMatch;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};
use trueup_vision::features::{self, Features};
use trueup_vision::matching::{SeenFeatures, consistent_matches};

use super::photographs;
use crate::project::read::whole_grids;
use crate::project::record::{ImageRecord, Project};

/// Progress is reported as this.
const STAGE: &str = "matching anew";
/// Pixels of the small copies that come with working pictures and are not used.
const NO_THUMBNAIL_PIXELS: f64 = 1.0;

/// How far apart the consistent matches of photographs lie in a panorama, in its own pixels.
///
/// Consistent are matches that move as their neighbors do and that one epipolar geometry explains
/// ([`consistent_matches`]): things elsewhere in depth count, which homographies and the mesh may not follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MatchEvaluation {
    /// Pairs of photographs that have such matches.
    pub pairs: usize,
    /// All their matches.
    pub matches: usize,
    /// Median over the pairs of their root mean square distance.
    pub rms_px: f64,
    /// Median over the pairs of their median distance.
    pub median_px: f64,
    /// Each pair, in the order of the project's photographs.
    pub by_pair: Vec<PairMatchEvaluation>,
}

/// How far apart the consistent matches of two photographs lie in a panorama, in its own pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairMatchEvaluation {
    /// Path of the first photograph.
    pub a: String,
    /// Path of the second photograph.
    pub b: String,
    /// Matches that lie in both grids.
    pub matches: usize,
    /// Root mean square distance.
    pub rms_px: f64,
    /// Median distance.
    pub median_px: f64,
}

/// Matches the photographs of a panorama anew, read from their files, wherever two may overlap, and measures how far
/// apart what they show alike lies.
///
/// Paths are tried as by [`crate::evaluate_pixels`]. Masks are not asked. The same matches are found for every panorama
/// of the same photographs with the same options of measuring and matching, but for lenses that bend, which the project
/// tells.
///
/// # Errors
/// [`Error::Input`] if a photograph is not found, is not the one that was stitched, cannot be read, or if grids or
/// focal lengths are damaged; [`Error::Unsolvable`] if no two photographs have matches; [`Error::Options`];
/// [`Error::Cancelled`].
pub fn evaluate_matches(project: &Project, project_folder: &Path, context: &StageContext) -> Result<MatchEvaluation> {
    project.options.validate()?;
    let records: Vec<&ImageRecord> = project.used_images().collect();
    let meshes = whole_grids(project, &records)?;
    let period = project.canvas.period();
    let seen = seen(project, &records, project_folder, context)?;
    let pairs: Vec<(usize, usize)> = (0..records.len())
        .flat_map(|a| (a + 1..records.len()).map(move |b| (a, b)))
        .filter(|&(a, b)| may_overlap(&meshes[a], &meshes[b], period))
        .collect();
    context.progress().begin(STAGE, pairs.len() as u64);
    let measured = |&(a, b): &(usize, usize)| {
        let matches =
            consistent_matches(&seen[a].as_seen(), &seen[b].as_seen(), &project.options.matching.matching, context)?;
        context.progress().advance(STAGE, 1);
        let matches = matches.iter().map(|one| full(one, [&seen[a].frame, &seen[b].frame])).collect();
        let pair = MatchedPair { a: &meshes[a], b: &meshes[b], matches };
        Ok(of_pair(&pair, period, [&records[a].path, &records[b].path]))
    };
    let by_pair = pairs.par_iter().map(measured).collect::<Result<Vec<_>>>()?;
    context.progress().finish(STAGE);
    summed(by_pair.into_iter().flatten().collect()).ok_or_else(|| {
        Error::unsolvable(
            "matching",
            format!("{} photographs", records.len()),
            "no two of them have matches that are consistent",
            "Measure a panorama of overlapping photographs.",
        )
    })
}

/// What is seen of a photograph.
struct Seen {
    features: Features,
    frame: WorkingFrame,
    /// In working pixels.
    camera: Camera,
}

impl Seen {
    fn as_seen(&self) -> SeenFeatures<'_> {
        SeenFeatures { features: &self.features, frame: &self.frame, camera: &self.camera }
    }
}

fn seen(
    project: &Project,
    records: &[&ImageRecord],
    project_folder: &Path,
    context: &StageContext,
) -> Result<Vec<Seen>> {
    let options = &project.options.measure;
    let photographs = photographs(project, records, project_folder, context)?;
    let of_one = |index: usize| {
        context.check_cancelled()?;
        let record = records[index];
        record.check_focal()?;
        let frame = WorkingFrame::new(record.width, record.height, options.working.pixels);
        let picture = photographs.working(index, &frame, NO_THUMBNAIL_PIXELS)?;
        let features = features::detect(&picture.gray, &options.features, context)?;
        // Where the project has no cameras, an ordinary lens: only what is near counts the same by it.
        let camera = record.camera(&rows_of(&Matrix3::identity())).unwrap_or_else(|| {
            let [width, height] = [record.width, record.height].map(|side| side as f64);
            Camera::new(USUAL_FOCAL * width.max(height), width, height, &Matrix3::identity())
        });
        Ok(Seen { features, frame, camera: camera.scaled(frame.working_from_full) })
    };
    // Working pictures are made one after the other: a photograph decoded whole is the largest thing here.
    (0..records.len()).map(of_one).collect()
}

/// A match in the photographs' own pixels.
fn full(one: &PointMatch, frames: [&WorkingFrame; 2]) -> PointMatch {
    let in_full = |place: [f64; 2], frame: &WorkingFrame| place.map(|part| part / frame.working_from_full);
    PointMatch { in_a: in_full(one.in_a, frames[0]), in_b: in_full(one.in_b, frames[1]) }
}

/// `None` without a match that lies in both grids.
fn of_pair(pair: &MatchedPair, period: Option<f64>, [a, b]: [&String; 2]) -> Option<PairMatchEvaluation> {
    let mut distances: Vec<f64> = panorama_distances(pair, period).filter(|distance| distance.is_finite()).collect();
    let squares: f64 = distances.iter().map(|distance| distance * distance).sum();
    let median_px = middle(&mut distances)?;
    let matches = distances.len();
    Some(PairMatchEvaluation {
        a: a.clone(),
        b: b.clone(),
        matches,
        rms_px: (squares / matches as f64).sqrt(),
        median_px,
    })
}

/// `None` without pairs.
fn summed(by_pair: Vec<PairMatchEvaluation>) -> Option<MatchEvaluation> {
    let of_pairs =
        |figure: fn(&PairMatchEvaluation) -> f64| middle(&mut by_pair.iter().map(figure).collect::<Vec<_>>());
    let (rms_px, median_px) = of_pairs(|pair| pair.rms_px).zip(of_pairs(|pair| pair.median_px))?;
    let matches = by_pair.iter().map(|pair| pair.matches).sum();
    Some(MatchEvaluation { pairs: by_pair.len(), matches, rms_px, median_px, by_pair })
}

/// The middle of the values, or the mean of the two beside it: of few pairs, [`trueup_core::statistics::median`] would
/// tell the worse.
fn middle(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values {
        [] => None,
        _ if values.len() % 2 == 1 => Some(values[half]),
        _ => Some((values[half - 1] + values[half]) / 2.0),
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::mesh::GridMesh;

    use super::*;

    /// b lies 3 px to the right of a, but for what moved: distances 3, 3, 3, 7 on one pair; 0 and 4 on the other.
    #[test]
    fn figures_are_of_pairs_in_panorama_pixels() {
        let a = GridMesh::regular(100.0, 100.0, 10.0);
        let mut b = a.clone();
        b.target.iter_mut().for_each(|vertex| vertex[0] += 3.0);
        let one = |x: f64| PointMatch { in_a: [50.0, 50.0], in_b: [50.0 + x, 50.0] };
        let path = |name: &str| name.to_owned();
        let pair =
            |matches: Vec<PointMatch>| of_pair(&MatchedPair { a: &a, b: &b, matches }, None, [&path("a"), &path("b")]);
        let first = pair(vec![one(0.0), one(0.0), one(0.0), one(4.0)]).expect("four matches");
        assert!((first.rms_px - 19.0_f64.sqrt()).abs() < 1e-12 && (first.median_px - 3.0).abs() < 1e-12, "{first:?}");
        let second = pair(vec![one(-3.0), one(1.0)]).expect("two matches");
        let found = summed(vec![first, second]).expect("two pairs");
        assert_eq!((found.pairs, found.matches), (2, 6));
        assert!((found.rms_px - (19.0_f64.sqrt() + 8.0_f64.sqrt()) / 2.0).abs() < 1e-12, "{found:?}");
        assert!((found.median_px - 2.5).abs() < 1e-12, "{found:?}");
        assert_eq!((pair(Vec::new()), summed(Vec::new())), (None, None));
    }
}
