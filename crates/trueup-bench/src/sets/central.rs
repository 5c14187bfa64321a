//! The middle of a set: the photograph that the others lie around, and those nearest to it.

use trueup::Truth;

/// Positions, ascending, of the `count` photographs around the middle one, and the position of that one.
///
/// The middle one has the least sum of angles to the viewing directions of all others; nearest are those that look in the
/// directions least different from its own, the earlier first where two are alike. `None` for a set without photographs.
pub(crate) fn central(truth: &Truth, count: usize) -> Option<(usize, Vec<usize>)> {
    let views: Vec<_> = truth.images.iter().map(|image| image.camera_from_world().row(2).transpose()).collect();
    let sum = |index: usize| views.iter().map(|view| view.angle(&views[index])).sum::<f64>();
    let middle = (0..views.len()).min_by(|&a, &b| sum(a).total_cmp(&sum(b)))?;
    let mut nearest: Vec<usize> = (0..views.len()).collect();
    nearest.sort_by(|&a, &b| views[a].angle(&views[middle]).total_cmp(&views[b].angle(&views[middle])));
    nearest.truncate(count);
    nearest.sort_unstable();
    Some((middle, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of cameras that look this many degrees to the right.
    fn row(yaws_deg: &[f64]) -> Truth {
        let image = |yaw: &f64| {
            let (sine, cosine) = yaw.to_radians().sin_cos();
            serde_json::json!({
                "file": "a.jpg", "width": 640, "height": 480, "focal_px": 500.0, "gamma_deg": 0.0,
                "R": [[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]],
            })
        };
        let images: Vec<_> = yaws_deg.iter().map(image).collect();
        serde_json::from_value(serde_json::json!({ "source": "test", "images": images })).expect("a truth")
    }

    #[test]
    fn the_nearest_photographs_lie_around_the_middle_one() {
        let truth = row(&[0.0, 70.0, 20.0, 45.0, 100.0]);
        assert_eq!(central(&truth, 1), Some((3, vec![3])));
        assert_eq!(central(&truth, 3), Some((3, vec![1, 2, 3])));
        assert_eq!(central(&truth, 9), Some((3, vec![0, 1, 2, 3, 4])));
        assert_eq!(central(&row(&[]), 3), None);
    }
}
