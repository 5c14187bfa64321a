//! Rectangles around regions of one direction, and how they are improved.

use super::gradient::{GradientField, PointMass};
use super::significance::FalseAlarms;

/// Changes tried in each step of the improvement (IPOL, section 2.8).
const TRIES: usize = 5;

/// What a try takes off the width, in reduced pixels (IPOL, section 2.8).
const WIDTH_STEP_PX: f64 = 0.5;

/// The narrowest rectangle the improvement leaves, in reduced pixels.
const MIN_IMPROVED_WIDTH_PX: f64 = 0.5;

/// The narrowest rectangle of a region: a row of pixels is one pixel wide.
const MIN_WIDTH_PX: f64 = 1.0;

/// Pixel centers this close outside a rectangle count as inside: those that define its sides must.
const BOUNDARY_SLACK_PX: f64 = 1e-6;

/// A rectangle in the padded field's coordinates: a center, a direction, and intervals along and across it.
#[derive(Debug, Clone, Copy)]
pub(super) struct LineSupportRectangle {
    center: [f64; 2],
    /// Unit vector; level lines run its way.
    direction: [f64; 2],
    /// Interval along the direction, from the center.
    along: [f64; 2],
    /// Interval along (-direction.y, direction.x), from the center.
    across: [f64; 2],
    /// How often the precision of the field's level lines was halved.
    halvings: usize,
}

impl LineSupportRectangle {
    /// The rectangle of a region: through its center of mass along the principal axis of its inertia, with gradient
    /// magnitudes for masses, and as large as to hold all the pixels' centers.
    ///
    /// `towards` is any vector within a quarter turn of the wanted direction. `None` if the region has no mass.
    ///
    /// # Source
    /// IPOL, section 2.5.
    pub(super) fn around(pixels: &[PointMass], towards: [f64; 2]) -> Option<Self> {
        let (mass, sum_x, sum_y) =
            pixels.iter().fold((0.0, 0.0, 0.0), |(sum, sum_x, sum_y), &PointMass { x, y, mass }| {
                (sum + mass, sum_x + mass * x, sum_y + mass * y)
            });
        if mass <= 0.0 {
            return None;
        }
        let center = [sum_x / mass, sum_y / mass];
        let (xx, xy, yy) = pixels.iter().fold((0.0, 0.0, 0.0), |(xx, xy, yy), &PointMass { x, y, mass }| {
            let (dx, dy) = (x - center[0], y - center[1]);
            (xx + mass * dx * dx, xy + mass * dx * dy, yy + mass * dy * dy)
        });
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let mut direction = [angle.cos(), angle.sin()];
        if direction[0] * towards[0] + direction[1] * towards[1] < 0.0 {
            direction = direction.map(|component| -component);
        }
        let (mut along, mut across) = ([0.0_f64; 2], [0.0_f64; 2]);
        for &PointMass { x, y, .. } in pixels {
            let (dx, dy) = (x - center[0], y - center[1]);
            let (a, b) = (dx * direction[0] + dy * direction[1], dy * direction[0] - dx * direction[1]);
            along = [lesser(along[0], a), greater(along[1], a)];
            across = [lesser(across[0], b), greater(across[1], b)];
        }
        let missing = 0.5 * (MIN_WIDTH_PX - (across[1] - across[0])).max(0.0);
        across = [across[0] - missing, across[1] + missing];
        Some(Self { center, direction, along, across, halvings: 0 })
    }

    /// Width, in reduced pixels.
    pub(super) fn width(&self) -> f64 {
        self.across[1] - self.across[0]
    }

    fn length(&self) -> f64 {
        self.along[1] - self.along[0]
    }

    /// The share of the rectangle's area that a region of `pixels` fills (may exceed 1 for small rectangles).
    pub(super) fn density(&self, pixels: usize) -> f64 {
        pixels as f64 / (self.length() * self.width()).max(f64::MIN_POSITIVE)
    }

    /// Start and end of the axis: through the center of mass unless that side was cut away.
    pub(super) fn axis(&self) -> [[f64; 2]; 2] {
        let offset = 0.0_f64.clamp(self.across[0], self.across[1]);
        self.along.map(|along| self.point(along, offset))
    }

    fn point(&self, along: f64, across: f64) -> [f64; 2] {
        let [x, y] = self.direction;
        [self.center[0] + along * x - across * y, self.center[1] + along * y + across * x]
    }

