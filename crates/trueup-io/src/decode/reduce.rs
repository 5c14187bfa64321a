//! Exact area averaging.

use trueup_core::raster::Raster;

/// Whole pixels are counted inside a real length this much too short, so that 799.9999999 is 800.
const ROUNDING_PX: f64 = 1e-6;

/// A sample of a picture that is reduced.
pub(crate) trait ReducedSample: Copy + Default + Into<f32> {
    /// The factor that brings a sample to the range 0 to 255.
    const TO_255: f32;
}

impl ReducedSample for u8 {
    const TO_255: f32 = 1.0;
}

impl ReducedSample for u16 {
    const TO_255: f32 = 1.0 / 257.0;
}

/// A sample of a picture that was reduced before.
impl ReducedSample for f32 {
    const TO_255: f32 = 1.0;
}

/// The source pixels under one target pixel along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    /// First source pixel.
    first: usize,
    /// Number of source pixels, at least one.
    count: usize,
    /// Weight of the first pixel; all weights of a span add up to 1.
    first_weight: f32,
    /// Weight of the pixels between the first and the last.
    inner_weight: f32,
    /// Weight of the last pixel, where it is not the first.
    last_weight: f32,
}

impl Span {
    fn weight(&self, offset: usize) -> f32 {
        match offset {
            0 => self.first_weight,
            _ if offset + 1 == self.count => self.last_weight,
            _ => self.inner_weight,
        }
    }
}

/// How many whole target pixels a real length holds; at least one.
pub(crate) fn whole_pixels(length: f64) -> usize {
    ((length + ROUNDING_PX) as usize).max(1)
}

/// The spans of `target_length` pixels over `length` source pixels: target pixel i covers the source from i / scale to
/// (i + 1) / scale, as far as there is source.
fn spans(length: usize, scale: f64, target_length: usize) -> Vec<Span> {
    let span = |index: usize| {
        // The last span may pass the end by rounding, and a target of a single pixel by much.
        let start = (index as f64 / scale).clamp(0.0, length as f64 - 1.0);
        let end = ((index + 1) as f64 / scale).min(length as f64).max(start + f64::EPSILON);
        let first = start as usize;
        let last = (end.ceil() as usize).saturating_sub(1).clamp(first, length - 1);
        let total = end - start;
        let first_end = end.min(first as f64 + 1.0);
        Span {
            first,
            count: last - first + 1,
            first_weight: ((first_end - start) / total) as f32,
            inner_weight: (1.0 / total) as f32,
            last_weight: ((end - last as f64) / total) as f32,
        }
    };
    (0..target_length).map(span).collect()
}

/// Reduces `source` by `scale` to `width` x `height` pixels from the corner (0, 0). The result is gray (from one
/// channel) or RGB (from three, and from four with the colors multiplied by alpha), 0 to 255.
///
/// Columns are averaged first, whole rows at a time: that runs through memory in order and in vector registers, and
/// leaves the rows, which do not, with the few rows that remain.
pub(crate) fn area_average<T: ReducedSample>(
    source: &Raster<T>,
    scale: f64,
    width: usize,
    height: usize,
) -> Raster<f32> {
    let channels = if source.channels() == 1 { 1 } else { 3 };
    if source.width() == 0 || source.height() == 0 {
        return Raster::new(0, 0, channels);
    }
    let columns = spans(source.width(), scale, width);
    let rows = spans(source.height(), scale, height);
    let mut target = Raster::new(width, height, channels);
    let mut sums = vec![0.0_f32; source.width() * source.channels()];
    for (y, span) in rows.iter().enumerate() {
        sums.fill(0.0);
        for offset in 0..span.count {
            let row = source.row(span.first + offset);
            let weight = span.weight(offset) * T::TO_255;
            if source.channels() == 4 && !is_opaque(row) {
                add_row_with_alpha(row, weight, &mut sums);
            } else {
                add_row(row, weight, &mut sums);
            }
        }
        match source.channels() {
            1 => average_columns::<1, 1>(&sums, &columns, target.row_mut(y)),
            3 => average_columns::<3, 3>(&sums, &columns, target.row_mut(y)),
            _ => average_columns::<4, 3>(&sums, &columns, target.row_mut(y)),
        }
    }
    target
}

fn is_opaque<T: ReducedSample>(rgba: &[T]) -> bool {
    rgba.as_chunks::<4>().0.iter().all(|&[_, _, _, alpha]| alpha.into() * T::TO_255 >= 255.0)
}

fn add_row<T: ReducedSample>(row: &[T], weight: f32, sums: &mut [f32]) {
    for (sum, &sample) in sums.iter_mut().zip(row) {
        *sum += weight * sample.into();
    }
}

