//! What of a picture lies beside the photograph in it: the frame around a print, the bars above and below a film.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::raster::{Photograph, Raster};

/// Columns and rows of a picture between its sides and the photograph in it, as the picture is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub struct Inset {
    /// Columns at the left.
    pub left: usize,
    /// Rows at the top.
    pub top: usize,
    /// Columns at the right.
    pub right: usize,
    /// Rows at the bottom.
    pub bottom: usize,
}

impl Inset {
    /// Columns and rows at the left, top, right and bottom.
    pub fn sides(&self) -> [usize; 4] {
        let Self { left, top, right, bottom } = *self;
        [left, top, right, bottom]
    }

    /// The inset of so many columns and rows at the left, top, right and bottom.
    pub fn from_sides([left, top, right, bottom]: [usize; 4]) -> Self {
        Self { left, top, right, bottom }
    }

    /// The inset whose every side is what `of` makes of this one's.
    #[must_use]
    pub fn map(self, of: impl FnMut(usize) -> usize) -> Self {
        Self::from_sides(self.sides().map(of))
    }

    /// Whether the photograph is the whole picture.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Width and height of the photograph in a picture of `size` pixels; `None` if nothing is left of it.
    pub fn inner(&self, [width, height]: [usize; 2]) -> Option<[usize; 2]> {
        let within = |length: usize, before: usize, after: usize| {
            length.checked_sub(before)?.checked_sub(after).filter(|&inner| inner > 0)
        };
        Some([within(width, self.left, self.right)?, within(height, self.top, self.bottom)?])
    }

    /// Width and height of the picture around a photograph of `size` pixels.
    pub fn outer(&self, [width, height]: [usize; 2]) -> [usize; 2] {
        let around = |length: usize, before: usize, after: usize| length.saturating_add(before).saturating_add(after);
        [around(width, self.left, self.right), around(height, self.top, self.bottom)]
    }

    /// From the picture's middle to the photograph's: columns to the right and rows down, in pixels.
    pub fn offset(&self) -> [f64; 2] {
        let half = |before: usize, after: usize| 0.5 * (before as f64 - after as f64);
        [half(self.left, self.right), half(self.top, self.bottom)]
    }

    /// The inset of the picture turned clockwise by so many quarters.
    #[must_use]
    pub fn turned(self, quarters: u8) -> Self {
        let mut sides = self.sides();
        sides.rotate_right(usize::from(quarters % 4));
        Self::from_sides(sides)
    }

    /// The photograph in `picture`.
    ///
    /// # Errors
    /// [`Error::Input`] if nothing is left of it.
    pub fn cut(&self, picture: Photograph) -> Result<Photograph> {
        if self.is_none() {
            return Ok(picture);
        }
        Ok(match picture {
            Photograph::Eight(raster) => Photograph::Eight(self.cut_raster(&raster)?),
            Photograph::Sixteen(raster) => Photograph::Sixteen(self.cut_raster(&raster)?),
        })
    }

    /// The photograph in a picture of any samples.
    ///
    /// # Errors
    /// [`Error::Input`] if nothing is left of it.
    pub fn cut_raster<T: Copy + Default>(&self, picture: &Raster<T>) -> Result<Raster<T>> {
        let size = [picture.width(), picture.height()];
        let [width, height] = self.inner(size).ok_or_else(|| {
            let subject = format!("picture of {} x {} px", size[0], size[1]);
            Error::input(
                subject,
                format!("nothing is left of it inside {self:?}"),
                "Give the picture that was measured.",
            )
        })?;
        let channels = picture.channels();
        let columns = self.left * channels..(self.left + width) * channels;
        let rows = self.top..self.top + height;
        let samples = rows.flat_map(|row| &picture.row(row)[columns.clone()]).copied().collect();
        Raster::from_data(width, height, channels, samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNEVEN: Inset = Inset { left: 1, top: 2, right: 3, bottom: 4 };

    #[test]
    fn a_photograph_is_cut_out_of_its_frame() {
        let picture = Raster::from_data(6, 8, 1, (0..48).collect::<Vec<u8>>()).expect("48 samples");
        let cut = UNEVEN.cut_raster(&picture).expect("a photograph");
        // Rows 2 and 3 of six, columns 1 and 2.
        assert_eq!(([cut.width(), cut.height()], cut.data()), ([2, 2], [13, 14, 19, 20].as_slice()));
        assert_eq!(UNEVEN.inner([6, 8]), Some([2, 2]));
        assert_eq!(UNEVEN.outer([2, 2]), [6, 8]);
        assert_eq!(UNEVEN.offset(), [-1.0, -1.0]);
        assert_eq!(UNEVEN.inner([4, 8]), None);
        assert!(UNEVEN.cut_raster(&Raster::<u8>::new(4, 8, 1)).is_err());
    }

    #[test]
    fn what_is_turned_four_times_is_the_same() {
        assert_eq!(UNEVEN.turned(1), Inset { left: 4, top: 1, right: 2, bottom: 3 });
        let turned = (0..4).fold(UNEVEN, |inset, _| inset.turned(1));
        assert_eq!(turned, UNEVEN);
        assert_eq!((UNEVEN.turned(1).turned(1), UNEVEN.turned(2).turned(1)), (UNEVEN.turned(2), UNEVEN.turned(3)));
    }
}
