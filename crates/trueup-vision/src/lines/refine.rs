//! Fits segments again to sub-pixel edge points of the unreduced photograph.
//!
//! A rectangle's axis comes from whole pixels of a region whose outline is ragged, so that its direction is off by more
//! than the photograph's pixels force it to be. Here an edge point is measured on each pixel row (or column, for flat
//! segments) that the segment crosses, from the pixels as they are, without interpolation between them, and a line is
//! fitted robustly.

use trueup_core::lines::LineSegment;
use trueup_core::raster::Raster;
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median, median_of};

/// Standard deviation, in pixels, of the Gaussian whose derivative is taken across a segment. The first scan measures
/// with it how blurred the edge is.
const SHARP_SIGMA_PX: f64 = 1.0;

/// The same for blurred edges: suppresses more noise, but would see the neighbors of sharp edges.
const BLURRED_SIGMA_PX: f64 = 1.5;

/// Edges whose own blur has at least this standard deviation, in pixels, are blurred.
const BLURRED_FROM_PX: f64 = 1.15;

/// Half the length of the longest of these filters, in pixels.
const MAX_REACH: usize = 5;

/// Variance, in squared pixels, of the blur that a pixel's own extent gives.
const PIXEL_VARIANCE: f64 = 1.0 / 12.0;

/// How the share of the plain parabola falls with the variance of the blur beyond the pixel's own, in 1 / px^2. With
/// this value, found by sampling ideal edges of blur 0 to 1 px at all phases, positions are off by less than 0.02 px.
const PARABOLA_DECAY: f64 = 6.0;

/// A filter's half-length in its standard deviations.
const REACH_SIGMAS: f64 = 2.8;

/// How far from the segment an edge point may be, in pixels: with the first filter, then with the one chosen.
const SEARCH_PX: [f64; 2] = [2.0, 1.0];

/// Rounds of the reweighted fit.
const FIT_ROUNDS: usize = 5;

/// Residuals beyond this many robust standard deviations lose influence (Tukey's biweight constant for 95 %
/// efficiency).
const TUKEY_SIGMAS: f64 = 4.685;

/// Robust standard deviations are not taken to be smaller than this, in pixels.
const MIN_RESIDUAL_PX: f64 = 0.03;

/// The smallest share of the rows crossed that must show an edge point.
const MIN_POINT_SHARE: f64 = 0.5;

/// The fewest edge points of a fit.
const MIN_POINTS: usize = 6;

/// A fit that moves an end by more than this, in pixels, has followed another edge and is not used.
const MAX_SHIFT_PX: f64 = 2.0;

/// Measures edge points in a photograph.
#[derive(Debug)]
pub(super) struct EdgeProfiles<'a> {
    picture: &'a Raster<f32>,
    sharp: Filter,
    blurred: Filter,
}

/// The derivative of a Gaussian.
#[derive(Debug, Clone, Copy)]
pub(super) struct Filter {
    sigma: f64,
    /// Samples on each side.
    reach: usize,
    /// Weights of the samples at 1 to `reach` pixels, minus those at the opposite side.
    weights: [f32; MAX_REACH],
}

impl Filter {
    fn new(sigma: f64) -> Self {
        let reach = ((sigma * REACH_SIGMAS).ceil() as usize).min(MAX_REACH);
        let weights = std::array::from_fn(|index| {
            let distance = (index + 1) as f64;
            (distance * (-0.5 * (distance / sigma).powi(2)).exp()) as f32
        });
        Self { sigma, reach, weights }
    }

    /// The slope of a profile at the center of `column`.
    fn slope(&self, profile: &Profile, column: usize) -> f32 {
        self.weights[..self.reach]
            .iter()
            .zip(1..)
            .map(|(weight, distance)| weight * (profile.at(column + distance) - profile.at(column - distance)))
            .sum()
    }
}

/// A line `minor = offset + slope * (major - origin)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    origin: f64,
    offset: f64,
    slope: f64,
}

