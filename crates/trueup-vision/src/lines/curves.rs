//! Follows the edges under segments beyond their ends, bent as they may be.
//!
//! Behind a lens that bends, a detector of straight segments cuts a long edge into pieces. Each piece says where the
//! edge is and which way it rises; from there it is followed on both sides, as long as edge points go on where the last
//! ones lead.

use nalgebra::{Matrix3, Vector3};
use trueup_core::lines::{EdgeCurve, LineSegment};
use trueup_core::raster::Raster;
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median_of};

use super::refine::{Crossing, EdgePoint, EdgeProfiles, Scan};

/// Shortest segment that an edge is followed from, pixels.
const SHORTEST_SEED_PX: f64 = 16.0;
/// Shortest curve that is kept, along its major axis, in diagonals of the picture: what is shorter shows no bend.
const SHORTEST_CURVE: f64 = 0.06;
/// Most curves that are followed, the longest segments' first.
const MOST_CURVES: usize = 400;
/// How far from where it is expected an edge point may be, pixels.
const SEARCH_PX: f64 = 1.5;
/// Rows (or columns) by which a curve grows at once.
const STEP: usize = 6;
/// Edge points at the end of a curve that say where it goes on.
const LEADING_POINTS: usize = 60;
/// Smallest share of the rows of a step that must show an edge point.
const MIN_POINT_SHARE: f64 = 0.7;
/// Largest median distance of a step's edge points from where they were expected, pixels.
const MAX_STRAY_PX: f64 = 0.6;
/// Factor by which the weight (the squared slope) of a step's edge points may differ from that of those before.
const MAX_WEIGHT_FACTOR: f64 = 16.0;
/// Steepest slope against the major axis at which a curve is followed.
const STEEPEST: f64 = 1.4;
/// Edge points for each place of a curve, ...
const POINTS_PER_PLACE: usize = 12;
/// ... which has so many places at most, ...
const MOST_PLACES: usize = 32;
/// ... and at least as many as show more than one bend.
const FEWEST_PLACES: usize = 5;
/// Points along a segment where it is looked whether a curve was there before.
const LOOKS: usize = 5;
/// Rounds of the reweighted fit.
const FIT_ROUNDS: usize = 3;
/// Residuals beyond so many median deviations lose influence: Tukey's constant for 95 % efficiency, of normal errors.
const TUKEY_MEDIANS: f64 = 4.685 * SD_PER_MEDIAN_MAGNITUDE;
/// Median deviations are not taken to be smaller than this, pixels.
const MIN_DEVIATION_PX: f64 = 0.03;

/// The curves under `segments`, longest segments first.
pub(super) fn follow(picture: &Raster<f32>, segments: &[LineSegment]) -> Vec<EdgeCurve> {
    let profiles = EdgeProfiles::new(picture);
    let (width, height) = (picture.width(), picture.height());
    let shortest_px = SHORTEST_CURVE * (width as f64).hypot(height as f64);
    let mut followed = Followed { width, height, numbers: vec![0; width * height], directions: Vec::new() };
    let mut curves = Vec::new();
    for segment in segments.iter().take_while(|segment| segment.length() >= SHORTEST_SEED_PX) {
        if followed.directions.len() == MOST_CURVES {
            break;
        }
        if followed.holds(segment) {
            continue;
        }
        let Some((major, points)) = followed_from(&profiles, segment) else { continue };
        followed.add(segment, major, &points);
        curves.extend(curve(major, &points, shortest_px));
    }
    curves
}

/// Where curves were followed before.
struct Followed {
    width: usize,
    height: usize,
    /// For every pixel the number of the last curve there, counted from 1; 0 without one.
    numbers: Vec<u32>,
    /// The unit vector along the segment that each was followed from.
    directions: Vec<[f64; 2]>,
}

