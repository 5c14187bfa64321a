//! Scale-invariant features (SIFT).
//!
//! The steps of [`detect`] are one file each: the Gaussian scale space, the extrema of its differences, their
//! orientations and their descriptors.

mod descriptor;
mod extrema;
mod maths;
mod orientation;
mod patch;
mod scale_space;
mod simd;

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::options::StageOptions;
use trueup_core::raster::Raster;
use trueup_core::{Error, Result, StageContext};

use extrema::Extremum;
use scale_space::Octave;
use simd::InstructionSet;

/// Length of a SIFT descriptor: 4 x 4 spatial bins of 8 orientations.
pub const DESCRIPTOR_LENGTH: usize = 128;

/// A SIFT descriptor, quantized to bytes.
pub type Descriptor = [u8; DESCRIPTOR_LENGTH];

/// A place that looks distinctive at one scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FeaturePoint {
    /// Position (x, y) in the picture's pixels.
    pub position: [f64; 2],
    /// Standard deviation of the Gaussian at which it was found, in the picture's pixels.
    pub scale_px: f64,
    /// Absolute difference-of-Gaussians response, in gray levels of 0 to 255.
    pub response: f64,
}

/// The features of one picture.
///
/// A point may have several descriptors, one for each dominant orientation; the distance of two points is the smallest
/// over their descriptors.
#[derive(Debug, Clone, Default)]
pub struct Features {
    /// The points, strongest response first.
    pub points: Vec<FeaturePoint>,
    /// The descriptors; those of one point are neighbors, in the order of the points.
    pub descriptors: Vec<Descriptor>,
    /// For every descriptor, the index of its point.
    pub descriptor_points: Vec<u32>,
}

impl Features {
    /// Those whose points satisfy `wanted`, in their order.
    #[must_use]
    pub fn filtered(&self, wanted: impl Fn(&FeaturePoint) -> bool) -> Self {
        let mut kept = Self::default();
        let mut number = vec![None; self.points.len()];
        for (point, number) in self.points.iter().zip(&mut number) {
            if wanted(point) {
                *number = Some(kept.points.len() as u32);
                kept.points.push(*point);
            }
        }
        for (descriptor, &point) in self.descriptors.iter().zip(&self.descriptor_points) {
            if let Some(&Some(number)) = number.get(point as usize) {
                kept.descriptors.push(*descriptor);
                kept.descriptor_points.push(number);
            }
        }
        kept
    }

    /// The features of the `count` strongest points, all if there are no more; points keep their indices.
    pub fn strongest(&self, count: usize) -> Cow<'_, Self> {
        if self.points.len() <= count {
            return Cow::Borrowed(self);
        }
        let descriptors = self.descriptor_points.partition_point(|&point| (point as usize) < count);
        Cow::Owned(Self {
            points: self.points[..count].to_vec(),
            descriptors: self.descriptors[..descriptors].to_vec(),
            descriptor_points: self.descriptor_points[..descriptors].to_vec(),
        })
    }
}

trueup_core::options! {
    /// How features are found and described.
    pub struct FeatureOptions("features") {
        /// Most points kept, strongest response first.
        max_points: usize = 8000, between(1.0, 1_000_000.0), "points";
        /// Whether the picture is doubled first, which finds finer detail for four times the work.
        double_image: bool = false, Allowed::Any, "";
        /// A picture with fewer points than this is searched again, doubled; 0 for never.
        sparse_points: usize = 1000, between(0.0, 1_000_000.0), "points";
        /// Scales sampled in each doubling of scale.
        levels_per_octave: usize = 3, between(1.0, 8.0), "levels";
        /// Blur of the first level of each octave, in the octave's samples.
        base_sigma: f64 = 1.6, between(0.8, 3.2), "samples";
        /// Blur the picture is assumed to have already.
        nominal_blur_px: f64 = 0.5, between(0.0, 2.0), "px";
        /// Smallest difference-of-Gaussians response of a point, in gray levels of 0 to 255.
        peak_threshold: f64 = 0.0, between(0.0, 255.0), "gray levels";
        /// Largest ratio of the two principal curvatures; points above it lie on edges.
        edge_threshold: f64 = 10.0, between(1.0, 1000.0), "";
        /// Most dominant orientations of a point, each with its own descriptor.
        max_orientations: usize = 4, between(1.0, 18.0), "orientations";
        /// Whether descriptors are L1-normalized and square-rooted (RootSIFT).
        root_sift: bool = false, Allowed::Any, "";
    }
}

/// Most pixels of a picture that [`detect`] accepts, the doubled picture counted where that is asked for.
const MAX_PIXELS: usize = 1 << 28;

/// Points described by one task.
const POINTS_PER_TASK: usize = 64;

/// Rows within which points count as neighbors in the order of work.
const NEIGHBOR_ROWS: usize = 16;

