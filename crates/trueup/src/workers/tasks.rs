//! What is handed to workers, and what they give: as bytes.

use std::borrow::Cow;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use trueup_compose::exposure::Corrections;
use trueup_compose::layout::CanvasLayout;
use trueup_compose::render::{Region, RegionWork, SmallWork};
use trueup_compose::small_views::MadeSmall;
use trueup_core::diagnostics::Reported;
use trueup_core::matches::PairMatches;
use trueup_core::source::{SourceImage, WorkingFrame};
use trueup_core::told_lens::ToldLens;
use trueup_core::{Error, Result};
use trueup_vision::features::{DESCRIPTOR_LENGTH, FeaturePoint, Features};
use trueup_vision::matching::Demand;

use crate::memo::PROGRAM;
use crate::options::StitchOptions;
use crate::pipeline::measured::{Measured, StoredRaster};

/// What tasks of one kind have in common.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Common {
    /// The program that handed them out: another one may do something else.
    pub program: Cow<'static, str>,
    pub options: StitchOptions,
    /// All photographs, by absolute paths; none for [`Kind::Match`].
    pub images: Vec<SourceImage>,
    pub kind: Kind,
}

impl Common {
    /// Of this program.
    pub(super) fn new(options: &StitchOptions, images: Vec<SourceImage>, kind: Kind) -> Self {
        Self { program: PROGRAM.into(), options: options.clone(), images, kind }
    }
}

/// What is to be done.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Kind {
    /// Photographs are measured: [`MeasureTask`].
    Measure {
        /// Whether the gray values are handed on.
        keep_grays: bool,
    },
    /// Pairs are matched: [`MatchTask`].
    Match,
    /// Photographs are made small: [`SmallTask`].
    Small { panorama: Placement, work: SmallWork },
    /// Regions of the canvas are finished: [`FinishTask`].
    Finish { panorama: Placement, work: RegionWork },
}

/// Where the photographs lie, and in which light.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Placement {
    pub layout: CanvasLayout,
    pub corrections: Corrections,
}

/// The numbers of the photographs to be measured.
pub(super) type MeasureTask = Vec<usize>;

/// What is known of each of them, in their order; `None` where it could not be found out, which is found out again by
/// who asked.
pub(super) type MeasureResult = Vec<Option<Reported<Measured>>>;

/// Pairs to be matched.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct MatchTask {
    /// The photographs in them, ascending.
    pub photographs: Vec<FeaturesOfOne>,
    /// By the places in `photographs`, the smaller first.
    pub pairs: Vec<(usize, usize)>,
    /// What they must show to be joined.
    pub demand: Demand,
}

/// What came of them, in their order, photographs numbered as in the task.
pub(super) type MatchResult = Vec<PairMatches>;

/// The positions of the photographs to be made small.
pub(super) type SmallTask = Vec<usize>;

/// What they became, in their order.
pub(super) type SmallResult = Vec<MadeSmall>;

/// A region to be finished, into a [`FinishedRegion`](trueup_compose::render::FinishedRegion).
pub(super) type FinishTask = Region;

/// A photograph's features.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct FeaturesOfOne {
    frame: WorkingFrame,
    told: ToldLens,
    points: Vec<FeaturePoint>,
    #[serde(with = "serde_bytes")]
    descriptors: Vec<u8>,
    descriptor_points: Vec<u32>,
    surroundings: StoredRaster,
}

impl FeaturesOfOne {
    pub(super) fn new(features: &Features, frame: WorkingFrame, told: ToldLens) -> Self {
        let Features { points, descriptors, descriptor_points, surroundings } = features;
        Self {
            frame,
            told,
            points: points.clone(),
            descriptors: descriptors.concat(),
            descriptor_points: descriptor_points.clone(),
            surroundings: StoredRaster::new(surroundings),
        }
    }

    /// The features, the frame they are measured in, and what is told of the lens; `None` if it is damaged.
    pub(super) fn restored(self) -> Option<(Features, WorkingFrame, ToldLens)> {
        let (descriptors, rest) = self.descriptors.as_chunks::<DESCRIPTOR_LENGTH>();
        let descriptors = rest.is_empty().then(|| descriptors.to_vec())?;
        let (points, descriptor_points, surroundings) =
            (self.points, self.descriptor_points, self.surroundings.restored()?);
        let features = Features { points, descriptors, descriptor_points, surroundings };
        Some((features, self.frame, self.told))
    }
}

/// Something as bytes.
///
/// # Errors
/// [`Error::Input`] if it cannot be written, which is a defect.
pub(super) fn written<T: Serialize + ?Sized>(value: &T) -> Result<Vec<u8>> {
    rmp_serde::to_vec_named(value).map_err(|error| Error::input("a task", error, "Report this as a defect."))
}

/// Something from its bytes.
///
/// # Errors
/// [`Error::Input`] if it is something else.
pub(super) fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    rmp_serde::from_slice(bytes).map_err(|error| damaged(&error.to_string()))
}

/// The error for bytes that no program of this version has written.
pub(super) fn damaged(reason: &str) -> Error {
    Error::input(
        "work that is divided",
        format!("what one program handed to another cannot be read ({reason})"),
        "Run the same version of trueup on all machines.",
    )
}
