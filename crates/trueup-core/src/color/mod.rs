//! How a picture's samples stand for light.

mod curve;
mod light_range;
mod tone;

pub use curve::TransferCurve;
pub use light_range::LightRange;
pub use tone::{ToneRelation, ToneSums};