impl Followed {
    /// Whether most of a segment lies on one curve or another that rises to the same side.
    fn holds(&self, segment: &LineSegment) -> bool {
        let direction = direction(segment);
        let is_held = |look: &usize| {
            let share = (*look as f64 + 0.5) / LOOKS as f64;
            let place = [0, 1].map(|axis| segment.start[axis] + share * (segment.end[axis] - segment.start[axis]));
            let number = self.pixel(place).map_or(0, |pixel| self.numbers[pixel]);
            let before = (number as usize).checked_sub(1).map(|curve| self.directions[curve]);
            before.is_some_and(|before| before[0] * direction[0] + before[1] * direction[1] > 0.0)
        };
        2 * (0..LOOKS).filter(is_held).count() > LOOKS
    }

    fn add(&mut self, segment: &LineSegment, major: usize, points: &[EdgePoint]) {
        self.directions.push(direction(segment));
        let number = self.directions.len() as u32;
        for point in points {
            for aside in [-1.0, 0.0, 1.0] {
                if let Some(pixel) = self.pixel(in_picture(major, [point.major, point.minor + aside])) {
                    self.numbers[pixel] = number;
                }
            }
        }
    }

    fn pixel(&self, [x, y]: [f64; 2]) -> Option<usize> {
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then(|| y as usize * self.width + x as usize)
    }
}

fn direction(segment: &LineSegment) -> [f64; 2] {
    [0, 1].map(|axis| (segment.end[axis] - segment.start[axis]) / segment.length())
}

/// A place by its major and minor coordinate.
fn in_picture(major: usize, [along, aside]: [f64; 2]) -> [f64; 2] {
    if major == 1 { [aside, along] } else { [along, aside] }
}

/// The major axis and the edge points, ascending along it, of the curve that a segment lies on.
fn followed_from(profiles: &EdgeProfiles, segment: &LineSegment) -> Option<(usize, Vec<EdgePoint>)> {
    let edge = profiles.fitted(segment)?;
    let Crossing { major, from, to } = edge.crossing;
    let scan = edge.scan.within(SEARCH_PX);
    let mut points = Vec::new();
    profiles.edge_points(|along| edge.fit.at(along), &edge.crossing, &scan, &mut points);
    let bend = Parabola::through(&points)?;
    points.clear();
    profiles.edge_points(|along| bend.at(along), &edge.crossing, &scan, &mut points);
    let grower = Grower { profiles, scan: &scan, major };
    grower.grow(&mut points, to, 1.0);
    points.reverse();
    grower.grow(&mut points, from, -1.0);
    points.reverse();
    Some((major, points))
}

/// Follows an edge.
struct Grower<'a> {
    profiles: &'a EdgeProfiles<'a>,
    scan: &'a Scan<'a>,
    major: usize,
}

impl Grower<'_> {
    /// Appends to `points` what follows from the major coordinate `end` on in the sense of `sign`.
    fn grow(&self, points: &mut Vec<EdgePoint>, mut end: f64, sign: f64) {
        let mut step = Vec::with_capacity(STEP + 1);
        loop {
            let leading = &points[points.len().saturating_sub(LEADING_POINTS)..];
            let Some(ahead) = Parabola::through(leading) else { return };
            let next = end + sign * STEP as f64;
            if ahead.slope(next).abs() > STEEPEST {
                return;
            }
            let crossing = Crossing { major: self.major, from: end.min(next), to: end.max(next) };
            step.clear();
            self.profiles.edge_points(|along| ahead.at(along), &crossing, self.scan, &mut step);
            let found = step.len() as f64 >= MIN_POINT_SHARE * STEP as f64;
            if !found || ahead.median_deviation(&step) > MAX_STRAY_PX {
                return;
            }
            let factor = median_of(step.iter().map(|point| point.weight)).unwrap_or_default()
                / median_of(leading.iter().map(|point| point.weight)).unwrap_or_default().max(f64::MIN_POSITIVE);
            if !(1.0 / MAX_WEIGHT_FACTOR..=MAX_WEIGHT_FACTOR).contains(&factor) {
                return;
            }
            if sign < 0.0 {
                step.reverse();
            }
            points.append(&mut step);
            end = next;
        }
    }
}

