//! How far overlaps are apart beyond the noise of what says so.
//!
//! Cameras, and the plain mesh after them, bring overlaps within a tenth of a pixel where the photographs were taken
//! from one point, nearer than any single match or cell of pixels says. Drawn to each of these, overlaps would follow
//! their noise. Noise differs from neighbor to neighbor; a true misalignment is common to them. The product of
//! neighbors' distances is therefore, on the mean, the square of the true one, and evidence weighs by it, as the prior
//! variance of what is estimated says in a Wiener filter.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

/// Misalignment, common to neighboring matches of a pair, from which on they are believed fully, pixels per axis; with
/// less the share falls with its square.
pub(crate) const FULL_PX: f64 = 0.7;
/// A share not worth the work: a common misalignment of a tenth of a pixel per axis, as cameras have.
pub(crate) const NEGLIGIBLE_SHARE: f64 = 0.02;
/// Closer matches share their pixels and so their noise.
const NEAREST_PX: f64 = 8.0;
/// Two cells of the usual grid: what is common over less, a grid cannot follow.
const FARTHEST_PX: f64 = 80.0;

/// One match, seen in the first photograph of a pair.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OverlapGap {
    /// Where, in working pixels.
    pub(crate) place: Vector2<f64>,
    /// Distance in the panorama of what should meet.
    pub(crate) gap: Vector2<f64>,
    /// The directions in which the distance is known: the identity for points, across the line for lines.
    pub(crate) known: Matrix2<f64>,
}

impl OverlapGap {
    /// What a match says of the square, per axis, that has no neighbor to confirm it.
    fn beyond_noise(&self) -> f64 {
        /// Standard deviation of a match per axis that is not exceeded by much: matches are found to half of it.
        const NOISE_PX: f64 = 1.0;
        (self.gap.norm_squared() / self.known.trace().max(1.0) - NOISE_PX * NOISE_PX).max(0.0)
    }
}

/// The matches of an overlap, as ascending indices, without those that show things which moved if anything did: the
/// farthest apart, of those beyond noise.
///
/// Cameras that moved leave most of what they show a little apart. What moved itself lies far from where it was, and
/// leaves all else where it is.
pub(crate) fn still(gaps: &[OverlapGap]) -> impl Iterator<Item = usize> {
    /// Distance up to which a match is taken for still, pixels: few matches of what stayed lie farther by their noise
    /// alone.
    const NOISE_PX: f64 = 1.0;
    /// The part of an overlap's matches that may have moved. Measured on 33 sets from one point into which people were
    /// drawn who walk through them: with a tenth, a fifth and this much, what is left of 9, 2 and 1 seems to show
    /// parallax (of 23 with all), and of 60 photographed sets that of 50, 50 and 51 (51).
    const MOVED: f64 = 0.3;
    let mut farthest: Vec<usize> =
        (0..gaps.len()).filter(|&k| gaps[k].gap.norm_squared() > NOISE_PX * NOISE_PX).collect();
    let square = |k: usize| gaps[k].gap.norm_squared();
    // The farther first; of those as far the later.
    farthest.sort_unstable_by(|&one, &other| square(other).total_cmp(&square(one)).then(other.cmp(&one)));
    farthest.truncate((MOVED * gaps.len() as f64) as usize);
    let mut is_still = vec![true; gaps.len()];
    farthest.into_iter().for_each(|k| is_still[k] = false);
    (0..gaps.len()).filter(move |&k| is_still[k])
}

/// Square, per axis, of the misalignment that neighbors have in common, around every piece of evidence. Where
/// none has a neighbor, what exceeds the usual noise.
pub(crate) fn common_squares(evidence: &[OverlapGap]) -> Vec<f64> {
    /// Neighbors that are compared with one another.
    const NEIGHBORS: usize = 12;
    /// Products with which a neighborhood is drawn to the mean of all.
    const DRAWN: f64 = 24.0;
    let around: Vec<CommonSum> = evidence
        .par_iter()
        .map(|one| {
            let near = nearest(evidence, one, 0.0, NEIGHBORS);
            let mut sum = CommonSum::default();
            for (k, one) in near.iter().enumerate() {
                for other in &near[..k] {
                    if (other.place - one.place).norm_squared() >= NEAREST_PX.powi(2) {
                        sum.add(one, other);
                    }
                }
            }
            sum
        })
        .collect();
    let mut overall = CommonSum::default();
    for sum in &around {
        overall.products += sum.products;
        overall.units += sum.units;
    }
    if overall.units == 0.0 {
        return evidence.iter().map(OverlapGap::beyond_noise).collect();
    }
    let mean = overall.mean_square();
    around
        .into_iter()
        .map(|sum| CommonSum { products: sum.products + DRAWN * mean, units: sum.units + DRAWN }.mean_square())
        .collect()
}