impl Fit {
    pub(super) fn at(&self, major: f64) -> f64 {
        self.offset + self.slope * (major - self.origin)
    }
}

/// The pixel rows (or columns, for flat segments) that a segment crosses, by its extent along the major axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// 1 if the major axis is y, 0 if it is x.
    pub major: usize,
    pub from: f64,
    /// Not less than `from`.
    pub to: f64,
}

/// An edge point: where, how much it weighs, and how wide the filtered edge is there.
#[derive(Debug, Clone, Copy)]
pub(super) struct EdgePoint {
    pub major: f64,
    pub minor: f64,
    /// The squared slope: positions are the surer the steeper the edge, noise being the same everywhere.
    pub weight: f64,
    /// Variance of the Gaussian the edge's slope looks like, in squared pixels: the edge's blur and the filter's.
    spread: f64,
}

impl<'a> EdgeProfiles<'a> {
    pub(super) fn new(picture: &'a Raster<f32>) -> Self {
        Self { picture, sharp: Filter::new(SHARP_SIGMA_PX), blurred: Filter::new(BLURRED_SIGMA_PX) }
    }

    /// Replaces the segment's ends by those of the line through its edge points, at the same rows (or columns). Leaves
    /// the segment alone if it crosses too few edge points or the line would leave its surroundings.
    pub(super) fn refine(&self, segment: &mut LineSegment) {
        let Some(FittedEdge { first, fit, crossing, .. }) = self.fitted(segment) else { return };
        let minor = 1 - crossing.major;
        let (from, to) = (segment.start[crossing.major], segment.end[crossing.major]);
        if [from, to].iter().all(|&end| (fit.at(end) - first.at(end)).abs() <= MAX_SHIFT_PX) {
            segment.start[minor] = fit.at(from);
            segment.end[minor] = fit.at(to);
        }
    }

    /// The line through the edge points under a segment; `None` if it crosses too few.
    pub(super) fn fitted(&self, segment: &LineSegment) -> Option<FittedEdge<'_>> {
        let [dx, dy] = [segment.end[0] - segment.start[0], segment.end[1] - segment.start[1]];
        // Steep segments are measured on rows: their major coordinate is y.
        let (major, minor) = if dy.abs() >= dx.abs() { (1, 0) } else { (0, 1) };
        let (from, to) = (segment.start[major], segment.end[major]);
        let origin = 0.5 * (from + to);
        let slope = (segment.end[minor] - segment.start[minor]) / (to - from);
        if !slope.is_finite() {
            return None;
        }
        let first = Fit { origin, offset: 0.5 * (segment.start[minor] + segment.end[minor]), slope };
        // The brighter side is on the right: for larger y that is smaller x; for larger x it is larger y.
        let sign = if (to > from) == (major == 0) { 1.0 } else { -1.0 };
        let crossing = Crossing { major, from: from.min(to), to: from.max(to) };
        let mut fit = first;
        let mut points = Vec::with_capacity((to - from).abs() as usize + 2);
        let mut scan = Scan { filter: &self.sharp, sign, search: 0.0, parabola_share: 0.0 };
        for search in SEARCH_PX {
            scan.search = search;
            points.clear();
            self.edge_points(|place| fit.at(place), &crossing, &scan, &mut points);
            if points.len() < MIN_POINTS || (points.len() as f64) < MIN_POINT_SHARE * (to - from).abs() {
                return None;
            }
            fit = fit_line(&points, &fit)?;
            let variance = blur_variance(&points, scan.filter);
            scan.filter = if variance < BLURRED_FROM_PX.powi(2) { &self.sharp } else { &self.blurred };
            scan.parabola_share = (-PARABOLA_DECAY * (variance - PIXEL_VARIANCE).max(0.0)).exp();
        }
        Some(FittedEdge { first, fit, crossing, scan })
    }

    /// Appends the edge point of each row whose center is between the ends, near where `expected` has it.
    pub(super) fn edge_points(
        &self,
        expected: impl Fn(f64) -> f64,
        crossing: &Crossing,
        scan: &Scan,
        points: &mut Vec<EdgePoint>,
    ) {
        let (rows, columns, row_step, column_step) = if crossing.major == 1 {
            (self.picture.height(), self.picture.width(), self.picture.width(), 1)
        } else {
            (self.picture.width(), self.picture.height(), 1, self.picture.width())
        };
        let first = (crossing.from - 0.5).ceil().max(0.0) as usize;
        let end = ((crossing.to - 0.5).floor() + 1.0).clamp(0.0, rows as f64) as usize;
        for row in first..end {
            let center = row as f64 + 0.5;
            let profile = Profile { samples: self.picture.data(), start: row * row_step, step: column_step, columns };
            points.extend(scan.peak(&profile, center, expected(center)));
        }
    }
}

