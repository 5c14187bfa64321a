//! The reduced picture's gradient: magnitudes and unit vectors along the level lines.

use rayon::prelude::*;
use trueup_core::raster::Raster;

/// Reduction of the picture before its gradient is taken, which removes aliasing and the staircase of pixels (IPOL,
/// section 2.1).
const REDUCTION: f64 = 0.8;

/// Factor from the reduced picture's coordinates to the picture's.
pub(super) const PICTURE_FROM_FIELD: f64 = 1.0 / REDUCTION;

/// Standard deviation of the Gaussian that goes with the reduction, in pixels of the reduced picture (IPOL, section
/// 2.1).
const SIGMA_REDUCED_PX: f64 = 0.6;

/// Bound on the error of a gray level by quantization, in levels of 0 to 255 (IPOL, section 2.2). Pixels whose gradient
/// could turn by more than [`ANGLE_TOLERANCE_DEG`] under this error take no part.
const QUANTIZATION: f64 = 2.0;

/// How far the level line of a pixel may turn from the direction of its region, in degrees (IPOL, section 2.4).
pub(super) const ANGLE_TOLERANCE_DEG: f64 = 22.5;

/// Classes of gradient magnitude by which seeds are ordered (IPOL, section 2.3).
const MAGNITUDE_CLASSES: usize = 1024;

/// The Gaussian is cut where it has fallen to 10^-3 of its peak: sqrt(2 ln 1000) standard deviations.
const GAUSSIAN_REACH_SIGMAS: f64 = 3.717;

/// Rows a thread reduces at a time.
const ROWS_PER_TASK: usize = 16;

/// A pixel of a region, in the padded field's coordinates, with its gradient magnitude for mass.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointMass {
    pub x: f64,
    pub y: f64,
    pub mass: f64,
}

impl PointMass {
    pub(super) fn squared_distance(&self, other: &Self) -> f64 {
        let (dx, dy) = (self.x - other.x, self.y - other.y);
        dx * dx + dy * dy
    }
}

/// Level lines and gradient magnitudes at the nodes between the pixels of the reduced picture.
///
/// Arrays are padded by one element on every side, which is never aligned with anything, so that neighbors need no
/// check of the border: the element at column x and row y of the padded arrays lies at (x, y) in corner coordinates of
/// the reduced picture.
#[derive(Debug)]
pub(super) struct GradientField {
    width: usize,
    height: usize,
    level_lines: Vec<[f32; 2]>,
    magnitudes: Vec<f32>,
}

impl GradientField {
    /// Reduces the picture and takes its gradient.
    pub(super) fn new(picture: &Raster<f32>) -> Self {
        Self::of_reduced(&reduce(picture, REDUCTION, SIGMA_REDUCED_PX))
    }

    /// The gradient on 2 x 2 pixels.
    ///
    /// # Source
    /// IPOL, sections 2.1 to 2.4. The gradient averages two differences on each axis; pixels whose magnitude is not
    /// above [`QUANTIZATION`] / sin([`ANGLE_TOLERANCE_DEG`]) have no direction (their level line is (0, 0)).
    fn of_reduced(reduced: &Raster<f32>) -> Self {
        let (width, height) = (reduced.width().saturating_sub(1), reduced.height().saturating_sub(1));
        if width == 0 || height == 0 {
            return Self { width: 0, height: 0, level_lines: vec![[0.0; 2]; 4], magnitudes: vec![0.0; 4] };
        }
        let stride = width + 2;
        let threshold = (QUANTIZATION / ANGLE_TOLERANCE_DEG.to_radians().sin()) as f32;
        let mut level_lines = vec![[0.0_f32; 2]; stride * (height + 2)];
        let mut magnitudes = vec![0.0_f32; stride * (height + 2)];
        let inside = stride..stride * (height + 1);
        level_lines[inside.clone()]
            .par_chunks_mut(stride)
            .zip(magnitudes[inside].par_chunks_mut(stride))
            .with_min_len(ROWS_PER_TASK)
            .enumerate()
            .for_each(|(y, (lines, magnitudes))| {
                let nodes = 1..=width;
                gradient_row(
                    reduced.row(y),
                    reduced.row(y + 1),
                    threshold,
                    &mut lines[nodes.clone()],
                    &mut magnitudes[nodes],
                );
            });
        Self { width, height, level_lines, magnitudes }
    }

    /// Nodes across, without padding.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Nodes down, without padding.
    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// Elements from one row of the padded arrays to the next.
    pub(super) fn stride(&self) -> usize {
        self.width + 2
    }

    /// Unit vectors along the level lines, the brighter side to their right on the screen; (0, 0) where there is none.
    pub(super) fn level_lines(&self) -> &[[f32; 2]] {
        &self.level_lines
    }

    /// Gradient magnitudes in gray levels per reduced pixel; 0 where there is no level line.
    pub(super) fn magnitudes(&self) -> &[f32] {
        &self.magnitudes
    }

