//! Gray pictures, read between their pixels.

use nalgebra::Vector2;
use trueup_core::raster::Raster;

/// Bilinear gray value; `None` outside the outermost pixels' centers.
pub(crate) fn gray_at(gray: &Raster<u8>, point: Vector2<f64>) -> Option<f64> {
    let (x, y) = (point.x - 0.5, point.y - 0.5);
    let inside = x >= 0.0 && y >= 0.0 && x < gray.width() as f64 - 1.0 && y < gray.height() as f64 - 1.0;
    if !inside {
        return None;
    }
    let (column, row) = (x as usize, y as usize);
    let (u, v) = (x - column as f64, y - row as f64);
    let channels = gray.channels();
    let along = |row: usize| {
        let pair = &gray.row(row)[column * channels..=(column + 1) * channels];
        f64::from(pair[0]) * (1.0 - u) + f64::from(pair[channels]) * u
    };
    Some(along(row) * (1.0 - v) + along(row + 1) * v)
}
