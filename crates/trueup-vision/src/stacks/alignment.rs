//! Where a member of a stack lies on its reference, to a part of a pixel.
//!
//! The cameras of a hand-held stack turn: a rotation by three angles, and the focal length, which two pictures tell the
//! better the farther they are apart. They are found by Gauss-Newton steps over pyramids, on the darker exposure and
//! what the brighter one lets expect of it, so that the exposures need not be known.
//!
//! # Source
//! Lucas and Kanade, "An iterative image registration technique with an application to stereo vision", IJCAI 1981;
//! Baker and Matthews, "Lucas-Kanade 20 years on: a unifying framework", IJCV 56(3), 2004, forwards compositional;
//! weights of Beaton and Tukey, "The fitting of power series", Technometrics 16(2), 1974, for what moved.

use nalgebra::{Matrix3, Matrix4, Rotation3, Vector3, Vector4};
use rayon::prelude::*;
use trueup_core::color::{ToneRelation, ToneSums};
use trueup_core::geometry::Homography;
use trueup_core::interpolation::cubic_convolution_taps;
use trueup_core::raster::Raster;
use trueup_core::statistics::{SD_PER_MEDIAN_MAGNITUDE, median};

use super::likeness::{CLIPPED, CRUSHED, expected, likeness};
use super::limits::MOST_SHIFT;
use crate::gray::halved;

/// Shortest side of the coarsest pictures, in pixels.
const COARSEST_PX: usize = 48;
/// Steps at each size, at most.
const MOST_STEPS: usize = 15;
/// A step that moves no corner by so much, in pixels of its size, is the last.
const STILL_PX: f64 = 0.005;
/// Residuals beyond this many standard deviations count for nothing: 95 % as efficient as least squares on normal ones
/// (Beaton and Tukey).
const TUKEY: f64 = 4.685;
/// Smallest standard deviation of residuals, in levels: rounding to 8 bits alone leaves 0.29, on both exposures 0.41.
const LEAST_DEVIATION: f64 = 0.4;
/// Standard deviation of the logarithm of a focal length that nothing tells: most lenses of panoramas see 40 to 90
/// degrees.
const GUESSED_FOCAL_DEVIATION: f64 = 0.4;
/// The same of one that metadata tell.
const TOLD_FOCAL_DEVIATION: f64 = 0.05;
/// A focal length that nothing tells, in longer sides: 50 degrees.
const GUESSED_FOCAL: f64 = 1.07;
/// Correlation of details at half the size from which two exposures are aligned: brackets of known cameras reach 0.8 to
/// 0.99.
const ALIGNED: f64 = 0.6;
/// Share of tiles with detail that must agree then.
const LEAST_AGREEING_TILES: f64 = 0.6;

/// Two exposures to be aligned.
#[derive(Debug, Clone, Copy)]
pub struct MemberPair<'a> {
    /// Gray values of the reference, 0 to 255.
    pub reference: &'a Raster<f32>,
    /// Of the member, in a picture of the same size.
    pub member: &'a Raster<f32>,
    /// How much brighter than the reference the member is, in stops.
    pub stops: f64,
    /// Where the member shows a thing, minus where the reference does, as parts of the width.
    pub shift: [f64; 2],
    /// The focal length in pixels of these pictures, if metadata tell it.
    pub focal_px: Option<f64>,
}

/// A member that lies on its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlignedMember {
    /// In pixels of the pictures given.
    pub reference_from_member: Homography,
    /// Correlation of their details, up to 1.
    pub correlation: f64,
}

/// Why a member does not lie on its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unaligned {
    /// The pictures have no size in common, or none that could be aligned.
    NoPicture,
    /// Its details are none of the reference's: their correlation.
    OtherDetails(f64),
    /// It lies too far from it: by this part of the longer side.
    TooFar(f64),
}