    /// An element of the padded arrays, its magnitude for mass.
    pub(super) fn pixel(&self, index: u32) -> PointMass {
        let stride = self.stride() as u32;
        let mass = f64::from(self.magnitudes[index as usize]);
        PointMass { x: f64::from(index % stride), y: f64::from(index / stride), mass }
    }

    /// The elements that have a level line, those of the largest magnitude first, in [`MAGNITUDE_CLASSES`] classes; row
    /// by row inside a class (IPOL, section 2.3).
    pub(super) fn seeds(&self) -> Vec<u32> {
        const LAST_CLASS: usize = MAGNITUDE_CLASSES - 1;
        let largest = self.magnitudes.iter().copied().fold(0.0_f32, f32::max);
        if largest <= 0.0 {
            return Vec::new();
        }
        let class_from_magnitude = MAGNITUDE_CLASSES as f32 / largest;
        // Class 0 holds the largest magnitudes.
        let class_of = |magnitude: f32| LAST_CLASS - ((magnitude * class_from_magnitude) as usize).min(LAST_CLASS);
        let mut starts = vec![0_usize; MAGNITUDE_CLASSES + 1];
        for &magnitude in self.magnitudes.iter().filter(|&&magnitude| magnitude > 0.0) {
            starts[class_of(magnitude) + 1] += 1;
        }
        for class in 0..MAGNITUDE_CLASSES {
            starts[class + 1] += starts[class];
        }
        let mut seeds = vec![0_u32; starts[MAGNITUDE_CLASSES]];
        for (index, &magnitude) in self.magnitudes.iter().enumerate() {
            if magnitude > 0.0 {
                let next = &mut starts[class_of(magnitude)];
                seeds[*next] = index as u32;
                *next += 1;
            }
        }
        seeds
    }
}

/// The nodes between two rows of pixels. All slices but the rows are as long as there are nodes.
fn gradient_row(upper: &[f32], lower: &[f32], threshold: f32, lines: &mut [[f32; 2]], magnitudes: &mut [f32]) {
    let pairs = upper.iter().zip(&upper[1..]).zip(lower.iter().zip(&lower[1..]));
    for (((&nw, &ne), (&sw, &se)), (line, magnitude)) in pairs.zip(lines.iter_mut().zip(magnitudes)) {
        let gradient_x = 0.5 * ((ne - nw) + (se - sw));
        let gradient_y = 0.5 * ((sw - nw) + (se - ne));
        let norm = (gradient_x * gradient_x + gradient_y * gradient_y).sqrt();
        // False for NaN and infinity too.
        let defined = norm > threshold && norm < f32::MAX;
        let inverse = if defined { 1.0 / norm } else { 0.0 };
        *magnitude = if defined { norm } else { 0.0 };
        *line = if defined { [gradient_y * inverse, -gradient_x * inverse] } else { [0.0; 2] };
    }
}

/// The picture smoothed by a Gaussian of `sigma_scale / scale` pixels and sampled at the centers of pixels that are
/// `1 / scale` wide; corners coincide. `scale` is below 1.
fn reduce(picture: &Raster<f32>, scale: f64, sigma_scale: f64) -> Raster<f32> {
    if picture.data().is_empty() {
        return picture.clone();
    }
    let columns = AxisFilter::new(picture.width(), scale, sigma_scale);
    let rows = AxisFilter::new(picture.height(), scale, sigma_scale);
    let mut reduced = Raster::new(columns.starts.len(), rows.starts.len(), 1);
    if reduced.data().is_empty() {
        return reduced;
    }
    let reduced_width = reduced.width();
    reduced.data_mut().par_chunks_mut(reduced_width).with_min_len(ROWS_PER_TASK).enumerate().for_each_init(
        || vec![0.0_f32; picture.width()],
        |blended, (y, output)| {
            rows.blend_rows(y, picture, blended);
            columns.filter_row(blended, output);
        },
    );
    reduced
}

/// A Gaussian sampled along one axis: for each output, weights of `taps` inputs from `start` on.
struct AxisFilter {
    taps: usize,
    starts: Vec<usize>,
    weights: Vec<f32>,
}

impl AxisFilter {
    fn new(length: usize, scale: f64, sigma_scale: f64) -> Self {
        let sigma = sigma_scale / scale;
        let reach = (sigma * GAUSSIAN_REACH_SIGMAS).ceil() as isize;
        let taps = (2 * reach as usize + 2).min(length);
        let outputs = (length as f64 * scale).floor() as usize;
        let mut starts = Vec::with_capacity(outputs);
        let mut weights = vec![0.0_f32; outputs * taps];
        let mut sampled = Vec::new();
        for (output, weights) in weights.chunks_exact_mut(taps.max(1)).enumerate() {
            let center = (output as f64 + 0.5) / scale;
            let first = center.floor() as isize - reach;
            let start = first.clamp(0, (length - taps) as isize);
            let inputs = first..first + 2 * reach + 2;
            let weight_of = |input: isize| (-0.5 * ((input as f64 + 0.5 - center) / sigma).powi(2)).exp();
            sampled.clear();
            sampled.extend(inputs.clone().map(weight_of));
            let total: f64 = sampled.iter().sum();
            for (input, sampled) in inputs.zip(&sampled) {
                let inside = mirror(input, length as isize) - start;
                // Short axes fold more than once; what falls outside the window then is negligible or nothing.
                if let Some(weight) = weights.get_mut(inside.max(0) as usize) {
                    *weight += (sampled / total) as f32;
                }
            }
            starts.push(start as usize);
        }
        Self { taps, starts, weights }
    }

