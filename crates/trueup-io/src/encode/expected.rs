//! How large a file is going to be, before there is one.

use std::path::Path;

use super::{OutputOptions, RGBA, TiffCompression};
use crate::format::PictureFormat;

/// Bytes a pixel of compressed panoramas of photographs, at the low end: what is refused would not have fitted.
const LOSSY: f64 = 0.1;
/// The same without loss.
const LOSSLESS: f64 = 0.8;

/// Bytes that a panorama of `width` x `height` pixels will take in the file `path`: exact where nothing is compressed, else
/// at the low end of what photographs take. 0 for formats that are not written.
pub fn expected_bytes(path: &Path, width: usize, height: usize, options: &OutputOptions) -> u64 {
    let bytes_per_pixel = match PictureFormat::of_extension(path) {
        None => 0.0,
        Some(PictureFormat::Jpeg) => LOSSY,
        Some(PictureFormat::Tiff) if options.tiff_compression == TiffCompression::None => RGBA as f64,
        Some(PictureFormat::Png | PictureFormat::Tiff | PictureFormat::WebP) => LOSSLESS,
    };
    // The cast saturates.
    (width as f64 * height as f64 * bytes_per_pixel) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_compressed_is_exact_and_the_rest_smaller() {
        let bytes = |name: &str, tiff_compression| {
            let options = OutputOptions { tiff_compression, ..OutputOptions::default() };
            expected_bytes(Path::new(name), 1000, 500, &options)
        };
        assert_eq!(bytes("a.tif", TiffCompression::None), 2_000_000);
        assert_eq!(bytes("a.tif", TiffCompression::Deflate), 400_000);
        assert_eq!(bytes("a.JPG", TiffCompression::None), 50_000);
        assert_eq!(bytes("a.gif", TiffCompression::None), 0);
        assert_eq!(expected_bytes(Path::new("a.png"), usize::MAX, usize::MAX, &OutputOptions::default()), u64::MAX);
    }
}
