//! A homography for every place: the direct linear transform with weights that fall off with distance.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2};
use trueup_core::geometry::{Homography, Normalization};

/// Distance over which the influence of a match on a vertex falls to 1/e, working px: the published 8.5 squared.
pub(crate) const DECAY_PX: f64 = 72.25;
/// Share of the matches that a place takes which must be left of them beside slopes. Chosen on the photographed sets:
/// with 0.5 and 1, pairs with few matches meet by a tenth to two fifths less well, with none a river below a skyline is
/// carried by its skyline.
const LEAST_LEFT: f64 = 0.25;
/// What is known of slopes besides, in matches a decay length away.
const KNOWN_SLOPE: f64 = 0.01;
/// Smallest weight of a match; it keeps vertices far from all matches determined.
pub(crate) const WEIGHT_FLOOR: f64 = 0.0015;

/// Whether at least so many matches tell of a place (source pixels): by the sum of their weights, each 1 at the place
/// itself, of which [`LEAST_LEFT`] must be left beside the slopes that are fitted with it.
///
/// Matches along a skyline tell much of places on it and next to nothing of those above and below, wherever a
/// homography may lead these. `least` is more than 0.
pub(crate) fn are_told_around(positions: &[Vector2<f64>], place: Vector2<f64>, least: f64) -> bool {
    /// Matches after which the sums are asked: seldom enough to cost nothing, often enough to end early.
    const ASKED_EVERY: usize = 32;
    let (mut sum, mut moment, mut squares) = (0.0, Vector2::zeros(), Matrix2::identity() * KNOWN_SLOPE);
    // More matches never take from what is left, so that what is told by some of them is told by all.
    positions.chunks(ASKED_EVERY).any(|some| {
        for position in some {
            let offset = position - place;
            let weight = weight_at(offset.norm());
            sum += weight;
            moment += offset / DECAY_PX * weight;
            squares += offset * offset.transpose() / DECAY_PX.powi(2) * weight;
        }
        // The place is the constant of a regression: what its slopes take of the information on it.
        let by_slopes = || squares.try_inverse().map_or(f64::INFINITY, |inverse| moment.dot(&(inverse * moment)));
        sum >= least && sum - by_slopes() >= LEAST_LEFT * least
    })
}

/// The weight of a match at a distance, pixels.
fn weight_at(distance: f64) -> f64 {
    (-distance / DECAY_PX).exp()
}

/// Matches prepared for fitting many local homographies.
///
/// # Source
/// Zaragoza et al., "As-projective-as-possible image stitching with moving DLT" (2013), equations 9 to 13.
///
/// # Departures
/// The weight of a match is exp(-distance / decay), with the distance not squared, as the code of the global similarity
/// prior has it; the published weight squares it.
#[derive(Debug, Clone)]
pub(crate) struct MovingDlt {
    /// Match positions in source pixels, for the weights.
    positions: Vec<Vector2<f64>>,
    /// Normalized (x, y) and (x', y').
    rows: Vec<[f64; 4]>,
    normalized_from_source: Matrix3<f64>,
    target_from_normalized: Matrix3<f64>,
    /// The solution with equal weights, where the iteration for each vertex starts.
    global: SVector<f64, 9>,
}

impl MovingDlt {
    /// Prepares the matches `source[k]` to `target[k]`. `None` with fewer than four or in a degenerate configuration.
    pub(crate) fn new(source: &[Vector2<f64>], target: &[Vector2<f64>]) -> Option<Self> {
        if source.len() < 4 || source.len() != target.len() {
            return None;
        }
        let (normalized_source, normalized_target) = (Normalization::of(source)?, Normalization::of(target)?);
        let rows: Vec<[f64; 4]> = source
            .iter()
            .zip(target)
            .map(|(&p, &q)| {
                let (p, q) = (normalized_source.apply(p), normalized_target.apply(q));
                [p.x, p.y, q.x, q.y]
            })
            .collect();
        let mut dlt = Self {
            positions: source.to_vec(),
            rows,
            normalized_from_source: normalized_source.matrix(),
            target_from_normalized: normalized_target.inverse(),
            global: SVector::zeros(),
        };
        let eigen = dlt.normal_matrix(|_| 1.0).symmetric_eigen();
        dlt.global = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        Some(dlt)
    }