/// The curve through edge points, if it is long and whole enough to tell anything.
fn curve(major: usize, points: &[EdgePoint], shortest_px: f64) -> Option<EdgeCurve> {
    let (first, last) = (points.first()?, points.last()?);
    let length = last.major - first.major;
    let count = (points.len() / POINTS_PER_PLACE).min(MOST_PLACES);
    if length < shortest_px || count < FEWEST_PLACES {
        return None;
    }
    let place = |k: usize| {
        let here = &points[k * points.len() / count..(k + 1) * points.len() / count];
        let mean = |of: fn(&EdgePoint) -> f64| here.iter().map(of).sum::<f64>() / here.len() as f64;
        in_picture(major, [mean(|point| point.major), mean(|point| point.minor)])
    };
    Some(EdgeCurve { places: (0..count).map(place).collect() })
}

/// A parabola `minor = offset + slope t + bend t^2` with t from `origin`.
struct Parabola {
    origin: f64,
    terms: Vector3<f64>,
}

impl Parabola {
    /// The one nearest to edge points, of which single ones may be gross errors; `None` through fewer than three.
    fn through(points: &[EdgePoint]) -> Option<Self> {
        let origin = points.iter().map(|point| point.major).sum::<f64>() / points.len().max(1) as f64;
        let mut fit = Self { origin, terms: Vector3::zeros() }.nearer(points, f64::INFINITY)?;
        for _ in 0..FIT_ROUNDS {
            let cutoff = TUKEY_MEDIANS * fit.median_deviation(points).max(MIN_DEVIATION_PX);
            fit = fit.nearer(points, cutoff)?;
        }
        Some(fit)
    }

    /// One round of the fit: points weigh by their slope and by Tukey's biweight of their distance.
    fn nearer(&self, points: &[EdgePoint], cutoff: f64) -> Option<Self> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for point in points {
            let t = point.major - self.origin;
            let closeness = 1.0 - ((point.minor - self.at(point.major)) / cutoff).powi(2);
            let weight = point.weight * closeness.max(0.0).powi(2);
            let powers = Vector3::new(1.0, t, t * t);
            normal += powers * powers.transpose() * weight;
            right += powers * (weight * point.minor);
        }
        let terms = normal.cholesky()?.solve(&right);
        terms.iter().all(|term| term.is_finite()).then_some(Self { origin: self.origin, terms })
    }

    fn at(&self, major: f64) -> f64 {
        let t = major - self.origin;
        self.terms[0] + t * (self.terms[1] + t * self.terms[2])
    }

    fn slope(&self, major: f64) -> f64 {
        self.terms[1] + 2.0 * self.terms[2] * (major - self.origin)
    }

    fn median_deviation(&self, points: &[EdgePoint]) -> f64 {
        median_of(points.iter().map(|point| (point.minor - self.at(point.major)).abs())).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::StageContext;

    use super::*;
    use crate::lines::{LineOptions, detect};

    /// A bright half plane beyond the parabola y = 150 + x^2 / 4000 about the middle, as a barrel bends an edge: 10 px
    /// at the ends. It is one curve from end to end, off by a few hundredths of a pixel.
    #[test]
    fn a_bent_edge_is_one_curve() {
        let parabola = |x: f64| 150.0 + (x - 200.0).powi(2) / 4000.0;
        let mut picture = Raster::new(400, 300, 1);
        for y in 0..300 {
            for x in 0..400 {
                let distance = y as f64 + 0.5 - parabola(x as f64 + 0.5);
                picture.pixel_mut(x, y)[0] = (100.0 + 80.0 * (distance / 0.8).tanh()) as f32;
            }
        }
        let segments = detect(&picture, &LineOptions::default(), &StageContext::default()).expect("valid input");
        let curves = follow(&picture, &segments);
        let [EdgeCurve { places }] = &curves[..] else { panic!("{} curves", curves.len()) };
        let length = (places[0][0] - places[places.len() - 1][0]).abs();
        assert!(length > 350.0, "{length}");
        for place in places {
            // A mean over 12 columns lies 12^2 / 12 / 4000 above the parabola.
            let off = place[1] - parabola(place[0]) - 0.003;
            assert!(off.abs() < 0.03, "{place:?}: {off}");
        }
    }
}