    /// The weighted mean of the picture's rows that make output row `y`.
    fn blend_rows(&self, y: usize, picture: &Raster<f32>, blended: &mut [f32]) {
        blended.fill(0.0);
        let weights = &self.weights[y * self.taps..(y + 1) * self.taps];
        for (tap, &weight) in weights.iter().enumerate() {
            // A weight of zero is a tap beyond the Gaussian's reach.
            if weight != 0.0 {
                let row = picture.row(self.starts[y] + tap);
                blended.iter_mut().zip(row).for_each(|(sum, &sample)| *sum += weight * sample);
            }
        }
    }

    /// Filters one row.
    fn filter_row(&self, row: &[f32], output: &mut [f32]) {
        let windows = self.starts.iter().zip(self.weights.chunks_exact(self.taps));
        for (sample, (&start, weights)) in output.iter_mut().zip(windows) {
            let inputs = &row[start..start + self.taps];
            *sample = weights.iter().zip(inputs).map(|(weight, input)| weight * input).sum();
        }
    }
}

/// The index in 0..length that `index` mirrors to at the outer edges of the first and last element.
fn mirror(index: isize, length: isize) -> isize {
    let folded = index.rem_euclid(2 * length);
    if folded < length { folded } else { 2 * length - 1 - folded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reduction_keeps_a_constant_and_the_corner() {
        let flat = Raster::from_data(11, 7, 1, vec![90.0; 77]).expect("sizes agree");
        let reduced = reduce(&flat, 0.8, 0.6);
        assert_eq!((reduced.width(), reduced.height()), (8, 5));
        assert!(reduced.data().iter().all(|&sample| (sample - 90.0).abs() < 1e-4));
        // A ramp of one level a pixel, x + 0.5 at its centers, stays a ramp of the same corner coordinates.
        let ramp = Raster::from_data(40, 1, 1, (0..40).map(|x| x as f32 + 0.5).collect()).expect("sizes agree");
        let filter = AxisFilter::new(40, 0.8, 0.6);
        let mut output = vec![0.0; 32];
        filter.filter_row(ramp.row(0), &mut output);
        assert!((f64::from(output[16]) - 16.5 / 0.8).abs() < 2e-3, "{}", output[16]);
    }

    #[test]
    fn strong_reductions_of_any_size_stay_within_the_levels() {
        for (width, height) in [(0, 0), (1, 1), (1, 500), (500, 1), (2, 2), (3, 8), (8, 8), (200, 100)] {
            let samples = (0..width * height).map(|index| ((index * 7919) % 256) as f32).collect();
            let busy = Raster::from_data(width, height, 1, samples).expect("sizes agree");
            let reduced = reduce(&busy, 0.1, 4.0);
            let sides = [reduced.width(), reduced.height()];
            assert!(width < 10 || height < 10 || sides == [width / 10, height / 10], "{sides:?}");
            assert!(reduced.data().iter().all(|level| (-0.01..=255.01).contains(level)), "{width} x {height}");
        }
    }

    #[test]
    fn level_lines_have_the_brighter_side_on_their_right() {
        // Brighter towards larger x: up the screen.
        let picture = Raster::from_data(2, 2, 1, vec![0.0, 100.0, 0.0, 100.0]).expect("sizes agree");
        let field = GradientField::of_reduced(&picture);
        assert_eq!(field.level_lines()[field.stride() + 1], [0.0, -1.0]);
        assert_eq!(field.magnitudes()[field.stride() + 1], 100.0);
    }

    #[test]
    fn seeds_come_by_falling_magnitude() {
        let picture = Raster::from_data(4, 2, 1, vec![0.0, 10.0, 60.0, 100.0, 0.0, 10.0, 60.0, 100.0]).expect("sizes");
        let field = GradientField::of_reduced(&picture);
        let first = field.stride() as u32 + 1;
        assert_eq!(field.seeds(), [first + 1, first + 2, first]);
    }

    #[test]
    fn mirroring_folds_as_often_as_needed() {
        let folded: Vec<isize> = (-3..6).map(|index| mirror(index, 2)).collect();
        assert_eq!(folded, [1, 1, 0, 0, 1, 1, 0, 0, 1]);
    }
}
