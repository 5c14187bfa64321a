//! What a surface is made of, and a place on it.

use nalgebra::Vector3;

use crate::color::{Rgb, srgb};
use crate::noise::{fractal_noise, lattice};

/// Index of a [`SurfaceMaterial`] in its scene.
pub(crate) type MaterialId = usize;

/// A kind of surface. Unless said otherwise `colors[0]` is the main color and `scale_m` the size of the motif.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pattern {
    /// Lime or gypsum plaster: blotches, trowel marks, stipple, cracks, water stains.
    Plaster,
    /// Printed paper: stripes of `colors[0]` and `[1]` with sprigs of `[2]`, no two alike.
    Wallpaper,
    /// Timber with the grain along the body's longest axis.
    Wood,
    /// Boards of width `scale_m` along the texture's z.
    Planks,
    /// Square tiles of `colors[0]` and `[1]` with joints of `[2]`.
    Tiles,
    /// Carpet tiles of size `scale_m`: loops of `colors[0]`, `[1]` and `[2]`, laid crosswise, worn and spotted.
    Carpet,
    /// Panels of size `scale_m` with holes, in a grid of `colors[1]`.
    CeilingPanels,
    /// Handwriting and sketches of `colors[1]` and `[2]` on a board.
    Writing,
    /// A rug with border and diamonds.
    Rug,
    /// A framed picture, drawn by seed: landscape, blocks, discs, still life.
    Picture,
    /// A book's spine, drawn by seed.
    Spine,
    /// Woven cloth.
    Fabric,
    /// Cloth hanging in folds of width `scale_m`.
    Curtain,
    /// Even paint with a trace of dirt.
    Paint,
    /// Leaves.
    Foliage,
    /// Bricks of height `scale_m` with mortar of `colors[1]`.
    Brick,
    /// Exterior render: weather streaks below and stains.
    Stucco,
    /// Dressed stone in courses of height `scale_m`.
    Ashlar,
    /// Road surface.
    Asphalt,
    /// Pavement slabs of size `scale_m`.
    Paving,
    /// A window pane with a dim room or a curtain behind.
    Pane,
    /// Louvred shutters with slats of height `scale_m`.
    Louvres,
    /// A board with lettering of `colors[1]`.
    Sign,
    /// A page of text: notices, posters, newspapers.
    Page,
    /// A meadow: tufts and blades of `colors[0]` and `[1]` in patches of width `scale_m`, flowers of `[2]`.
    Grass,
    /// Rough rock.
    Rock,
}

/// A surface: pattern, colors and how it shines.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfaceMaterial {
    pub(crate) pattern: Pattern,
    pub(crate) colors: [Rgb; 3],
    /// Size of the motif, metres.
    pub(crate) scale_m: f64,
    /// Mirror reflectance at right angles, 0 to 1 (dielectrics about 0.04).
    pub(crate) gloss: f64,
    /// Light given off, as a multiple of the color.
    pub(crate) emission: f64,
}

impl SurfaceMaterial {
    /// A matt material of up to three sRGB colors.
    pub(crate) fn new(pattern: Pattern, scale_m: f64, colors: [u32; 3]) -> Self {
        Self { pattern, colors: colors.map(srgb), scale_m, gloss: 0.0, emission: 0.0 }
    }

    /// The same with a polished surface.
    pub(crate) fn glossy(self, gloss: f64) -> Self {
        Self { gloss, ..self }
    }

    /// The same giving off light.
    pub(crate) fn emitting(self, emission: f64) -> Self {
        Self { emission, ..self }
    }
}

/// A place on a surface, in every coordinate a pattern may want.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    /// In the texture frame, metres.
    pub(crate) point: Vector3<f64>,
    /// To the right and down on the face, metres in the texture frame.
    pub(crate) across: f64,
    /// Down on the face, metres in the texture frame.
    pub(crate) down: f64,
    /// To the right and down in [0, 1] of the face.
    pub(crate) unit: [f64; 2],
    /// Width and height of the face, metres.
    pub(crate) size: [f64; 2],
    /// Axis (0..3) along which timber of this body was sawn.
    pub(crate) grain: usize,
    /// Width of the pixel on the surface, metres.
    pub(crate) footprint: f64,
    /// Of the body.
    pub(crate) seed: u32,
}

impl Spot {
    /// Fractal noise at the spot.
    pub(crate) fn noise(&self, wavelength: f64, octaves: u32, gain: f64, salt: u32) -> f64 {
        fractal_noise(self.point, wavelength, octaves, gain, self.footprint, salt)
    }

    /// A random number in [0, 1) of the body.
    pub(crate) fn chance(&self, salt: i64) -> f64 {
        lattice(salt, 17, 5, self.seed)
    }
}
