//! What a ray sees that leaves the scene, and the sun.

use nalgebra::Vector3;

use crate::color::{Rgb, mix, srgb};
use crate::noise::{edge, fractal_noise};

/// The sun: a small bright disc, so that shadows have a narrow soft edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sun {
    /// Unit vector from the scene to the sun.
    pub(crate) towards: Vector3<f64>,
    /// Irradiance on a surface that faces it.
    pub(crate) irradiance: Rgb,
}

/// Sine of the sun's angular radius; smaller than the true 0.0047, so that few samples make a clean edge.
pub(crate) const SUN_RADIUS: f64 = 0.003;

/// Sky with clouds, and a far line of trees below.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sky {
    pub(crate) seed: u32,
    /// Share of the sky under clouds, 0 to 1.
    pub(crate) clouds: f64,
    /// Radiance of the clear zenith's brightest channel.
    pub(crate) brightness: f64,
}

impl Sky {
    /// Radiance from a unit direction; `footprint` is the pixel's angle in radians.
    pub(crate) fn radiance(&self, direction: Vector3<f64>, footprint: f64) -> Rgb {
        let up = -direction.y;
        let sky = self.above(direction, up.max(0.0), footprint);
        // The height of the skyline runs round the horizon as noise on the unit circle.
        let level = direction.x.hypot(direction.z).max(1e-6);
        let round = Vector3::new(direction.x, 0.0, direction.z) / level;
        let skyline = 0.045 + 0.05 * fractal_noise(round * 3.0, 0.7, 7, 0.6, 3.0 * footprint, self.seed ^ 1);
        let trees = 1.0 - edge(up, skyline, footprint);
        if trees == 0.0 {
            return sky;
        }
        let crown = fractal_noise(direction * 40.0, 1.0, 5, 0.75, 40.0 * footprint, self.seed ^ 2);
        let haze = mix(srgb(0x4d_6138), srgb(0x8c_9c8c), (up / skyline.max(1e-3)).clamp(0.0, 1.0) * 0.5);
        let tree = haze * (1.0 + 0.75 * crown) * (0.55 * self.brightness);
        let field = mix(srgb(0x84_8a66), srgb(0xa8_a080), 0.5 + 0.5 * crown) * (0.55 * self.brightness);
        mix(sky, mix(tree, field, edge(-up, 0.015, 0.02)), trees)
    }

    fn above(&self, direction: Vector3<f64>, up: f64, footprint: f64) -> Rgb {
        let horizon = srgb(0xdc_e6ee) * (0.95 * self.brightness);
        let zenith = srgb(0x4f_86c6) * (0.9 * self.brightness);
        let clear = mix(horizon, zenith, (1.6 * up).min(1.0).sqrt());
        // Clouds lie on a plane overhead and crowd towards the horizon.
        let plane = Vector3::new(direction.x, 0.0, direction.z) / (up + 0.12);
        let blur = footprint / ((up + 0.12) * (up + 0.12));
        let body = fractal_noise(plane, 1.4, 8, 0.55, blur, self.seed);
        let cover = edge(body, 0.35 - 0.7 * self.clouds, 0.35);
        let shade = 0.82 + 0.35 * fractal_noise(plane + Vector3::new(0.13, 0.0, 0.07), 0.7, 6, 0.55, blur, self.seed);
        mix(clear, srgb(0xff_fcf6) * (1.05 * self.brightness * shade), 0.9 * cover * (6.0 * up).min(1.0))
    }
}
