//! The record of a stitch: what it holds, how it is filled, read again, and what else is made from it.

pub(crate) mod fill;
pub(crate) mod hugin;
pub(crate) mod projection;
pub(crate) mod provenance;
pub(crate) mod read;
pub(crate) mod record;
pub(crate) mod replace;

pub use hugin::hugin_project;
pub use projection::ProjectionRecord;
pub use record::{
    Canvas, CropRecord, FlatSceneRecord, ImageRecord, ImageStatus, LevelRecord, ManhattanRecord, MeshRecord,
    PROJECT_FORMAT, PROJECT_VERSION, PairRecord, Project, StackMemberRecord,
};
