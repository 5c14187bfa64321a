//! Photographs in, an upright panorama out, with numbers and reasons for what was done.
//!
//! [`Stitcher`] runs trueup's stages in their order: find and measure the photographs, match them, estimate cameras,
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
//! for alignment in stitcher.align(&inputs)?.alignments {
//!     let panorama = stitcher.compose(&alignment)?.panorama;
//!     let metadata = stitcher.metadata(&alignment);
//!     trueup::write_picture("pano.jpg".as_ref(), &panorama, &metadata, &options.output, &context)?;
//! }
//! # Ok::<(), trueup::Error>(())
//! ```
#![forbid(unsafe_code)]

mod align;
mod arrangement;
mod budget;
mod by_hand;
mod cache;
mod clock;
pub mod compare;
mod evaluation;
mod files;
mod inputs;
mod left_out;
mod masks;
mod matched;
mod measure;
mod measures;
mod memory;
mod method;
mod names;
mod options;
mod outputs;
mod pairs;
mod project;
mod projection_record;
mod provenance;
mod pto;
mod recompose;
mod record;
mod recorded;
mod refinement;
mod replacements;
mod stitcher;

pub use cache::{Cache, CacheOptions, CacheUse};
pub use evaluation::{Evaluation, PictureEvaluation, PixelEvaluation, evaluate, evaluate_pixels, read_truth};
pub use files::{StitchJob, Written};
pub use inputs::{Inputs, Reference};
pub use masks::{MaskFile, MaskKind, MaskRecord};
pub use measures::{BentLine, LongLines, Measures, PictureMeasures, ReprojectionMeasures, UprightMeasures};
pub use method::Method;
pub use options::{StitchOptions, WorkingOptions};
pub use project::{
    Canvas, ImageRecord, ImageStatus, ManhattanRecord, MeshRecord, PROJECT_FORMAT, PROJECT_VERSION, PairRecord, Project,
};
pub use projection_record::ProjectionRecord;
pub use pto::hugin_project;
pub use recompose::ComposeJob;
pub use stitcher::{Aligned, Alignment, MatchedPhotographs, Stitcher};
pub use trueup_align::projection::{FlatKind, Projection, ProjectionOptions};
pub use trueup_align::similarity::PriorMethod;
pub use trueup_compose::fidelity::Fidelity;
pub use trueup_compose::render::{Panorama, Rendered};
pub use trueup_core::context::{CancelToken, Progress, Silent};
pub use trueup_core::diagnostics::{Diagnostic, Severity};
pub use trueup_core::options::{InvalidOption, OptionDescription};
pub use trueup_core::raster::RowSource;
pub use trueup_core::spherical::{SphericalFrame, SphericalProjection};
pub use trueup_core::truth::{ImageTruth, Truth};
pub use trueup_core::{Error, Result, StageContext};
pub use trueup_io::encode::{
    Metadata, OutputOptions, abandon_unfinished, check_place, write as write_picture, write_atomically,
};
