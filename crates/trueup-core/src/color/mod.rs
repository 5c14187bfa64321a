//! How a picture's samples stand for light.

mod curve;
mod tone;

pub use curve::TransferCurve;
pub use tone::{ToneRelation, ToneSums};
