//! What the user decides about light.

trueup_core::choice! {
    /// Which photograph's look the panorama keeps.
    pub enum GainAnchor {
        /// The geometric mean of all gains is 1 in every channel.
        Mean = "mean",
        /// The reference's gains are 1.
        Reference = "reference",
        /// The reference's colors, and the brightness at which least of all photographs turns white or black.
        Scene = "scene",
    }
}

trueup_core::choice! {
    /// What may differ between the photographs.
    pub enum ExposureModel {
        /// Brightness: one gain per photograph.
        Gain = "gain",
        /// Brightness, color cast (a gain per channel) and vignetting (one lens per camera).
        Full = "full",
    }
}

trueup_core::options! {
    /// How brightness, color and vignetting of the photographs are evened out.
    pub struct ExposureOptions("exposure") {
        /// Whether anything is evened out at all. Switch it off for photographs that were evened out before, or to see
        /// their own light.
        enabled: bool = true, Allowed::Any, "", basic;
        /// What may differ between the photographs. Choose `gain` if color casts are wanted as they are, or if
        /// vignetting was corrected before and there are few overlaps to tell it from the scene.
        model: ExposureModel = ExposureModel::Full, Allowed::Any, "";
        /// Which photograph's look the panorama keeps. Choose `reference` to have one photograph stay as it was taken,
        /// however bright or dark it is, `mean` for the middle of all.
        anchor: GainAnchor = GainAnchor::Scene, Allowed::Any, "";
        /// Whether the cameras' response is estimated beside the full model, one for all photographs; without, their
        /// samples are taken for light by the color profile's curve. Switch it off for photographs whose samples are
        /// known to follow their profile, such as developed raw files.
        response: bool = true, Allowed::Any, "";
        /// Largest gain beside the median photograph's; the smallest is its inverse. Photographs of sun and shade that
        /// each were exposed for what they show lie up to five stops from it. Lower it if a photograph that is nearly
        /// black comes out as noise.
        max_gain: f64 = 32.0, between(1.0, 1000.0), "";
    }
}
