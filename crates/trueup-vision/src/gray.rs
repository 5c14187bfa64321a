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

/// The picture at half its size: means of two by two samples; an odd last row or column is left out.
pub(crate) fn halved<T: Copy + Default + Into<f32>>(picture: &Raster<T>) -> Raster<f32> {
    let mut half = Raster::new(picture.width() / 2, picture.height() / 2, 1);
    for y in 0..half.height() {
        let [upper, lower] = [2 * y, 2 * y + 1].map(|y| picture.row(y));
        let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
        for (mean, (upper, lower)) in half.row_mut(y).iter_mut().zip(pairs) {
            *mean = 0.25 * (upper[0].into() + upper[1].into() + lower[0].into() + lower[1].into());
        }
    }
    half
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_of_the_half_is_the_mean_of_four() {
        let samples = [1_u8, 3, 0, 0, 9, 5, 8, 0, 1, 9, 7, 7, 7, 7, 7];
        let half = halved(&Raster::from_data(5, 3, 1, samples.to_vec()).expect("15 samples"));
        assert_eq!((half.width(), half.height(), half.data()), (2, 1, &[4.25, 0.25][..]));
        assert!(halved(&Raster::<u8>::new(0, 0, 1)).data().is_empty());
    }
}
