//! The photographs that a job names: found, checked, with their masks, in one color space, within the memory.

use std::path::PathBuf;
use std::sync::Arc;

use rayon::prelude::*;
use trueup_compose::fusion::ExposureFusion;
use trueup_core::color::LightRange;
use trueup_core::diagnostics::Subject;
use trueup_core::mask::Masks;
use trueup_core::source::{PhotographSource, SourceImage};
use trueup_core::{Error, Result, StageContext};
use trueup_io::color::PhotographColors;
use trueup_io::decode::FilePhotographs;
use trueup_io::source::{self, InMemory, RejectedSource, Sources};

use super::budget::{Budget, Measuring};
use super::frames;
use super::light::{self, WantedLight};
use crate::inputs::AllMasks;
use crate::inputs::reference_named;
use crate::inputs::tell_lenses;
use crate::inputs::{Inputs, Reference};
use crate::memo::KeyMaker;
use crate::options::StitchOptions;
use crate::project::record::MaskRecord;
use crate::report::left_out::{none_usable, reason_of_rejected};

/// Photographs that were found, before their colors are looked into.
#[derive(Debug, Default)]
pub(crate) struct FoundPhotographs {
    /// Those that can be read.
    pub images: Vec<SourceImage>,
    /// The pixels of those among them that are no files.
    pub in_memory: InMemory,
    /// Inputs that cannot be read.
    pub rejected: Vec<RejectedSource>,
    /// What is ignored or kept of `images`.
    pub masks: AllMasks,
    /// In which light they are handed out.
    pub light: WantedLight,
    /// The project that told the lenses of some.
    pub lens_from: Option<PathBuf>,
}

/// The photographs to be stitched. They are numbered by their place in `images`.
#[derive(Debug)]
pub(crate) struct PhotographSet {
    /// Those that can be read.
    pub images: Vec<SourceImage>,
    /// Inputs that cannot.
    pub rejected: Vec<RejectedSource>,
    /// The masks of each photograph, as they are recorded.
    pub masks: Vec<Vec<MaskRecord>>,
    /// The project that told the lenses of some.
    pub lens_from: Option<PathBuf>,
    /// Their pixels.
    pub files: Arc<FilePhotographs>,
    /// How they are measured within the memory.
    pub measuring: Measuring,
}

impl PhotographSet {
    /// Finds what `inputs` name.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no photograph, or the reference, a mask or the project of a lens fits none;
    /// [`Error::Limits`]; [`Error::Cancelled`].
    pub(crate) fn find(inputs: &Inputs, options: &StitchOptions, context: &StageContext) -> Result<Self> {
        let accepted = &options.measure.source;
        let scan =
            |context: &StageContext| source::scan_with(&inputs.photographs, &inputs.in_memory, accepted, context);
        let (sources, mut told) = context.gather(|context| context.time("source", || scan(context)))?.split();
        let Sources { photographs, mut rejected } = sources;
        rejected.retain(|one| !inputs.stood_for.contains(&one.path));
        rejected.iter_mut().for_each(|one| tell_why(one, &inputs.unusable));
        if photographs.is_empty() {
            return Err(nothing_found(inputs, &rejected));
        }
        let used = context.time("decoding", || frames::needed(&photographs, inputs, options, context))?;
        let new_number = |number: usize| used.binary_search(&number);
        told.findings.retain(|one| !matches!(one.subject, Subject::Photograph(number) if new_number(number).is_err()));
        context.absorb(told.renumbered(|number| new_number(number).unwrap_or(number)));
        let mut images: Vec<SourceImage> = used.iter().map(|&number| photographs[number].clone()).collect();
        if let Reference::Named(name) = &inputs.reference {
            reference_named(&images, name)?;
        }
        if let Some(path) = &inputs.lens_from {
            tell_lenses(path, &mut images, context)?;
        }
        let masks = AllMasks::read(&inputs.masks, &inputs.in_memory, &images, accepted, context)?;
        let light = WantedLight::Surveyed;
        let (in_memory, lens_from) = (inputs.in_memory.clone(), inputs.lens_from.clone());
        let found = FoundPhotographs { images, in_memory, rejected, masks, light, lens_from };
        Self::open(found, options, context)
    }

    /// Photographs that are found already.
    ///
    /// # Errors
    /// [`Error::Limits`] if one is too large for the memory; [`Error::Cancelled`].
    pub(crate) fn open(found: FoundPhotographs, options: &StitchOptions, context: &StageContext) -> Result<Self> {
        let FoundPhotographs { images, in_memory, rejected, masks: AllMasks { masks, records }, light, lens_from } =
            found;
        let over = |images: &[SourceImage], cache_bytes: usize| {
            let files = FilePhotographs::new(images.to_vec(), cache_bytes);
            files.with_in_memory(in_memory.clone()).fused_by(Arc::new(ExposureFusion))
        };
        let budget = Budget::new(&options.run.resources);
        let measuring = budget.measuring(&over(&images, 0), options.measure.working.pixels)?;
        let light = match light {
            WantedLight::Known(light) => light,
            WantedLight::Surveyed => {
                context.time("decoding", || light::surveyed(&images, measuring.at_once, context))?
            }
        };
        let images = light::handed_out_in(images, light);
        let files = handed_out(over(&images, measuring.kept_bytes), &images, light, context).with_masks(masks);
        Ok(Self { images, rejected, masks: records, lens_from, files: Arc::new(files), measuring })
    }

    /// What a set was opened from, in the light that it turned out to have: to be changed, and [opened
    /// again](Self::reopened).
    pub(crate) fn into_found(self) -> FoundPhotographs {
        let Self { images, rejected, masks: records, lens_from, files, .. } = self;
        FoundPhotographs {
            masks: AllMasks { masks: (0..images.len()).map(|number| files.given_masks(number)).collect(), records },
            images,
            in_memory: files.in_memory_photographs().clone(),
            rejected,
            light: WantedLight::Known(files.light()),
            lens_from,
        }
    }

