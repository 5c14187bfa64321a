//! Photographs made small for people to look at, with as little decoding as that takes.

use trueup_core::Result;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::{SourceImage, WorkingFrame};

use super::orientation::upright;
use super::photograph::stored_of_at_least;
use super::reduce;
use super::working::{rgb8, whole_size};

/// By how much decoders make photographs smaller along each side.
const FACTORS: [usize; 4] = [1, 2, 4, 8];

/// A photograph of at most `max_pixels` pixels, upright, 8-bit RGB with its colors as they are stored. Where the
/// format's decoder can make photographs smaller by itself, it does so first, which takes a fraction of the time and
/// memory and less care: its pixels are only nearly the means of what they stand for, and a border may be off by a
/// pixel. What is measured comes of [`working`](super::working).
///
/// # Errors
/// As [`photograph`](super::photograph()).
pub fn small(source: &SourceImage, max_pixels: f64) -> Result<Raster<u8>> {
    // Decoders reduce all of a picture: what lies beside the photograph goes afterwards.
    let [width, height] = source.picture_size();
    let share = (source.width as f64 / width as f64) * (source.height as f64 / height as f64);
    let frame = WorkingFrame::new(width, height, (max_pixels / share).max(1.0));
    let (width, height) = whole_size(&frame);
    let stored = stored_of_at_least(source, [width, height])?;
    let colors = match stored {
        Photograph::Eight(raster) => reduced(&upright(raster, source.orientation), source, &frame),
        Photograph::Sixteen(raster) => reduced(&upright(raster, source.orientation), source, &frame),
    };
    let scaled = |pixels: usize| (pixels as f64 * frame.working_from_full).round() as usize;
    let inset = source.inset.map(scaled);
    rgb8(&if inset.is_none() { colors } else { inset.cut_raster(&colors)? })
}

/// The rest of the way from what the decoder made of `source` to `frame`.
fn reduced<T: reduce::ReducedSample>(picture: &Raster<T>, source: &SourceImage, frame: &WorkingFrame) -> Raster<f32> {
    // How many pixels along a side became one; what is left over at a border became one, too.
    let [full_width, full_height] = source.picture_size();
    let sides = [(full_width, picture.width()), (full_height, picture.height())];
    let is_made_by = |factor: &usize| sides.iter().all(|(full, made)| full.div_ceil(*factor) == *made);
    let factor = FACTORS.into_iter().find(is_made_by).unwrap_or(1);
    let (width, height) = whole_size(frame);
    reduce::area_average(picture, frame.working_from_full * factor as f64, width, height)
}
