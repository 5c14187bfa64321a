//! The methods: what a panorama's shape is found by, and what draws its photographs together.

use trueup_align::similarity::PriorMethod;
use trueup_align::warps::WarpModel;

/// How a method deforms the grids, and under which prior.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MethodForm {
    /// The mesh energies under this prior.
    Mesh(PriorMethod),
    /// A warp model. Level and roll are those of the straightened cameras.
    Warp(WarpModel),
}

/// Declares the methods: a name, a meaning, and of what each is made.
macro_rules! methods {
    ($($(#[doc = $doc:literal])* $variant:ident = $name:literal: $form:expr,)*) => {
        trueup_core::choice! {
            /// How the panorama's shape is found.
            pub enum Method {
                $($(#[doc = $doc])* $variant = $name,)*
            }
        }

        impl Method {
            /// What the method is made of.
            pub(crate) fn form(self) -> MethodForm {
                match self { $(Self::$variant => $form,)* }
            }
        }
    };
}

methods! {
    /// Vanishing-point-guided natural stitching: upright wherever the scene has straight lines to tell.
    Vpg = "vpg": MethodForm::Mesh(PriorMethod::VanishingPoints),
    /// The two-dimensional global similarity prior: as many photographs as possible are not turned at all.
    Gsp2d = "gsp-2d": MethodForm::Mesh(PriorMethod::Gsp2d),
    /// The three-dimensional global similarity prior: straightened cameras, corrected where overlaps contradict them.
    Gsp3d = "gsp-3d": MethodForm::Mesh(PriorMethod::Gsp3d),
    /// The mesh under straightened cameras alone: what vpg falls back to where no lines guide it.
    Straightening = "straightening": MethodForm::Mesh(PriorMethod::Straightening),
    /// One homography per photograph, onto the plane of the reference.
    Homography = "homography": MethodForm::Warp(WarpModel::Homography),
    /// Straightened cameras on a sphere, a cylinder or a plane (warps.surface), as AutoStitch has them.
    Autostitch = "autostitch": MethodForm::Warp(WarpModel::Autostitch),
    /// As-projective-as-possible: a homography for every grid vertex.
    Apap = "apap": MethodForm::Warp(WarpModel::Apap),
    /// Shape-preserving half-projective: a homography on one side, an upright similarity on the other.
    Sphp = "sphp": MethodForm::Warp(WarpModel::Sphp),
    /// Shape-preserving half-projective with a similarity that may turn.
    SphpFree = "sphp-free": MethodForm::Warp(WarpModel::SphpFree),
    /// Adaptive as-natural-as-possible: homographies that turn into similarities away from the overlaps.
    Aanap = "aanap": MethodForm::Warp(WarpModel::Aanap),
    /// Homographies whose scale grows only linearly outside the overlaps.
    QuasiHomography = "quasi-homography": MethodForm::Warp(WarpModel::QuasiHomography),
}

trueup_core::choice! {
    /// What draws overlapping photographs together.
    pub enum Evidence {
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

impl Evidence {
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
