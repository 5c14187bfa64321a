//! Fits segments again to sub-pixel edge points of the unreduced picture.
//!
//! A rectangle's axis comes from whole pixels of a region whose outline is ragged, so that its direction is off by more
//! than the picture's pixels force it to be. Here an edge point is measured on each pixel row (or column, for flat
//! segments) that the segment crosses, from the pixels as they are, without interpolation between them, and a line is
//! fitted robustly.

use trueup_core::lines::LineSegment;
use trueup_core::raster::Raster;

/// Standard deviation of the Gaussian whose derivative is taken across the segment, in pixels.
const PROFILE_SIGMA_PX: f64 = 1.0;

/// Half the length of that filter, in pixels: 3 standard deviations.
const PROFILE_REACH: usize = 3;

/// How far from the segment an edge point may be, in pixels, in the first fit and in the ones that follow.
const SEARCH_PX: [f64; 3] = [2.0, 1.5, 1.0];

/// Rounds of the reweighted fit.
const FIT_ROUNDS: usize = 5;

/// Residuals beyond this many robust standard deviations lose influence (Tukey's biweight constant for 95 % efficiency).
const TUKEY_SIGMAS: f64 = 4.685;

/// Robust standard deviations are not taken to be smaller than this, in pixels.
const MIN_RESIDUAL_PX: f64 = 0.03;

/// Standard deviation of a normal law over its median absolute deviation.
const SIGMA_FROM_MAD: f64 = 1.4826;

/// The smallest share of the rows crossed that must show an edge point.
const MIN_POINT_SHARE: f64 = 0.5;

/// The fewest edge points of a fit.
const MIN_POINTS: usize = 6;

/// A fit that moves an end by more than this, in pixels, has followed another edge and is not used.
const MAX_SHIFT_PX: f64 = 2.0;

/// Measures edge points in a picture.
#[derive(Debug)]
pub(super) struct EdgeProfiles<'a> {
    image: &'a Raster<f32>,
    /// Weights of the samples at 1 to `PROFILE_REACH` pixels, minus those at the opposite side.
    derivative: [f64; PROFILE_REACH],
}

/// A line `minor = offset + slope * (major - origin)`.
#[derive(Debug, Clone, Copy)]
struct Fit {
    origin: f64,
    offset: f64,
    slope: f64,
}

impl Fit {
    fn at(&self, major: f64) -> f64 {
        self.offset + self.slope * (major - self.origin)
    }
}

/// An edge point: where, and how steep.
#[derive(Debug, Clone, Copy)]
struct EdgePoint {
    major: f64,
    minor: f64,
    weight: f64,
}

impl<'a> EdgeProfiles<'a> {
    pub(super) fn new(image: &'a Raster<f32>) -> Self {
        let mut derivative = [0.0; PROFILE_REACH];
        for (index, weight) in derivative.iter_mut().enumerate() {
            let distance = (index + 1) as f64;
            *weight = distance * (-0.5 * (distance / PROFILE_SIGMA_PX).powi(2)).exp();
        }
        Self { image, derivative }
    }

    /// Replaces the segment's ends by those of the line through its edge points, at the same rows (or columns). Leaves
    /// the segment alone if it crosses too few edge points or the line would leave its surroundings.
    pub(super) fn refine(&self, segment: &mut LineSegment) {
        let [dx, dy] = [segment.end[0] - segment.start[0], segment.end[1] - segment.start[1]];
        // Steep segments are measured on rows: their major coordinate is y.
        let (major, minor) = if dy.abs() >= dx.abs() { (1, 0) } else { (0, 1) };
        let (from, to) = (segment.start[major], segment.end[major]);
        let origin = 0.5 * (from + to);
        let slope = (segment.end[minor] - segment.start[minor]) / (to - from);
        if !slope.is_finite() {
            return;
        }
        let first = Fit { origin, offset: 0.5 * (segment.start[minor] + segment.end[minor]), slope };
        // The brighter side is on the right: for larger y that is smaller x; for larger x it is larger y.
        let sign = (to - from).signum() * if major == 1 { -1.0 } else { 1.0 };
        let mut fit = first;
        let mut points = Vec::with_capacity((to - from).abs() as usize + 2);
        for search in SEARCH_PX {
            self.edge_points(&fit, (from.min(to), from.max(to)), major, sign, search, &mut points);
            if points.len() < MIN_POINTS || (points.len() as f64) < MIN_POINT_SHARE * (to - from).abs() {
                return;
            }
            let Some(better) = fit_line(&points, &fit) else { return };
            fit = better;
        }
        if [from, to].iter().all(|&end| (fit.at(end) - first.at(end)).abs() <= MAX_SHIFT_PX) {
            segment.start[minor] = fit.at(from);
            segment.end[minor] = fit.at(to);
        }
    }

