//! A geometry that is at hand, for another view or for other photographs.

use trueup_core::Result;
use trueup_core::mask::Masks;
use trueup_core::source::SourceImage;

use super::Stitcher;
use super::light::WantedLight;
use super::photographs::FoundPhotographs;
use super::results::Alignment;
use crate::inputs::AllMasks;
use crate::inputs::Inputs;
use crate::project::record::ImageRecord;
use crate::project::replace::named_photographs;

impl Stitcher<'_> {
    /// The geometry of `alignment`, arranged by this stitcher's options, over the photographs that `shown` names in
    /// place of its own, one for each in [`Project::used_images`](crate::Project::used_images): rigs and videos are
    /// aligned once. Of `shown`, the photographs are heeded; masks are those of the photographs that were aligned.
    ///
    /// # Errors
    /// [`Error::Options`](trueup_core::Error::Options); [`Error::Unsupported`](trueup_core::Error::Unsupported) if an
    /// option of the geometry is another one than when it was found; [`Error::Input`](trueup_core::Error::Input) if
    /// there are more or fewer photographs, or they have other sizes;
    /// [`Error::NotApplicable`](trueup_core::Error::NotApplicable) if a projection is asked for and no camera is known;
    /// those of the layout; [`Error::Limits`](trueup_core::Error::Limits);
    /// [`Error::Cancelled`](trueup_core::Error::Cancelled).
    pub fn rearrange(&self, alignment: &Alignment, shown: Option<&Inputs>) -> Result<Alignment> {
        let project = &alignment.project;
        self.options().refuse_other_geometry(&project.options)?;
        let found = self.context().gather(|context| match shown {
            Some(Inputs { photographs, in_memory, .. }) => {
                let records: Vec<&ImageRecord> = project.used_images().collect();
                let accepted = &self.options().measure.source;
                let images = named_photographs(&records, photographs, in_memory, accepted, context)?;
                Ok(FoundPhotographs { images, in_memory: in_memory.clone(), ..alignment.found() })
            }
            None => Ok(alignment.found()),
        })?;
        let (found, told) = found.split();
        let mut rearranged = self.recall(project, found, alignment.evidence.clone())?;
        rearranged.record(told);
        Ok(rearranged)
    }
}

impl Alignment {
    /// The photographs used, as they were found.
    fn found(&self) -> FoundPhotographs {
        let numbers: Vec<usize> = match &self.positions {
            Some(positions) => (0..positions.len()).collect(),
            None => self.project.used_positions(),
        };
        let images: Vec<SourceImage> =
            numbers.iter().map(|&number| self.photographs.sources()[number].clone()).collect();
        let masks: Vec<Masks> = numbers.iter().map(|&number| self.photographs.given_masks(number)).collect();
        let records = self.project.used_images().map(|image| image.masks.clone()).collect();
        let in_memory = self.photographs.in_memory_photographs().clone();
        let masks = AllMasks { masks, records };
        let light = WantedLight::Known(self.photographs.light());
        FoundPhotographs { images, in_memory, masks, light, ..FoundPhotographs::default() }
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::{Error, StageContext};
    use trueup_io::decode;
    use trueup_io::source::InMemory;

    use super::*;
    use crate::options::StitchOptions;
    use crate::project::record::Project;
    use crate::test_room::{ROOM, samples_of};

    fn rows(stitcher: &Stitcher, alignment: &mut Alignment) -> Vec<u8> {
        samples_of(&stitcher.compose(alignment).expect("composed").panorama)
    }

    #[test]
    fn an_alignment_serves_other_views_and_other_photographs() {
        let context = StageContext::default();
        let mut options = StitchOptions::default();
        options.set("canvas.scale=0.1").expect("an option");
        let stitcher = Stitcher::new(&options, &context);
        let mut alignment = stitcher.align(&Inputs::new([ROOM])).expect("aligned").alignments.remove(0);
        let own = rows(&stitcher, &mut alignment);
        let mut same = stitcher.rearrange(&alignment, None).expect("the same");
        assert_eq!(rows(&stitcher, &mut same), own);

        let mut in_memory = InMemory::default();
        let names: Vec<String> = (0..5).map(|number| format!("frame {number}")).collect();
        for (name, source) in names.iter().zip(alignment.photographs.sources()) {
            in_memory.insert(name, decode::photograph(source).expect("decoded"));
        }
        let frames = Inputs { in_memory, ..Inputs::new(names.clone()) };
        let mut others = stitcher.rearrange(&alignment, Some(&frames)).expect("other photographs");
        assert_eq!(rows(&stitcher, &mut others), own, "their pixels are the same");
        assert_eq!(others.project.images[2].path, "frame 2");

        let mut round = options.clone();
        round.set("projection.kind=equirectangular").expect("an option");
        let rounded = Stitcher::new(&round, &context).rearrange(&others, None).expect("another view");
        assert!(rounded.project.projection.is_some() && rounded.project.images[2].path == "frame 2");

        // Measured as if it had been stitched in that view, by the names that the photographs have there.
        let stitched =
            Stitcher::new(&round, &context).align(&Inputs::new([ROOM])).expect("aligned").alignments.remove(0);
        let mut measured = Stitcher::new(&round, &context).rearrange(&alignment, None).expect("another view").project;
        assert!(measured.measures.is_some() && measured.measures != alignment.project.measures);
        assert_eq!(measured.measures, stitched.project.measures);
        let judged = |project: &Project| project.warnings().cloned().collect::<Vec<_>>();
        assert_eq!(judged(&measured), judged(&stitched.project));
        let renamed = (0..5).map(|number| (measured.images[number].path.clone(), names[number].clone())).collect();
        measured.rename_files(&renamed);
        assert_eq!(rounded.project.measures, measured.measures);

        let few = Inputs { photographs: frames.photographs[1..].to_vec(), ..frames };
        let refused = stitcher.rearrange(&alignment, Some(&few)).expect_err("one is missing");
        assert!(refused.to_string().contains("4 were given for 5"), "{refused}");
        options.set("mesh.cell_px=30").expect("an option");
        let refused = Stitcher::new(&options, &context).rearrange(&alignment, None).expect_err("another geometry");
        assert!(matches!(refused, Error::Unsupported { .. }), "{refused}");
    }
}
