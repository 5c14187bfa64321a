//! Photographs in, an upright panorama out, with numbers and reasons for what was done.
//!
//! [`Stitcher`] runs the phases in their order: find and measure the photographs, match them, estimate cameras,
//! vanishing points and the similarity prior, deform the grids, and compose the panorama. Everything it decided is in
//! the [`Project`], which is also what `--project` writes.
//!
//! ```no_run
//! use trueup::{Inputs, StitchOptions, Stitcher, StageContext};
//!
//! let options = StitchOptions::default();
//! let context = StageContext::default();
//! let stitcher = Stitcher::new(&options, &context);
//! let inputs = Inputs::new(["holiday/"]);
//! for mut alignment in stitcher.align(&inputs)?.alignments {
//!     let panorama = stitcher.compose(&mut alignment)?.panorama;
//!     let metadata = stitcher.metadata(&alignment);
//!     trueup::write_picture("pano.jpg".as_ref(), &panorama, &metadata, &options.compose.output, &context)?;
//! }
//! # Ok::<(), trueup::Error>(())
//! ```
#![forbid(unsafe_code)]

mod batch;
#[doc(hidden)]
pub mod fuzzing;
mod inputs;
mod job;
mod memo;
mod options;
mod pipeline;
mod project;
mod report;
#[cfg(test)]
mod test_room;
mod workers;

pub use batch::{Batch, BatchJob, PhotographsOfFolder, SetOutcome, SetRecord, Shard};
pub use inputs::{Inputs, MaskFile, Reference};
pub use job::{
    ComposeJob, FRAMES_TAKEN, Outputs, RAW_DEVELOPED, ReadFile, RecordedPanorama, SideOutput, StitchJob, Written,
    thread_pool, write_thumbnail,
};
pub use memo::{CacheUse, PhotographCache};
pub use options::{
    AlignOptions, ArrangeOptions, ChangedOption, ComposeOptions, Evidence, MatchOptions, MeasureOptions, Method, Phase,
    RandomOptions, ResourceOptions, RunOptions, ShapeOptions, StitchOptions, Structure, WorkingOptions,
};
pub use pipeline::{
    Aligned, Alignment, CARRIER_LEFT_OUT, CROP_TOO_SMALL, FRAMES_PASSED_OVER, MatchedPhotographs, PROJECTION_CUT,
    Stitcher,
};
pub use project::{
    Canvas, CropRecord, FlatSceneRecord, HuginImage, HuginProject, ImageRecord, ImageStatus, LevelRecord, LineGuide,
    ManhattanRecord, MaskKind, MaskRecord, MeshRecord, PROJECT_FORMAT, PROJECT_VERSION, PairRecord, Project,
    ProjectionRecord, StackMemberRecord, hugin_project, read_project,
};
pub use report::brightness::BrightnessStep;
pub use report::evaluation::{
    Evaluation, MatchEvaluation, PairMatchEvaluation, PhotographEvaluation, PixelEvaluation, StatedEvaluation,
    compare_overlaps, evaluate, evaluate_matches, evaluate_pixels, read_truth, scale_up_to,
};
pub use report::judgement::{Judgement, Verdict, is_of_measures};
pub use report::measures::{
    BentLine, FEWEST_CERTAIN, LongLines, MeasuredLine, Measures, PairMeasures, PhotographMeasures, PlaceMeasures,
    ReprojectionMeasures, UprightMeasures, WorstPair, lean_side,
};
pub use report::shown::ShownPhotographs;
pub use trueup_align::cameras::{CameraOptions, FlatEvidence, LensKind, SceneModel};
pub use trueup_align::mesh::DRAWN_BY_CAMERAS;
pub use trueup_align::projection::{FlatKind, Projection, ProjectionOptions};
pub use trueup_align::similarity::{PHOTOGRAPH_TURNED, PriorMethod};
pub use trueup_compose::crop::Crop;
pub use trueup_compose::fidelity::Fidelity;
pub use trueup_compose::render::{Panorama, Rendered};
pub use trueup_core::context::{CancelToken, Progress, Silent};
pub use trueup_core::diagnostics::{Diagnostic, Reported, Severity, Subject};
pub use trueup_core::options::{InvalidOption, OptionDescription, OptionValue, Tier};
pub use trueup_core::raster::{Photograph, Raster, RowSource};
pub use trueup_core::spherical::{SphericalFrame, SphericalProjection};
pub use trueup_core::truth::{ImageTruth, Truth};
pub use trueup_core::{Error, Result, StageContext};
pub use trueup_io::encode::{
    Depth, Metadata, OutputOptions, abandon_unfinished, abandon_unfinished_soon, check_place, same_place,
    write as write_picture, write_atomically, written_extensions,
};
pub use trueup_io::source::{InMemory, ORIENTATION_TAG_STALE, names_photograph, read_extensions, readable_formats};
pub use trueup_io::text;
pub use workers::{TakeResult, Worker, Workers};
