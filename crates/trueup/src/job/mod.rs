//! Jobs: from inputs, or a project, to the files that are to come of them.

mod compose;
mod developed;
mod layers;
mod made;
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
pub use outputs::{Outputs, ReadFile};
pub use reopen::RecordedPanorama;
pub use side_outputs::SideOutput;
pub use stitch::StitchJob;
pub use threads::thread_pool;
pub use thumbnail::write_thumbnail;
pub use video::FRAMES_TAKEN;
pub use write::Written;
