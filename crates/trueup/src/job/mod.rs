//! Jobs: what is to be stitched, and the files that are to come of it.

mod compose;
mod developed;
pub(crate) mod inputs;
mod layers;
pub(crate) mod lens_from;
mod made;
pub(crate) mod masks;
pub(crate) mod names;
mod outputs;
mod reopen;
mod side_outputs;
mod small_panorama;
mod stitch;
mod summary;
mod threads;
mod thumbnail;
mod video;
mod write;

pub use compose::ComposeJob;
pub use developed::RAW_DEVELOPED;
pub use inputs::{Inputs, Reference};
pub use masks::{MaskFile, MaskKind, MaskRecord};
pub use outputs::{Outputs, ReadFile};
pub use reopen::RecordedPanorama;
pub use side_outputs::SideOutput;
pub use stitch::StitchJob;
pub use threads::thread_pool;
pub use thumbnail::write_thumbnail;
pub use video::FRAMES_TAKEN;
pub use write::Written;
