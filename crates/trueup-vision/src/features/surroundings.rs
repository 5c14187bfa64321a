//! What surrounds the points of a photograph, by which matches are placed more exactly than points are found.

use trueup_core::raster::Raster;

/// Shares of a sample and its two neighbors, in quarters.
const WEIGHTS: [f32; 3] = [1.0, 2.0, 1.0];

/// The picture in eight bits, smoothed by a quarter, a half and a quarter along both axes: little enough to keep what
/// tells a place, and enough that what lies between samples is nearly linear. Beyond its border, it goes on as at the
/// border.
pub(super) fn smoothed(picture: &Raster<f32>) -> Raster<u8> {
    let (width, height) = (picture.width(), picture.height());
    let mut smooth = Raster::new(width, height, 1);
    if width == 0 || height == 0 {
        return smooth;
    }
    let [before, own, after] = WEIGHTS;
    let mut column_sums = vec![0.0_f32; width + 2];
    for y in 0..height {
        let [above, at, below] = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| picture.row(y));
        for (x, sum) in column_sums[1..=width].iter_mut().enumerate() {
            *sum = before * above[x] + own * at[x] + after * below[x];
        }
        column_sums[0] = column_sums[1];
        column_sums[width + 1] = column_sums[width];
        for (smooth, sums) in smooth.row_mut(y).iter_mut().zip(column_sums.windows(3)) {
            // The cast saturates.
            *smooth = ((before * sums[0] + own * sums[1] + after * sums[2]) / 16.0 + 0.5) as u8;
        }
    }
    smooth
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One pixel of 160: a quarter, an eighth beside and a sixteenth aslant; in a corner the border counts again.
    #[test]
    fn a_pixel_goes_to_its_neighbors() {
        let mut picture = Raster::new(5, 4, 1);
        picture.pixel_mut(2, 1)[0] = 160.0;
        let smooth = smoothed(&picture);
        assert_eq!(smooth.row(0), [0, 10, 20, 10, 0]);
        assert_eq!(smooth.row(1), [0, 20, 40, 20, 0]);
        assert_eq!(smooth.row(3), [0; 5]);
        picture.pixel_mut(2, 1)[0] = 0.0;
        picture.pixel_mut(0, 0)[0] = 160.0;
        assert_eq!(smoothed(&picture).row(0), [90, 30, 0, 0, 0]);
        assert!(smoothed(&Raster::new(0, 0, 1)).data().is_empty());
        let flat = Raster::from_data(3, 3, 1, vec![254.6; 9]).expect("nine samples");
        assert_eq!(smoothed(&flat).data(), [255; 9]);
    }
}
