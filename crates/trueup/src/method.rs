//! What a panorama's shape is found by, and what draws its photographs together.

use trueup_align::similarity::PriorMethod;
use trueup_align::warps::WarpModel;

trueup_core::choice! {
    /// How the panorama's shape is found.
    pub enum Method {
        /// Vanishing-point-guided natural stitching: upright wherever the scene has straight lines to tell.
        Vpg = "vpg",
        /// The two-dimensional global similarity prior: as many photographs as possible are not turned at all.
        Gsp2d = "gsp-2d",
        /// The three-dimensional global similarity prior: straightened cameras, corrected where overlaps contradict them.
        Gsp3d = "gsp-3d",
        /// One homography per photograph, onto the plane of the reference.
        Homography = "homography",
        /// Straightened cameras on a sphere, a cylinder or a plane (warps.surface), as AutoStitch has them.
        Autostitch = "autostitch",
        /// As-projective-as-possible: a homography for every grid vertex.
        Apap = "apap",
        /// Shape-preserving half-projective: a homography on one side, an upright similarity on the other.
        Sphp = "sphp",
        /// Shape-preserving half-projective with a similarity that may turn.
        SphpFree = "sphp-free",
        /// Adaptive as-natural-as-possible: homographies that turn into similarities away from the overlaps.
        Aanap = "aanap",
        /// Homographies whose scale grows only linearly outside the overlaps.
        QuasiHomography = "quasi-homography",
    }
}

/// What makes a method: how the grids are deformed, and under which prior.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// The mesh energies under this prior; `None` leaves the prior to `similarity.prior`.
    Mesh(Option<PriorMethod>),
    /// A warp model. Level and roll are those of the straightened cameras.
    Warp(WarpModel),
}

impl Method {
    /// The one place that says what a method is made of.
    pub(crate) fn shape(self) -> Shape {
        match self {
            Self::Vpg => Shape::Mesh(None),
            Self::Gsp2d => Shape::Mesh(Some(PriorMethod::Gsp2d)),
            Self::Gsp3d => Shape::Mesh(Some(PriorMethod::Gsp3d)),
            Self::Homography => Shape::Warp(WarpModel::Homography),
            Self::Autostitch => Shape::Warp(WarpModel::Autostitch),
            Self::Apap => Shape::Warp(WarpModel::Apap),
            Self::Sphp => Shape::Warp(WarpModel::Sphp),
            Self::SphpFree => Shape::Warp(WarpModel::SphpFree),
            Self::Aanap => Shape::Warp(WarpModel::Aanap),
            Self::QuasiHomography => Shape::Warp(WarpModel::QuasiHomography),
        }
    }
}

trueup_core::choice! {
    /// What draws overlapping photographs together.
    pub enum Alignment {
        /// Matched points, carried to the whole overlap.
        Points = "points",
        /// And matched lines.
        Lines = "lines",
        /// And the pixels themselves.
        Photometric = "photometric",
        /// And both, lines first.
        LinesPhotometric = "lines+photometric",
    }
}

impl Alignment {
    /// Whether matched lines take part.
    pub fn uses_lines(self) -> bool {
        matches!(self, Self::Lines | Self::LinesPhotometric)
    }

    /// Whether pixels take part.
    pub fn uses_pixels(self) -> bool {
        matches!(self, Self::Photometric | Self::LinesPhotometric)
    }
}

trueup_core::choice! {
    /// What of the photographs' structure is kept, beyond the neighborhoods of grid vertices.
    pub enum Structure {
        /// Nothing.
        None = "none",
        /// Long straight lines.
        Lines = "lines",
    }
}