/// Finds where `pair`'s member lies on its reference.
///
/// # Errors
/// [`Unaligned`] if what is found is no alignment.
pub fn align(pair: &MemberPair) -> Result<AlignedMember, Unaligned> {
    let MemberPair { reference, member, stops, shift, focal_px } = *pair;
    let same_size = (reference.width(), reference.height()) == (member.width(), member.height());
    if !same_size || reference.width().min(reference.height()) < COARSEST_PX {
        return Err(Unaligned::NoPicture);
    }
    let member_is_bright = stops >= 0.0;
    let (dark, bright) = if member_is_bright { (reference, member) } else { (member, reference) };
    let sign = if member_is_bright { 1.0 } else { -1.0 };
    let longer = reference.width().max(reference.height()) as f64;
    let mut sizes = vec![(dark.clone(), bright.clone())];
    while let Some((dark, bright)) = sizes.last()
        && dark.width().min(dark.height()) >= 2 * COARSEST_PX
    {
        sizes.push((halved(dark), halved(bright)));
    }
    let width = reference.width() as f64;
    let guess = focal_px.unwrap_or(GUESSED_FOCAL * longer);
    let deviation = if focal_px.is_some() { TOLD_FOCAL_DEVIATION } else { GUESSED_FOCAL_DEVIATION };
    let angles = [0, 1].map(|axis| sign * shift[axis] * width / guess);
    let mut turn = Turn {
        rotation: Rotation3::from_scaled_axis(Vector3::new(-angles[1], angles[0], 0.0)),
        log_focal: 0.0,
        guess,
        deviation,
    };
    let size = [reference.width(), reference.height()];
    let is_near = |moved: f64| moved <= 2.0 * MOST_SHIFT * longer;
    for (level, (dark, bright)) in sizes.iter().enumerate().rev() {
        let before = turn;
        turn.refine(dark, bright, 0.5_f64.powi(level as i32));
        // Where hardly anything is not white, small pictures may lead astray; larger ones tell more from where these
        // began.
        if !is_near(turn.farthest_px(size)) {
            turn = before;
        }
    }
    let moved = turn.farthest_px(size);
    if !is_near(moved) {
        return Err(Unaligned::TooFar(moved / longer));
    }
    let bright_from_dark = turn.bright_from_dark(size, 1.0);
    let checked = usize::from(sizes.len() > 1);
    let (dark, bright) = &sizes[checked];
    let scale = 0.5_f64.powi(checked as i32);
    let warped = turn.warped(bright, scale);
    let found = expected(dark, &warped).map(|(_, expected)| likeness(dark, &expected)).unwrap_or_default();
    if found.correlation < ALIGNED || found.agreeing_tiles < LEAST_AGREEING_TILES {
        return Err(Unaligned::OtherDetails(found.correlation));
    }
    let reference_from_member = match member_is_bright {
        true => bright_from_dark.inverse().ok_or(Unaligned::NoPicture)?,
        false => bright_from_dark,
    };
    Ok(AlignedMember { reference_from_member, correlation: found.correlation })
}

/// The larger of two numbers; none if either is none.
fn larger(one: f64, other: f64) -> f64 {
    if one.is_nan() || one > other { one } else { other }
}

fn corners([width, height]: [usize; 2]) -> [nalgebra::Vector2<f64>; 4] {
    let (width, height) = (width as f64, height as f64);
    [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]].map(nalgebra::Vector2::from)
}

/// How the camera turned from the dark exposure to the bright one, and its focal length.
#[derive(Debug, Clone, Copy)]
struct Turn {
    rotation: Rotation3<f64>,
    /// Of the focal length over the one that was guessed.
    log_focal: f64,
    /// In pixels of the full pictures.
    guess: f64,
    /// Standard deviation of `log_focal` before the pictures are looked at.
    deviation: f64,
}

/// Sums over pixels: a symmetric matrix and a vector.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    matrix: Matrix4<f64>,
    vector: Vector4<f64>,
}

impl Turn {
    fn focal(&self) -> f64 {
        self.guess * self.log_focal.exp()
    }

