//! Turns stored pixels upright.

use trueup_core::raster::Raster;

/// Side of the square blocks in which a quarter turn walks the picture, so that the reads of one block stay in cache.
const BLOCK: usize = 32;

/// The picture as EXIF orientation `tag` (1 to 8) wants it displayed; other tags leave it as it is.
///
/// # Source
/// TIFF 6.0 section 8 (Orientation); EXIF 3.0 section 4.6.5.1.
pub(crate) fn upright<T: Copy + Default>(stored: Raster<T>, tag: u8) -> Raster<T> {
    match stored.channels() {
        _ if !(2..=8).contains(&tag) => stored,
        1 => rearranged::<T, 1>(&stored, tag),
        3 => rearranged::<T, 3>(&stored, tag),
        4 => rearranged::<T, 4>(&stored, tag),
        _ => stored,
    }
}

fn rearranged<T: Copy + Default, const CHANNELS: usize>(stored: &Raster<T>, tag: u8) -> Raster<T> {
    let (stored_width, stored_height) = (stored.width(), stored.height());
    let quarter_turn = tag >= 5;
    let (width, height) = if quarter_turn { (stored_height, stored_width) } else { (stored_width, stored_height) };
    // Tags that run the stored columns, and the stored rows, from their far end.
    let columns_reversed = matches!(tag, 2 | 3 | 7 | 8);
    let rows_reversed = matches!(tag, 3 | 4 | 6 | 7);

    let (source, _) = stored.data().as_chunks::<CHANNELS>();
    let mut upright = Raster::new(width, height, CHANNELS);
    let (target, _) = upright.data_mut().as_chunks_mut::<CHANNELS>();
    let block = if quarter_turn { BLOCK } else { width.max(1) };
    for block_y in (0..height).step_by(BLOCK) {
        for block_x in (0..width).step_by(block) {
            for y in block_y..(block_y + BLOCK).min(height) {
                for x in block_x..(block_x + block).min(width) {
                    let (column, row) = if quarter_turn { (y, x) } else { (x, y) };
                    let column = if columns_reversed { stored_width - 1 - column } else { column };
                    let row = if rows_reversed { stored_height - 1 - row } else { row };
                    target[y * width + x] = source[row * stored_width + column];
                }
            }
        }
    }
    upright
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The letter F in 2 x 3 pixels of its own, as every tag's display must show it.
    ///
    /// `stored[tag - 1]` is what a camera holding the F under that tag stores, written down from the table of the TIFF
    /// specification: which side of the display the stored row 0 and column 0 are.
    #[test]
    fn all_eight_tags_give_the_same_upright_picture() {
        let upright_f = [1, 2, 3, 4, 5, 6];
        let stored: [(usize, [u8; 6]); 8] = [
            (2, [1, 2, 3, 4, 5, 6]), // row 0 top, column 0 left
            (2, [2, 1, 4, 3, 6, 5]), // top, right
            (2, [6, 5, 4, 3, 2, 1]), // bottom, right
            (2, [5, 6, 3, 4, 1, 2]), // bottom, left
            (3, [1, 3, 5, 2, 4, 6]), // left, top
            (3, [2, 4, 6, 1, 3, 5]), // right, top
            (3, [6, 4, 2, 5, 3, 1]), // right, bottom
            (3, [5, 3, 1, 6, 4, 2]), // left, bottom
        ];
        for (index, (width, data)) in stored.into_iter().enumerate() {
            let raster = Raster::from_data(width, 6 / width, 1, data.to_vec()).expect("six samples");
            let shown = upright(raster, index as u8 + 1);
            assert_eq!((shown.width(), shown.height()), (2, 3), "tag {}", index + 1);
            assert_eq!(shown.data(), upright_f, "tag {}", index + 1);
        }
    }

    #[test]
    fn channels_stay_together_over_block_borders() {
        let (width, height) = (2 * BLOCK + 3, BLOCK + 1);
        let data: Vec<u16> = (0..width * height).flat_map(|pixel| [pixel as u16; 3]).collect();
        let raster = Raster::from_data(width, height, 3, data).expect("matching size");
        let turned = upright(raster.clone(), 6);
        assert_eq!(turned.pixel(0, 0), raster.pixel(0, height - 1));
        assert_eq!(turned.pixel(height - 1, width - 1), raster.pixel(width - 1, 0));
        // Tag 8 undoes tag 6.
        assert_eq!(upright(turned, 8), raster);
    }
}
