//! From a scene and a camera to a photograph.

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::raster::Raster;

use crate::bvh::Ray;
use crate::color::{Rgb, encode, luminance};
use crate::dice::{mix, unit_of};
use crate::rig::PosedCamera;
use crate::scene::lit::LitScene;
use crate::trace::{trace, trace_surface};

trueup_core::choice! {
    /// How carefully a picture is rendered.
    pub enum Quality {
        /// One sample a pixel, no reflections: for tests.
        Preview = "preview",
        /// One sample a pixel, and four instead where a surface ends; no reflections: for statistics over many sets.
        Draft = "draft",
        /// One sample a pixel, and four instead where a surface, a shadow or a drawn line ends.
        Standard = "standard",
        /// Nine samples a pixel.
        Fine = "fine",
    }
}

impl Quality {
    /// Samples along each side of a pixel that gets many.
    fn side(self) -> usize {
        match self {
            Self::Preview => 1,
            Self::Draft | Self::Standard => 2,
            Self::Fine => 3,
        }
    }

    /// For those that give one sample to pixels amid even ones: the step of tone, of 1, up to which one surface is
    /// even. Steps below that of [`Quality::Standard`] are lost in grain and texture.
    fn even_step(self) -> Option<f64> {
        match self {
            Self::Draft => Some(f64::INFINITY),
            Self::Standard => Some(0.07),
            Self::Preview | Self::Fine => None,
        }
    }

    /// How often a ray may be mirrored.
    fn mirrors(self) -> u32 {
        match self {
            Self::Preview | Self::Draft => 0,
            Self::Standard | Self::Fine => 1,
        }
    }
}

/// Renders the photograph that `posed` takes of the scene: 8-bit sRGB, `width` x `height` x 3.
///
/// Bytes are the same for any number of threads on one build; the mathematics library (sine, power) may change a last
/// digit from one platform to another.
pub fn render(scene: &LitScene, posed: &PosedCamera, quality: Quality) -> Raster<u8> {
    let mut picture = Raster::new(posed.width, posed.height, 3);
    if posed.width == 0 || posed.height == 0 {
        return picture;
    }
    let eye = Eye::new(posed);
    let step = quality.even_step();
    let glances = step.map_or_else(Vec::new, |_| eye.glances(scene, quality));
    let step = step.unwrap_or_default();
    let row_length = 3 * posed.width;
    picture.data_mut().par_chunks_mut(row_length).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
            let light = match glances.get(y * posed.width + x) {
                Some(glance) if is_even(&glances, x, y, posed.width, step) => glance.light,
                _ => eye.pixel(scene, x, y, quality),
            };
            let shade = posed.shade.gain(&eye.direction(x as f64 + 0.5, y as f64 + 0.5));
            pixel.copy_from_slice(&develop(light * scene.exposure * shade, posed, x, y));
        }
    });
    picture
}

/// What one sample through a pixel's center shows.
#[derive(Debug, Clone, Copy)]
struct Glance {
    light: Rgb,
    /// Body and face, or sky.
    surface: u64,
    /// Perceived brightness, 0 to 1.
    tone: f64,
}

/// Whether a pixel shows the same surface as its four neighbors and is about as bright: then one sample will do,
/// as textures are filtered to the pixel.
fn is_even(glances: &[Glance], x: usize, y: usize, width: usize, step: f64) -> bool {
    let index = y * width + x;
    let here = &glances[index];
    let even = |other: usize| {
        glances.get(other).is_none_or(|other| other.surface == here.surface && (other.tone - here.tone).abs() < step)
    };
    (x == 0 || even(index - 1))
        && (x + 1 == width || even(index + 1))
        && (y == 0 || even(index - width))
        && even(index + width)
}

/// Depth along the optical axis, metres, through every pixel's center; infinite where there is only sky.
pub(crate) fn depth_map(scene: &LitScene, posed: &PosedCamera) -> Raster<f32> {
    let mut depths = Raster::new(posed.width, posed.height, 1);
    if posed.width == 0 || posed.height == 0 {
        return depths;
    }
    let eye = Eye::new(posed);
    depths.data_mut().par_chunks_mut(posed.width).enumerate().for_each(|(y, row)| {
        for (x, depth) in row.iter_mut().enumerate() {
            let ray = Ray::new(eye.center, eye.direction(x as f64 + 0.5, y as f64 + 0.5));
            let hit = scene.unlit.hierarchy.nearest(&ray, f64::INFINITY);
            *depth = hit.map_or(f32::INFINITY, |(_, entry)| (entry.distance * ray.direction.dot(&eye.axis)) as f32);
        }
    });
    depths
}

/// A camera with what every pixel needs precomputed.
struct Eye {
    center: Vector3<f64>,
    axis: Vector3<f64>,
    posed: PosedCamera,
    world_from_camera: nalgebra::Matrix3<f64>,
}

