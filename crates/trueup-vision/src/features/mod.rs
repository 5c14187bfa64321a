//! Scale-invariant features (SIFT).
//!
//! The steps of [`detect`] are one file each: the Gaussian scale space, the extrema of its differences, their
//! orientations and their descriptors. `feature` holds what they find, `coarse` finds them at half the size.

mod coarse;
mod descriptor;
mod extrema;
mod feature;
mod maths;
mod options;
mod orientation;
mod patch;
mod scale_space;
mod simd;
mod source;
mod surroundings;

#[cfg(test)]
mod tests;

use rayon::prelude::*;
use trueup_core::options::StageOptions;
use trueup_core::raster::Raster;
use trueup_core::{Error, Result, StageContext};

pub use coarse::detect_coarse;
use extrema::Extremum;
pub use feature::{DESCRIPTOR_LENGTH, Descriptor, FeaturePoint, Features};
pub use options::FeatureOptions;
use scale_space::{Octave, SearchSize};
use simd::InstructionSet;
pub use source::{FeatureSource, no_photograph};

/// A photograph with fewer points than this is searched again, doubled: finer detail for four times the work.
const SPARSE_POINTS: usize = 1000;

/// Most pixels of a photograph that is searched, the doubled photograph's own where it is doubled.
const MAX_PIXELS: usize = 1 << 28;

/// Points described by one task.
const POINTS_PER_TASK: usize = 64;

/// Rows within which points count as neighbors in the order of work.
const NEIGHBOR_ROWS: usize = 16;

/// Finds and describes the features of a photograph.
///
/// `picture` has one channel of 0 to 255. A photograph too small or too flat has no features; one in which few are
/// found is searched again at double size. The result is the same for any number of threads and every vector width;
/// only the system's sine and cosine may differ between machines, in the last bit.
///
/// # Errors
/// [`Error::Options`] for options out of range, [`Error::Input`] for a photograph of several channels,
/// [`Error::Limits`] for one too large, [`Error::Cancelled`].
///
/// # Source
/// Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 2004.
pub fn detect(picture: &Raster<f32>, options: &FeatureOptions, context: &StageContext) -> Result<Features> {
    let instructions = InstructionSet::detect();
    let found = match enough_at_original(picture, options, instructions, context)? {
        Some(features) => features,
        None => detect_at(SearchSize::Doubled, picture, options, instructions, context)?,
    };
    Ok(Features { surroundings: surroundings::smoothed(picture), ..found })
}

/// The features of a photograph at its own size; `None` where they are so few that it is searched again.
fn enough_at_original(
    picture: &Raster<f32>,
    options: &FeatureOptions,
    instructions: InstructionSet,
    context: &StageContext,
) -> Result<Option<Features>> {
    let is_enough = |count: usize| count >= SPARSE_POINTS || !may_double(picture);
    let found = Found::at(SearchSize::Original, picture, options, instructions, context)?;
    // No more are described than were found: those of a photograph that is searched again anyway need not be.
    if !is_enough(found.extrema.len()) {
        return Ok(None);
    }
    let features = found.described(instructions, context)?;
    Ok(is_enough(features.points.len()).then_some(features))
}

/// Whether the doubled photograph is within the limit.
fn may_double(picture: &Raster<f32>) -> bool {
    picture.width().saturating_mul(picture.height()) <= MAX_PIXELS / 4
}

/// [`detect`] at one size, whatever is found.
fn detect_at(
    size: SearchSize,
    picture: &Raster<f32>,
    options: &FeatureOptions,
    instructions: InstructionSet,
    context: &StageContext,
) -> Result<Features> {
    Found::at(size, picture, options, instructions, context)?.described(instructions, context)
}

/// The strongest extrema of a photograph at one size, and the scale space in which they are.
struct Found {
    octaves: Vec<Octave>,
    extrema: Vec<Extremum>,
}

impl Found {
    fn at(
        size: SearchSize,
        picture: &Raster<f32>,
        options: &FeatureOptions,
        instructions: InstructionSet,
        context: &StageContext,
    ) -> Result<Self> {
        check(size, picture, options)?;
        if picture.width() == 0 || picture.height() == 0 {
            return Ok(Self { octaves: Vec::new(), extrema: Vec::new() });
        }
        let octaves = scale_space::build(picture, size, instructions, context)?;
        let mut extrema = Vec::new();
        for octave in 0..octaves.len() {
            extrema.extend(extrema::find(&octaves, octave, options, instructions, context)?);
        }
        // A stable sort: equal responses stay in the order of octave, row and column.
        extrema.sort_by(|a, b| b.response.abs().total_cmp(&a.response.abs()));
        extrema.truncate(options.max_points);
        Ok(Self { octaves, extrema })
    }

    fn described(self, instructions: InstructionSet, context: &StageContext) -> Result<Features> {
        Ok(gathered(described(&self.octaves, &self.extrema, instructions, context)?))
    }
}

/// What [`describe`] finds for each extremum, in their order.
///
/// The work goes from place to place, not from strong to weak: the planes are far larger than any cache, and
/// neighbors share what is in it.
fn described(
    octaves: &[Octave],
    extrema: &[Extremum],
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
            Ok(indices.iter().map(|&index| describe(octaves, &extrema[index], instructions)).collect())
        })
        .collect();
    let mut described: Vec<Option<Described>> = Vec::new();
    described.resize_with(extrema.len(), || None);
    for (index, found) in order.into_iter().zip(found?.into_iter().flatten()) {
        described[index] = found;
    }
    Ok(described)
}

fn check(size: SearchSize, picture: &Raster<f32>, options: &FeatureOptions) -> Result<()> {
    options.check()?;
    if picture.channels() != 1 {
        return Err(Error::input(
            "picture for feature detection",
            format!("it has {} channels", picture.channels()),
            "Give a gray picture of one channel.",
        ));
    }
    let pixels = match size {
        SearchSize::Original => picture.data().len(),
        SearchSize::Doubled => 4 * picture.data().len(),
    };
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
fn describe(octaves: &[Octave], extremum: &Extremum, instructions: InstructionSet) -> Option<Described> {
    let octave = &octaves[extremum.octave];
    let plane = &octave.planes[extremum.level];
    let (position, sigma) = (extremum.position, extremum.sigma);
    let angles = instructions.run(orientation::Orientations { plane, position, sigma });
    let descriptors: Vec<Descriptor> = angles
        .into_iter()
        .filter_map(|angle| instructions.run(descriptor::Describe { plane, position, sigma, angle }))
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
    // No more room than is filled: photographs' features are the most that is known of them.
    let (mut points, mut descriptors) = (0, 0);
    for one in described.iter().flatten() {
        points += 1;
        descriptors += one.descriptors.len();
    }
    features.points.reserve_exact(points);
    features.descriptors.reserve_exact(descriptors);
    features.descriptor_points.reserve_exact(descriptors);
    for (index, Described { point, descriptors }) in described.into_iter().flatten().enumerate() {
        features.points.push(point);
        features.descriptor_points.extend(std::iter::repeat_n(index as u32, descriptors.len()));
        features.descriptors.extend(descriptors);
    }
    features
}
