//! How alike the photographs look where they overlap, on canvases of one pixel scale for all panoramas.

use trueup_core::{Error, Result, StageContext};

use trueup::MatchedPhotographs;
use trueup::Project;
use trueup::{PixelEvaluation, compare_overlaps, scale_up_to};

/// The pixel measures, or why there are none.
pub(crate) type Pixels = std::result::Result<PixelEvaluation, String>;

/// Pixels per photograph pixel at which `photograph_pixels` have together as many as panoramas are compared on.
pub(crate) fn common_scale(photograph_pixels: f64, canvas_pixels: f64) -> f64 {
    (canvas_pixels / photograph_pixels).sqrt().min(1.0)
}

/// Compares the photographs of a panorama that has `panorama_scale` pixels per photograph pixel, at `common_scale`; a
/// panorama whose photographs are stretched beyond the limit of memory is compared at a smaller one. The scale of the
/// outcome is in pixels per photograph pixel.
///
/// # Errors
/// [`Error::Cancelled`] and failures of the system; what concerns this panorama alone is told as the reason.
pub(crate) fn compare(
    set: &MatchedPhotographs,
    project: &Project,
    panorama_scale: f64,
    common_scale: f64,
    context: &StageContext,
) -> Result<Pixels> {
    let positions = project.used_positions();
    let compared = scale_up_to(project, common_scale / panorama_scale)
        .and_then(|scale| compare_overlaps(project, set.photographs(), &positions, scale, context));
    match compared {
        Ok(found) => Ok(Ok(PixelEvaluation { scale: found.scale * panorama_scale, ..found })),
        Err(Error::Input { subject, reason, .. }) => Ok(Err(format!("{reason}: {subject}"))),
        Err(Error::Unsolvable { why, .. }) => Ok(Err(why)),
        Err(other) => Err(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photographs_are_compared_at_the_size_of_the_canvas_and_never_enlarged() {
        assert_eq!(common_scale(6e6, 1.5e6), 0.5);
        assert_eq!(common_scale(1e6, 1.5e6), 1.0);
    }
}
