//! What the user decides about rendering.

use crate::weights::Weighting;

trueup_core::choice! {
    /// How a photograph is read between its samples.
    pub enum Interpolation {
        /// Two samples along each axis: soft, never rings.
        Bilinear = "bilinear",
        /// Four samples along each axis (Catmull-Rom): keeps detail.
        Bicubic = "bicubic",
    }
}

trueup_core::choice! {
    /// What a canvas pixel shows where photographs overlap.
    pub enum Blend {
        /// The photograph that the seams give it to, blended over the seams with its neighbors: contours over a few
        /// pixels, colors over many.
        MultiBand = "multiband",
        /// The mean of all, each weighted by its distance from its own border.
        Feather = "feather",
        /// The plain mean of all: shows misalignment best.
        Average = "average",
        /// The photograph that the seams give it to, alone: shows every seam.
        None = "none",
    }
}

trueup_core::choice! {
    /// How photographs of very different exposure come together in one picture.
    pub enum Look {
        /// Differences that a picture can bear are evened out; beyond, sun stays brighter than shade and each near to
        /// how it was exposed, with a wide and smooth change between them.
        Natural = "natural",
        /// One exposure for the whole panorama: light is in the same proportion everywhere, however dark or bright that
        /// is.
        Linear = "linear",
        /// Everything nearly as it was exposed: most detail in sun and in shade, and least of the difference between
        /// them.
        Hdr = "hdr",
    }
}

/// How a blend makes canvas pixels of photographs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Composition {
    /// One photograph is shown at a place, as the seams say.
    AlongSeams(Transition),
    /// All photographs are shown everywhere, each with its weight.
    Averaged(Weighting),
}

/// What is seen where the photograph shown changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Transition {
    /// Nothing of the change: the bands of a pyramid go over, each within its own width.
    Bands,
    /// The change.
    Cut,
}

impl Blend {
    /// How it makes pixels. This is the one place where a blend says what it is.
    pub(crate) fn composition(self) -> Composition {
        match self {
            Self::MultiBand => Composition::AlongSeams(Transition::Bands),
            Self::None => Composition::AlongSeams(Transition::Cut),
            Self::Feather => Composition::Averaged(Weighting::Feathered),
            Self::Average => Composition::Averaged(Weighting::Equal),
        }
    }

    /// Whether it shows one photograph at a place, so that a panorama has seams.
    pub fn has_seams(self) -> bool {
        matches!(self.composition(), Composition::AlongSeams(_))
    }
}

trueup_core::options! {
    /// How the photographs become one panorama.
    pub struct RenderOptions("render") {
        /// How a photograph is read between its samples. Choose `bilinear` if sharp contours show faint lines beside
        /// them.
        interpolation: Interpolation = Interpolation::Bicubic, Allowed::Any, "";
        /// What a pixel shows where photographs overlap. Choose `none` to finish the seams by hand, `feather` for soft
        /// transitions without seams, `average` to see misalignment.
        blend: Blend = Blend::MultiBand, Allowed::Any, "", basic;
        /// How photographs of very different exposure come together. Choose `linear` to measure light or to finish
        /// tones by hand, `hdr` for detail in sun and shade alike. Photographs of like exposure look the same with all
        /// of them.
        look: Look = Look::Natural, Allowed::Any, "", basic;
        /// Widest transition of multi-band blending, as a share of the photographs' shorter side on the canvas. Raise
        /// it if brightness or color still change visibly beside a seam, lower it if light spreads from one photograph
        /// to another.
        transition: f64 = 0.1, between(0.0, 1.0), "";
    }
}
