//! Color profiles: which colors the numbers of photographs mean, and one color space for all of them.
//!
//! * [`PhotographColors::survey`] reads what every photograph says of its colors and chooses the panorama's space;
//! * decoding then converts the photographs that were in another ([`crate::decode::FilePhotographs::in_colors`]);
//! * [`crate::encode`] embeds the space's profile, or converts the panorama to sRGB.
//!
//! # Source
//! ICC.1:2022 (profile format). Conversions are colorimetric and relative to white, by `moxcms`.

mod convert;
mod embedded;
pub(crate) mod icc;
mod named;
mod rows;
mod sanity;
#[cfg(test)]
mod sanity_tests;
mod survey;
#[cfg(test)]
mod tests;

pub(crate) use convert::{Conversion, relit};
pub use icc::srgb_profile;
pub(crate) use named::{
    Chromaticities, NamedSpace, names_primaries, profile_of_chromaticities, profile_of_code_points, profile_of_light,
    space_of_code_points,
};
pub(crate) use rows::InSrgb;
pub use survey::PhotographColors;