    /// The homography around `vertex` (source pixels); `None` where it is not determined.
    pub(crate) fn at(&self, vertex: Vector2<f64>) -> Option<Homography> {
        // Beyond this distance the floor is the weight, which most matches have, without an exponential.
        let floor_px = -WEIGHT_FLOOR.ln() * DECAY_PX;
        self.solve(|position| {
            let square = (position - vertex).norm_squared();
            if square >= floor_px * floor_px { WEIGHT_FLOOR } else { weight_at(square.sqrt()).max(WEIGHT_FLOOR) }
        })
    }

    /// The homography for any weights of the match positions.
    pub(crate) fn solve(&self, weight: impl Fn(Vector2<f64>) -> f64) -> Option<Homography> {
        /// Most steps of the inverse iteration; two or three settle it.
        const ITERATIONS: usize = 8;
        /// Change of direction, 1 - cosine, below which it has settled.
        const SETTLED: f64 = 1e-12;
        /// What is added to the diagonal, as a share of the trace: exact matches make the matrix singular.
        const RELATIVE_SHIFT: f64 = 1e-12;
        let mut normal = self.normal_matrix(weight);
        let shift = normal.trace() * RELATIVE_SHIFT;
        for k in 0..9 {
            normal[(k, k)] += shift;
        }
        // Inverse iteration: the eigenvector of the smallest eigenvalue, from the global solution.
        let factor = normal.cholesky()?;
        let mut h = self.global;
        for _ in 0..ITERATIONS {
            let next = factor.solve(&h).try_normalize(f64::MIN_POSITIVE)?;
            let change = 1.0 - next.dot(&h).abs();
            h = next;
            if change < SETTLED {
                break;
            }
        }
        let normalized = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
        let matrix = self.target_from_normalized * normalized * self.normalized_from_source;
        let scale = matrix[(2, 2)];
        let matrix = matrix / scale;
        matrix.iter().all(|entry| entry.is_finite()).then_some(Homography(matrix))
    }

