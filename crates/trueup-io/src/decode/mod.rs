//! Pixels from files: whole photographs, and the reduced pictures that measurement works on.

mod files;
mod mask;
pub(crate) mod orientation;
mod photograph;
mod reduce;
mod small;
#[cfg(test)]
mod tests;
mod working;

pub use files::FilePhotographs;
pub use mask::{mask, mask_in_memory};
pub use photograph::{decoding_surplus, photograph, sample_bits};
pub use small::small;
pub use working::{WorkingPicture, reduce_photograph, working};
