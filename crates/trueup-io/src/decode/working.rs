//! Photographs reduced to the sizes that measurement works on.

use trueup_core::raster::{LUMA, Photograph, Raster};
use trueup_core::source::{SourceImage, WorkingFrame};
use trueup_core::{Error, Result};

use super::photograph::photograph;
use super::reduce;

/// A photograph reduced to the sizes that measurement works on.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkingPicture {
    /// Rec. 601 luma of the encoded values, 0 to 255, one channel: the whole pixels inside the working frame.
    pub gray: Raster<f32>,
    /// A small RGB picture for comparing colors and for reports: the whole pixels inside `thumbnail_frame`.
    pub thumbnail: Raster<u8>,
    /// Size and scale of the thumbnail; its corner is the photograph's corner, like that of the working frame.
    pub thumbnail_frame: WorkingFrame,
}

/// Decodes a photograph and reduces it to the working frame and to a thumbnail of at most `thumbnail_max_area` pixels.
///
/// # Errors
/// As [`photograph`]; [`Error::Input`] if `frame` is not a frame of this photograph.
pub fn working(source: &SourceImage, frame: &WorkingFrame, thumbnail_max_area: f64) -> Result<WorkingPicture> {
    reduce_photograph(&photograph(source)?, &source.name, frame, thumbnail_max_area)
}

/// Reduces a decoded photograph by exact area averaging: every working pixel is the mean of the full pixels under it,
/// each weighted by the area it covers, so that `working = working_from_full * full` holds without any shift.
/// Transparent parts count as black. Where nothing is to be reduced, the values are those of the photograph.
///
/// # Errors
/// [`Error::Input`] if `frame` is not a frame of a photograph of this size.
pub fn reduce_photograph(
    photograph: &Photograph,
    name: &str,
    frame: &WorkingFrame,
    thumbnail_max_area: f64,
) -> Result<WorkingPicture> {
    let (width, height) = (photograph.width(), photograph.height());
    let scale = frame.working_from_full;
    let fits = |working: f64, full: usize| (working - full as f64 * scale).abs() <= 0.5;
    if !(scale > 0.0 && scale <= 1.0 && fits(frame.width, width) && fits(frame.height, height)) {
        return Err(Error::input(
            name,
            format!("it has {width} x {height} px, which does not belong to a working frame of {frame:?}"),
            "Make the frame from the photograph's own size.",
        ));
    }
    let colors = average_to_frame(photograph, frame);
    // A thumbnail of no area would have no scale; one pixel is the least.
    let thumbnail_frame = WorkingFrame::new(width, height, thumbnail_max_area.max(1.0));
    let thumbnail = if thumbnail_frame.working_from_full <= scale {
        // The mean of means weighted by area: the photograph need not be walked again.
        let (width, height) = whole_size(&thumbnail_frame);
        reduce::area_average(&colors, thumbnail_frame.working_from_full / scale, width, height)
    } else {
        average_to_frame(photograph, &thumbnail_frame)
    };
    Ok(WorkingPicture { gray: luma(colors)?, thumbnail: rgb8(&thumbnail)?, thumbnail_frame })
}

fn average_to_frame(photograph: &Photograph, frame: &WorkingFrame) -> Raster<f32> {
    let (width, height) = whole_size(frame);
    match photograph {
        Photograph::Eight(raster) => reduce::area_average(raster, frame.working_from_full, width, height),
        Photograph::Sixteen(raster) => reduce::area_average(raster, frame.working_from_full, width, height),
    }
}

/// The whole pixels inside a frame.
pub(super) fn whole_size(frame: &WorkingFrame) -> (usize, usize) {
    (reduce::whole_pixels(frame.width), reduce::whole_pixels(frame.height))
}

/// The luma of a gray or RGB picture.
fn luma(colors: Raster<f32>) -> Result<Raster<f32>> {
    if colors.channels() == 1 {
        return Ok(colors);
    }
    let (pixels, _) = colors.data().as_chunks::<3>();
    let gray = pixels.iter().map(|[r, g, b]| LUMA[0] * r + LUMA[1] * g + LUMA[2] * b).collect();
    Raster::from_data(colors.width(), colors.height(), 1, gray)
}

/// A gray or RGB picture as rounded 8-bit RGB.
pub(super) fn rgb8(colors: &Raster<f32>) -> Result<Raster<u8>> {
    // The addition rounds; the conversion truncates and saturates.
    let rounded = |value: f32| (value + 0.5) as u8;
    let data = if colors.channels() == 1 {
        colors.data().iter().flat_map(|&gray| [rounded(gray); 3]).collect()
    } else {
        colors.data().iter().map(|&value| rounded(value)).collect()
    };
    Raster::from_data(colors.width(), colors.height(), 3, data)
}