    /// The 9 x 9 matrix A^T W^2 A. Its blocks are four weighted sums of p p^T, p = (x, y, 1).
    fn normal_matrix(&self, weight: impl Fn(Vector2<f64>) -> f64) -> SMatrix<f64, 9, 9> {
        let mut sums = [[0.0; 6]; 4];
        for (position, &[x, y, u, v]) in self.positions.iter().zip(&self.rows) {
            let w = weight(*position).powi(2);
            let products = [x * x, x * y, x, y * y, y, 1.0];
            let factors = [w, w * u, w * v, w * (u * u + v * v)];
            for (sum, factor) in sums.iter_mut().zip(factors) {
                for (entry, product) in sum.iter_mut().zip(products) {
                    *entry += factor * product;
                }
            }
        }
        let block = |s: &[f64; 6]| Matrix3::new(s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]);
        let [plain, by_u, by_v, by_square] = [block(&sums[0]), block(&sums[1]), block(&sums[2]), block(&sums[3])];
        let mut normal = SMatrix::<f64, 9, 9>::zeros();
        normal.fixed_view_mut::<3, 3>(0, 0).copy_from(&plain);
        normal.fixed_view_mut::<3, 3>(3, 3).copy_from(&plain);
        normal.fixed_view_mut::<3, 3>(0, 6).copy_from(&-by_u);
        normal.fixed_view_mut::<3, 3>(6, 0).copy_from(&-by_u);
        normal.fixed_view_mut::<3, 3>(3, 6).copy_from(&-by_v);
        normal.fixed_view_mut::<3, 3>(6, 3).copy_from(&-by_v);
        normal.fixed_view_mut::<3, 3>(6, 6).copy_from(&by_square);
        normal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noisy_matches() -> (Vec<Vector2<f64>>, Vec<Vector2<f64>>) {
        let homography = Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0));
        (0..80)
            .map(|k| {
                let t = f64::from(k);
                let source = Vector2::new((t * 0.618).fract() * 640.0, (t * 0.755).fract() * 480.0);
                let noise = Vector2::new((t * 0.3).sin(), (t * 0.7).cos()) * 0.8;
                (source, homography.apply(source) + noise)
            })
            .unzip()
    }

    /// Equal weights everywhere must give the plain DLT, which is computed by another route.
    #[test]
    fn equal_weights_are_the_plain_dlt() {
        let (source, target) = noisy_matches();
        let dlt = MovingDlt::new(&source, &target).expect("regular");
        let moving = dlt.solve(|_| 1.0).expect("regular");
        let plain = Homography::fit(&source, &target, None).expect("regular");
        assert!((moving.0 - plain.0).amax() < 1e-6 * plain.0.amax());
    }

    #[test]
    fn local_weights_are_the_weighted_dlt() {
        let (source, target) = noisy_matches();
        let vertex = Vector2::new(100.0, 300.0);
        let weights: Vec<f64> = source.iter().map(|p| (-(p - vertex).norm() / 72.25_f64).exp().max(0.0015)).collect();
        let moving = MovingDlt::new(&source, &target).and_then(|dlt| dlt.at(vertex)).expect("regular");
        let weighted = Homography::fit(&source, &target, Some(&weights)).expect("regular");
        assert!((moving.apply(vertex) - weighted.apply(vertex)).norm() < 1e-5);
    }

    /// 1 at the place, 1/e a decay length away to either side, next to nothing far away.
    #[test]
    fn matches_count_by_how_near_they_are() {
        let at = |x: f64| Vector2::new(10.0 + x * DECAY_PX, 20.0);
        let positions = [at(0.0), at(1.0), at(-1.0), Vector2::new(1e4, 0.0)];
        let told = 1.0 + 2.0 * (-1.0_f64).exp();
        let at_least = |least: f64| are_told_around(&positions, Vector2::new(10.0, 20.0), least);
        assert!(at_least(told - 1e-12) && !at_least(told + 1e-12));
    }

    /// Twenty matches along a line tell of its places, and of those beside it next to nothing: a slope across the line
    /// takes all but `KNOWN_SLOPE`. By hand of what is left half a decay length aside, where the weights sum up to W:
    /// W - (W / 2)^2 / (W / 4 + 0.01) = 0.01 W / (W / 4 + 0.01), less than 0.04. In a field around a place all is left.
    #[test]
    fn matches_along_a_line_tell_nothing_beside_it() {
        let line: Vec<Vector2<f64>> = (0..20).map(|k| Vector2::new(10.0 * f64::from(k), 100.0)).collect();
        let middle = |aside: f64| Vector2::new(95.0, 100.0 + aside * DECAY_PX);
        assert!(are_told_around(&line, middle(0.0), 4.0) && are_told_around(&line, middle(0.02), 4.0));
        assert!(!are_told_around(&line, middle(0.5), 0.16) && are_told_around(&line, middle(0.5), 0.1));
        let field: Vec<Vector2<f64>> =
            (0..100).map(|k| Vector2::new(f64::from(k % 10) * 10.0, f64::from(k / 10) * 10.0)).collect();
        assert!(are_told_around(&field, Vector2::new(45.0, 45.0), 4.0 * 4.0));
    }

    #[test]
    fn too_few_or_coincident_matches_have_no_homography() {
        let point = vec![Vector2::new(1.0, 2.0); 6];
        assert!(MovingDlt::new(&point, &point).is_none());
        assert!(MovingDlt::new(&point[..3], &point[..3]).is_none());
    }
}
