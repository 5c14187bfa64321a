//! How alike two photographs look where both lie on the panorama.

use trueup_core::raster::Raster;

use super::overlap_pixels::{OverlapPixels, WHITE, eroded};
use super::similarity_index;

/// Side of the windows whose correlation is taken, pixels.
const WINDOW: usize = 3;
/// Standard deviation of the gray values below which a window has no texture to correlate.
const FLAT: f64 = 1.0;

/// How alike two photographs look in their overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverlapMeasures {
    /// |Omega|: pixels that both cover, without those at the overlap's border.
    pub pixels: usize,
    /// Root mean square over windows of 1 - NCC (normalized cross correlation of 3 x 3 pixels), 0 to 2.
    pub ncc_rmse: f64,
    /// Its square.
    pub ncc_mse: f64,
    /// Mean square difference of the gray values.
    pub intensity_mse: f64,
    /// Peak signal to noise ratio after evening out the brightness, decibels; `None` if they are equal.
    pub psnr_db: Option<f64>,
    /// Mean structural similarity after evening out the brightness, at most 1; `None` where no window of 11 x 11 pixels
    /// lies in the overlap.
    pub ssim: Option<f64>,
}

impl OverlapPixels<'_> {
    /// Measures the overlap. `None` if the sizes differ, if there is no overlap, or if there is no texture in it.
    ///
    /// Windows that are flat in both photographs are passed over; one that is flat in one of them only counts as
    /// uncorrelated. For PSNR and SSIM both photographs are first brought to the geometric mean of their mean gray
    /// values.
    ///
    /// # Source
    /// Seam-guided and direct alignment papers for the NCC measure; Wang, Bovik, Sheikh, Simoncelli, Image Quality
    /// Assessment: From Error Visibility to Structural Similarity, 2004, for SSIM.
    pub fn measure(&self) -> Option<OverlapMeasures> {
        let (width, height) = (self.covered.width(), self.covered.height());
        let fits = |gray: &Raster<f32>| (gray.width(), gray.height(), gray.channels()) == (width, height, 1);
        if !fits(self.a) || !fits(self.b) || self.covered.channels() != 1 {
            return None;
        }
        let inside = eroded(self.covered, WINDOW / 2);
        let pixels = inside.data().iter().filter(|&&inside| inside).count();
        let ncc_mse = self.ncc_mse(&inside)?;
        let intensity_mse = self.mean_square_difference(&inside, [1.0, 1.0]);
        let gains = self.gains(&inside);
        let compensated = self.mean_square_difference(&inside, gains);
        let psnr_db = (compensated > 0.0).then(|| 10.0 * (WHITE * WHITE / compensated).log10());
        let ssim = similarity_index::mean(self, gains);
        Some(OverlapMeasures { pixels, ncc_rmse: ncc_mse.sqrt(), ncc_mse, intensity_mse, psnr_db, ssim })
    }

    /// Factors that bring both photographs to the geometric mean of their mean gray values; 1 if one is black.
    fn gains(&self, inside: &Raster<bool>) -> [f64; 2] {
        let sum = |gray: &Raster<f32>| -> f64 {
            gray.data().iter().zip(inside.data()).filter(|&(_, &inside)| inside).map(|(&gray, _)| f64::from(gray)).sum()
        };
        let ratio = sum(self.b) / sum(self.a);
        if ratio.is_finite() && ratio > 0.0 { [ratio.sqrt(), 1.0 / ratio.sqrt()] } else { [1.0, 1.0] }
    }

    fn mean_square_difference(&self, inside: &Raster<bool>, gains: [f64; 2]) -> f64 {
        let (mut sum, mut count) = (0.0, 0_usize);
        for ((&a, &b), &inside) in self.a.data().iter().zip(self.b.data()).zip(inside.data()) {
            if inside {
                sum += (gains[0] * f64::from(a) - gains[1] * f64::from(b)).powi(2);
                count += 1;
            }
        }
        sum / count.max(1) as f64
    }

    /// Mean of (1 - NCC)^2 over the windows with texture; `None` without any.
    fn ncc_mse(&self, inside: &Raster<bool>) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0_usize);
        for y in 0..inside.height() {
            for x in (0..inside.width()).filter(|&x| inside.pixel(x, y)[0]) {
                let (a, b) = (window(self.a, x, y), window(self.b, x, y));
                let correlation = match (centered(&a), centered(&b)) {
                    (None, None) => continue,
                    (Some(a), Some(b)) => a.iter().zip(&b).map(|(a, b)| a * b).sum(),
                    _ => 0.0,
                };
                sum += (1.0_f64 - correlation).powi(2);
                count += 1;
            }
        }
        (count > 0).then(|| sum / count as f64)
    }
}

/// The 3 x 3 gray values around a pixel that is not on the raster's border.
fn window(gray: &Raster<f32>, x: usize, y: usize) -> [f64; WINDOW * WINDOW] {
    std::array::from_fn(|k| f64::from(gray.pixel(x + k % WINDOW - WINDOW / 2, y + k / WINDOW - WINDOW / 2)[0]))
}

/// A window of mean 0 and length 1; `None` if it is flat.
fn centered(window: &[f64; WINDOW * WINDOW]) -> Option<[f64; WINDOW * WINDOW]> {
    let count = window.len() as f64;
    let mean = window.iter().sum::<f64>() / count;
    let norm = window.iter().map(|value| (value - mean).powi(2)).sum::<f64>().sqrt();
    (norm >= FLAT * count.sqrt()).then(|| window.map(|value| (value - mean) / norm))
}

/// The means of several overlaps' measures, weighted by their pixels; `None` without any.
///
/// `pixels` is their sum. Overlaps without a PSNR or an SSIM are left out of that mean; `ncc_mse` is the mean of the
/// overlaps' own and so not the square of `ncc_rmse`.
pub fn mean_over_overlaps(overlaps: &[OverlapMeasures]) -> Option<OverlapMeasures> {
    let mean = |value: &dyn Fn(&OverlapMeasures) -> Option<f64>| {
        let (sum, weight) = overlaps.iter().fold((0.0, 0.0), |(sum, weight), one| match value(one) {
            Some(value) => (sum + value * one.pixels as f64, weight + one.pixels as f64),
            None => (sum, weight),
        });
        (weight > 0.0).then(|| sum / weight)
    };
    Some(OverlapMeasures {
        pixels: overlaps.iter().map(|one| one.pixels).sum(),
        ncc_rmse: mean(&|one| Some(one.ncc_rmse))?,
        ncc_mse: mean(&|one| Some(one.ncc_mse))?,
        intensity_mse: mean(&|one| Some(one.intensity_mse))?,
        psnr_db: mean(&|one| one.psnr_db),
        ssim: mean(&|one| one.ssim),
    })
}

#[cfg(test)]
#[path = "overlap_tests.rs"]
mod tests;
