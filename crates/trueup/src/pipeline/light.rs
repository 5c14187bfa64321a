//! Light that is brighter than white: whether photographs have any, and the range in which all of them are handed out
//! then.

use rayon::prelude::*;
use trueup_core::color::{LightRange, TransferCurve};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::raster::{LUMA, Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::statistics::median;
use trueup_core::{Result, StageContext};
use trueup_io::decode;

/// In which light photographs are handed out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum WantedLight {
    /// As their pixels ask for.
    #[default]
    Surveyed,
    /// As it was decided before; `None` for light that ends at white.
    Known(Option<LightRange>),
}

/// The light in which floating point samples are looked at first: any that such files hold.
const ANY_LIGHT: LightRange = LightRange { white: 1.0 / (1 << 10) as f64, peak: (1_u64 << 40) as f64 };

/// The brightest sample of photographs whose light ends at white, as they are exported with floating point samples:
/// white but for rounding, or at least a quarter of it.
const ENDS_AT_WHITE: std::ops::RangeInclusive<f64> = 0.25..=1.005;

/// Light of the middle tone, as a share of what is drawn as white: with it, half of a picture is darker than sRGB's
/// level 172, as in photographs of rooms and streets.
const MIDDLE: f64 = 0.4;

/// How far above the brightest sample light is kept: as far as samples of [`ANY_LIGHT`] are rounded, and a little more.
const ROOM: f64 = 1.05;

/// The range of the floating point photographs among `images`; `None` if there is none, or their light ends at white as
/// that of other photographs. Each is decoded; those that cannot be are passed over, and told of where they are
/// measured.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(super) fn surveyed(images: &[SourceImage], at_once: usize, context: &StageContext) -> Result<Option<LightRange>> {
    let members = |image: &'_ SourceImage| -> Vec<SourceImage> {
        let stack = image.stack.iter().map(|member| &member.source);
        std::iter::once(image).chain(stack).filter(|one| one.is_float).cloned().collect()
    };
    let floating: Vec<SourceImage> = images.iter().flat_map(members).collect();
    let Some(curve) = TransferCurve::light(ANY_LIGHT).filter(|_| !floating.is_empty()) else { return Ok(None) };
    let mut tones = Tones::default();
    for group in floating.chunks(at_once.max(1)) {
        let found: Vec<Option<Tones>> = group
            .par_iter()
            .map(|image| {
                context.check_cancelled()?;
                match decode::photograph(&SourceImage { light: Some(ANY_LIGHT), ..image.clone() }) {
                    Ok(Photograph::Sixteen(raster)) => Ok(Some(Tones::of(&raster))),
                    Ok(Photograph::Eight(_)) | Err(_) => Ok(None),
                }
            })
            .collect::<Result<_>>()?;
        found.iter().flatten().for_each(|one| tones.add(one));
    }
    let light = |level: usize| curve.linear(level as f64 / f64::from(u16::MAX)) * ANY_LIGHT.peak;
    let Some((middle, brightest)) = tones.middle_and_brightest().map(|(a, b)| (light(a), light(b))) else {
        return Ok(None);
    };
    if ENDS_AT_WHITE.contains(&brightest) {
        return Ok(None);
    }
    let range = range_of(middle, ROOM * brightest);
    let message = format!(
        "the light of floating point samples reaches {}, {:.1} stops above what is drawn as white; all of it is kept in floating point \
         panoramas",
        in_words(brightest),
        (brightest / range.white).log2().max(0.0)
    );
    let hint = "Write .exr, .hdr, or .tif with --depth float for the light; other panoramas show it as a picture.";
    context.report(Diagnostic::note("light-kept", Subject::stage("photographs"), message, hint));
    Ok(Some(range))
}

/// A light in a few digits.
fn in_words(light: f64) -> String {
    if (0.01..1e4).contains(&light) { format!("{light:.2}") } else { format!("{light:.1e}") }
}

/// The range in which a middle tone is drawn as one.
fn range_of(middle: f64, peak: f64) -> LightRange {
    LightRange { white: (middle / MIDDLE).min(peak), peak }
}

/// How far above the white of its darkest exposure the light of a stack may come out: the exposures are measured anew
/// when it is merged, and what evens out its light is in that, too.
const ROOM_OF_STACKS: f64 = 4.0;

