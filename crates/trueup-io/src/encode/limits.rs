//! What the formats can hold, checked before anything is written.

use std::path::Path;

use trueup_core::{Error, Result};

use super::options::{Alpha, DeepZoomFormat, Depth, OutputOptions};
use super::{Background, RGBA, tiff};
use crate::format::{OutputFormat, PictureFormat};

/// The format that the extension of `path` names; refuses one that has not the depth or the background asked for.
pub(super) fn output_format(path: &Path, options: &OutputOptions) -> Result<OutputFormat> {
    let format = OutputFormat::of_extension(path).ok_or_else(|| {
        let what = match path.extension() {
            Some(extension) => format!("writing {} as .{}", path.display(), extension.to_string_lossy()),
            None => format!("writing {} without an extension", path.display()),
        };
        Error::Unsupported { what, hint: "End the name in .jpg, .jpeg, .png, .tif, .tiff, .webp or .dzi.".to_owned() }
    })?;
    check_depth(path, format, options)?;
    check_background(path, format, options)?;
    Ok(format)
}

/// Refuses a format that has not the depth asked for.
fn check_depth(path: &Path, format: OutputFormat, options: &OutputOptions) -> Result<()> {
    let (what, has) = match options.depth {
        Depth::Auto | Depth::Eight => return Ok(()),
        Depth::Sixteen => ("16 bits a sample", &[PictureFormat::Png, PictureFormat::Tiff][..]),
        Depth::Float => ("floating point samples", &[PictureFormat::Tiff][..]),
    };
    match format {
        OutputFormat::Picture(picture) if has.contains(&picture) => Ok(()),
        _ => Err(Error::Unsupported {
            what: format!("writing {} with {what}", path.display()),
            hint: match options.depth {
                Depth::Float => "End the name in .tif, or leave output.depth at auto.",
                _ => "End the name in .png or .tif, or leave output.depth at auto.",
            }
            .to_owned(),
        }),
    }
}

/// Refuses a background that is to be transparent where nothing can be.
fn check_background(path: &Path, format: OutputFormat, options: &OutputOptions) -> Result<()> {
    let hint = match format {
        _ if options.background != Background::Transparent => return Ok(()),
        OutputFormat::Picture(PictureFormat::Jpeg) => {
            "End the name in .png, .tif or .webp, or leave the background at auto, or choose a color."
        }
        OutputFormat::DeepZoom if options.dzi_format == DeepZoomFormat::Jpeg => {
            "Set output.dzi_format to png, or leave the background at auto, or choose a color."
        }
        _ if options.alpha == Alpha::Drop => "Leave output.alpha at auto.",
        OutputFormat::DeepZoom | OutputFormat::Picture(_) => return Ok(()),
    };
    let what = format!("writing {} with a transparent background", path.display());
    Err(Error::Unsupported { what, hint: hint.to_owned() })
}

/// The longest side that a format can hold, and what to do about a longer one.
///
/// # Source
/// JPEG: 16-bit sizes, ITU-T T.81 B.2.2. PNG: 31-bit sizes, W3C PNG 11.2.1. WebP: 14-bit sizes, of which the common
/// decoders take one less, RFC 9649 and libwebp. Deep Zoom: 32-bit sizes, of which programs take half.
pub(super) fn largest_side(format: OutputFormat) -> (usize, &'static str) {
    const SIGNED: usize = (1 << 31) - 1;
    match format {
        OutputFormat::Picture(PictureFormat::Jpeg) => {
            (65_535, "Write .tif, .dzi or .png instead, or a smaller panorama.")
        }
        OutputFormat::Picture(PictureFormat::WebP) => {
            (16_383, "Write .jpg, .tif or .png instead, or a smaller panorama.")
        }
        OutputFormat::Picture(PictureFormat::Png) | OutputFormat::DeepZoom => (SIGNED, "Write a smaller panorama."),
        OutputFormat::Picture(PictureFormat::Tiff) => (tiff::MAX_SIDE, "Write a smaller panorama."),
    }
}

/// Refuses what a format cannot hold.
pub(super) fn check_sides(path: &Path, (largest, instead): (usize, &str), width: usize, height: usize) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::input(path.display(), "the panorama is empty", "There is nothing to write."));
    }
    // Rows and tiles are held in the widest samples, 32-bit floating point numbers.
    let bytes = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(RGBA * size_of::<f32>()));
    if width.max(height) > largest || bytes.is_none() {
        return Err(Error::Limits {
            subject: path.display().to_string(),
            needed: format!("{width} x {height} px"),
            allowed: format!("{largest} px per side"),
            hint: instead.to_owned(),
        });
    }
    Ok(())
}
