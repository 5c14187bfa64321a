//! A photograph made small, for people to look at.

use std::path::Path;

use trueup_core::raster::OpaqueRgb;
use trueup_core::{Error, Result, StageContext};
use trueup_io::encode::{self, Metadata, OutputOptions};
use trueup_io::{decode, source};

use crate::options::StitchOptions;

/// Writes `photograph`, upright and reduced to at most `max_pixels`, to `place`, whose extension chooses the format;
/// returns its own width and height after orientation. Of `options`, those of reading photographs are heeded. Colors
/// are written as the photograph has them, without its profile. Of a JPEG, no more is decoded than that takes.
///
/// # Errors
/// [`Error::Input`] if it is no photograph that can be read; those of writing; [`Error::Cancelled`].
pub fn write_thumbnail(
    photograph: &str,
    max_pixels: f64,
    place: &Path,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<[usize; 2]> {
    let found = source::scan(&[photograph.to_owned()], &options.measure.source, context)?;
    let Some(image) = found.photographs.first() else {
        let none = || Error::input(photograph, "it is no photograph", "Give a photograph.");
        return Err(found.rejected.first().map_or_else(none, |rejected| rejected.to_error()));
    };
    let picture = OpaqueRgb(decode::small(image, max_pixels)?);
    encode::write(place, &picture, &Metadata::default(), &OutputOptions::default(), context)?;
    Ok([image.width, image.height])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_room::ROOM;

    #[test]
    fn a_thumbnail_has_the_shape_of_its_photograph_and_no_more_pixels_than_asked_for() {
        let photograph = &format!("{ROOM}/02.jpg");
        let desk = tempfile::tempdir().expect("a folder");
        let (context, options) = (StageContext::default(), StitchOptions::default());
        let place = desk.path().join("small.png");
        let size = write_thumbnail(photograph, 30_000.0, &place, &options, &context).expect("written");
        assert_eq!(size, [1200, 900]);
        // 1200 x 900 divided by 6 is 200 x 150, thirty thousand.
        let written = source::scan(&[place.display().to_string()], &options.measure.source, &context).expect("read");
        assert_eq!((written.photographs[0].width, written.photographs[0].height), (200, 150));
        let text = desk.path().join("text.jpg");
        std::fs::write(&text, "no photograph").expect("written");
        let refused = write_thumbnail(&text.display().to_string(), 30_000.0, &place, &options, &context);
        assert!(matches!(refused, Err(Error::Input { .. })), "{refused:?}");
    }
}
