//! Local optimization: from a hypothesis down to the nearest minimum of the truncated transfer error.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, SMatrix, SVector, Vector2};
use trueup_core::geometry::{Homography, Normalization};

use super::matched_points::MatchedPoints;

/// Thresholds of the first steps, in units of the final one: a sample of four sees its surroundings only roughly.
const FIRST_THRESHOLDS: [f64; 2] = [2.0, 1.5];
/// Largest number of steps.
const MAX_STEPS: usize = 12;
/// Relative decrease of the cost below which the minimum counts as reached.
const SETTLED: f64 = 1e-4;
/// Fewest matches that a step is taken from: one more than determine the map.
const FEWEST: f64 = 5.0;

type Normal = SMatrix<f64, 8, 8>;
type Step = SVector<f64, 8>;

/// Moves homographies to where fewer matches disagree, and by less.
#[derive(Debug)]
pub(super) struct LocalOptimizer<'a> {
    in_a: &'a [Vector2<f64>],
    /// Places in b moved to the origin and scaled to unit spread, where all entries of a step are of like size.
    in_b: Vec<Vector2<f64>>,
    inlier: f64,
    normalized_from_pixels: Matrix3<f64>,
    pixels_from_normalized: Matrix3<f64>,
}

impl<'a> LocalOptimizer<'a> {
    /// For the given matches; errors count up to `inlier_px`. `None` if the places in b coincide.
    pub(super) fn new(points: &'a MatchedPoints, inlier_px: f64) -> Option<Self> {
        let frame = Normalization::of(&points.in_b)?;
        Some(Self {
            in_a: &points.in_a,
            in_b: points.in_b.iter().map(|&place| frame.apply(place)).collect(),
            inlier: inlier_px * frame.matrix()[(0, 0)],
            normalized_from_pixels: frame.matrix(),
            pixels_from_normalized: frame.inverse(),
        })
    }

    /// The plausible map of least cost on the way from `start` to the nearest minimum of the sum over all matches of
    /// min(1, error^2 / inlier_px^2), and that cost; `start` itself is taken as plausible. The way ends
    /// early where it arrives at the cost `known` of a minimum found before.
    ///
    /// # Source
    /// Chum, Matas and Kittler, Locally optimized RANSAC, with shrinking thresholds; the cost is that of Torr and
    /// Zisserman, MLESAC, section 4, minimized by Gauss and Newton's method.
    ///
    /// # Departures
    /// A step is a small projective map of b after the present one, so that no denominators appear in its equations.
    pub(super) fn optimize(
        &self,
        start: &Homography,
        known: f64,
        is_plausible: &impl Fn(&Homography) -> bool,
    ) -> (Homography, f64) {
        let mut current = Homography(self.normalized_from_pixels * start.0);
        let (mut best, mut best_cost) = (*start, f64::INFINITY);
        for step in 0..MAX_STEPS {
            let sums = self.sums(&current.0, FIRST_THRESHOLDS.get(step).copied().unwrap_or(1.0));
            let decrease = best_cost - sums.cost;
            if decrease > 0.0 {
                let in_pixels = Homography(self.pixels_from_normalized * current.0);
                if step == 0 || is_plausible(&in_pixels) {
                    (best, best_cost) = (in_pixels, sums.cost);
                }
            }
            let is_known = (sums.cost / known - 1.0).abs() <= SETTLED;
            if is_known || (step > FIRST_THRESHOLDS.len() && decrease <= SETTLED * best_cost) {
                break;
            }
            let Some(next) = sums.step().map(|step| step * current.0) else { break };
            current = Homography(next / next.amax());
        }
        (Homography(best.0 / best.0.amax()), best_cost)
    }

    /// What the matches within `reach` thresholds of a map into normalized places say.
    fn sums(&self, map: &Matrix3<f64>, reach: f64) -> Sums {
        let scale = self.inlier.powi(2).recip();
        let mut sums = Sums::default();
        for (a, b) in self.in_a.iter().zip(&self.in_b) {
            let mapped = map * a.push(1.0);
            let (x, y) = (mapped.x / mapped.z, mapped.y / mapped.z);
            let (dx, dy) = (b.x - x, b.y - y);
            let error = if mapped.z > 0.0 { (dx * dx + dy * dy) * scale } else { f64::INFINITY };
            sums.cost += error.min(1.0);
            if error > reach * reach {
                continue;
            }
            let (xx, xy, yy) = (x * x, x * y, y * y);
            let (square, along) = (xx + yy, dx * x + dy * y);
            let moments =
                [1.0, x, y, xx, xy, yy, x * xx, x * xy, x * yy, y * yy, square * xx, square * xy, square * yy];
            let residuals = [dx * x, dx * y, dx, dy * x, dy * y, dy, -along * x, -along * y];
            sums.moments.iter_mut().zip(moments).for_each(|(sum, term)| *sum += term);
            sums.residuals.iter_mut().zip(residuals).for_each(|(sum, term)| *sum += term);
        }
        sums
    }
}

/// Sums over the matches near a map that takes them to (x, y), with residuals (dx, dy).
#[derive(Debug, Default)]
struct Sums {
    /// Of min(1, error^2 / inlier^2) over all matches.
    cost: f64,
    /// Of 1, x, y, x2, xy, y2, x3, x2y, xy2, y3, and x2, xy, y2 times x2 + y2.
    moments: [f64; 13],
    /// Of dx (x, y, 1), dy (x, y, 1) and -(dx x + dy y) (x, y).
    residuals: [f64; 8],
}