/// The range of stacks: of each the thumbnail of the reference, whose samples are by `curve`, and by how many stops the
/// others are brighter.
pub(super) fn of_stacks<'a>(
    stacks: impl Iterator<Item = (&'a Raster<u8>, f64)>,
    curve: &TransferCurve,
) -> Option<LightRange> {
    let (mut levels, mut darkest) = (Vec::new(), 0.0_f64);
    for (thumbnail, stops) in stacks {
        darkest = darkest.min(stops);
        let (pixels, _) = thumbnail.data().as_chunks::<3>();
        levels.extend(pixels.iter().map(|pixel| (0..3).map(|k| LUMA[k] * f32::from(pixel[k])).sum::<f32>()));
    }
    let middle = median(&mut levels)?;
    // One level at least: of what is black, any tone may be the middle one.
    let middle = curve.linear(f64::from(middle.max(1.0)) / 255.0);
    Some(range_of(middle, ROOM_OF_STACKS * (-darkest).exp2())).filter(LightRange::is_sound)
}

/// The same photographs, of which those of floating point samples are handed out in `light`.
pub(crate) fn handed_out_in(mut images: Vec<SourceImage>, light: Option<LightRange>) -> Vec<SourceImage> {
    for image in &mut images {
        image.light = light.filter(|_| image.is_float);
        for member in &mut image.stack {
            member.source.light = light.filter(|_| member.source.is_float);
        }
    }
    images
}

/// How often samples are how bright.
struct Tones {
    /// Of pixels that are not black, by their brightest channel.
    counts: Vec<u64>,
}

impl Default for Tones {
    fn default() -> Self {
        Self { counts: vec![0; 1 << u16::BITS] }
    }
}

impl Tones {
    fn of(raster: &Raster<u16>) -> Self {
        let mut tones = Self::default();
        for pixel in raster.data().chunks_exact(raster.channels().max(1)) {
            let is_seen = pixel.get(3).is_none_or(|&alpha| alpha > 0);
            let brightest = pixel.iter().take(3).copied().max().unwrap_or(0);
            if is_seen && brightest > 0 {
                tones.counts[usize::from(brightest)] += 1;
            }
        }
        tones
    }

    fn add(&mut self, other: &Self) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(own, other)| *own += other);
    }

    /// The level that half of the pixels are below, and the largest; `None` of what is black.
    fn middle_and_brightest(&self) -> Option<(usize, usize)> {
        let half = self.counts.iter().sum::<u64>() / 2;
        let mut below = 0;
        let middle = self.counts.iter().position(|count| {
            below += count;
            below > half
        })?;
        Some((middle, self.counts.iter().rposition(|&count| count > 0)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_of_stacks_holds_what_the_darkest_exposure_tells() {
        // Half of the pixels are at level 100, light 0.127438 by sRGB's curve, the others brighter.
        let levels = [100, 100, 100, 180].iter().flat_map(|&level| [level; 3]).collect();
        let thumbnail = Raster::from_data(2, 2, 3, levels).expect("samples");
        let range = of_stacks([(&thumbnail, 0.0), (&thumbnail, -3.0)].into_iter(), &TransferCurve::SRGB);
        let LightRange { white, peak } = range.expect("a range");
        assert!((white - 0.127_438 / 0.4).abs() < 1e-5 && (peak - 32.0).abs() < 1e-9, "{white} {peak}");
        assert_eq!(of_stacks(std::iter::empty(), &TransferCurve::SRGB), None);
    }

    #[test]
    fn tones_are_counted_without_black_and_what_is_transparent() {
        let pixels = [[0, 0, 0, 9], [5, 7, 1, 65_535], [7, 0, 0, 1], [9, 9, 9, 0], [3, 2, 30, 4]];
        let raster = Raster::from_data(5, 1, 4, pixels.concat()).expect("samples");
        let mut tones = Tones::of(&raster);
        assert_eq!(tones.middle_and_brightest(), Some((7, 30)));
        tones.add(&Tones::of(&Raster::from_data(4, 1, 1, vec![50, 60, 70, 80]).expect("samples")));
        assert_eq!(tones.middle_and_brightest(), Some((50, 80)));
        assert_eq!(Tones::default().middle_and_brightest(), None);
    }
}