    /// Pixels whose center is inside, and how many of them are aligned with the direction, by each of the tangents.
    fn count<const N: usize>(&self, field: &GradientField, tangents: [f32; N]) -> (usize, [usize; N]) {
        let corners = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| self.point(self.along[a], self.across[b])[1]);
        let top = corners.iter().copied().fold(f64::INFINITY, f64::min) - BOUNDARY_SLACK_PX;
        let bottom = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max) + BOUNDARY_SLACK_PX;
        let first_row = top.ceil().max(1.0) as usize;
        let last_row = bottom.floor().min(field.height() as f64).max(0.0) as usize;
        let direction = self.direction.map(|component| component as f32);
        let sides = Sides::of(self);
        let (mut total, mut aligned) = (0, [0; N]);
        for row in first_row..=last_row {
            let (left, right) = sides.row_interval(row as f64);
            let first = left.ceil().max(1.0) as usize;
            let last = right.floor().min(field.width() as f64).max(0.0) as usize;
            if first > last {
                continue;
            }
            let start = row * field.stride();
            total += last - first + 1;
            for &line in &field.level_lines()[start + first..=start + last] {
                for (aligned, tangent) in aligned.iter_mut().zip(tangents) {
                    *aligned += usize::from(is_aligned(line, direction, tangent));
                }
            }
        }
        (total, aligned)
    }

    fn significance(&self, field: &GradientField, false_alarms: &FalseAlarms) -> f64 {
        let precision = false_alarms.precision(self.halvings);
        let (total, [aligned]) = self.count(field, [precision.tangent]);
        false_alarms.significance(total, aligned, precision)
    }

    /// The rectangle at each of the next finer precisions, with its significance.
    fn finer(self, field: &GradientField, false_alarms: &FalseAlarms) -> [(Self, f64); TRIES] {
        let variants: [Self; TRIES] = std::array::from_fn(|k| Self { halvings: self.halvings + 1 + k, ..self });
        let precisions = variants.map(|variant| false_alarms.precision(variant.halvings));
        let (total, aligned) = self.count(field, precisions.map(|precision| precision.tangent));
        std::array::from_fn(|k| (variants[k], false_alarms.significance(total, aligned[k], precisions[k])))
    }

    /// Cuts `first` off the one side and `second` off the other; `None` if too little would remain.
    fn narrower(mut self, first: f64, second: f64) -> Option<Self> {
        self.across = [self.across[0] + first, self.across[1] - second];
        (self.width() >= MIN_IMPROVED_WIDTH_PX).then_some(self)
    }
}

/// Where the sides of a rectangle cross rows of pixels.
struct Sides {
    /// The rectangle's center.
    center: [f64; 2],
    /// Of a pixel `dx` columns and `dy` rows from the center, `dx factor + dy other` lies along the rectangle, and then
    /// across it, within a range.
    bounds: [Bound; 2],
}

/// See [`Sides::bounds`].
struct Bound {
    factor: f64,
    /// One over it.
    reciprocal: f64,
    other: f64,
    range: [f64; 2],
}

impl Sides {
    fn of(rectangle: &LineSupportRectangle) -> Self {
        let [x, slope] = rectangle.direction;
        let bound = |factor: f64, other: f64, [low, high]: [f64; 2]| {
            let range = [low - BOUNDARY_SLACK_PX, high + BOUNDARY_SLACK_PX];
            Bound { factor, reciprocal: factor.recip(), other, range }
        };
        let bounds = [bound(x, slope, rectangle.along), bound(-slope, x, rectangle.across)];
        Self { center: rectangle.center, bounds }
    }

    /// The columns of row `y` that are inside, as an interval that may be empty.
    fn row_interval(&self, y: f64) -> (f64, f64) {
        let dy = y - self.center[1];
        let (mut left, mut right) = (f64::NEG_INFINITY, f64::INFINITY);
        // Each bounds dx unless its factor vanishes.
        for Bound { factor, reciprocal, other, range } in &self.bounds {
            let [low, high] = range.map(|side| side - dy * other);
            if factor.abs() < f64::EPSILON {
                if low > 0.0 || high < 0.0 {
                    return (f64::INFINITY, f64::NEG_INFINITY);
                }
                continue;
            }
            let (a, b) = (low * reciprocal, high * reciprocal);
            left = greater(left, lesser(a, b));
            right = lesser(right, greater(a, b));
        }
        (left + self.center[0], right + self.center[0])
    }
}

