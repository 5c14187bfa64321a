//! One view: a pinhole picture taken inside a panorama.

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::raster::Raster;
use trueup_core::{Result, StageContext};

use super::panorama::Panorama360;

/// A pinhole camera at the panorama's center.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PinholeView {
    /// Focal length and rotation, from the panorama's frame to the camera's.
    pub camera: Camera,
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
}

impl PinholeView {
    pub(super) fn new(width: usize, height: usize, focal_px: f64, camera_from_panorama: &Matrix3<f64>) -> Self {
        Self { camera: Camera::new(focal_px, width as f64, height as f64, camera_from_panorama), width, height }
    }

    /// Takes the picture: each pixel is the mean of at least `least_samples` x `least_samples` interpolated samples,
    /// and of more where the panorama is finer than that. `develop` is called once for every row and makes the bytes of
    /// its pixels from their colors, which are averaged as they are encoded.
    ///
    /// # Errors
    /// [`trueup_core::Error::Cancelled`].
    pub(super) fn take<F>(
        &self,
        panorama: &Panorama360,
        least_samples: usize,
        develop: impl Fn(usize) -> F + Sync,
        context: &StageContext,
    ) -> Result<Raster<u8>>
    where
        F: FnMut([f32; 3]) -> [u8; 3],
    {
        let samples = self.samples_per_side(panorama).max(least_samples);
        let panorama_from_camera = self.camera.rotation().transpose();
        let mut picture = Raster::new(self.width, self.height, 3);
        let rows = picture.data_mut().par_chunks_exact_mut(3 * self.width).enumerate();
        rows.try_for_each(|(y, row)| -> Result<()> {
            context.check_cancelled()?;
            let mut develop = develop(y);
            for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                let bearing = |dx: f64, dy: f64| self.camera.bearing(Vector2::new(x as f64 + dx, y as f64 + dy));
                *pixel = develop(mean_color(panorama, samples, |dx, dy| panorama_from_camera * bearing(dx, dy)));
            }
            Ok(())
        })?;
        Ok(picture)
    }

    /// Samples along a pixel's side that leave none of the panorama's pixels out in the middle of the view, where the
    /// view is coarsest.
    fn samples_per_side(&self, panorama: &Panorama360) -> usize {
        (panorama.pixels_per_radian() / self.camera.focal_px).ceil() as usize
    }
}

/// The mean over `samples` x `samples` places of a pixel, each in 0 to 1, that `direction` turns into directions.
fn mean_color(panorama: &Panorama360, samples: usize, direction: impl Fn(f64, f64) -> Vector3<f64>) -> [f32; 3] {
    let place = |index: usize| (index as f64 + 0.5) / samples as f64;
    let mut sum = [0.0_f32; 3];
    for down in 0..samples {
        for right in 0..samples {
            let color = panorama.color(&direction(place(right), place(down)));
            sum = std::array::from_fn(|channel| sum[channel] + color[channel]);
        }
    }
    sum.map(|value| value / (samples * samples) as f32)
}

/// A color as bytes, rounded.
pub(super) fn to_bytes(color: [f32; 3]) -> [u8; 3] {
    // The conversion truncates and saturates.
    color.map(|value| (value + 0.5) as u8)
}
