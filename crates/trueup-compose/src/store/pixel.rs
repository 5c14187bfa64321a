//! What a canvas consists of, in memory and as bytes.

use trueup_core::Result;
use trueup_core::scratch::ScratchFile;

use crate::weights::alpha;

/// A finished pixel: square roots of linear light and alpha, 65535 is 1.
pub(crate) type RootPixel = [u16; 4];

/// Sums over photographs of weight * (red, green, blue) in linear light, and of the weights.
pub(crate) type SumPixel = [f32; 4];

/// What a canvas consists of.
pub(crate) trait Pixel: Copy + Default + Send + Sync {
    /// Bytes of a pixel in a file.
    const BYTES: usize;
    /// Writes the pixel, little-endian.
    fn write(self, bytes: &mut [u8]);
    /// Reads what [`Self::write`] wrote.
    fn read(bytes: &[u8]) -> Self;
    /// Whether nothing shows through.
    fn is_opaque(&self) -> bool;
}

macro_rules! pixels {
    ($($sample:ty, $opaque:expr);*) => {$(
        impl Pixel for [$sample; 4] {
            const BYTES: usize = size_of::<Self>();

            #[inline(always)]
            fn write(self, bytes: &mut [u8]) {
                for (bytes, sample) in bytes.chunks_exact_mut(size_of::<$sample>()).zip(self) {
                    bytes.copy_from_slice(&sample.to_le_bytes());
                }
            }

            #[inline(always)]
            fn read(bytes: &[u8]) -> Self {
                let mut samples = bytes.chunks_exact(size_of::<$sample>()).map(|bytes| {
                    let mut own = [0; size_of::<$sample>()];
                    own.copy_from_slice(bytes);
                    <$sample>::from_le_bytes(own)
                });
                std::array::from_fn(|_| samples.next().unwrap_or_default())
            }

            fn is_opaque(&self) -> bool {
                $opaque(self[3])
            }
        }
    )*};
}
pixels!(u16, |opacity| opacity == u16::MAX; f32, |sum| alpha(sum) >= 1.0);

/// Pixels as bytes.
pub(crate) fn to_bytes<P: Pixel>(pixels: &[P]) -> Vec<u8> {
    let mut bytes = vec![0; pixels.len() * P::BYTES];
    for (pixel, bytes) in pixels.iter().zip(bytes.chunks_exact_mut(P::BYTES)) {
        pixel.write(bytes);
    }
    bytes
}

/// Reads `count` pixels from a file.
pub(crate) fn read_pixels<P: Pixel>(file: &dyn ScratchFile, offset: u64, count: usize) -> Result<Vec<P>> {
    let mut bytes = vec![0; count * P::BYTES];
    file.read_at(&mut bytes, offset)?;
    Ok(bytes.chunks_exact(P::BYTES).map(P::read).collect())
}

/// How many pixels let something show through.
pub(super) fn translucent<P: Pixel>(pixels: &[P]) -> usize {
    pixels.iter().filter(|pixel| !pixel.is_opaque()).count()
}
