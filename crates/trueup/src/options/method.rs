//! The methods: what a panorama's shape is found by, and what draws its photographs together.

use trueup_align::match_points::TransferModel;
use trueup_align::mesh::BaseShape;
use trueup_align::similarity::{BetaMode, Fallback, GateMode, PrintedEquations, PriorMethod};
use trueup_align::vanishing::Intrinsics;
use trueup_align::warps::WarpModel;

use super::AlignOptions;

/// How a method deforms the grids, and under which prior.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MethodForm {
    /// The mesh energies under this prior.
    Mesh(PriorMethod, Edition),
    /// A warp model. Level and roll are those of the straightened cameras.
    Warp(WarpModel),
}

/// Which form of a method with a prior it is: what of the options it fixes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Edition {
    /// Ours, of which every part is an option.
    Ours,
    /// As published, with the errors of the publication mended.
    Published,
    /// As printed, errors included, wherever that can be computed.
    Printed,
}

impl Edition {
    /// Sets what a method of this edition with this prior fixes.
    fn fix(self, prior: PriorMethod, options: &mut AlignOptions) {
        if self == Self::Ours {
            return;
        }
        fix_published_mesh(options);
        if prior == PriorMethod::VanishingPoints {
            fix_published_guidance(options);
        }
        if self == Self::Printed {
            options.similarity.as_printed = PrintedEquations::ALL;
            options.similarity.beta_mode = BetaMode::Printed;
        }
    }
}

/// The mesh of VPG, GSP and the AANAP compared with them: one similarity for each photograph, vertices carried by
/// moving DLT, undivided cells, the weights of GSP's authors, no refinement but one that is asked for, and outlines and
/// lines that nothing holds while one draws overlaps together: one similarity for each photograph leaves no room for
/// lines that stay straight where a neighbor lies under another perspective, and photographs would turn to make it.
fn fix_published_mesh(options: &mut AlignOptions) {
    /// Residual weights of the three energies next to an overlap, for cells of 40 working pixels.
    const ALIGNMENT: f64 = 1.0;
    const LOCAL: f64 = 0.75;
    const PRIOR: f64 = 6.0;
    options.match_points.model = TransferModel::MovingDlt;
    if options.stitch.align == Evidence::Auto {
        options.stitch.align = Evidence::Points;
    }
    let mesh = &mut options.mesh;
    mesh.base = BaseShape::Similarity;
    mesh.subdivision = 1;
    (mesh.alignment_weight, mesh.local_weight, mesh.prior_weight) = (ALIGNMENT, LOCAL, PRIOR);
    mesh.outline_weight = 0.0;
    options.line_alignment.straightness = 0.0;
}

/// The guidance of VPG: each photograph's own vanishing points, found without intrinsics, against relative rolls, the
/// divergence alone for a gate, GSP in three dimensions behind it.
fn fix_published_guidance(options: &mut AlignOptions) {
    options.vanishing.intrinsics = Intrinsics::Unknown;
    let similarity = &mut options.similarity;
    similarity.gate = GateMode::Paper;
    similarity.beta_mode = BetaMode::World;
    similarity.fallback = Fallback::Gsp3d;
    similarity.as_printed = PrintedEquations::NONE;
    similarity.guided_redetection = false;
    similarity.joint_refinement = false;
    similarity.camera_correction = false;
    similarity.pooled_search = false;
    similarity.vertical_only = false;
    similarity.gravity = false;
    similarity.far_horizon = false;
    similarity.turned_photographs = false;
    similarity.pitch_prior = 0.0;
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
            /// What `projection.kind = auto` means under this method: a view chosen for the scene if it is ours, by
            /// default ("vpg"); of every other method, which is there to be compared, the shape that is its own.
            pub(crate) fn chooses_view(self) -> bool {
                self == Self::Vpg
            }

            /// What the method is made of.
            pub(crate) fn form(self) -> MethodForm {
                match self { $(Self::$variant => $form,)* }
            }

            /// Sets the options that the method fixes.
            pub(crate) fn fix(self, options: &mut AlignOptions) {
                match self.form() {
                    MethodForm::Mesh(prior, edition) => edition.fix(prior, options),
                    MethodForm::Warp(_) => {}
                }
            }
        }
    };
}

methods! {
    /// Vanishing-point-guided natural stitching: upright wherever the scene has straight lines to tell.
    Vpg = "vpg": MethodForm::Mesh(PriorMethod::VanishingPoints, Edition::Ours),
    /// The two-dimensional global similarity prior: as many photographs as possible are not turned at all.
    Gsp2d = "gsp-2d": MethodForm::Mesh(PriorMethod::Gsp2d, Edition::Ours),
    /// The three-dimensional global similarity prior: straightened cameras, corrected where overlaps contradict them.
    Gsp3d = "gsp-3d": MethodForm::Mesh(PriorMethod::Gsp3d, Edition::Ours),
    /// Vanishing-point-guided natural stitching as published, with the errors of the paper mended.
    VpgPublished = "vpg-published": MethodForm::Mesh(PriorMethod::VanishingPoints, Edition::Published),
    /// The same with the paper's equations as they are printed, errors included: for research, not for panoramas.
    VpgLiteral = "vpg-literal": MethodForm::Mesh(PriorMethod::VanishingPoints, Edition::Printed),
    /// The two-dimensional global similarity prior on the mesh as published.
    Gsp2dPublished = "gsp-2d-published": MethodForm::Mesh(PriorMethod::Gsp2d, Edition::Published),
    /// The three-dimensional global similarity prior on the mesh as published.
    Gsp3dPublished = "gsp-3d-published": MethodForm::Mesh(PriorMethod::Gsp3d, Edition::Published),
    /// AANAP's turns on the same mesh, as the paper of vpg compares with them.
    AanapPublished = "aanap-published": MethodForm::Mesh(PriorMethod::Aanap, Edition::Published),
    /// The mesh under straightened cameras alone: what vpg falls back to where no lines guide it.
    Straightening = "straightening": MethodForm::Mesh(PriorMethod::Straightening, Edition::Ours),
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
        /// What the photographs ask for: matched lines and pixels too, where parallax keeps matched points apart. As
        /// published: points.
        Auto = "auto",
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
