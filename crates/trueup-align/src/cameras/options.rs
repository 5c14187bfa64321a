//! What a user can choose about cameras.

use trueup_core::options::{InvalidOption, OptionValue};

/// Widest field of view, degrees, of a lens that keeps lines straight: what the shortest focal length that is believed
/// of a photograph sees.
const WIDEST_RECTILINEAR_DEG: f64 = 118.0;

trueup_core::choice! {
    /// Which photographs share a focal length.
    pub enum FocalSharing {
        /// One focal length per camera and size, unless the photographs themselves say that it varies.
        Auto = "auto",
        /// One focal length per camera and size.
        Shared = "shared",
        /// A focal length for every photograph.
        PerPicture = "per-picture",
    }
}

trueup_core::choice! {
    /// What kind of lens took the photographs.
    pub enum LensKind {
        /// As the matches tell; nearly always a lens that keeps lines straight, but for what they show of its
        /// distortion.
        Auto = "auto",
        /// A lens that bends nothing: photographs that were corrected by the camera or a raw developer, or were
        /// rendered.
        Pinhole = "pinhole",
        /// A lens that is to keep lines straight, with distortion as the matches tell.
        Rectilinear = "rectilinear",
        /// A fisheye, with distortion as the matches tell.
        Fisheye = "fisheye",
    }
}

trueup_core::choice! {
    /// What the photographs show, and how their cameras moved.
    pub enum SceneModel {
        /// As the matches tell: rotating cameras, unless these explain them much worse than a plane does that moving
        /// cameras see.
        Auto = "auto",
        /// Anything, by cameras that stayed where they were and turned.
        Rotating = "rotating",
        /// Something flat, by cameras that moved along it: scans, murals, the ground from the air. It is drawn as it
        /// lies in its plane.
        Plane = "plane",
    }
}

trueup_core::choice! {
    /// Where the focal lengths of photographs without metadata start from.
    pub enum StartFocal {
        /// One for all, that by which turning cameras explain the matches best.
        Searched = "searched",
        /// Each photograph's own: the median of what the homographies around the vertices of its overlaps tell, as GSP
        /// has it.
        LocalHomographies = "local-homographies",
    }
}

trueup_core::options! {
    /// How cameras are found.
    pub struct CameraOptions("cameras") {
        /// What the photographs show, and how their cameras moved. Say `plane` where a document or a facade that was
        /// taken in two photographs comes out bent; `rotating` where a flat wall was taken from one place and is drawn
        /// as a plane.
        scene: SceneModel = SceneModel::Auto, Allowed::Any, "", basic;
        /// What kind of lens took the photographs. Say it where few photographs overlap, which tell little of a lens,
        /// or where a line that is straight comes out bent.
        lens: LensKind = LensKind::Auto, Allowed::Any, "", basic;
        /// Field of view of every photograph across its longer side, through the whole lens, by any calibration or
        /// specification; the matches may still change the focal length by up to 5 %. Say it where photographs carry no
        /// focal length, or a wrong one; 0 leaves it to them.
        fov: f64 = 0.0, between(0.0, 190.0), "degrees", basic;
        /// Which photographs share a focal length. `shared` where the lens was not touched and short rows still bend;
        /// `per-picture` where it was zoomed between photographs and `auto` does not notice.
        focal_sharing: FocalSharing = FocalSharing::Auto, Allowed::Any, "";
        /// Where the focal lengths of photographs without metadata start from. `local-homographies` to compare with GSP
        /// as published.
        start_focal: StartFocal = StartFocal::Searched, Allowed::Any, "";
        /// Standard deviation of a focal length from metadata, relative. Lower it where the metadata are calibrated;
        /// raise it where a lens reports a focal length that is far from the true one.
        known_focal_sd: f64 = 0.1, between(0.001, 10.0), "";
        /// Root mean square residual above which the cameras are found without a pair, if the photographs stay
        /// connected without it. Of such pairs, only those that are overlaps for sure, and differ by up to three times
        /// as much, are still drawn and measured. Raise it to keep overlaps with parallax; lower it where a wrong pair
        /// bends the panorama.
        max_pair_rms_px: f64 = 10.0, between(0.5, 1000.0), "working px";
    }
}

impl CameraOptions {
    /// The kind of lens that is meant: beyond what any other can see, a fisheye.
    pub(super) fn kind_of_lens(&self) -> LensKind {
        match self.lens {
            LensKind::Auto if self.fov > WIDEST_RECTILINEAR_DEG => LensKind::Fisheye,
            kind => kind,
        }
    }

    /// What no single option's range can say: a field of view beyond what the kind of lens can see.
    pub fn beyond_the_lens(&self) -> Vec<InvalidOption> {
        let is_straight = matches!(self.lens, LensKind::Pinhole | LensKind::Rectilinear);
        if !is_straight || self.fov <= WIDEST_RECTILINEAR_DEG {
            return Vec::new();
        }
        let allowed = format!("0 to {WIDEST_RECTILINEAR_DEG} for cameras.lens = {}", self.lens.display());
        vec![InvalidOption { name: "cameras.fov".to_owned(), value: self.fov.display(), allowed }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_of_view_beyond_the_lens_is_named() {
        let wide = CameraOptions { lens: LensKind::Rectilinear, fov: 150.0, ..CameraOptions::default() };
        assert_eq!(
            wide.beyond_the_lens()[0].to_string(),
            "invalid cameras.fov = 150 (allowed: 0 to 118 for cameras.lens = rectilinear)"
        );
        let unsaid = CameraOptions { lens: LensKind::Auto, ..wide };
        assert!(unsaid.beyond_the_lens().is_empty());
        assert_eq!(unsaid.kind_of_lens(), LensKind::Fisheye);
    }
}