    /// The edge point of each row whose centre is between the ends.
    fn edge_points(
        &self,
        fit: &Fit,
        (from, to): (f64, f64),
        major: usize,
        sign: f64,
        search: f64,
        points: &mut Vec<EdgePoint>,
    ) {
        points.clear();
        let (rows, columns, row_step, column_step) = if major == 1 {
            (self.image.height(), self.image.width(), self.image.width(), 1)
        } else {
            (self.image.width(), self.image.height(), 1, self.image.width())
        };
        let first = (from - 0.5).ceil().max(0.0) as usize;
        let end = ((to - 0.5).floor() + 1.0).clamp(0.0, rows as f64) as usize;
        for row in first..end {
            let centre = row as f64 + 0.5;
            let profile = Profile { samples: self.image.data(), start: row * row_step, step: column_step, columns };
            if let Some((minor, weight)) = self.peak(&profile, fit.at(centre), sign, search) {
                points.push(EdgePoint { major: centre, minor, weight });
            }
        }
    }

    /// The steepest place of a profile within `search` of `expected`, and its slope.
    ///
    /// The derivative of a blurred step is a Gaussian: a parabola through the logarithms of its three largest samples
    /// finds the peak without bias.
    fn peak(&self, profile: &Profile, expected: f64, sign: f64, search: f64) -> Option<(f64, f64)> {
        let margin = (PROFILE_REACH + 1) as f64;
        let low = (expected - search - 0.5).ceil();
        let high = (expected + search - 0.5).floor();
        if !(low >= margin && high + margin < profile.columns as f64) {
            return None;
        }
        let (low, high) = (low as usize, high as usize);
        let mut best = (0, 0.0);
        for column in low..=high {
            let slope = sign * self.slope(profile, column);
            if slope > best.1 {
                best = (column, slope);
            }
        }
        let (column, slope) = best;
        if slope <= 0.0 {
            return None;
        }
        let (before, after) = (sign * self.slope(profile, column - 1), sign * self.slope(profile, column + 1));
        if !(before > 0.0 && after > 0.0 && before <= slope && after <= slope) {
            return None;
        }
        let [left, middle, right] = [before, slope, after].map(f64::ln);
        let curvature = left - 2.0 * middle + right;
        (curvature < 0.0).then(|| (column as f64 + 0.5 + 0.5 * (left - right) / curvature, slope))
    }

    fn slope(&self, profile: &Profile, column: usize) -> f64 {
        self.derivative
            .iter()
            .enumerate()
            .map(|(index, weight)| weight * (profile.at(column + index + 1) - profile.at(column - index - 1)))
            .sum()
    }
}

/// A row or a column of the picture.
struct Profile<'a> {
    samples: &'a [f32],
    start: usize,
    step: usize,
    columns: usize,
}

impl Profile<'_> {
    fn at(&self, column: usize) -> f64 {
        f64::from(self.samples[self.start + column * self.step])
    }
}

/// The line through edge points by reweighted least squares with Tukey's biweight.
fn fit_line(points: &[EdgePoint], initial: &Fit) -> Option<Fit> {
    let mut fit = *initial;
    let mut deviations = Vec::with_capacity(points.len());
    for _ in 0..FIT_ROUNDS {
        deviations.clear();
        deviations.extend(points.iter().map(|point| (point.minor - fit.at(point.major)).abs()));
        let middle = deviations.len() / 2;
        let (_, &mut median, _) = deviations.select_nth_unstable_by(middle, f64::total_cmp);
        let cutoff = TUKEY_SIGMAS * (SIGMA_FROM_MAD * median).max(MIN_RESIDUAL_PX);
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
