//! The carrier phase: what photographs show of what carries the camera, a bonnet or the legs of a drone, is taken from
//! what is known of them.

use trueup_core::carrier::CarrierParts;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::mask::Mask;
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};
use trueup_vision::carrier;

use super::measure::{Measurements, OfOneSize};
use super::measured::Measured;
use super::photographs::PhotographSet;
use super::shelf::{FeaturesOnShelf, Shelf, ShelvedFeatures};
use crate::memo::KeyMaker;
use crate::options::StitchOptions;

/// The code of photographs in which what carries the camera is not looked at.
pub const CARRIER_LEFT_OUT: &str = "carrier-left-out";

/// The stage by which its time is told.
const STAGE: &str = "matching";

/// What the phase works on.
pub(super) struct CarrierInput<'a> {
    pub set: PhotographSet,
    pub measurements: Measurements,
    pub shelf: &'a Shelf<'a>,
}

/// Photographs of which the carrier is not looked at.
pub(super) struct CarrierLeftOut {
    pub set: PhotographSet,
    pub measurements: Measurements,
}

/// Finds where photographs show the carrier, and forgets what was measured there; without one, everything stays as it
/// was.
///
/// # Errors
/// [`trueup_core::Error::Io`] if features cannot be read; [`trueup_core::Error::Limits`];
/// [`trueup_core::Error::Cancelled`].
pub(super) fn run(input: CarrierInput, options: &StitchOptions, context: &StageContext) -> Result<CarrierLeftOut> {
    let CarrierInput { set, mut measurements, shelf } = input;
    let found = context.time(STAGE, || found(&set.images, &measurements, context))?;
    if found.is_empty() {
        return Ok(CarrierLeftOut { set, measurements });
    }
    let mut photographs = set.into_found();
    for Shown { numbers, size, parts } in &found {
        let mask = parts.mask(*size);
        for &number in numbers {
            photographs.images[number].carrier = Some(parts.clone());
            if let Ok(measured) = &mut measurements.photographs[number] {
                forget(measured, &mask, shelf)?;
            }
            let key = measurements.keys[number].take();
            measurements.keys[number] = key.map(|key| KeyMaker::new().key(&key).part(parts).finish());
        }
        context.report(note(numbers.len(), mask.share()));
    }
    Ok(CarrierLeftOut { set: PhotographSet::reopened(photographs, options, context)?, measurements })
}

/// The carrier that each of some photographs of one size shows.
struct Shown {
    numbers: Vec<usize>,
    size: [usize; 2],
    /// Where, in pixels of the photographs.
    parts: CarrierParts,
}

fn found(images: &[SourceImage], measurements: &Measurements, context: &StageContext) -> Result<Vec<Shown>> {
    let features = measurements.photographs.iter().map(|one| one.as_ref().ok().map(|one| &one.features));
    let features = FeaturesOnShelf(features.collect());
    let mut found = Vec::new();
    for (size, OfOneSize { numbers, measured }) in measurements.by_size(images) {
        // That of all of them.
        let frame = &measured[0].frame;
        if let Some(parts) = carrier::find(&features, &numbers, frame, context)? {
            found.push(Shown { numbers, size, parts: parts.scaled(1.0 / frame.working_from_full) });
        }
    }
    Ok(found)
}

/// Forgets what was measured of the carrier, which `mask` marks in the photograph's pixels.
fn forget(measured: &mut Measured, mask: &Mask, shelf: &Shelf) -> Result<()> {
    let was_held = matches!(measured.features, ShelvedFeatures::Held(_));
    measured.forget(mask)?;
    if !was_held {
        measured.features = std::mem::take(&mut measured.features).put_on(shelf);
    }
    Ok(())
}

/// Says that so many photographs show the carrier, in a `share` of each.
fn note(photographs: usize, share: f64) -> Diagnostic {
    let percent = 100.0 * share;
    Diagnostic::note(
        CARRIER_LEFT_OUT,
        Subject::stage("matching"),
        format!(
            "{photographs} photographs show the same at one place, whatever they look at ({percent:.0} % of each): what the camera is fixed to \
             is not looked at, nor shown where another photograph can be"
        ),
        "A mask of each photograph (--mask) marks it more exactly.",
    )
}

#[cfg(test)]
mod tests {
    use trueup_core::raster::Photograph;

    use super::*;
    use crate::inputs::Inputs;
    use crate::memo::PhotographCache;
    use crate::pipeline::{Alignment, Stitcher};
    use crate::test_room::room_in_memory;

    /// Where the bonnet begins, as a share of a photograph's height.
    const BONNET: f64 = 0.82;

    /// Speckles of three pixels a side, the same in each photograph, over its lower part.
    fn before_a_bonnet(photograph: Photograph) -> Photograph {
        let Photograph::Eight(mut raster) = photograph else { panic!("8 bits") };
        let (top, channels) = ((BONNET * raster.height() as f64) as usize, raster.channels());
        for y in top..raster.height() {
            for (x, pixel) in raster.row_mut(y).chunks_mut(channels).enumerate() {
                let speckle = ((x / 3) as u32).wrapping_mul(0x9e37_79b9) ^ ((y / 3) as u32).wrapping_mul(0x85eb_ca6b);
                pixel.fill((speckle.wrapping_mul(0xc2b2_ae35) >> 25) as u8 + 40);
            }
        }
        Photograph::Eight(raster)
    }

    fn aligned(inputs: &Inputs, cache: Option<&PhotographCache>) -> Alignment {
        let options = StitchOptions::default();
        let context = StageContext::default();
        let stitcher = Stitcher::new(&options, &context).with_cache(cache);
        stitcher.align(inputs).expect("a panorama").alignments.remove(0)
    }

    #[test]
    fn cameras_before_a_bonnet_are_those_without() {
        let without = aligned(&room_in_memory(|photograph| photograph), None);
        assert!(without.project.images.iter().all(|image| image.carrier.is_none()));
        let desk = tempfile::tempdir().expect("a folder");
        let cache = PhotographCache::open(desk.path(), 1e9).expect("a cache");
        let inputs = room_in_memory(before_a_bonnet);
        let with = aligned(&inputs, Some(&cache));
        assert_eq!(with.project.used(), 5);
        assert!(with.project.diagnostics.iter().any(|one| one.code == CARRIER_LEFT_OUT));
        for (image, clean) in with.project.images.iter().zip(&without.project.images) {
            let parts = image.carrier.as_ref().expect("of every photograph");
            assert!(parts.mask([image.width, image.height]).share() > 0.1);
            // Squares of 40 working pixels, which may begin as much above it.
            let highest = parts.rectangles().iter().map(|&[_, top, ..]| top).fold(f64::INFINITY, f64::min);
            assert!(highest > (BONNET - 0.1) * image.height as f64, "{highest} of {}", image.height);
            let turned = |rows: Option<[[f64; 3]; 3]>| rows.expect("a camera")[0];
            let [x, clean_x] = [image, clean].map(|image| turned(image.rotation));
            let cosine: f64 = x.iter().zip(clean_x).map(|(one, other)| one * other).sum();
            assert!(cosine.min(1.0).acos().to_degrees() < 0.1, "{}", image.path);
        }
        let again = aligned(&inputs, Some(&cache));
        assert_eq!(again.project.images, with.project.images);
        assert_eq!(cache.uses().get("pair").map_or(0, |pairs| pairs.made), 10, "pairs are matched once");
    }
}