/// What is known of the edge under a segment.
pub(super) struct FittedEdge<'a> {
    /// The segment's own line.
    first: Fit,
    /// The line through its edge points.
    pub fit: Fit,
    pub crossing: Crossing,
    /// How its edge points are found.
    pub scan: Scan<'a>,
}

/// How a profile is searched for its edge point.
pub(super) struct Scan<'a> {
    filter: &'a Filter,
    /// 1 if the profile rises across the edge, -1 if it falls.
    sign: f32,
    /// Largest distance from where the edge is expected, in pixels.
    search: f64,
    /// Weight of the parabola through the slopes against the one through their logarithms, 0 to 1.
    parabola_share: f64,
}

impl<'a> Scan<'a> {
    /// The same that searches so far, in pixels.
    pub(super) fn within(&self, search: f64) -> Scan<'a> {
        Scan { search, ..*self }
    }

    /// The steepest place of the profile at `major` near `expected`.
    ///
    /// The derivative of a step blurred by a Gaussian is a Gaussian: a parabola through the logarithms of its three
    /// largest samples finds the peak without bias, and its width. The derivative of a step that only the pixels' own
    /// extent blurs is a mean of two Gaussians a pixel apart, whose peak a parabola through the samples themselves
    /// finds without bias. In between, the two places are off in opposite senses and a weighted mean serves.
    fn peak(&self, profile: &Profile, major: f64, expected: f64) -> Option<EdgePoint> {
        let margin = (self.filter.reach + 1) as f64;
        let (from, to) = (expected - self.search - 0.5, expected + self.search - 0.5);
        // The bounds are whole numbers: what lies within them does so rounded inwards, too.
        if !(from > margin - 1.0 && to < profile.columns as f64 - margin) {
            return None;
        }
        // As `f64::ceil`, which is a call where not every processor has the instruction.
        let below = from as usize;
        let (low, high) = (below + usize::from((below as f64) < from), to as usize);
        let slope_at = |column| self.sign * self.filter.slope(profile, column);
        let (mut column, mut slope) = (0, 0.0);
        for candidate in low..=high {
            let steepness = slope_at(candidate);
            if steepness > slope {
                (column, slope) = (candidate, steepness);
            }
        }
        if slope <= 0.0 {
            return None;
        }
        let (before, after) = (slope_at(column - 1), slope_at(column + 1));
        if !(before > 0.0 && after > 0.0 && before <= slope && after <= slope) {
            return None;
        }
        let [left, right] = [before, after].map(|neighbor| f64::from(neighbor / slope).ln());
        let curvature = left + right;
        let bend = f64::from(before - 2.0 * slope + after);
        if !(curvature < 0.0 && bend < 0.0) {
            return None;
        }
        let by_logarithms = 0.5 * (left - right) / curvature;
        let by_slopes = 0.5 * f64::from(before - after) / bend;
        Some(EdgePoint {
            major,
            minor: column as f64 + 0.5 + by_logarithms + self.parabola_share * (by_slopes - by_logarithms),
            weight: f64::from(slope * slope),
            spread: -1.0 / curvature,
        })
    }
}

/// A row or a column of the photograph.
struct Profile<'a> {
    samples: &'a [f32],
    start: usize,
    step: usize,
    columns: usize,
}

