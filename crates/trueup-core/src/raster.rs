//! Pixels in memory: interleaved channels, rows from top to bottom.

use std::ops::Range;

use crate::error::{Error, Result};

/// Rec. 601 luma weights of red, green and blue, applied to encoded values.
///
/// # Source
/// ITU-R BT.601-7, section 2.5.1.
pub const LUMA: [f32; 3] = [0.299, 0.587, 0.114];

/// [`LUMA`] of encoded red, green and blue in 256ths of a level, by whole numbers: off by less than half a level.
#[inline]
pub fn luma_256ths([red, green, blue]: [u8; 3]) -> u32 {
    77 * u32::from(red) + 150 * u32::from(green) + 29 * u32::from(blue)
}

/// A picture of `width` x `height` pixels with `channels` interleaved samples each.
///
/// Sample `c` of the pixel whose center is at (x + 0.5, y + 0.5) is `data[(y * width + x) * channels + c]`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Raster<T> {
    width: usize,
    height: usize,
    channels: usize,
    data: Vec<T>,
}

impl<T: Copy + Default> Raster<T> {
    /// A picture filled with `T::default()` (zero for numbers).
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        Self { width, height, channels, data: vec![T::default(); width * height * channels] }
    }

    /// Wraps samples that are already in memory.
    ///
    /// # Errors
    /// [`Error::Input`] if `data` does not hold `width * height * channels` samples.
    pub fn from_data(width: usize, height: usize, channels: usize, data: Vec<T>) -> Result<Self> {
        let expected = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(channels));
        if expected != Some(data.len()) {
            return Err(Error::input(
                format!("raster of {width} x {height} x {channels}"),
                format!("{} samples were given", data.len()),
                "Give width * height * channels samples.",
            ));
        }
        Ok(Self { width, height, channels, data })
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Samples per pixel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// All samples, row by row, channels interleaved.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All samples for writing.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Takes the samples out.
    pub fn into_data(self) -> Vec<T> {
        self.data
    }

    /// The samples of row `y`, `width * channels` of them.
    pub fn row(&self, y: usize) -> &[T] {
        let length = self.width * self.channels;
        &self.data[y * length..(y + 1) * length]
    }

    /// The samples of row `y` for writing.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        let length = self.width * self.channels;
        &mut self.data[y * length..(y + 1) * length]
    }

    /// The samples of pixel (x, y).
    pub fn pixel(&self, x: usize, y: usize) -> &[T] {
        let start = (y * self.width + x) * self.channels;
        &self.data[start..start + self.channels]
    }

    /// The samples of pixel (x, y) for writing.
    pub fn pixel_mut(&mut self, x: usize, y: usize) -> &mut [T] {
        let start = (y * self.width + x) * self.channels;
        &mut self.data[start..start + self.channels]
    }
}

impl<T: Copy> Raster<T> {
    /// See [`Photograph::some_rows`].
    fn some_rows(&self, rows: Range<usize>) -> Self {
        let end = rows.end.min(self.height);
        let start = rows.start.min(end);
        let samples = self.width * self.channels;
        Self { height: end - start, data: self.data[start * samples..end * samples].to_vec(), ..*self }
    }
}

impl<T: Copy + PartialEq> Raster<T> {
    /// See [`Photograph::without_full_alpha`]; `full` is what is opaque.
    fn without_full_alpha(mut self, full: T) -> Self {
        const RGBA: usize = 4;
        let (pixels, _) = self.data.as_chunks::<RGBA>();
        if self.channels != RGBA || !pixels.iter().all(|pixel| pixel[3] == full) {
            return self;
        }
        // In place: there may be no room for both.
        for pixel in 0..pixels.len() {
            self.data.copy_within(RGBA * pixel..RGBA * pixel + RGBA - 1, (RGBA - 1) * pixel);
        }
        self.channels = RGBA - 1;
        self.data.truncate(self.width * self.height * self.channels);
        self.data.shrink_to_fit();
        self
    }
}