/// Whether two directions are within the angle of the tangent given; never if either is (0, 0).
#[inline]
pub(super) fn is_aligned(line: [f32; 2], direction: [f32; 2], tangent: f32) -> bool {
    let dot = line[0] * direction[0] + line[1] * direction[1];
    let cross = line[0] * direction[1] - line[1] * direction[0];
    dot > 0.0 && cross.abs() <= tangent * dot
}

/// The lesser of two numbers, of which neither is NaN: one instruction.
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The greater of two numbers, of which neither is NaN: one instruction.
fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Looks for a more significant variant of a rectangle that is not significant yet: finer precisions, then a smaller
/// width, then one side, then the other cut away, then finer precisions again. Returns the best with its -log10 NFA.
///
/// # Source
/// IPOL, section 2.8.
pub(super) fn improve(
    rectangle: LineSupportRectangle,
    field: &GradientField,
    false_alarms: &FalseAlarms,
    enough: f64,
) -> (LineSupportRectangle, f64) {
    const HALF: f64 = 0.5 * WIDTH_STEP_PX;
    /// What is cut off both sides in each try; `None` to try finer precisions.
    const STEPS: [Option<[f64; 2]>; 5] =
        [None, Some([HALF, HALF]), Some([WIDTH_STEP_PX, 0.0]), Some([0.0, WIDTH_STEP_PX]), None];
    let mut best = (rectangle, rectangle.significance(field, false_alarms));
    for step in STEPS {
        if best.1 > enough {
            break;
        }
        let start = best.0;
        let mut better = |variant: (LineSupportRectangle, f64)| {
            if variant.1 > best.1 {
                best = variant;
            }
        };
        let Some([first, second]) = step else {
            start.finer(field, false_alarms).into_iter().for_each(better);
            continue;
        };
        let mut variant = start;
        for _ in 0..TRIES {
            let Some(next) = variant.narrower(first, second) else { break };
            variant = next;
            better((variant, variant.significance(field, false_alarms)));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the definition: whether the places along and across of a pixel's center are between the sides.
    #[test]
    fn pixels_are_counted_that_lie_inside() {
        let field = GradientField::new(&trueup_core::raster::Raster::new(60, 50, 1));
        for angle_deg in [0.0_f64, 17.0, 45.0, 90.0, 133.0, 180.0, 211.0, 270.0, 300.0] {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            let rectangle = LineSupportRectangle {
                center: [20.3, 18.6],
                direction: [cos, sin],
                along: [-14.2, 11.75],
                across: [-1.35, 2.4],
                halvings: 0,
            };
            let inside = |x: usize, y: usize| {
                let (dx, dy) = (x as f64 - 20.3, y as f64 - 18.6);
                let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
                (-14.2..=11.75).contains(&along) && (-1.35..=2.4).contains(&across)
            };
            let expected = (1..=field.height())
                .flat_map(|y| (1..=field.width()).map(move |x| (x, y)))
                .filter(|&(x, y)| inside(x, y));
            assert_eq!(rectangle.count(&field, [1.0]), (expected.count(), [0]), "{angle_deg} degrees");
        }
    }

    /// Waves that run another way at every place.
    #[test]
    fn several_precisions_count_as_each_by_itself() {
        let wave = |k: usize| 100.0 + 90.0 * ((k % 60) as f32 * 0.21).sin() * ((k / 60) as f32 * 0.13).cos();
        let picture = trueup_core::raster::Raster::from_data(60, 50, 1, (0..60 * 50).map(wave).collect());
        let field = GradientField::new(&picture.expect("as many"));
        let rectangle = LineSupportRectangle {
            center: [28.2, 22.7],
            direction: [0.8, 0.6],
            along: [-18.0, 17.3],
            across: [-7.5, 9.1],
            halvings: 0,
        };
        let tangents = [1.2, 0.4, 0.2, 0.1];
        let (total, aligned) = rectangle.count(&field, tangents);
        assert!(aligned.is_sorted_by(|wider, finer| wider > finer) && aligned[0] < total, "{aligned:?} of {total}");
        for (aligned, tangent) in aligned.into_iter().zip(tangents) {
            assert_eq!(rectangle.count(&field, [tangent]), (total, [aligned]), "{tangent}");
        }
    }
}