    /// In pixels of a picture `scale` as large as the full one.
    fn bright_from_dark(&self, [width, height]: [usize; 2], scale: f64) -> Homography {
        let focal = self.focal() * scale;
        let camera = Matrix3::new(focal, 0.0, width as f64 / 2.0, 0.0, focal, height as f64 / 2.0, 0.0, 0.0, 1.0);
        let (x, y) = (width as f64 / 2.0, height as f64 / 2.0);
        let inverse = Matrix3::new(1.0 / focal, 0.0, -x / focal, 0.0, 1.0 / focal, -y / focal, 0.0, 0.0, 1.0);
        Homography(camera * self.rotation.matrix() * inverse)
    }

    /// How far it moves the corner of a full picture that it moves farthest, in pixels.
    fn farthest_px(&self, size: [usize; 2]) -> f64 {
        let bright_from_dark = self.bright_from_dark(size, 1.0);
        let moved = corners(size).map(|corner| (bright_from_dark.apply(corner) - corner).norm());
        moved.into_iter().fold(0.0, larger)
    }

    /// `bright` as the dark camera would have seen it; NaN outside.
    fn warped(&self, bright: &Raster<f32>, scale: f64) -> Vec<f32> {
        let (width, height) = (bright.width(), bright.height());
        let bright_from_dark = self.bright_from_dark([width, height], scale);
        let row = |y: usize| {
            let sample = move |x: usize| {
                let place = bright_from_dark.apply([x as f64 + 0.5, y as f64 + 0.5].into());
                cubic(bright, place.x, place.y)
            };
            (0..width).map(sample)
        };
        (0..height).into_par_iter().flat_map_iter(row).collect()
    }

    /// Steps until nothing moves.
    fn refine(&mut self, dark: &Raster<f32>, bright: &Raster<f32>, scale: f64) {
        let size = [dark.width(), dark.height()];
        for _ in 0..MOST_STEPS {
            let before = self.bright_from_dark(size, scale);
            let Some(step) = self.step(dark, bright, scale) else { return };
            self.rotation *= Rotation3::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
            // A camera is no telescope, whatever a picture without detail says.
            self.log_focal = (self.log_focal + step[3]).clamp(-3.0 * self.deviation, 3.0 * self.deviation);
            let after = self.bright_from_dark(size, scale);
            let moved = corners(size).map(|corner| (after.apply(corner) - before.apply(corner)).norm());
            if moved.into_iter().all(|moved| moved < STILL_PX) {
                return;
            }
        }
    }

    /// The next step: angles and logarithm of the focal length; `None` if the pictures tell none.
    fn step(&self, dark: &Raster<f32>, bright: &Raster<f32>, scale: f64) -> Option<Vector4<f64>> {
        let warped = self.warped(bright, scale);
        let width = dark.width();
        let tells = |dark: f32, bright: f32| bright < CLIPPED && (dark > CRUSHED || bright > CRUSHED);
        let mut sums = ToneSums::default();
        for (&dark, &bright) in dark.data().iter().zip(&warped) {
            if tells(dark, bright) {
                sums.add(bright, dark);
            }
        }
        let relation = ToneRelation::fit(&sums)?;
        let residual = |(&dark, &bright): (&f32, &f32)| match tells(dark, bright) {
            true => dark - relation.at(bright),
            false => f32::NAN,
        };
        let residuals: Vec<f32> = dark.data().par_iter().zip(&warped).map(residual).collect();
        let deviation = deviation(&residuals)?;
        let row = |y: usize| self.row_sums(y, [&warped, &residuals], width, &relation, deviation, scale, dark.height());
        let rows: Vec<Sums> = (1..dark.height().saturating_sub(1)).into_par_iter().map(row).collect();
        let mut all = Sums::default();
        for row in rows {
            all.matrix += row.matrix;
            all.vector += row.vector;
        }
        let prior = 1.0 / (self.deviation * self.deviation);
        all.matrix[(3, 3)] += prior;
        all.vector[3] += prior * self.log_focal;
        all.matrix
            .cholesky()
            .map(|factor| factor.solve(&-all.vector))
            .filter(|step| step.iter().all(|one| one.is_finite()))
    }