fn add_row_with_alpha<T: ReducedSample>(row: &[T], weight: f32, sums: &mut [f32]) {
    // Full alpha times this is 1.
    let alpha_to_unit = T::TO_255 / 255.0;
    for (sum, &[r, g, b, alpha]) in sums.as_chunks_mut::<4>().0.iter_mut().zip(row.as_chunks::<4>().0) {
        let weight = weight * (alpha.into() * alpha_to_unit);
        sum[0] += weight * r.into();
        sum[1] += weight * g.into();
        sum[2] += weight * b.into();
    }
}

/// Averages along a row of `SOURCE` channels, of which the first `TARGET` are kept.
fn average_columns<const SOURCE: usize, const TARGET: usize>(sums: &[f32], columns: &[Span], target: &mut [f32]) {
    let (pixels, _) = sums.as_chunks::<SOURCE>();
    let (target, _) = target.as_chunks_mut::<TARGET>();
    for (value, span) in target.iter_mut().zip(columns) {
        let covered = &pixels[span.first..span.first + span.count];
        *value = [0.0; TARGET];
        for (offset, pixel) in covered.iter().enumerate() {
            let weight = span.weight(offset);
            for (sum, sample) in value.iter_mut().zip(pixel) {
                *sum += weight * sample;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use trueup_core::source::WorkingFrame;

    use super::*;

    fn to_frame<T: ReducedSample>(source: &Raster<T>, frame: &WorkingFrame) -> Raster<f32> {
        area_average(source, frame.working_from_full, whole_pixels(frame.width), whole_pixels(frame.height))
    }

    #[test]
    fn no_reduction_is_no_resampling() {
        let source = Raster::from_data(4, 3, 1, (0..12_u8).map(|i| i * 21).collect()).expect("12 samples");
        let same = to_frame(&source, &WorkingFrame::new(4, 3, 1e9));
        let expected: Vec<f32> = source.data().iter().map(|&v| f32::from(v)).collect();
        assert_eq!(same.data(), expected);
    }

    #[test]
    fn fractional_coverage_is_weighted_by_area() {
        // Scale 2/3: target pixel 0 covers source [0, 1.5), pixel 1 covers [1.5, 3).
        let source = Raster::from_data(3, 1, 1, vec![30_u8, 60, 120]).expect("3 samples");
        let reduced = area_average(&source, 2.0 / 3.0, 2, 1);
        let expected = [(30.0 + 0.5 * 60.0) / 1.5, (0.5 * 60.0 + 120.0) / 1.5];
        for (value, expected) in reduced.data().iter().zip(expected) {
            assert!((value - expected).abs() < 1e-4, "{value} {expected}");
        }
    }

    #[test]
    fn alpha_weighs_the_colors() {
        let source = Raster::from_data(2, 1, 4, vec![200_u8, 100, 50, 255, 200, 100, 50, 0]).expect("8 samples");
        let reduced = area_average(&source, 0.5, 1, 1);
        assert_eq!(reduced.channels(), 3);
        for (value, expected) in reduced.data().iter().zip([100.0, 50.0, 25.0]) {
            assert!((value - expected).abs() < 1e-4);
        }
        let opaque = Raster::from_data(2, 1, 4, vec![200_u16 * 257; 8]).expect("8 samples");
        let opaque = Raster::from_data(
            2,
            1,
            4,
            opaque.data().iter().enumerate().map(|(i, &v)| if i % 4 == 3 { u16::MAX } else { v }).collect(),
        )
        .expect("8 samples");
        assert!((area_average(&opaque, 0.5, 1, 1).data()[0] - 200.0).abs() < 1e-3);
    }

    proptest! {
        /// A ramp keeps its values under area averaging: working pixel x shows the ramp at (x + 0.5) / scale. The
        /// ramp's pixels are steps, and a mean that begins or ends within a step is off by up to an eighth of it.
        #[test]
        fn geometry_has_no_shift(width in 17_usize..200, height in 1_usize..40, area in 4.0_f64..4000.0) {
            let frame = WorkingFrame::new(width, height, area);
            let data: Vec<u16> = (0..height).flat_map(|_| (0..width).map(|x| (257 * x) as u16)).collect();
            let reduced = to_frame(&Raster::from_data(width, height, 1, data).expect("size"), &frame);
            // A single column may stand for less than its whole width; the contract is about whole pixels.
            prop_assume!(frame.width >= 1.0);
            let tolerance = 0.125 * frame.working_from_full + 0.01;
            for x in 0..reduced.width() {
                let expected = (x as f64 + 0.5) / frame.working_from_full - 0.5;
                prop_assert!((f64::from(reduced.row(0)[x]) - expected).abs() < tolerance);
            }
        }

        #[test]
        fn weights_add_up_to_one(length in 1_usize..5000, scale in 0.0005_f64..=1.0) {
            for span in spans(length, scale, whole_pixels(length as f64 * scale)) {
                let sum: f32 = (0..span.count).map(|offset| span.weight(offset)).sum();
                prop_assert!((sum - 1.0).abs() < 1e-3);
                prop_assert!(span.first + span.count <= length);
            }
        }
    }
}
