//! The exposure that suits a scene.

use nalgebra::Vector3;

use super::lit::LitScene;
use super::viewpoint::round_about;
use crate::color::luminance;
use crate::trace::trace;

/// The gain that makes the brightness round the eye a middle gray, as a photographer would set it before a panorama.
pub(super) fn measure(scene: &LitScene) -> f64 {
    /// Tangents of the elevations looked at; negative is up.
    const ELEVATIONS: [f64; 5] = [-0.35, -0.15, 0.0, 0.15, 0.35];
    const MIDDLE_GRAY_INDOORS: f64 = 0.2;
    /// Lower, as the sky is much brighter than the rest.
    const MIDDLE_GRAY_OUTDOORS: f64 = 0.15;
    /// Angle over which brightness is measured, radians.
    const ANGLE: f64 = 0.02;
    let eye = Vector3::from(scene.viewpoint().eye);
    let (mut logarithms, mut count) = (0.0, 0.0);
    for direction in ELEVATIONS.into_iter().flat_map(round_about) {
        // Without soft sun and without mirrors.
        let light = trace(scene, eye, direction, ANGLE, [0.0, 0.0], 0);
        logarithms += luminance(light).max(1e-3).ln();
        count += 1.0;
    }
    let gray = if scene.unlit.is_outdoors() { MIDDLE_GRAY_OUTDOORS } else { MIDDLE_GRAY_INDOORS };
    gray / (logarithms / count).exp()
}