impl Sums {
    /// The projective map near the identity by which the residuals become least; `None` if too few matches determine
    /// it.
    ///
    /// With parameters s it moves (x, y) by (s0 x + s1 y + s2, s3 x + s4 y + s5) - (s6 x + s7 y) (x, y), to first
    /// order.
    fn step(&self) -> Option<Matrix3<f64>> {
        let [one, x, y, xx, xy, yy, xxx, xxy, xyy, yyy, corner_xx, corner_xy, corner_yy] = self.moments;
        if one < FEWEST {
            return None;
        }
        let square = Matrix3::new(xx, xy, x, xy, yy, y, x, y, one);
        let cross_x = Matrix3x2::new(xxx, xxy, xxy, xyy, xx, xy);
        let cross_y = Matrix3x2::new(xxy, xyy, xyy, yyy, xy, yy);
        let mut normal = Normal::zeros();
        for (row, cross) in [(0, cross_x), (3, cross_y)] {
            normal.fixed_view_mut::<3, 3>(row, row).copy_from(&square);
            normal.fixed_view_mut::<3, 2>(row, 6).copy_from(&-cross);
            normal.fixed_view_mut::<2, 3>(6, row).copy_from(&-cross.transpose());
        }
        normal.fixed_view_mut::<2, 2>(6, 6).copy_from(&Matrix2::new(corner_xx, corner_xy, corner_xy, corner_yy));
        let s = normal.cholesky()?.solve(&Step::from(self.residuals));
        let step = Matrix3::new(1.0 + s[0], s[1], s[2], s[3], 1.0 + s[4], s[5], s[6], s[7], 1.0);
        step.iter().all(|entry| entry.is_finite()).then_some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INLIER_PX: f64 = 5.0;

    fn example() -> Homography {
        Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0))
    }

    fn rough() -> Homography {
        Homography(example().0 + Matrix3::new(0.004, -0.003, 2.0, 0.003, 0.004, -1.5, 2e-6, -2e-6, 0.0))
    }

    /// Points of a quasi-regular grid, those in b displaced by up to about `noise_px`, every fifth by far more.
    fn points(noise_px: f64) -> MatchedPoints {
        let in_a: Vec<Vector2<f64>> =
            (0..60).map(|k| Vector2::new(f64::from(k * 97 % 640), f64::from(k * 61 % 480))).collect();
        let noise = |k: usize| Vector2::new((k as f64 * 1.7).sin(), (k as f64 * 2.3).cos()) * noise_px;
        let wrong =
            |k: usize| if k.is_multiple_of(5) { Vector2::new(40.0 + k as f64, -90.0) } else { Vector2::zeros() };
        let in_b = in_a.iter().enumerate().map(|(k, &p)| example().apply(p) + noise(k) + wrong(k)).collect();
        MatchedPoints { in_a, in_b }
    }

    fn cost(map: &Homography, points: &MatchedPoints) -> f64 {
        let pairs = points.in_a.iter().zip(&points.in_b);
        pairs.map(|(&a, &b)| ((b - map.apply(a)).norm_squared() / INLIER_PX.powi(2)).min(1.0)).sum()
    }

    fn optimized(points: &MatchedPoints, start: &Homography) -> (Homography, f64) {
        LocalOptimizer::new(points, INLIER_PX).expect("places differ").optimize(start, f64::INFINITY, &|_| true)
    }

    #[test]
    fn exact_matches_among_wrong_ones_give_the_exact_map() {
        let (found, cost) = optimized(&points(0.0), &rough());
        assert!((found.0 / found.0[(2, 2)] - example().0).amax() < 1e-6);
        assert!((cost - 12.0).abs() < 1e-9, "the wrong matches alone cost: {cost}");
    }

    #[test]
    fn the_result_is_a_minimum_of_the_cost_it_states() {
        let points = points(1.5);
        let (found, least) = optimized(&points, &rough());
        let found = Homography(found.0 / found.0[(2, 2)]);
        assert!((least - cost(&found, &points)).abs() < 1e-9);
        assert!(least < cost(&rough(), &points));
        for entry in 0..8 {
            let scale = [1e-3, 1e-3, 0.3, 1e-3, 1e-3, 0.3, 2e-6, 2e-6][entry];
            for step in [-scale, scale] {
                let mut moved = found;
                moved.0[(entry / 3, entry % 3)] += step;
                assert!(cost(&moved, &points) > least, "entry {entry}");
            }
        }
    }

    #[test]
    fn implausible_maps_and_too_few_matches_leave_the_start() {
        let points = points(1.5);
        let optimizer = LocalOptimizer::new(&points, INLIER_PX).expect("places differ");
        let same = |found: Homography| (found.0 / found.0[(2, 2)] - rough().0).amax() < 1e-9;
        assert!(same(optimizer.optimize(&rough(), f64::INFINITY, &|_| false).0));
        let four = points.select(&[1, 2, 3, 4]);
        assert!(same(optimized(&four, &rough()).0));
        let one_place = MatchedPoints { in_b: vec![Vector2::new(1.0, 2.0); 60], ..points };
        assert!(LocalOptimizer::new(&one_place, INLIER_PX).is_none());
    }
}
