//! A panorama as its metadata see it.

use std::path::Path;

use trueup_core::spherical::SphericalFrame;

/// The name the panorama bears as its maker.
pub const SOFTWARE: &str = concat!("trueup ", env!("CARGO_PKG_VERSION"));

/// What is written beside a panorama and shows as much of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PanoramaPart {
    /// Every photograph by itself, as it lies on the panorama.
    Layers,
    /// Which photograph is shown where.
    Seams,
}

impl PanoramaPart {
    /// All of them.
    pub(crate) const ALL: [Self; 2] = [Self::Layers, Self::Seams];

    /// How its file describes itself.
    pub(crate) const fn description(self) -> &'static str {
        match self {
            Self::Layers => "Layers of a panorama",
            Self::Seams => "Seams of a panorama",
        }
    }
}

/// A finished panorama, as its metadata see it.
#[derive(Debug, Clone, Copy)]
pub struct PanoramaDescription<'a> {
    /// The files of the photographs in it.
    pub photographs: &'a [&'a Path],
    /// Position of the reference among them.
    pub reference: usize,
    /// Direction of each photograph in the levelled world, radians to the right of its z axis; `None` where unknown.
    pub yaws: &'a [Option<f64>],
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Whether it is written in sRGB.
    pub is_srgb: bool,
    /// Where it lies on the sphere, if viewers are to know.
    pub spherical: Option<SphericalFrame>,
    /// How the whole sphere's middle is turned against the level world, degrees: upwards, and clockwise as a head is,
    /// so that the horizon turns anticlockwise. Zero for a panorama that stands upright.
    pub pose_deg: [f64; 2],
}