/// The nearest to one piece of evidence, at most so many, which lie `from_px` to [`FARTHEST_PX`] from it; in the order
/// of their distance, on which sums depend.
fn nearest<'a>(evidence: &'a [OverlapGap], one: &OverlapGap, from_px: f64, most: usize) -> Vec<&'a OverlapGap> {
    let near = from_px.powi(2)..FARTHEST_PX.powi(2);
    let mut found: Vec<(f64, &OverlapGap)> = evidence
        .iter()
        .map(|other| ((other.place - one.place).norm_squared(), other))
        .filter(|(square, _)| near.contains(square))
        .collect();
    if found.len() > most {
        found.select_nth_unstable_by(most - 1, |one, other| one.0.total_cmp(&other.0));
        found.truncate(most);
    }
    found.sort_by(|one, other| one.0.total_cmp(&other.0));
    found.into_iter().map(|(_, other)| other).collect()
}

/// Whether neighbors have more in common than noise would: the nearest of each alone, since what parallax leaves of
/// overlaps that were drawn together changes its sign over a few cells.
pub(crate) fn is_beyond_noise(overlaps: &[Vec<OverlapGap>]) -> bool {
    /// Neighbors that are asked of each. Measured on 61 photographed sets, 108 pairs and triples out of them and 191
    /// cut sets from one place: eight or twelve tell these apart as well, two worse.
    const NEIGHBORS: usize = 4;
    /// Standard errors that noise seldom comes to: of these 191 sets, of 50 whose shares alone say that parallax keeps
    /// them apart, 19 do, and 116 of 121 photographed ones.
    const NOISE: f64 = 1.5;
    let of_one = |evidence: &[OverlapGap], one: &OverlapGap| {
        nearest(evidence, one, NEAREST_PX, NEIGHBORS).iter().fold([0.0; 2], |[sum, squares], other| {
            let product = one.gap.dot(&other.gap);
            [sum + product, squares + product * product]
        })
    };
    let of_overlap = |evidence: &Vec<OverlapGap>| {
        evidence.iter().map(|one| of_one(evidence, one)).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
    };
    let sums: Vec<[f64; 2]> = overlaps.par_iter().map(of_overlap).collect();
    let [sum, squares] = sums.into_iter().fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
    sum > NOISE * squares.sqrt()
}

/// What neighbors have in common, in the mean of all evidence.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommonSquare {
    sum: CommonSum,
    /// Standard error of the products' sum if they had nothing in common.
    error: f64,
}

impl CommonSquare {
    pub(crate) fn of(evidence: &[OverlapGap]) -> Self {
        Self::of_overlaps(&[evidence])
    }

    /// Of several overlaps together; what lies in different ones is not near.
    pub(crate) fn of_overlaps<E: AsRef<[OverlapGap]>>(overlaps: &[E]) -> Self {
        /// Pieces of an overlap that are compared with one another; more hardly change the mean.
        const MOST: usize = 400;
        let (mut sum, mut squares) = (CommonSum::default(), 0.0);
        for evidence in overlaps.iter().map(AsRef::as_ref) {
            let some: Vec<&OverlapGap> = evidence.iter().step_by(evidence.len().div_ceil(MOST).max(1)).collect();
            for (k, one) in some.iter().enumerate() {
                for other in &some[..k] {
                    if (NEAREST_PX..FARTHEST_PX).contains(&(other.place - one.place).norm()) {
                        // Products with a member in common are uncorrelated all the same, so that their squares add up.
                        squares += sum.add(one, other).powi(2);
                    }
                }
            }
        }
        Self { sum, error: squares.sqrt() }
    }

