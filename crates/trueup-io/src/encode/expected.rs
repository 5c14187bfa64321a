//! How large a file is going to be, before there is one.

use std::path::Path;

use super::{DeepZoomFormat, OutputOptions, TiffCompression};
use crate::format::{OutputFormat, PictureFormat};

/// Bytes a pixel of compressed panoramas of photographs, at the low end: what is refused would not have fitted.
const LOSSY: f64 = 0.1;
/// The same without loss, for every byte of a sample.
const LOSSLESS: f64 = 0.8;
/// Channels of a pixel without transparency.
const COLORS: f64 = 3.0;

/// Bytes that a panorama of `width` x `height` pixels will take in `path`, a file or the files of a Deep Zoom pyramid: exact
/// where nothing is compressed and nothing transparent, else at the low end of what photographs take. 0 for formats that are
/// not written.
pub fn expected_bytes(path: &Path, width: usize, height: usize, options: &OutputOptions) -> u64 {
    let sample_bytes = f64::from(options.depth.sample_bytes());
    let bytes_per_pixel = match OutputFormat::of_extension(path) {
        None => 0.0,
        Some(OutputFormat::DeepZoom) if options.dzi_format == DeepZoomFormat::Png => LOSSLESS,
        Some(OutputFormat::DeepZoom | OutputFormat::Picture(PictureFormat::Jpeg)) => LOSSY,
        Some(OutputFormat::Picture(PictureFormat::Tiff)) if options.tiff_compression == TiffCompression::None => {
            COLORS * sample_bytes
        }
        Some(OutputFormat::Picture(_)) => LOSSLESS * sample_bytes,
    };
    // The cast saturates.
    (width as f64 * height as f64 * bytes_per_pixel) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::Depth;

    #[test]
    fn what_is_not_compressed_is_exact_and_the_rest_smaller() {
        let bytes = |name: &str, tiff_compression| {
            let options = OutputOptions { tiff_compression, ..OutputOptions::default() };
            expected_bytes(Path::new(name), 1000, 500, &options)
        };
        assert_eq!(bytes("a.tif", TiffCompression::None), 1_500_000);
        assert_eq!(bytes("a.tif", TiffCompression::Deflate), 400_000);
        let deep =
            OutputOptions { depth: Depth::Float, tiff_compression: TiffCompression::None, ..OutputOptions::default() };
        assert_eq!(expected_bytes(Path::new("a.tiff"), 1000, 500, &deep), 6_000_000);
        assert_eq!(bytes("a.dzi", TiffCompression::None), 50_000);
        assert_eq!(bytes("a.JPG", TiffCompression::None), 50_000);
        assert_eq!(bytes("a.gif", TiffCompression::None), 0);
        assert_eq!(expected_bytes(Path::new("a.png"), usize::MAX, usize::MAX, &OutputOptions::default()), u64::MAX);
    }
}
