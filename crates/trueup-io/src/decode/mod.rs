//! Pixels from files: whole photographs, and the reduced pictures that measurement works on.

mod files;
mod mask;
pub(crate) mod orientation;
mod photograph;
mod reduce;
#[cfg(test)]
mod tests;
mod working;

pub use files::FilePhotographs;
pub use mask::mask;
pub use photograph::{decoding_surplus, photograph, sample_bits};
pub use working::{WorkingPicture, reduce_photograph, working};