impl Profile<'_> {
    fn at(&self, column: usize) -> f32 {
        self.samples[self.start + column * self.step]
    }
}

/// Variance of the edge's own blur, in squared pixels: what the median point is wider than the filter.
fn blur_variance(points: &[EdgePoint], filter: &Filter) -> f64 {
    median_of(points.iter().map(|point| point.spread)).unwrap_or_default() - filter.sigma.powi(2)
}

/// The line through edge points by reweighted least squares with Tukey's biweight.
fn fit_line(points: &[EdgePoint], initial: &Fit) -> Option<Fit> {
    let mut fit = *initial;
    let mut deviations = Vec::with_capacity(points.len());
    for _ in 0..FIT_ROUNDS {
        deviations.clear();
        deviations.extend(points.iter().map(|point| (point.minor - fit.at(point.major)).abs()));
        let cutoff = TUKEY_SIGMAS * (SD_PER_MEDIAN_MAGNITUDE * median(&mut deviations)?).max(MIN_RESIDUAL_PX);
        fit = weighted_line(points, &fit, cutoff)?;
    }
    Some(fit)
}

/// One round: points weigh by their slope and by the biweight of their residual.
fn weighted_line(points: &[EdgePoint], fit: &Fit, cutoff: f64) -> Option<Fit> {
    let (mut s, mut st, mut stt, mut sr, mut str_) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for point in points {
        let t = point.major - fit.origin;
        let residual = point.minor - fit.at(point.major);
        let closeness = 1.0 - (residual / cutoff).powi(2);
        if closeness > 0.0 {
            let weight = point.weight * closeness * closeness;
            s += weight;
            st += weight * t;
            stt += weight * t * t;
            sr += weight * residual;
            str_ += weight * t * residual;
        }
    }
    let determinant = s * stt - st * st;
    let better = Fit {
        origin: fit.origin,
        offset: fit.offset + (stt * sr - st * str_) / determinant,
        slope: fit.slope + (s * str_ - st * sr) / determinant,
    };
    (determinant > 0.0 && better.offset.is_finite() && better.slope.is_finite()).then_some(better)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Edges straight down a photograph, so that every row sees the same phase: `blur_px` wide, of any sub-pixel
    /// position.
    fn position_error(blur_px: f64, phase: f64) -> f64 {
        const SUBSAMPLES: usize = 200;
        let edge = 12.0 + phase;
        let mut picture = Raster::new(24, 30, 1);
        for x in 0..24 {
            let brightness = |index: usize| {
                let distance = (x as f64 + (index as f64 + 0.5) / SUBSAMPLES as f64) - edge;
                // The logistic curve nearest to the normal distribution, within 1 %.
                if blur_px == 0.0 {
                    f64::from(distance > 0.0)
                } else {
                    1.0 / (1.0 + (-1.702 * distance / blur_px).exp())
                }
            };
            let mean = (0..SUBSAMPLES).map(brightness).sum::<f64>() / SUBSAMPLES as f64;
            for y in 0..30 {
                picture.pixel_mut(x, y)[0] = (50.0 + 150.0 * mean) as f32;
            }
        }
        let mut segment = LineSegment { start: [12.3, 28.0], end: [12.6, 2.0], width_px: 2.0, significance: 1.0 };
        EdgeProfiles::new(&picture).refine(&mut segment);
        assert!((segment.start[0] - segment.end[0]).abs() < 1e-3, "{segment:?}");
        segment.start[0] - edge
    }

    #[test]
    fn edge_points_are_unbiased_for_any_blur_and_phase() {
        for blur_px in [0.0, 0.3, 0.5, 0.8, 1.2, 1.6] {
            for phase in [0.0, 0.1, 0.25, 0.4, 0.5, 0.65, 0.9] {
                let error = position_error(blur_px, phase);
                assert!(error.abs() < 0.02, "blur {blur_px}, phase {phase}: {error} px");
            }
        }
    }
}
