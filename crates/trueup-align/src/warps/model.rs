//! The methods that are warp models.

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