impl Eye {
    fn new(posed: &PosedCamera) -> Self {
        let world_from_camera = posed.camera.rotation().transpose();
        let axis = world_from_camera * Vector3::z();
        Self { center: Vector3::from(posed.center), axis, posed: *posed, world_from_camera }
    }

    fn direction(&self, x: f64, y: f64) -> Vector3<f64> {
        (self.world_from_camera * self.posed.camera.bearing(Vector2::new(x, y))).normalize()
    }

    /// One sample through every pixel's center.
    fn glances(&self, scene: &LitScene, quality: Quality) -> Vec<Glance> {
        /// Textures are filtered to this share of a pixel: narrower than one sample's place would deserve, as sharp as
        /// what four samples show.
        const SHARPNESS: f64 = 0.7;
        const BRIGHTEST: f64 = 6.0;
        let angle = SHARPNESS / self.posed.camera.focal_px;
        (0..self.posed.height * self.posed.width)
            .into_par_iter()
            .map(|index| {
                let (x, y) = (index % self.posed.width, index / self.posed.width);
                let direction = self.direction(x as f64 + 0.5, y as f64 + 0.5);
                let (light, surface) =
                    trace_surface(scene, self.center, direction, angle, [0.0, 0.0], quality.mirrors());
                let light = light.map(|channel| channel.min(BRIGHTEST / scene.exposure));
                let tone = (luminance(light) * scene.exposure).clamp(0.0, 1.0).sqrt();
                Glance { light, surface, tone }
            })
            .collect()
    }

    /// Mean light over a pixel: a grid of samples, slightly turned so that all rows and columns differ.
    fn pixel(&self, scene: &LitScene, x: usize, y: usize, quality: Quality) -> Rgb {
        let side = quality.side();
        let count = side * side;
        let angle = 1.0 / (self.posed.camera.focal_px * side as f64);
        let turn = std::f64::consts::TAU * unit_of(mix((x as u64) << 32 | y as u64));
        let mut sum = Rgb::zeros();
        for k in 0..count {
            let (u, v) = ((k % side) as f64, (k / side) as f64);
            let middle = (side as f64 - 1.0) / 2.0;
            let slant = 1.0 / side as f64;
            let dx = (u + 0.5 + (v - middle) * slant) / side as f64;
            let dy = (v + 0.5 - (u - middle) * slant) / side as f64;
            let direction = self.direction(x as f64 + dx, y as f64 + dy);
            // A spiral over the sun's disc, turned from pixel to pixel.
            let radius = ((k as f64 + 0.5) / count as f64).sqrt();
            let (sine, cosine) = (turn + 2.4 * k as f64).sin_cos();
            let light =
                trace(scene, self.center, direction, angle, [radius * cosine, radius * sine], quality.mirrors());
            // A very bright spot must not outshine the rest of its pixel: bounded as film bounds it.
            const BRIGHTEST: f64 = 6.0;
            sum += light.map(|channel| (channel * scene.exposure).min(BRIGHTEST));
        }
        sum / (count as f64 * scene.exposure)
    }
}

/// Exposure, vignetting, tone curve, noise and quantization of one pixel.
fn develop(light: Rgb, posed: &PosedCamera, x: usize, y: usize) -> [u8; 3] {
    let (cx, cy) = (posed.width as f64 / 2.0, posed.height as f64 / 2.0);
    let (dx, dy) = (x as f64 + 0.5 - cx, y as f64 + 0.5 - cy);
    let falloff = 1.0 - posed.vignetting * (dx * dx + dy * dy) / (cx * cx + cy * cy);
    let pixel = mix(posed.seed ^ mix(y as u64 * posed.width as u64 + x as u64));
    std::array::from_fn(|channel| {
        let exposed = light[channel] * posed.exposure * posed.white_balance[channel] * falloff;
        let value = 255.0 * encode(shoulder(exposed)) + posed.noise * grain(pixel, channel as u64);
        (value + 0.5).clamp(0.0, 255.0) as u8
    })
}

/// A film's answer: straight up to the knee, then a long smooth shoulder that reaches 1 only in the limit.
fn shoulder(linear: f64) -> f64 {
    const KNEE: f64 = 0.4;
    const REST: f64 = 1.0 - KNEE;
    if linear <= KNEE { linear.max(0.0) } else { 1.0 - REST / (1.0 + (linear - KNEE) / REST) }
}

/// Noise of standard deviation 1: the sum of four uniforms, scaled.
fn grain(pixel: u64, channel: u64) -> f64 {
    let bits = mix(pixel.wrapping_add(channel));
    let sum: f64 = (0..4).map(|k| ((bits >> (16 * k)) & 0xffff) as f64 / 65536.0).sum();
    // Each uniform has variance 1/12.
    (sum - 2.0) * 3.0_f64.sqrt()
}
