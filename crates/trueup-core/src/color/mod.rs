//! How a picture's samples stand for light.

mod curve;

pub use curve::TransferCurve;
