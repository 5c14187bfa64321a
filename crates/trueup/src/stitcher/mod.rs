//! The order of the stages: the one place that knows it.

mod composing;
mod matching;
mod recalling;
mod results;

use std::path::Path;
use std::sync::Arc;

use trueup_compose::exposure::{self, Corrections, Thumbnail};
use trueup_compose::layout::CanvasLayout;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::mask::Masks;
use trueup_core::raster::Raster;
use trueup_core::source::{PhotographSource, SourceImage, WorkingFrame};
use trueup_core::{Result, StageContext};
use trueup_io::color::PhotographColors;
use trueup_io::decode::FilePhotographs;
use trueup_io::source::{self, RejectedSource};

use crate::align::{self, Component};
use crate::arrangement;
use crate::budget::Budget;
use crate::cache::{Cache, Key, Known, photograph_keys};
use crate::clock::Clock;
use crate::inputs::{Inputs, Reference};
use crate::left_out::LeftOut;
use crate::masks::AllMasks;
use crate::matched::{reference_named, require_all};
use crate::measures;
use crate::options::StitchOptions;
use crate::record::{fill_geometry, place};

pub use results::{Aligned, Alignment, MatchedPhotographs};

/// Runs the stages with one set of options.
#[derive(Debug)]
pub struct Stitcher<'a> {
    options: &'a StitchOptions,
    context: &'a StageContext<'a>,
    cache: Option<&'a Cache>,
    output: Option<&'a Path>,
}

impl<'a> Stitcher<'a> {
    /// A stitcher with these options. Parallel work runs on the current thread pool.
    pub fn new(options: &'a StitchOptions, context: &'a StageContext<'a>) -> Self {
        Self { options, context, cache: None, output: None }
    }

    /// The same stitcher, which finds results of earlier runs in `cache` and keeps its own there. They decide how long the
    /// work takes, never what comes of it.
    #[must_use]
    pub fn with_cache(self, cache: Option<&'a Cache>) -> Self {
        Self { cache, ..self }
    }

    /// The options of all stages.
    pub(crate) fn options(&self) -> &StitchOptions {
        self.options
    }

