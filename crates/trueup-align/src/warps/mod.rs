//! Warp models of a pair that are no mesh energy.

mod sphp;

pub use sphp::SphpWarp;