/// A decoded photograph at its own depth: 8 or 16 bits a sample, 1 (gray), 3 (RGB) or 4 (RGBA) channels, sRGB-like
/// encoding, already in its upright orientation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Photograph {
    /// 8 bits a sample, 0 to 255.
    Eight(Raster<u8>),
    /// 16 bits a sample, 0 to 65535.
    Sixteen(Raster<u16>),
}

impl Photograph {
    /// Width in pixels.
    pub fn width(&self) -> usize {
        match self {
            Self::Eight(raster) => raster.width(),
            Self::Sixteen(raster) => raster.width(),
        }
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        match self {
            Self::Eight(raster) => raster.height(),
            Self::Sixteen(raster) => raster.height(),
        }
    }

    /// Bytes that its samples take.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Eight(raster) => size_of_val(raster.data()),
            Self::Sixteen(raster) => size_of_val(raster.data()),
        }
    }

    /// Bits of a sample: 8 or 16.
    pub fn sample_bits(&self) -> u16 {
        match self {
            Self::Eight(_) => 8,
            Self::Sixteen(_) => 16,
        }
    }

    /// Whether it has an alpha channel, so that parts of it may be transparent.
    pub fn has_alpha(&self) -> bool {
        self.channels() == 4
    }

    /// The same without an alpha channel through which nothing shows anywhere; one through which something does stays.
    #[must_use]
    pub fn without_full_alpha(self) -> Self {
        match self {
            Self::Eight(raster) => Self::Eight(raster.without_full_alpha(u8::MAX)),
            Self::Sixteen(raster) => Self::Sixteen(raster.without_full_alpha(u16::MAX)),
        }
    }

    /// Samples per pixel: 1, 3 or 4.
    pub fn channels(&self) -> usize {
        match self {
            Self::Eight(raster) => raster.channels(),
            Self::Sixteen(raster) => raster.channels(),
        }
    }

    /// A copy of some of its rows, as far as it has them.
    #[must_use]
    pub fn some_rows(&self, rows: Range<usize>) -> Self {
        match self {
            Self::Eight(raster) => Self::Eight(raster.some_rows(rows)),
            Self::Sixteen(raster) => Self::Sixteen(raster.some_rows(rows)),
        }
    }
}

/// A finished picture that hands out its rows, so that a writer needs no copy of the whole.
pub trait RowSource: Sync {
    /// Width in pixels.
    fn width(&self) -> usize;
    /// Height in pixels.
    fn height(&self) -> usize;
    /// Whether every pixel is known to be wholly opaque; `false` where that is not known.
    fn is_opaque(&self) -> bool {
        false
    }
    /// Writes row `y` as 8-bit RGBA, encoded, with straight (not premultiplied) alpha: `4 * width` samples.
    ///
    /// # Errors
    /// If the pixels cannot be had, e.g. from a file that holds them.
    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()>;
    /// Writes row `y` as 16-bit RGBA, encoded by the same curve, with straight alpha: `4 * width` samples, 65535 is
    /// full.
    ///
    /// # Errors
    /// Those of [`Self::rgba8_row`].
    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()>;
    /// Writes row `y` as RGBA in linear light (1 is white, more is possible) with straight alpha (0 to 1): `4 * width`
    /// samples.
    ///
    /// # Errors
    /// Those of [`Self::rgba8_row`].
    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()>;
}

/// A raster of three 8-bit channels (red, green, blue) as an opaque picture; it has no linear light.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OpaqueRgb(pub Raster<u8>);

impl RowSource for OpaqueRgb {
    fn width(&self) -> usize {
        self.0.width()
    }

    fn height(&self) -> usize {
        self.0.height()
    }

    fn is_opaque(&self) -> bool {
        true
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        for (pixel, color) in row.chunks_exact_mut(4).zip(self.0.row(y).chunks_exact(3)) {
            pixel[..3].copy_from_slice(color);
            pixel[3] = u8::MAX;
        }
        Ok(())
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        for (pixel, color) in row.chunks_exact_mut(4).zip(self.0.row(y).chunks_exact(3)) {
            // 257 * 255 = 65535.
            for (sample, &level) in pixel.iter_mut().zip(color) {
                *sample = u16::from(level) * 257;
            }
            pixel[3] = u16::MAX;
        }
        Ok(())
    }