    /// What the stages are given beside their input.
    pub(crate) fn context(&self) -> &StageContext<'a> {
        self.context
    }

    /// Finds, measures and matches the photographs and estimates the panoramas' geometry:
    /// [`Stitcher::match_photographs`], then [`Stitcher::align_matched`].
    ///
    /// # Errors
    /// Those of the two.
    pub fn align(&self, inputs: &Inputs) -> Result<Aligned> {
        self.align_matched(&self.match_photographs(inputs)?, inputs)
    }

    /// Finds, measures and matches the photographs. What comes of it can be aligned several times, with other references
    /// or other options of the later stages.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] when no photograph can be read, or the graph or the reference does not fit the
    /// photographs; [`Error::Cancelled`].
    ///
    /// [`Error::Cancelled`]: trueup_core::Error::Cancelled
    /// [`Error::Input`]: trueup_core::Error::Input
    /// [`Error::Options`]: trueup_core::Error::Options
    pub fn match_photographs(&self, inputs: &Inputs) -> Result<MatchedPhotographs> {
        self.options.validate()?;
        let mut clock = Clock::default();
        let sources = clock.time("source", || source::scan(&inputs.photographs, &self.options.source, self.context))?;
        self.check_any(&sources, inputs)?;
        if let Reference::Named(name) = &inputs.reference {
            reference_named(&sources.images, name)?;
        }
        let masks = AllMasks::read(&inputs.masks, &sources.images, &self.options.source, self.context)?;
        let (photographs, at_once) = self.open(sources.images.clone(), masks.masks)?;
        let keys = match self.cache {
            Some(_) => clock.time("source", || photograph_keys(&photographs, self.options, self.context))?,
            None => Vec::new(),
        };
        let known = (self.known(&keys), at_once);
        let matched = self.match_all((sources, masks.records), &photographs, known, inputs, &mut clock)?;
        if let Some(cache) = self.cache {
            cache.report(self.context);
        }
        let findings = self.context.take_diagnostics();
        Ok(MatchedPhotographs { matched, photographs, clock, findings, memory: None, keys })
    }

    /// Estimates the geometry of the panoramas that matched photographs make.
    ///
    /// Of `inputs`, the photographs and the graph are those that were matched; the reference, `all` and `require_all` are
    /// heeded.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] when the reference does not fit the photographs, or `require_all` is not met;
    /// [`Error::Unsolvable`] when no two photographs overlap; [`Error::Cancelled`].
    ///
    /// [`Error::Cancelled`]: trueup_core::Error::Cancelled
    /// [`Error::Input`]: trueup_core::Error::Input
    /// [`Error::Options`]: trueup_core::Error::Options
    /// [`Error::Unsolvable`]: trueup_core::Error::Unsolvable
    pub fn align_matched(&self, set: &MatchedPhotographs, inputs: &Inputs) -> Result<Aligned> {
        self.options.validate()?;
        let MatchedPhotographs { matched, photographs, findings, .. } = set;
        let components = self.components_to_stitch(matched, inputs)?;
        if inputs.require_all {
            require_all(matched, &components)?;
        }
        for index in 0..matched.sources.images.len() {
            if !components.iter().any(|component| component.contains(&index)) {
                photographs.forget(index);
                self.report_left_out(index, &matched.why_left_out(index, &components));
            }
        }
        for rejected in &matched.sources.rejected {
            self.report_rejected(rejected);
        }
        let found = findings.iter().cloned().chain(self.context.take_diagnostics());
        let shared_diagnostics: Vec<_> = found.collect();

        let mut alignments = Vec::new();
        for component in &components {
            let mut alignment = self.align_component(component, &components, set, inputs)?;
            if let Some(cache) = self.cache {
                cache.report(self.context);
            }
            let own = self.context.take_diagnostics();
            alignment.project.diagnostics = shared_diagnostics.iter().cloned().chain(own).collect();
            alignments.push(alignment);
        }
        Ok(Aligned { alignments })
    }

    /// The photographs with their masks, in one color space, and how many of them may be measured at once.
    fn open(&self, images: Vec<SourceImage>, masks: Vec<Masks>) -> Result<(Arc<FilePhotographs>, usize)> {
        let measuring = Budget::new(self.options).measuring(&images, self.options)?;
        let colors = PhotographColors::survey(&images, self.context);
        let photographs = FilePhotographs::new(images, measuring.kept_bytes).in_colors(colors);
        Ok((Arc::new(photographs.with_masks(masks)), measuring.at_once))
    }

    fn known<'k>(&'k self, keys: &'k [Option<Key>]) -> Option<Known<'k>> {
        self.cache.filter(|_| !keys.is_empty()).map(|cache| Known { cache, keys })
    }

    fn align_component(
        &self,
        members: &[usize],
        stitched: &[Vec<usize>],
        set: &MatchedPhotographs,
        inputs: &Inputs,
    ) -> Result<Alignment> {
        let MatchedPhotographs { matched, photographs, clock, memory, .. } = set;
        let mut clock = clock.clone();
        let reference = matched.reference_of(members, inputs)?;
        let rotation = match matched.graph_file.reference == Some(reference) {
            true => matched.graph_file.reference_rotation_deg.unwrap_or(0.0).to_radians(),
            false => 0.0,
        };
        let component =
            Component::new(members, reference, rotation, &matched.sources.images, &matched.measured, &matched.pairs);
        let geometry = match members.len() {
            1 => None,
            _ => {
                let found = self.context.gather(|context| match (memory, self.known(&set.keys)) {
                    (None, Some(known)) => {
                        align::run_or_recall(&component, self.options, context, &mut clock, &known, photographs)
                    }
                    (memory, _) => {
                        align::run(&component, self.options, context, &mut clock, memory.as_ref(), photographs)
                    }
                })?;
                Some(self.context.absorb(found.renumbered(|local| members[local])))
            }
        };
        let placed = place(&component, geometry.as_ref());
        let sources = arrangement::Sources::of_geometry(placed, &component, geometry.as_ref());
        let arrangement = clock.time("canvas", || arrangement::run(sources, self.options, self.context))?;
        let corrections = clock.time("exposure", || {
            let thumbnails = members.iter().zip(component.camera_groups()).filter_map(|(&picture, camera)| {
                let measured = matched.measured[picture].as_ref()?;
                Some((&measured.thumbnail, measured.thumbnail_frame, camera))
            });
            self.correct(&arrangement.plane, component.reference, photographs, thumbnails)
        })?;
        let mut project = matched.project(self.options, members, stitched);
        fill_geometry(&mut project, &component, geometry.as_ref(), &arrangement, &corrections);
        project.color_space = photographs.colors().map(PhotographColors::name).unwrap_or_default();
        project.measures = geometry.as_ref().map(|geometry| {
            clock.time("measures", || measures::run(&component, geometry, &arrangement.plane, self.options))
        });
        project.seconds.clone_from(clock.seconds());
        let layout = arrangement.written;
        let corrections = corrections.of_placed(&layout, |photograph| members.binary_search(&photograph).ok());
        Ok(Alignment { project, layout, corrections, photographs: photographs.clone(), clock })
    }

    /// What evens out the light of the photographs placed in `layout`, from their thumbnails, each with its frame and the
    /// camera that took it.
    fn correct<'t>(
        &self,
        layout: &CanvasLayout,
        reference: usize,
        photographs: &FilePhotographs,
        thumbnails: impl Iterator<Item = (&'t Raster<u8>, WorkingFrame, usize)>,
    ) -> Result<Corrections> {
        let curve = photographs.transfer_curve();
        let thumbnails: Vec<Thumbnail> =
            thumbnails.map(|(raster, frame, camera)| Thumbnail { raster, curve: &curve, frame, camera }).collect();
        let input = exposure::ExposureInput { layout, thumbnails: &thumbnails, reference };
        Ok(exposure::run(&input, &self.options.exposure, self.context)?.corrections)
    }

    fn report_left_out(&self, photograph: usize, left_out: &LeftOut) {
        self.context.report(Diagnostic::warning(
            left_out.code,
            Subject::Photograph(photograph),
            &left_out.reason,
            &left_out.hint,
        ));
    }

    fn report_rejected(&self, rejected: &RejectedSource) {
        self.context.report(Diagnostic::warning(
            &rejected.code,
            Subject::file(&rejected.name),
            &rejected.reason,
            &rejected.hint,
        ));
    }
}