    /// Square, per axis, of the misalignment; not negative, and 0 where none has a neighbor.
    pub(crate) fn mean(self) -> f64 {
        self.sum.mean_square()
    }

    /// The same less its standard error: what is sure.
    pub(crate) fn sure(self) -> f64 {
        self.with_errors(-1.0)
    }

    /// The same with two standard errors more: what it hardly exceeds. Infinite where none has a neighbor.
    pub(crate) fn at_most(self) -> f64 {
        if self.sum.units > 0.0 { self.with_errors(2.0) } else { f64::INFINITY }
    }

    fn with_errors(self, errors: f64) -> f64 {
        CommonSum { products: self.sum.products + errors * self.error, ..self.sum }.mean_square()
    }
}

/// What neighbors say alike, summed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CommonSum {
    /// Of the products of neighbors' distances.
    pub(crate) products: f64,
    /// Of what they would be for a misalignment of 1 px.
    pub(crate) units: f64,
}

impl CommonSum {
    /// Adds what two neighbors say, and says the product of their distances.
    fn add(&mut self, one: &OverlapGap, other: &OverlapGap) -> f64 {
        let product = one.gap.dot(&other.gap);
        self.products += product;
        self.units += (one.known * other.known).trace();
        product
    }

    /// The mean square that the sums come to; not negative.
    pub(crate) fn mean_square(self) -> f64 {
        if self.units > 0.0 { (self.products / self.units).max(0.0) } else { 0.0 }
    }
}

