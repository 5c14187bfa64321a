//! What was written on photographs: a date, a brand, a frame's ornament at the same place of each, whatever the camera
//! looks at. It matches better than anything in the scene.

use std::collections::BTreeSet;

use trueup_core::source::WorkingFrame;

use super::putative::PutativeMatch;
use crate::features::Features;
use crate::squares::{STILL_PX, Square, featured, square};

/// Largest part of a photograph's room with features that writing takes up. Of two photographs of one view all features
/// stand still, all over it.
const MOST_ROOM: f64 = 0.2;
/// Frames whose sides differ by no more, relative, are of one size.
const SAME_SIDE: f64 = 1e-3;

/// Where writing is in two photographs: at a distance from one of their corners.
#[derive(Debug, Clone, Copy)]
struct Writing {
    corners: [[f64; 2]; 2],
    /// How much larger it is in the second.
    scale: f64,
}

impl Writing {
    /// Those that programs place: in photographs of one size at the same place; in others, as upright ones among those
    /// held across, in the same corner, as large as it was or as one of the sides makes it.
    fn all([a, b]: [&WorkingFrame; 2]) -> Vec<Self> {
        let [wider, taller] = [b.width / a.width, b.height / a.height];
        if [wider, taller].iter().all(|ratio| (ratio - 1.0).abs() <= SAME_SIDE) {
            return vec![Self { corners: [[0.0; 2]; 2], scale: 1.0 }];
        }
        let corner = |frame: &WorkingFrame, [right, below]: [bool; 2]| {
            [if right { frame.width } else { 0.0 }, if below { frame.height } else { 0.0 }]
        };
        let corners = [[false, false], [true, false], [false, true], [true, true]];
        let of_corner = |which: [bool; 2]| {
            let corners = [corner(a, which), corner(b, which)];
            [1.0, wider, taller].map(|scale| Self { corners, scale })
        };
        corners.into_iter().flat_map(of_corner).collect()
    }

    fn holds(&self, one: &PutativeMatch) -> bool {
        let [in_a, in_b] = [(one.at.in_a, self.corners[0]), (one.at.in_b, self.corners[1])]
            .map(|([x, y], [corner_x, corner_y])| [x - corner_x, y - corner_y]);
        (in_b[0] - self.scale * in_a[0]).hypot(in_b[1] - self.scale * in_a[1]) <= STILL_PX
    }
}

/// The matches of two photographs but for those on writing, where there is some. `a` has all features of the first.
pub(super) fn without_written(
    putative: Vec<PutativeMatch>,
    a: &Features,
    frames: [&WorkingFrame; 2],
) -> Vec<PutativeMatch> {
    let held = |writing: Writing| putative.iter().map(|one| writing.holds(one)).collect::<Vec<bool>>();
    let count = |held: &[bool]| held.iter().filter(|&&is_held| is_held).count();
    // Of equals the first.
    let most = |most: Vec<bool>, one: Vec<bool>| if count(&one) > count(&most) { one } else { most };
    let on_writing = Writing::all(frames).into_iter().map(held).reduce(most).unwrap_or_default();
    if !on_writing.contains(&true) {
        return putative;
    }
    let of_writing = putative.iter().zip(&on_writing).filter(|(_, is_held)| **is_held);
    let written: BTreeSet<Square> = of_writing.map(|(one, _)| square(one.at.in_a)).collect();
    if written.len() as f64 > MOST_ROOM * featured(&a.points).len() as f64 {
        return putative;
    }
    putative.into_iter().zip(on_writing).filter(|(_, is_held)| !is_held).map(|(one, _)| one).collect()
}

#[cfg(test)]
mod tests {
    use trueup_core::matches::PointMatch;

    use super::*;
    use crate::features::FeaturePoint;

    const FRAME: WorkingFrame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };

    fn without(putative: &[PutativeMatch], features: &Features) -> Vec<PutativeMatch> {
        without_written(putative.to_vec(), features, [&FRAME; 2])
    }

    /// 20 x 15 features all over a photograph of 800 x 600 px.
    fn features() -> Features {
        let at = |number: usize| [40.0 * (number % 20) as f64 + 20.0, 40.0 * (number / 20) as f64 + 20.0];
        let points = (0..300).map(|number| FeaturePoint { position: at(number), scale_px: 2.0, response: 10.0 });
        Features { points: points.collect(), ..Features::default() }
    }

    /// A match of each feature, which has moved by so much.
    fn matches(features: &Features, moved: impl Fn([f64; 2]) -> f64) -> Vec<PutativeMatch> {
        let of_point = |(point_a, point): (usize, &FeaturePoint)| {
            let [x, y] = point.position;
            let at = PointMatch { in_a: [x, y], in_b: [x + moved([x, y]), y] };
            PutativeMatch { point_a, point_b: point_a, squared_distance: 0, ratio: 0.5, at }
        };
        features.points.iter().enumerate().map(of_point).collect()
    }

    #[test]
    fn writing_stands_still_while_all_else_moves() {
        let features = features();
        // Lines of writing in the lower left corner: 5 x 2 squares of 300.
        let is_written = |[x, y]: [f64; 2]| x < 200.0 && y > 520.0;
        let on_writing = matches(&features, |place| if is_written(place) { 0.5 } else { 90.0 });
        let kept = without(&on_writing, &features);
        assert_eq!(kept.len(), 290);
        assert!(kept.iter().all(|one| !is_written(one.at.in_a)));
    }

    #[test]
    fn a_view_that_stands_still_is_no_writing() {
        let features = features();
        let still = matches(&features, |_| 0.5);
        assert_eq!(without(&still, &features), still);
        // Half of it, before which someone walked.
        let half = matches(&features, |[x, _]| if x < 400.0 { 0.0 } else { 30.0 });
        assert_eq!(without(&half, &features), half);
        let moved = matches(&features, |_| 2.0);
        assert_eq!(without(&moved, &features), moved);
        assert_eq!(without(&[], &Features::default()), Vec::new());
    }

    /// By hand: 100 px from the left and 80 above the lower side, in a photograph 4/3 as high 4/3 as far from both:
    /// (133.3, 800 - 106.7).
    #[test]
    fn writing_of_upright_photographs_is_in_the_same_corner() {
        let features = features();
        let upright = WorkingFrame { width: 600.0, height: 800.0, working_from_full: 1.0 };
        let at = PointMatch { in_a: [100.0, 520.0], in_b: [133.3, 693.3] };
        let written = PutativeMatch { point_a: 0, point_b: 0, squared_distance: 0, ratio: 0.5, at };
        let seen = PutativeMatch { at: PointMatch { in_a: [400.0, 300.0], in_b: [120.0, 410.0] }, ..written };
        assert_eq!(without_written(vec![written, seen], &features, [&FRAME, &upright]), vec![seen]);
    }
}