/// Finds and describes the features of a picture.
///
/// `image` has one channel of 0 to 255. A picture too small or too flat has no features. The result is the same for
/// any number of threads and every vector width; only the system's sine and cosine may differ between machines, in the
/// last bit.
///
/// # Errors
/// [`Error::Options`] for options out of range, [`Error::Input`] for a picture of several channels,
/// [`Error::Limits`] for one too large, [`Error::Cancelled`].
///
/// # Source
/// Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 2004. RootSIFT: Arandjelovic and
/// Zisserman, "Three things everyone should know to improve object retrieval", CVPR 2012.
pub fn detect(image: &Raster<f32>, options: &FeatureOptions, context: &StageContext) -> Result<Features> {
    let instructions = InstructionSet::detect();
    let features = detect_with(image, options, context, instructions)?;
    if options.double_image || features.points.len() >= options.sparse_points || !may_double(image) {
        return Ok(features);
    }
    let doubled = FeatureOptions { double_image: true, ..options.clone() };
    detect_with(image, &doubled, context, instructions)
}

/// Whether the doubled picture is within the limit.
fn may_double(image: &Raster<f32>) -> bool {
    image.width().saturating_mul(image.height()) <= MAX_PIXELS / 4
}

fn detect_with(
    image: &Raster<f32>,
    options: &FeatureOptions,
    context: &StageContext,
    instructions: InstructionSet,
) -> Result<Features> {
    check(image, options)?;
    if image.width() == 0 || image.height() == 0 {
        return Ok(Features::default());
    }
    let octaves = scale_space::build(image, options, instructions, context)?;
    let mut extrema = Vec::new();
    for octave in 0..octaves.len() {
        extrema.extend(extrema::find(&octaves, octave, options, instructions, context)?);
    }
    // A stable sort: equal responses stay in the order of octave, row and column.
    extrema.sort_by(|a, b| b.response.abs().total_cmp(&a.response.abs()));
    extrema.truncate(options.max_points);
    Ok(gathered(described(&octaves, &extrema, options, instructions, context)?))
}

/// What [`describe`] finds for each extremum, in their order.
///
/// The work goes from place to place, not from strong to weak: the planes are far larger than any cache, and
/// neighbors share what is in it.
fn described(
    octaves: &[Octave],
    extrema: &[Extremum],
    options: &FeatureOptions,
    instructions: InstructionSet,
    context: &StageContext,
) -> Result<Vec<Option<Described>>> {
    let place = |extremum: &Extremum| {
        let [x, y] = extremum.sample;
        (extremum.octave, extremum.level, y / NEIGHBOR_ROWS, x)
    };
    let mut order: Vec<usize> = (0..extrema.len()).collect();
    order.sort_by_key(|&index| place(&extrema[index]));
    let found: Result<Vec<Vec<_>>> = order
        .par_chunks(POINTS_PER_TASK)
        .map(|indices| {
            context.check_cancelled()?;
            Ok(indices.iter().map(|&index| describe(octaves, &extrema[index], options, instructions)).collect())
        })
        .collect();
    let mut described: Vec<Option<Described>> = Vec::new();
    described.resize_with(extrema.len(), || None);
    for (index, found) in order.into_iter().zip(found?.into_iter().flatten()) {
        described[index] = found;
    }
    Ok(described)
}

fn check(image: &Raster<f32>, options: &FeatureOptions) -> Result<()> {
    options.check()?;
    if image.channels() != 1 {
        return Err(Error::input(
            "picture for feature detection",
            format!("it has {} channels", image.channels()),
            "Give a gray picture of one channel.",
        ));
    }
    let pixels = image.data().len() * if options.double_image { 4 } else { 1 };
    if pixels > MAX_PIXELS {
        return Err(Error::Limits {
            subject: "feature detection".to_owned(),
            needed: format!("{pixels} pixels"),
            allowed: format!("{MAX_PIXELS} pixels"),
            hint: "Reduce the picture first.".to_owned(),
        });
    }
    Ok(())
}

/// A point and its descriptors.
struct Described {
    point: FeaturePoint,
    descriptors: Vec<Descriptor>,
}

/// The orientations and descriptors of an extremum; `None` if it has none.
fn describe(
    octaves: &[Octave],
    extremum: &Extremum,
    options: &FeatureOptions,
    instructions: InstructionSet,
) -> Option<Described> {
    let octave = &octaves[extremum.octave];
    let plane = &octave.planes[extremum.level];
    let (position, sigma) = (extremum.position, extremum.sigma);
    let limit = options.max_orientations;
    let angles = instructions.run(orientation::Orientations { plane, position, sigma, limit });
    let root_sift = options.root_sift;
    let descriptors: Vec<Descriptor> = angles
        .into_iter()
        .filter_map(|angle| instructions.run(descriptor::Describe { plane, position, sigma, angle, root_sift }))
        .collect();
    let point = FeaturePoint {
        // Sample k lies on pixel k * step, whose center is half a pixel further.
        position: position.map(|coordinate| coordinate * octave.step_px + 0.5),
        scale_px: sigma * octave.step_px,
        response: extremum.response.abs(),
    };
    (!descriptors.is_empty()).then_some(Described { point, descriptors })
}

fn gathered(described: Vec<Option<Described>>) -> Features {
    let mut features = Features::default();
    for (index, Described { point, descriptors }) in described.into_iter().flatten().enumerate() {
        features.points.push(point);
        features.descriptor_points.extend(std::iter::repeat_n(index as u32, descriptors.len()));
        features.descriptors.extend(descriptors);
    }
    features
}
