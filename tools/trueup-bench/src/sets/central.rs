//! The middle of a set: the photograph that the others lie around, and those nearest to it.

use trueup::Truth;

use crate::statistics::median;

/// Positions, ascending, of the `count` photographs around the middle one, and the position of that one.
///
/// The middle one is of the half whose elevation is nearest the median (in a full turn of several rows, the photographs
/// near a pole look least differently from all others) and has the least sum of angles to the viewing directions of
/// all; nearest are those that look in the directions least different from its own, the earlier first where two are
/// alike. `None` for a set without photographs.
pub(crate) fn central(truth: &Truth, count: usize) -> Option<(usize, Vec<usize>)> {
    let views: Vec<_> = truth.images.iter().map(|image| image.camera_from_world().row(2).transpose()).collect();
    let elevations: Vec<f64> = views.iter().map(|view| view.y.asin()).collect();
    let usual = median(&elevations)?;
    let off: Vec<f64> = elevations.iter().map(|elevation| (elevation - usual).abs()).collect();
    let allowed = median(&off)?;
    let candidates = (0..views.len()).filter(|&index| off[index] <= allowed);
    let sum = |index: usize| views.iter().map(|view| view.angle(&views[index])).sum::<f64>();
    let middle = candidates.min_by(|&a, &b| sum(a).total_cmp(&sum(b)))?;
    let mut nearest: Vec<usize> = (0..views.len()).collect();
    nearest.sort_by(|&a, &b| views[a].angle(&views[middle]).total_cmp(&views[b].angle(&views[middle])));
    nearest.truncate(count);
    nearest.sort_unstable();
    Some((middle, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cameras that look this many degrees to the right and up.
    fn looking(directions_deg: &[[f64; 2]]) -> Truth {
        let image = |[yaw, pitch]: &[f64; 2]| {
            let ((s, c), (up, level)) = (yaw.to_radians().sin_cos(), pitch.to_radians().sin_cos());
            serde_json::json!({
                "file": "a.jpg", "width": 640, "height": 480, "focal_px": 500.0, "gamma_deg": 0.0,
                "R": [[c, 0.0, -s], [s * up, level, c * up], [s * level, -up, c * level]],
            })
        };
        let images: Vec<_> = directions_deg.iter().map(image).collect();
        serde_json::from_value(serde_json::json!({ "source": "test", "images": images })).expect("a truth")
    }

    #[test]
    fn the_nearest_photographs_lie_around_the_middle_one() {
        let truth = looking(&[[0.0, 0.0], [70.0, 0.0], [20.0, 0.0], [45.0, 0.0], [100.0, 0.0]]);
        assert_eq!(central(&truth, 1), Some((3, vec![3])));
        assert_eq!(central(&truth, 3), Some((3, vec![1, 2, 3])));
        assert_eq!(central(&truth, 9), Some((3, vec![0, 1, 2, 3, 4])));
        assert_eq!(central(&looking(&[]), 3), None);
    }

    #[test]
    fn a_full_turn_of_three_rows_is_not_reduced_to_its_pole() {
        let around = (0..12).map(|step| 30.0 * f64::from(step));
        let rows: Vec<[f64; 2]> =
            [50.0, 5.0, -40.0].iter().flat_map(|up| around.clone().map(|yaw| [yaw, *up])).collect();
        let (middle, nearest) = central(&looking(&rows), 3).expect("photographs");
        assert!((12..24).contains(&middle) && nearest.contains(&middle));
    }
}