    /// Photographs of a set that was open before, of which something has changed.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub(crate) fn reopened(found: FoundPhotographs, options: &StitchOptions, context: &StageContext) -> Result<Self> {
        // What it says of the photographs' colors was told already.
        Ok(context.gather(|context| Self::open(found, options, context))?.value)
    }

    /// The names by which people know the photographs.
    pub(crate) fn names(&self) -> Vec<String> {
        self.images.iter().map(|image| image.name.clone()).collect()
    }

    /// Whether there are masks of each photograph.
    pub(crate) fn marked(&self) -> Vec<bool> {
        self.masks.iter().map(|masks| !masks.is_empty()).collect()
    }

    /// What decides the pixels of these photographs: their bytes, how they are turned and masked, the color space and
    /// the light that they are brought to, and of a stack the same of each exposure. `None` for files that cannot be
    /// read.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn keys(&self, photographs: &[usize], context: &StageContext) -> Result<Vec<Option<KeyMaker>>> {
        let color_space = self.files.colors().map(|colors| (colors.name(), colors.icc().map(<[u8]>::to_vec)));
        let color_space = (color_space, self.files.light());
        let content = |maker: KeyMaker, image: &SourceImage| -> Option<KeyMaker> {
            let maker = maker.part(&(
                image.width,
                image.height,
                image.inset,
                image.orientation,
                &image.outline,
                &image.carrier,
            ));
            if let Some(photograph) = self.files.in_memory_photographs().of(image) {
                return Some(maker.photograph(photograph));
            }
            std::fs::File::open(&image.path).and_then(|file| maker.file(file)).ok()
        };
        let key = |&index: &usize| -> Result<Option<KeyMaker>> {
            context.check_cancelled()?;
            let image = &self.images[index];
            let mut maker = KeyMaker::new().part(&color_space);
            if let Masks { ignored: Some(ignored), .. } = self.files.masks(index) {
                maker = maker.part(&ignored.words());
            }
            let whole = image.stack.iter().try_fold(content(maker, image), |maker, member| {
                Some(content(maker?.part(&member.reference_from_member), &member.source))
            });
            Ok(whole.flatten())
        };
        photographs.par_iter().map(key).collect()
    }
}

/// The photographs `files` of `images`, whose [light is told](light::handed_out_in), in one color space and in that
/// light: as panoramas are stitched from them, and measured again.
pub(crate) fn handed_out(
    files: FilePhotographs,
    images: &[SourceImage],
    light: Option<LightRange>,
    context: &StageContext,
) -> FilePhotographs {
    let colors = match light {
        Some(_) => PhotographColors::survey_to_srgb(images, context),
        None => PhotographColors::survey(images, context),
    };
    files.in_colors(colors).in_light(light)
}

/// Puts the reason that is `known` for a file in place of what its content tells.
fn tell_why(rejected: &mut RejectedSource, known: &[RejectedSource]) {
    if let Some(known) = known.iter().find(|known| known.path == rejected.path) {
        *rejected = RejectedSource { name: std::mem::take(&mut rejected.name), ..known.clone() };
    }
}

/// The error when no input is a photograph.
fn nothing_found(inputs: &Inputs, rejected: &[RejectedSource]) -> Error {
    if !rejected.is_empty() {
        return none_usable(rejected.iter().cloned().map(reason_of_rejected).collect());
    }
    Error::input(
        if inputs.photographs.is_empty() { "photographs".to_owned() } else { inputs.photographs.join(", ") },
        "no photographs were given",
        "Name at least two overlapping photographs, or a folder that holds them.",
    )
}

#[cfg(test)]
mod tests {
    use trueup_compose::render::Rendered;

    use super::*;
    use crate::memo::PhotographCache;
    use crate::pipeline::{Alignment, Stitcher};
    use crate::test_room::{ROOM, room_in_memory, samples_of};

    fn stitched(inputs: &Inputs, options: &StitchOptions, cache: Option<&PhotographCache>) -> (Alignment, Rendered) {
        let context = StageContext::default();
        let stitcher = Stitcher::new(options, &context).with_cache(cache);
        let mut alignment = stitcher.align(inputs).expect("a panorama").alignments.remove(0);
        let rendered = stitcher.compose(&mut alignment).expect("composed");
        (alignment, rendered)
    }

    /// The photographs of the room say nothing of camera and colors: their pixels are all there is of them.
    #[test]
    fn photographs_in_memory_are_stitched_as_their_files_are_and_kept_by_their_pixels() {
        let mut options = StitchOptions::default();
        options.set("canvas.scale=0.1").expect("an option");
        let inputs = room_in_memory(|photograph| photograph);
        let desk = tempfile::tempdir().expect("a folder");
        let cache = PhotographCache::open(desk.path(), 1e9).expect("a cache");
        let (from_files, rendered) = stitched(&Inputs::new([ROOM]), &options, None);
        for _ in 0..2 {
            let (alignment, again) = stitched(&inputs, &options, Some(&cache));
            assert_eq!(samples_of(&again.panorama), samples_of(&rendered.panorama));
            assert_eq!(alignment.photograph_bits().expect("known"), from_files.photograph_bits().expect("known"));
            assert_eq!(alignment.project.images[0].path, "00.jpg");
            assert_eq!(alignment.project.images[0].mesh, from_files.project.images[0].mesh);
        }
        let found = cache.uses().get("measured").map_or(0, |one| one.found);
        assert_eq!(found, inputs.photographs.len(), "the second time, nothing is measured");
    }
}
