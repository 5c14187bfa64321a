//! Connected pixels whose level lines share a direction.

use super::gradient::{ANGLE_TOLERANCE_DEG, GradientField, PointMass};
use super::rectangle::{LineSupportRectangle, is_aligned};

/// The smallest region a rectangle can be fitted to.
const MIN_REGION: usize = 2;

/// Smallest share of a rectangle's area that its region must fill; sparser regions bend and are cut (IPOL, section
/// 2.6).
const MIN_DENSITY: f64 = 0.7;

/// What a step of the reduction of a sparse region leaves of its radius (IPOL, section 2.6).
const RADIUS_REDUCTION: f64 = 0.75;

/// A sparse region is grown again within this many standard deviations of the directions near its seed (IPOL, 2.6).
const TOLERANCE_SIGMAS: f64 = 2.0;

/// Grows regions; every pixel belongs to at most one.
#[derive(Debug)]
pub(super) struct RegionGrower<'a> {
    field: &'a GradientField,
    /// Pixels that are in a region or have no level line.
    used: Vec<bool>,
    /// The region in the making, its seed first.
    region: Vec<u32>,
    /// Its pixels, where they are looked at more than once.
    pixels: Vec<PointMass>,
    /// Sum of the region's level lines: its direction.
    sum: [f32; 2],
    tolerance: f64,
    /// Its tangent.
    tangent: f32,
}

impl<'a> RegionGrower<'a> {
    pub(super) fn new(field: &'a GradientField) -> Self {
        let tolerance = ANGLE_TOLERANCE_DEG.to_radians();
        Self {
            field,
            used: field.magnitudes().iter().map(|&magnitude| magnitude <= 0.0).collect(),
            region: Vec::new(),
            pixels: Vec::new(),
            sum: [0.0; 2],
            tolerance,
            tangent: tolerance.tan() as f32,
        }
    }

    /// The probability that a pixel of noise is aligned with a region.
    pub(super) fn aligned_probability(&self) -> f64 {
        self.tolerance / std::f64::consts::PI
    }

    /// Grows a region from `seed` and fits its rectangle; `None` if the seed is taken, or the region is smaller than
    /// `min_region` or cannot be made dense enough.
    pub(super) fn rectangle_from(&mut self, seed: u32, min_region: usize) -> Option<LineSupportRectangle> {
        if self.used[seed as usize] {
            return None;
        }
        self.grow(seed, self.tangent);
        if self.region.len() < min_region.max(MIN_REGION) {
            return None;
        }
        let rectangle = self.fit()?;
        if rectangle.density(self.region.len()) >= MIN_DENSITY {
            return Some(rectangle);
        }
        let rectangle = self.grow_narrowly(seed, &rectangle)?;
        if rectangle.density(self.region.len()) >= MIN_DENSITY {
            return Some(rectangle);
        }
        self.shrink(seed, rectangle)
    }

    fn fit(&mut self) -> Option<LineSupportRectangle> {
        self.pixels.clear();
        self.pixels.extend(self.region.iter().map(|&index| self.field.pixel(index)));
        LineSupportRectangle::around(&self.pixels, self.sum.map(f64::from))
    }

    /// Adds 8-connected pixels, within the angle of the tangent given of the region's mean direction, until there are
    /// none.
    ///
    /// # Source
    /// IPOL, section 2.4.
    fn grow(&mut self, seed: u32, tangent: f32) {
        let lines = self.field.level_lines();
        let stride = self.field.stride();
        // The neighbors, from the one at the upper left on.
        let offsets = [0, 1, 2, stride, stride + 2, 2 * stride, 2 * stride + 1, 2 * stride + 2];
        self.region.clear();
        self.region.push(seed);
        self.used[seed as usize] = true;
        let mut sum = lines[seed as usize];
        let mut next = 0;
        while let Some(&index) = self.region.get(next) {
            next += 1;
            // Pixels of the field have all eight neighbors in the padded arrays.
            let first = index as usize - stride - 1;
            for offset in offsets {
                let neighbor = first + offset;
                if !self.used[neighbor] && is_aligned(lines[neighbor], sum, tangent) {
                    self.used[neighbor] = true;
                    sum = [sum[0] + lines[neighbor][0], sum[1] + lines[neighbor][1]];
                    self.region.push(neighbor as u32);
                }
            }
        }
        self.sum = sum;
    }

    /// Grows the region again with a tolerance taken from the directions near its seed.
    ///
    /// # Source
    /// IPOL, section 2.6.
    fn grow_narrowly(&mut self, seed: u32, rectangle: &LineSupportRectangle) -> Option<LineSupportRectangle> {
        let lines = self.field.level_lines();
        let seed_line = lines[seed as usize];
        let center = self.field.pixel(seed);
        let near = squared(rectangle.width());
        let (mut count, mut sum, mut sum_of_squares) = (0.0, 0.0, 0.0);
        for (&index, pixel) in self.region.iter().zip(&self.pixels) {
            let line = lines[index as usize];
            self.used[index as usize] = false;
            if pixel.squared_distance(&center) < near {
                let dot = line[0] * seed_line[0] + line[1] * seed_line[1];
                let cross = seed_line[0] * line[1] - seed_line[1] * line[0];
                let turn = f64::from(cross.atan2(dot));
                count += 1.0;
                sum += turn;
                sum_of_squares += turn * turn;
            }
        }
        let variance = if count > 0.0 { sum_of_squares / count - squared(sum / count) } else { 0.0 };
        // Never wider than the first growth, which the seed's surroundings alone could suggest.
        let tolerance = (TOLERANCE_SIGMAS * variance.max(0.0).sqrt()).min(self.tolerance);
        self.grow(seed, tolerance.tan() as f32);
        if self.region.len() < MIN_REGION { None } else { self.fit() }
    }

    /// Gives up the pixels farthest from the seed until the rectangle is dense enough.
    ///
    /// # Source
    /// IPOL, section 2.6.
    fn shrink(&mut self, seed: u32, mut rectangle: LineSupportRectangle) -> Option<LineSupportRectangle> {
        let center = self.field.pixel(seed);
        let mut radius_squared = rectangle
            .axis()
            .map(|end| squared(end[0] - center.x) + squared(end[1] - center.y))
            .into_iter()
            .fold(0.0, f64::max);
        while rectangle.density(self.region.len()) < MIN_DENSITY {
            radius_squared *= squared(RADIUS_REDUCTION);
            let used = &mut self.used;
            let mut pixels = self.pixels.iter();
            self.region.retain(|&index| {
                let keep = pixels.next().is_some_and(|pixel| pixel.squared_distance(&center) <= radius_squared);
                used[index as usize] = keep;
                keep
            });
            if self.region.len() < MIN_REGION {
                return None;
            }
            rectangle = self.fit()?;
        }
        Some(rectangle)
    }
}

fn squared(value: f64) -> f64 {
    value * value
}