    fn linear_row(&self, _: usize, _: &mut [f32]) -> Result<()> {
        let hint = "Ask for 8 or 16 bits.".to_owned();
        Err(Error::Unsupported { what: "linear light of an 8-bit picture".to_owned(), hint })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_opaque_picture_is_its_raster() {
        let picture = OpaqueRgb(Raster::from_data(2, 1, 3, vec![1_u8, 2, 3, 0, 255, 7]).expect("six samples"));
        let (mut eight, mut sixteen) = ([0_u8; 8], [0_u16; 8]);
        picture.rgba8_row(0, &mut eight).expect("a row");
        picture.rgba16_row(0, &mut sixteen).expect("a row");
        assert_eq!(eight, [1, 2, 3, 255, 0, 255, 7, 255]);
        assert_eq!(sixteen, [257, 514, 771, 65535, 0, 65535, 1799, 65535]);
        assert!(picture.linear_row(0, &mut [0.0; 8]).is_err());
    }

    #[test]
    fn some_rows_are_those_that_there_are() {
        let photograph = Photograph::Sixteen(Raster::from_data(2, 3, 1, vec![0, 1, 10, 11, 20, 21]).expect("samples"));
        let rows = |rows: Range<usize>| match photograph.some_rows(rows) {
            Photograph::Sixteen(raster) => (raster.width(), raster.height(), raster.channels(), raster.into_data()),
            Photograph::Eight(_) => panic!("of its own depth"),
        };
        assert_eq!(rows(1..2), (2, 1, 1, vec![10, 11]));
        assert_eq!(rows(1..9), (2, 2, 1, vec![10, 11, 20, 21]));
        assert_eq!(rows(7..9), (2, 0, 1, vec![]));
    }

    #[test]
    fn alpha_that_is_full_everywhere_is_left_out() {
        let two = |last: u8| {
            Photograph::Eight(Raster::from_data(2, 1, 4, vec![1, 2, 3, 255, 4, 5, 6, last]).expect("eight samples"))
        };
        let opaque = two(255).without_full_alpha();
        assert_eq!(opaque, Photograph::Eight(Raster::from_data(2, 1, 3, vec![1, 2, 3, 4, 5, 6]).expect("six samples")));
        assert_eq!(opaque.clone().without_full_alpha(), opaque);
        assert_eq!(two(254).without_full_alpha(), two(254));
        let deep = |alpha| Photograph::Sixteen(Raster::from_data(1, 1, 4, vec![1, 2, 3, alpha]).expect("four samples"));
        assert_eq!([deep(u16::MAX), deep(255)].map(|one| one.without_full_alpha().channels()), [3, 4]);
        let none = Photograph::Eight(Raster::new(0, 0, 4));
        assert_eq!(none.without_full_alpha().channels(), 3);
    }

    #[test]
    fn luma_by_whole_numbers_is_luma() {
        for pixel in [[0_u8; 3], [255; 3], [255, 0, 0], [0, 255, 0], [0, 0, 255], [17, 200, 99]] {
            let exact: f32 = (0..3).map(|channel| LUMA[channel] * f32::from(pixel[channel])).sum();
            assert!((luma_256ths(pixel) as f32 / 256.0 - exact).abs() < 0.5, "{pixel:?}");
        }
    }

    #[test]
    fn pixels_are_addressed_row_by_row() {
        let mut raster = Raster::<u8>::new(3, 2, 2);
        raster.pixel_mut(2, 1).copy_from_slice(&[7, 9]);
        assert_eq!(raster.row(1), [0, 0, 0, 0, 7, 9]);
        assert_eq!(raster.pixel(2, 1), [7, 9]);
    }

    #[test]
    fn wrong_sample_counts_are_refused() {
        assert!(Raster::from_data(2, 2, 3, vec![0_u8; 11]).is_err());
        assert!(Raster::from_data(usize::MAX, 2, 3, vec![0_u8; 11]).is_err());
    }
}
