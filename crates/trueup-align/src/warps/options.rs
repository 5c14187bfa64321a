//! Options of the warp models.

use super::distance_kernel::DistanceKernel;

trueup_core::choice! {
    /// A method that is a warp model.
    pub enum WarpModel {
        /// One homography per photograph, onto the plane of the reference.
        Homography = "homography",
        /// Straightened cameras on a sphere, a cylinder or a plane.
        Autostitch = "autostitch",
        /// As-projective-as-possible: moving DLT.
        Apap = "apap",
        /// Shape-preserving half-projective, its similarity upright.
        Sphp = "sphp",
        /// Shape-preserving half-projective, its similarity free to turn.
        SphpFree = "sphp-free",
        /// Adaptive as-natural-as-possible.
        Aanap = "aanap",
        /// Homographies of linear scale outside the overlaps.
        QuasiHomography = "quasi-homography",
    }
}

trueup_core::choice! {
    /// Where the homographies between photographs come from.
    pub enum HomographySource {
        /// From the cameras: they agree all the way round, and know of no parallax.
        Cameras = "cameras",
        /// From the matches of each pair, chained along the strongest overlaps.
        Pairs = "pairs",
    }
}

trueup_core::choice! {
    /// The surface that the method autostitch projects onto.
    pub enum AutostitchSurface {
        /// Longitude and latitude: any field of view but the poles.
        Spherical = "spherical",
        /// Longitude and height: verticals stay straight, heights grow towards the poles.
        Cylindrical = "cylindrical",
        /// The plane ahead: all lines stay straight; less than half a turn.
        Plane = "plane",
    }
}

trueup_core::options! {
    /// How the methods that are warp models place the photographs.
    pub struct WarpOptions("warps") {
        /// Where the homographies of the method homography come from. Choose the pairs where the photographs were taken
        /// from different places.
        homographies: HomographySource = HomographySource::Cameras, Allowed::Any, "";
        /// Where those of the methods sphp, sphp-free and quasi-homography come from. Choose the cameras where the
        /// pairs' own homographies do not agree.
        pair_homographies: HomographySource = HomographySource::Pairs, Allowed::Any, "";
        /// The surface that the method autostitch projects onto. Choose the plane for narrow views with straight lines,
        /// the cylinder for verticals that stay straight.
        surface: AutostitchSurface = AutostitchSurface::Spherical, Allowed::Any, "";
        /// How the weight of a match falls with its distance from a vertex in the method apap. Change it to compare
        /// with results made by the paper's formula.
        apap_kernel: DistanceKernel = DistanceKernel::Code, Allowed::Any, "";
        /// Distance over which that weight falls to 1/e; 72.25 is the published 8.5 squared. Lower it where overlaps
        /// still show double, raise it where they are bent.
        apap_decay_px: f64 = 72.25, between(1.0, 10000.0), "working px";
        /// Whether the method aanap moves the photographs that are placed already along with the one that joins them.
        /// Turn it off to keep the reference as it was taken, and where photographs are refused for their size; what
        /// joins is then less like a similarity.
        adapt_reference: bool = true, Allowed::Any, "";
    }
}
