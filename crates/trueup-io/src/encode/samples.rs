//! Samples on their way from a picture into a file, at any depth.

use trueup_core::Result;
use trueup_core::color::TransferCurve;
use trueup_core::raster::RowSource;

use super::background::Background;

/// Samples of an RGBA pixel.
pub(crate) const RGBA: usize = 4;

/// A sample of a picture that is written. Pixels are RGBA with straight alpha.
pub(crate) trait OutputSample: Copy + Default + PartialEq + Send + Sync + 'static {
    /// Alpha of a pixel that nothing shows through.
    const OPAQUE: Self;

    /// Row `y` of a picture, `4 * width` samples.
    fn row(picture: &dyn RowSource, y: usize, row: &mut [Self]) -> Result<()>;

    /// The mean of four pixels, each weighted by its alpha.
    fn mean(pixels: [[Self; 4]; 4]) -> [Self; 4];

    /// A pixel laid over a background.
    fn over(pixel: [Self; 4], background: [Self; 3]) -> [Self; 3];

    /// The samples of a background.
    fn of(background: Background) -> [Self; 3];

    /// Appends a row of samples as they are, in the machine's order of bytes.
    fn append(row: &[Self], bytes: &mut Vec<u8>);

    /// Appends a row of samples as differences from the pixel to the left, `channels` samples away.
    fn append_differences(row: &[Self], channels: usize, bytes: &mut Vec<u8>);
}

macro_rules! whole_sample {
    ($type:ty, $wide:ty, $row:ident) => {
        impl OutputSample for $type {
            const OPAQUE: Self = <$type>::MAX;

            fn row(picture: &dyn RowSource, y: usize, row: &mut [Self]) -> Result<()> {
                picture.$row(y, row)
            }

            #[inline]
            fn mean(pixels: [[Self; 4]; 4]) -> [Self; 4] {
                let sum = |channel: usize| pixels.iter().map(|pixel| <$wide>::from(pixel[channel])).sum::<$wide>();
                let alphas = sum(3);
                let alpha = ((alphas + 2) / 4) as $type;
                let color = |channel: usize| -> $type {
                    if alphas == 4 * <$wide>::from(<$type>::MAX) {
                        return ((sum(channel) + 2) / 4) as $type;
                    }
                    let weighted = |pixel: &[Self; 4]| <$wide>::from(pixel[channel]) * <$wide>::from(pixel[3]);
                    ((pixels.iter().map(weighted).sum::<$wide>() + alphas / 2) / alphas) as $type
                };
                if alpha == 0 { [0; 4] } else { [color(0), color(1), color(2), alpha] }
            }

            #[inline]
            fn over([r, g, b, alpha]: [Self; 4], below: [Self; 3]) -> [Self; 3] {
                const FULL: $wide = <$type>::MAX as $wide;
                let alpha = <$wide>::from(alpha);
                // Rounded division.
                let mixed = |value: Self, below: Self| {
                    ((<$wide>::from(value) * alpha + <$wide>::from(below) * (FULL - alpha) + FULL / 2) / FULL) as $type
                };
                [mixed(r, below[0]), mixed(g, below[1]), mixed(b, below[2])]
            }

            fn of(background: Background) -> [Self; 3] {
                // From 8 bits to as many as there are: 255 becomes the largest value.
                background.levels().map(|level| <$type>::from(level) * (<$type>::MAX / <$type>::from(u8::MAX)))
            }

            fn append(row: &[Self], bytes: &mut Vec<u8>) {
                bytes.extend(row.iter().flat_map(|sample| sample.to_ne_bytes()));
            }

            fn append_differences(row: &[Self], channels: usize, bytes: &mut Vec<u8>) {
                let (first, rest) = row.split_at(channels.min(row.len()));
                Self::append(first, bytes);
                bytes.extend(rest.iter().zip(row).flat_map(|(value, left)| value.wrapping_sub(*left).to_ne_bytes()));
            }
        }
    };
}
whole_sample!(u8, u32, rgba8_row);
whole_sample!(u16, u64, rgba16_row);

/// Linear light.
impl OutputSample for f32 {
    const OPAQUE: Self = 1.0;

    fn row(picture: &dyn RowSource, y: usize, row: &mut [Self]) -> Result<()> {
        picture.linear_row(y, row)
    }

    #[inline]
    fn mean(pixels: [[Self; 4]; 4]) -> [Self; 4] {
        let alphas: f32 = pixels.iter().map(|pixel| pixel[3]).sum();
        if alphas <= 0.0 {
            return [0.0; 4];
        }
        let color = |channel: usize| pixels.iter().map(|pixel| pixel[channel] * pixel[3]).sum::<f32>() / alphas;
        [color(0), color(1), color(2), alphas / 4.0]
    }

