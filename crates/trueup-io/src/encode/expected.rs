//! How large a file is going to be, before there is one.

use std::path::Path;

use super::options::OutputOptions;
use crate::formats;

/// Bytes that a panorama of `width` x `height` pixels will take in `path`, a file or the files of a Deep Zoom pyramid:
/// exact where nothing is compressed and nothing transparent, else at the low end of what photographs take. 0 for
/// formats that are not written.
pub fn expected_bytes(path: &Path, width: usize, height: usize, options: &OutputOptions) -> u64 {
    let bytes_per_pixel = formats::writing_of(path).map_or(0.0, |writing| (writing.bytes_per_pixel)(options));
    // The cast saturates.
    (width as f64 * height as f64 * bytes_per_pixel) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::{Depth, TiffCompression};

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