    #[allow(clippy::too_many_arguments)]
    fn row_sums(
        &self,
        y: usize,
        [warped, residuals]: [&[f32]; 2],
        width: usize,
        relation: &ToneRelation,
        deviation: f64,
        scale: f64,
        height: usize,
    ) -> Sums {
        let focal = self.focal() * scale;
        let mut sums = Sums::default();
        for x in 1..width - 1 {
            let index = y * width + x;
            let residual = f64::from(residuals[index]);
            let share = residual / (TUKEY * deviation);
            if share.is_nan() || share.abs() >= 1.0 {
                continue;
            }
            let weight = (1.0 - share * share).powi(2) / (deviation * deviation);
            // Of the picture as it is warped: what a turn ahead of the others does to it.
            let along = f64::from(warped[index + 1] - warped[index - 1]) / 2.0;
            let down = f64::from(warped[index + width] - warped[index - width]) / 2.0;
            let slope = -f64::from(relation.slope(warped[index]));
            if !(along.is_finite() && down.is_finite()) {
                continue;
            }
            let (u, v) =
                ((x as f64 + 0.5 - width as f64 / 2.0) / focal, (y as f64 + 0.5 - height as f64 / 2.0) / focal);
            let (along, down) = (slope * along * focal, slope * down * focal);
            let by_focal = self.by_focal([u, v]);
            let jacobian = Vector4::new(
                -along * u * v - down * (1.0 + v * v),
                along * (1.0 + u * u) + down * u * v,
                -along * v + down * u,
                along * by_focal[0] + down * by_focal[1],
            );
            sums.matrix.syger(weight, &jacobian, &jacobian, 1.0);
            sums.vector += weight * residual * jacobian;
        }
        sums.matrix.fill_upper_triangle_with_lower_triangle();
        sums
    }

    /// How the place in the bright picture that belongs to one in the dark picture, both in focal lengths from the
    /// middle, moves with the logarithm of the focal length.
    fn by_focal(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let ray = self.rotation * Vector3::new(u, v, 1.0);
        // A longer focal length leaves the place in the dark picture where it is, so that its ray comes nearer to the
        // axis.
        let moved = self.rotation * Vector3::new(-u, -v, 0.0);
        [0, 1].map(|axis| (ray[axis] + moved[axis] - ray[axis] / ray.z * moved.z) / ray.z)
    }
}

/// Standard deviation of numbers of which some are far off, from the median of their magnitudes; `None` without any.
fn deviation(residuals: &[f32]) -> Option<f64> {
    let mut magnitudes: Vec<f32> = residuals.iter().filter(|one| !one.is_nan()).map(|one| one.abs()).collect();
    median(&mut magnitudes).map(|median| (SD_PER_MEDIAN_MAGNITUDE * f64::from(median)).max(LEAST_DEVIATION))
}

/// The picture at a place, by cubic convolution; NaN beyond the middles of its outermost pixels but one.
fn cubic(picture: &Raster<f32>, x: f64, y: f64) -> f32 {
    let (column, row) = ((x - 0.5).floor(), (y - 0.5).floor());
    let within = |first: f64, length: usize| first >= 1.0 && first + 2.0 < length as f64;
    if !(within(column, picture.width()) && within(row, picture.height())) {
        return f32::NAN;
    }
    let (along, down) =
        (cubic_convolution_taps((x - 0.5 - column) as f32), cubic_convolution_taps((y - 0.5 - row) as f32));
    let (column, row) = (column as usize - 1, row as usize - 1);
    let mut sum = 0.0;
    for (k, down) in down.into_iter().enumerate() {
        let samples = &picture.row(row + k)[column..column + 4];
        sum += down * (along[0] * samples[0] + along[1] * samples[1] + along[2] * samples[2] + along[3] * samples[3]);
    }
    sum.clamp(0.0, 255.0)
}