/// The share of its weight that evidence has where the misalignment has a mean square of `common` per axis, and would
/// have its whole weight from `full_px` on.
pub(crate) fn share(common: f64, full_px: f64) -> f64 {
    (common / (full_px * full_px)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look independent, uniform in -0.5 to 0.5.
    fn noise(k: u64) -> f64 {
        let mixed = (k + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((mixed ^ (mixed >> 32)) % 10_000) as f64 / 10_000.0 - 0.5
    }

    /// Points and lines on a lattice of 10 px, misaligned by `true_gap` and noise of standard deviation 0.5.
    fn lattice(true_gap: Vector2<f64>) -> Vec<OverlapGap> {
        (0..900_u64)
            .map(|k| {
                let angle = std::f64::consts::TAU * noise(3 * k);
                let normal = Vector2::new(angle.cos(), angle.sin());
                let known = if k % 3 == 0 { normal * normal.transpose() } else { Matrix2::identity() };
                let error = Vector2::new(noise(3 * k + 1), noise(3 * k + 2)) * (0.5 * 12.0_f64.sqrt());
                let place = Vector2::new((k % 30) as f64, (k / 30) as f64) * 10.0;
                OverlapGap { place, gap: known * (true_gap + error), known }
            })
            .collect()
    }

    #[test]
    fn noise_has_nothing_in_common_and_a_misalignment_its_square() {
        let mean = |gap: Vector2<f64>| common_squares(&lattice(gap)).iter().sum::<f64>() / 900.0;
        let none = mean(Vector2::zeros());
        assert!(none < 0.03, "{none}");
        // Half of 0.6^2 + 0.8^2 per axis.
        let found = mean(Vector2::new(0.6, -0.8));
        assert!((found - 0.5).abs() < 0.06, "{found}");
    }

    /// Of points alone. The standard error of some 7,800 products is 0.007 of the 0.5.
    #[test]
    fn the_mean_of_all_is_common_less_its_standard_error() {
        let points = |true_gap| -> Vec<OverlapGap> {
            lattice(true_gap).into_iter().filter(|one| one.known == Matrix2::identity()).collect()
        };
        assert!(CommonSquare::of(&points(Vector2::zeros())).sure() < 0.002);
        let found = CommonSquare::of(&points(Vector2::new(0.6, -0.8)));
        assert!((found.sure() - 0.5).abs() < 0.06 && found.mean() > found.sure(), "{found:?}");
    }

    /// Of a hundred matches, the eight that lie 2 to 9 px off are left out, and none within 1 px; where half lie 9 px
    /// off, three tenths of all, the later ones.
    #[test]
    fn the_farthest_beyond_noise_are_not_still() {
        let gaps = |far: &dyn Fn(usize) -> f64| -> Vec<OverlapGap> {
            let one = |k: usize| OverlapGap {
                place: Vector2::new(k as f64, 0.0),
                gap: Vector2::new(0.0, far(k)),
                known: Matrix2::identity(),
            };
            (0..100).map(one).collect()
        };
        let few: Vec<usize> = still(&gaps(&|k| if k < 8 { 2.0 + k as f64 } else { 1.0 })).collect();
        assert_eq!(few, (8..100).collect::<Vec<_>>());
        let half: Vec<usize> = still(&gaps(&|k| if k % 2 == 0 { 9.0 } else { 0.1 })).collect();
        let wanted: Vec<usize> = (0..100).filter(|k| k % 2 == 1 || *k < 40).collect();
        assert_eq!(half, wanted);
        assert_eq!(still(&[]).count(), 0);
    }

    /// Four points 10 px apart in a square, 1 px off to the right: six products of 1, twelve axes, and a standard error
    /// of the square root of six.
    #[test]
    fn a_few_neighbors_are_believed_with_caution() {
        let one = |x: f64, y: f64| OverlapGap {
            place: Vector2::new(x, y),
            gap: Vector2::new(1.0, 0.0),
            known: Matrix2::identity(),
        };
        let square = [one(0.0, 0.0), one(10.0, 0.0), one(0.0, 10.0), one(10.0, 10.0)];
        let common = CommonSquare::of(&square);
        assert!((common.sure() - (6.0 - 6.0_f64.sqrt()) / 12.0).abs() < 1e-12);
        assert!((common.mean() - 0.5).abs() < 1e-12);
        assert!((common.at_most() - (6.0 + 2.0 * 6.0_f64.sqrt()) / 12.0).abs() < 1e-12);
        // Those of another overlap are no neighbors, wherever they lie.
        let apart = CommonSquare::of_overlaps(&[&square[..1], &square[1..]]);
        assert!((apart.at_most() - (3.0 + 2.0 * 3.0_f64.sqrt()) / 6.0).abs() < 1e-12);
        // Too near to be told apart by their noise, or too far to be neighbors.
        assert_eq!(CommonSquare::of(&[one(0.0, 0.0), one(7.9, 0.0), one(90.0, 0.0)]).mean(), 0.0);
        let none = CommonSquare::of(&[]);
        assert_eq!((none.mean(), none.at_most()), (0.0, f64::INFINITY));
    }

    /// A shift of half the noise, and one that changes its sign from cell to cell of 40 px.
    #[test]
    fn a_misalignment_is_more_than_noise_and_noise_is_not() {
        let with = |gap: fn(&OverlapGap) -> Vector2<f64>| {
            let moved = |one: OverlapGap| OverlapGap { gap: one.gap + gap(&one), ..one };
            is_beyond_noise(&[lattice(Vector2::zeros()).into_iter().map(moved).collect()])
        };
        assert!(!with(|_| Vector2::zeros()));
        assert!(with(|_| Vector2::new(0.25, 0.0)));
        let checkered = |one: &OverlapGap| {
            let cell = one.place.map(|coordinate| (coordinate / 40.0).floor());
            Vector2::new(if (cell.x + cell.y) % 2.0 == 0.0 { 0.4 } else { -0.4 }, 0.0)
        };
        assert!(with(checkered));
        assert!(!is_beyond_noise(&[]) && !is_beyond_noise(&[Vec::new()]));
    }

    #[test]
    fn what_has_no_neighbor_must_exceed_the_usual_noise() {
        assert_eq!(common_squares(&[]), [0.0; 0]);
        let lonely = |gap: f64| {
            let known = Matrix2::from_diagonal(&Vector2::new(1.0, 0.0));
            common_squares(&[OverlapGap { place: Vector2::zeros(), gap: Vector2::new(gap, 0.0), known }])[0]
        };
        assert_eq!([lonely(0.9), lonely(-2.0)], [0.0, 3.0]);
        assert_eq!(share(0.0, 1.0), 0.0);
        assert_eq!(share(9.0, 1.0), 1.0);
    }
}
