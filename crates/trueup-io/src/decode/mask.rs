//! Masks from picture files.

use std::path::Path;

use trueup_core::mask::Mask;
use trueup_core::raster::{LUMA, Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result, StageContext};

use super::orientation;
use super::photograph::photograph;
use crate::source::{self, RejectedSource, SourceOptions};

/// The share of white from which on a pixel of a mask counts as white, and the opacity from which on it counts as
/// opaque.
const HALF: f32 = 0.5;

/// Reads a picture that marks parts of the photograph `source`: the pixels that are white and opaque, at least by half.
///
/// The picture has the photograph's size as it is shown, with what lies beside it in its file. One that has the size in
/// which a photograph with a quarter turn is stored is turned with it.
///
/// # Errors
/// [`Error::Input`] if the file cannot be read or has another size; [`Error::Options`]; [`Error::Cancelled`].
pub fn mask(file: &Path, source: &SourceImage, options: &SourceOptions, context: &StageContext) -> Result<Mask> {
    let path = file.display().to_string();
    // A mask may be smaller than any photograph worth stitching; its size is that of one.
    let mut found = source::scan_any_size(std::slice::from_ref(&path), options, context)?;
    let Some(picture) = found.photographs.pop().filter(|_| found.photographs.is_empty()) else {
        return Err(found.rejected.first().map_or_else(
            || Error::input(&path, "it is no single picture", "Give one picture as a mask."),
            RejectedSource::to_error,
        ));
    };
    marks(&photograph(&picture)?, &path, source)
}

/// The same of a picture in memory, which messages call `name`.
///
/// # Errors
/// [`Error::Input`] if it has another size.
pub fn mask_in_memory(picture: &Photograph, name: &str, source: &SourceImage) -> Result<Mask> {
    marks(picture, name, source)
}

fn marks(picture: &Photograph, name: &str, source: &SourceImage) -> Result<Mask> {
    let size = (picture.width(), picture.height());
    let [width, height] = source.picture_size();
    let turned = source.orientation >= 5 && width != height && size == (height, width);
    if size != (width, height) && !turned {
        return Err(Error::input(
            name,
            format!(
                "the mask has {} x {} px, the photograph {} has {} x {} px",
                size.0, size.1, source.name, width, height
            ),
            "Save the mask in the size of the photograph as it is shown.",
        ));
    }
    let white = white(picture)?;
    let white = if turned { orientation::upright(white, source.orientation) } else { white };
    Ok(Mask::from_fn(white.width(), white.height(), |x, y| white.pixel(x, y)[0]).inside(source.inset))
}

fn white(picture: &Photograph) -> Result<Raster<bool>> {
    match picture {
        Photograph::Eight(raster) => white_of(raster, f32::from(u8::MAX)),
        Photograph::Sixteen(raster) => white_of(raster, f32::from(u16::MAX)),
    }
}

fn white_of<T: Copy + Default + Into<f32>>(raster: &Raster<T>, full: f32) -> Result<Raster<bool>> {
    let is_white = |pixel: &[T]| {
        let value = |channel: usize| pixel[channel].into() / full;
        let luma = match pixel.len() {
            3.. => LUMA[0] * value(0) + LUMA[1] * value(1) + LUMA[2] * value(2),
            _ => value(0),
        };
        luma >= HALF && pixel.get(3).is_none_or(|&alpha| alpha.into() / full >= HALF)
    };
    let marks = raster.data().chunks_exact(raster.channels().max(1)).map(is_white).collect();
    Raster::from_data(raster.width(), raster.height(), 1, marks)
}
