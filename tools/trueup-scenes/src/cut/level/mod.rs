//! Where the scene's vertical points in a panorama, from its vertical lines.
//!
//! A straight line of the scene and the panorama's center span a plane; its unit normal n, in the panorama's frame, is
//! orthogonal to the line's direction in space. The vertical d is the direction near the panorama's own down that most
//! normals are orthogonal to: n . d = 0. `lines` finds the normals in pinhole views all around, `fit` the direction.

mod fit;
mod lines;
mod options;

use nalgebra::Vector3;
use trueup_core::options::StageOptions;
use trueup_core::truth::{Level, LevelOrigin};
use trueup_core::{Result, StageContext};

use super::panorama::Panorama360;
use fit::{Fit, fit};
use lines::{UprightLine, upright_lines};
pub use options::LevelOptions;

/// Measures where the scene's vertical points in the panorama's frame.
///
/// Two halves of the views are measured apart and must agree. Where they do not, where the standard error is large or
/// vertical lines are few, the panorama's own down is returned with the reason: [`LevelOrigin::Panorama`].
///
/// # Errors
/// [`trueup_core::Error::Options`] for options out of range, [`trueup_core::Error::Cancelled`].
pub fn measure_level(panorama: &Panorama360, options: &LevelOptions, context: &StageContext) -> Result<Level> {
    options.check()?;
    let lines = upright_lines(panorama, options, context)?;
    let half = |parity| lines.iter().copied().filter(|line| line.column % 2 == parity).collect::<Vec<UprightLine>>();
    let fits = [fit(&lines, options), fit(&half(0), options), fit(&half(1), options)];
    Ok(judge(&fits, options))
}

/// Believes the fit to all lines if it is certain and those to the halves agree; says why not otherwise.
fn judge([all, even, odd]: &[Option<Fit>; 3], options: &LevelOptions) -> Level {
    let own = Level::plain(LevelOrigin::Panorama, Vector3::y().into());
    let (Some(all), Some(even), Some(odd)) = (all, even, odd) else {
        let lines = all.as_ref().map_or(0, |fit| fit.support);
        let reason = "too few lines point one way near the panorama's own vertical".to_owned();
        return Level { lines: Some(lines), reason: Some(reason), ..own };
    };
    let halves_deg = even.down.cross(&odd.down).norm().atan2(even.down.dot(&odd.down)).to_degrees();
    let error_deg = all.standard_error.to_degrees();
    let (fewest, needed) = (even.support.min(odd.support), options.min_lines);
    let reason = if fewest < needed {
        Some(format!("{fewest} vertical lines in one half of the views, {needed} needed"))
    } else if halves_deg > options.max_halves_deg {
        let allowed = options.max_halves_deg;
        Some(format!("two halves of the views disagree by {halves_deg:.2} degrees, at most {allowed} are trusted"))
    } else if error_deg > options.max_standard_error_deg {
        let allowed = options.max_standard_error_deg;
        Some(format!("the standard error is {error_deg:.2} degrees, at most {allowed} are trusted"))
    } else {
        None
    };
    Level {
        origin: if reason.is_some() { LevelOrigin::Panorama } else { LevelOrigin::Measured },
        down: if reason.is_some() { own.down } else { all.down.into() },
        standard_error_deg: error_deg.is_finite().then_some(error_deg),
        halves_deg: Some(halves_deg),
        lines: Some(all.support),
        reason,
    }
}