    #[inline]
    fn over([r, g, b, alpha]: [Self; 4], below: [Self; 3]) -> [Self; 3] {
        let mixed = |value: Self, below: Self| value * alpha + below * (1.0 - alpha);
        [mixed(r, below[0]), mixed(g, below[1]), mixed(b, below[2])]
    }

    /// Floating point samples are in sRGB's primaries, so that levels are by its curve.
    fn of(background: Background) -> [Self; 3] {
        background.levels().map(|level| TransferCurve::SRGB.linear(f64::from(level) / f64::from(u8::MAX)) as f32)
    }

    fn append(row: &[Self], bytes: &mut Vec<u8>) {
        bytes.extend(row.iter().flat_map(|sample| sample.to_ne_bytes()));
    }

    /// The most significant bytes of all samples, then the next, and so on; of these bytes the differences.
    ///
    /// # Source
    /// Adobe Photoshop TIFF Technical Note 3 (2005).
    fn append_differences(row: &[Self], channels: usize, bytes: &mut Vec<u8>) {
        let plane = |index: usize| row.iter().map(move |sample| sample.to_be_bytes()[index]);
        let planes: Vec<u8> = (0..size_of::<Self>()).flat_map(plane).collect();
        u8::append_differences(&planes, channels, bytes);
    }
}

/// A row of RGBA as it is written: with `channels` 4 as it is, with 3 laid over the background. Replaces `out`.
pub(crate) fn flattened<S: OutputSample>(rgba: &[S], channels: usize, background: [S; 3], out: &mut Vec<S>) {
    match channels {
        4 => {
            out.clear();
            out.extend_from_slice(rgba);
        }
        _ => {
            out.resize(rgba.len() / RGBA * 3, S::default());
            lay_over(rgba, background, out);
        }
    }
}

/// Lays a row of RGBA over the background: as many pixels of three samples, `out`.
pub(crate) fn lay_over<S: OutputSample>(rgba: &[S], background: [S; 3], out: &mut [S]) {
    for (out, &pixel) in out.as_chunks_mut::<3>().0.iter_mut().zip(rgba.as_chunks::<RGBA>().0) {
        let [r, g, b, alpha] = pixel;
        *out = if alpha == S::OPAQUE { [r, g, b] } else { S::over(pixel, background) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_weigh_by_alpha() {
        let opaque = [[10_u8, 20, 30, 255], [20, 20, 30, 255], [30, 20, 30, 255], [42, 20, 31, 255]];
        assert_eq!(u8::mean(opaque), [26, 20, 30, 255]);
        let half = [[200_u16, 100, 0, 65535], [9999, 9999, 9999, 0], [100, 300, 0, 65535], [7, 7, 7, 0]];
        assert_eq!(u16::mean(half), [150, 200, 0, 32768]);
        assert_eq!(u8::mean([[9, 9, 9, 0]; 4]), [0; 4]);
        assert_eq!(f32::mean([[2.0, 0.5, 0.0, 1.0], [0.0; 4], [4.0, 0.5, 0.0, 1.0], [0.0; 4]]), [3.0, 0.5, 0.0, 0.5]);
    }

    #[test]
    fn transparent_parts_show_the_background() {
        assert_eq!(u8::over([200, 100, 0, 255], [128; 3]), [200, 100, 0]);
        // 200 / 255 and 55 / 255 of 40, 60 and 80 over 1, 2 and 3, rounded.
        assert_eq!(u8::over([40, 60, 80, 200], [1, 2, 3]), [32, 47, 63]);
        assert_eq!(u16::over([9, 9, 9, 0], u16::of(Background::WHITE)), [65535; 3]);
        assert_eq!(u16::of(Background::Color([128, 1, 0])), [128 * 257, 257, 0]);
        assert_eq!(f32::over([1.0, 0.5, 0.0, 0.5], [1.0, 1.0, 0.5]), [1.0, 0.75, 0.25]);
        // IEC 61966-2-1:1999, equation 6: ((128 / 255 + 0.055) / 1.055)^2.4.
        let [r, g, b] = f32::of(Background::Color([128, 0, 255]));
        assert!((r - 0.215_861).abs() < 1e-6 && g == 0.0 && b == 1.0, "{r} {g} {b}");
    }

    /// The bytes of two pixels of one channel: 1.0 is 3f800000, -2.0 is c0000000.
    #[test]
    fn floats_are_differenced_plane_by_plane() {
        let mut bytes = Vec::new();
        f32::append_differences(&[1.0, -2.0], 1, &mut bytes);
        assert_eq!(bytes, [0x3f, 0x81, 0xc0, 0x80, 0, 0, 0, 0]);
    }
}
