//! What lies beside a segment, compared between two photographs.

use nalgebra::Vector2;
use trueup_core::raster::Raster;

use crate::gray::gray_at;

/// Sections along a stretch.
const SECTIONS: usize = 4;
/// Points averaged in a section.
const POINTS: usize = 4;
/// Bands on each side.
const BANDS: usize = 5;
/// Distance of the bands' middles.
const BAND_PX: f64 = 2.0;
/// Values that describe a stretch: sections of bands.
const VALUES: usize = SECTIONS * 2 * BANDS;

/// The same stretch of an edge in two photographs, from its first to its last point.
pub(super) struct Stretch {
    pub(super) a: [Vector2<f64>; 2],
    pub(super) b: [Vector2<f64>; 2],
}

/// Normalized correlation of what lies beside the stretch in both photographs, -1 to 1; `None` where it leaves one or
/// has no contrast.
pub(super) fn likeness(a: &Raster<u8>, b: &Raster<u8>, stretch: &Stretch) -> Option<f64> {
    let (a, b) = (centered(strip(a, stretch.a)?)?, centered(strip(b, stretch.b)?)?);
    Some(a.iter().zip(&b).map(|(a, b)| a * b).sum())
}

/// Mean gray values of the bands of every section.
fn strip(gray: &Raster<u8>, [start, end]: [Vector2<f64>; 2]) -> Option<[f64; VALUES]> {
    let along = (end - start).try_normalize(f64::EPSILON)?;
    let across = Vector2::new(-along.y, along.x);
    let mut values = [0.0; VALUES];
    for (section, bands) in values.chunks_mut(2 * BANDS).enumerate() {
        for point in 0..POINTS {
            let share = ((section * POINTS + point) as f64 + 0.5) / (SECTIONS * POINTS) as f64;
            let middle = start.lerp(&end, share);
            for (band, value) in bands.iter_mut().enumerate() {
                let offset = (band as f64 - BANDS as f64 + 0.5) * BAND_PX;
                *value += gray_at(gray, middle + across * offset)? / POINTS as f64;
            }
        }
    }
    Some(values)
}

/// Mean 0 and length 1; `None` if all are nearly equal.
fn centered(values: [f64; VALUES]) -> Option<[f64; VALUES]> {
    /// Least standard deviation, gray levels.
    const FLAT: f64 = 2.0;
    let mean = values.iter().sum::<f64>() / VALUES as f64;
    let norm = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>().sqrt();
    (norm >= FLAT * (VALUES as f64).sqrt()).then(|| values.map(|value| (value - mean) / norm))
}
