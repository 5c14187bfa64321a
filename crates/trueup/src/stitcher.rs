//! The order of the stages: the one place that knows it.

use std::path::{Path, PathBuf};

use trueup_align::stitch_graph::{GraphFile, StitchGraph, parse_graph_file};
use trueup_compose::exposure::{self, Corrections, Thumbnail};
use trueup_compose::fidelity::{self, Fidelity};
use trueup_compose::layout::CanvasLayout;
use trueup_compose::render::{self, Panorama};
use trueup_core::diagnostics::Diagnostic;
use trueup_core::lines::LineSegment;
use trueup_core::source::{PhotographSource, SourceImage, WorkingFrame};
use trueup_core::{Error, Result, StageContext};
use trueup_io::colour::PhotographColours;
use trueup_io::decode::FilePhotographs;
use trueup_io::encode::{self, Metadata};
use trueup_io::scratch::{ScratchFolder, check_room};
use trueup_io::source::{self, RejectedSource, Sources};
use trueup_vision::features::Features;

use crate::align::{self, Component, camera_groups};
use crate::arrangement;
use crate::budget::Budget;
use crate::cache::{Cache, Key, Known, photograph_keys};
use crate::clock::Clock;
use crate::inputs::{Inputs, Reference};
use crate::left_out::LeftOut;
use crate::masks::{AllMasks, MaskRecord};
use crate::matched::{Matched, no_overlap, none_usable, reason_of_rejected, require_all};
use crate::measure;
use crate::measures;
use crate::memory::OverlapMemory;
use crate::names;
use crate::options::StitchOptions;
use crate::pairs;
use crate::project::Project;
use crate::provenance;
use crate::record::{fill_geometry, place, record_composition};
use crate::recorded::Recorded;

/// Runs the stages with one set of options.
#[derive(Debug)]
pub struct Stitcher<'a> {
    options: &'a StitchOptions,
    context: &'a StageContext<'a>,
    cache: Option<&'a Cache>,
    output: Option<&'a Path>,
}

/// What [`Stitcher::align`] found: one alignment per group of photographs to be stitched, the largest first.
#[derive(Debug)]
pub struct Aligned {
    /// At least one.
    pub alignments: Vec<Alignment>,
}

/// Photographs that were found, measured and matched, ready to be aligned.
#[derive(Debug)]
pub struct MatchedPhotographs {
    matched: Matched,
    photographs: std::sync::Arc<FilePhotographs>,
    clock: Clock,
    findings: Vec<Diagnostic>,
    memory: Option<OverlapMemory>,
    /// What decides each photograph's measurements; empty without a cache.
    keys: Vec<Option<Key>>,
}

impl MatchedPhotographs {
    /// Lets alignments share the cameras and overlaps that they have in common: for experiments that align the same
    /// photographs many times. The seconds that a shared stage took when it ran are counted in every alignment.
    pub fn remembering(self) -> Self {
        Self { memory: Some(OverlapMemory::default()), ..self }
    }

    /// The photographs, in the order of [`Project::images`].
    pub(crate) fn photographs(&self) -> &FilePhotographs {
        &self.photographs
    }

    /// The line segments of a photograph, in the pixels of its working frame; `None` if it could not be decoded.
    pub(crate) fn lines_of(&self, photograph: usize) -> Option<(&[LineSegment], WorkingFrame)> {
        let measured = self.matched.measured.get(photograph)?.as_ref()?;
        Some((&measured.lines, measured.frame))
    }
}

/// The geometry of one panorama, ready to be composed.
#[derive(Debug)]
pub struct Alignment {
    /// The record so far; complete but for the seconds that composing and writing take.
    pub project: Project,
    layout: CanvasLayout,
    corrections: Corrections,
    photographs: std::sync::Arc<FilePhotographs>,
    clock: Clock,
}

impl Alignment {
    /// Where the photographs lie on the canvas.
    pub(crate) fn layout(&self) -> &CanvasLayout {
        &self.layout
    }

    /// Gain, colour and vignetting of every photograph placed, and the response of all.
    pub(crate) fn corrections(&self) -> &Corrections {
        &self.corrections
    }

    /// The photographs, in the order of [`Project::images`].
    pub(crate) fn photographs(&self) -> &FilePhotographs {
        &self.photographs
    }

    /// Adds what composing found to the record.
    pub(crate) fn record_findings(&mut self, findings: Vec<Diagnostic>) {
        let names: Vec<String> = self.photographs.images().iter().map(|image| image.name.clone()).collect();
        self.project.diagnostics.extend(findings.into_iter().map(|one| names::by_name(one, &names)));
    }

    /// Adds the wall seconds that a later stage took to the record.
    pub(crate) fn record_seconds(&mut self, stage: &str, duration: std::time::Duration) {
        self.clock.add(stage, duration);
        self.project.seconds.clone_from(self.clock.seconds());
    }
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
    /// [`Error::Options`]; [`Error::Input`] when no photograph can be read or the graph does not fit the photographs;
    /// [`Error::Cancelled`].
    pub fn match_photographs(&self, inputs: &Inputs) -> Result<MatchedPhotographs> {
        self.options.validate()?;
        let mut clock = Clock::default();
        let sources = clock.time("source", || source::scan(&inputs.photographs, &self.options.source, self.context))?;
        self.check_any(&sources, inputs)?;
        let measuring = Budget::new(self.options).measuring(&sources.images, self.options)?;
        let masks = AllMasks::read(&inputs.masks, &sources.images, &self.options.source, self.context)?;
        let colours = PhotographColours::survey(&sources.images, self.context);
        let photographs = FilePhotographs::new(sources.images.clone(), measuring.kept_bytes).in_colours(colours);
        let photographs = std::sync::Arc::new(photographs.with_masks(masks.masks));
        let keys = match self.cache {
            Some(_) => clock.time("source", || photograph_keys(&photographs, self.options, self.context))?,
            None => Vec::new(),
        };
        let known = (self.known(&keys), measuring.at_once);
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
    pub fn align_matched(&self, set: &MatchedPhotographs, inputs: &Inputs) -> Result<Aligned> {
        self.options.validate()?;
        let MatchedPhotographs { matched, photographs, findings, .. } = set;
        let components = self.components_to_stitch(matched, inputs)?;
        if inputs.require_all {
            require_all(matched, &components)?;
        }
        for (index, image) in matched.sources.images.iter().enumerate() {
            if !components.iter().any(|component| component.contains(&index)) {
                photographs.forget(index);
                self.report_left_out(&image.name, &matched.why_left_out(index, &components));
            }
        }
        for rejected in &matched.sources.rejected {
            self.report_rejected(rejected);
        }
        let file_names = matched.names();
        let found = findings.iter().cloned().chain(self.context.take_diagnostics());
        let shared_diagnostics: Vec<_> = found.map(|one| names::by_name(one, &file_names)).collect();

        let mut alignments = Vec::new();
        for component in &components {
            let mut alignment = self.align_component(component, &components, set, inputs)?;
            if let Some(cache) = self.cache {
                cache.report(self.context);
            }
            let own = self.context.take_diagnostics().into_iter().map(|one| names::by_name(one, &file_names));
            alignment.project.diagnostics = shared_diagnostics.iter().cloned().chain(own).collect();
            alignments.push(alignment);
        }
        Ok(Aligned { alignments })
    }

    /// Says where composed panoramas will be written: scratch files go into the same folder, unless `stitch.scratch` names
    /// one, and leave room for them. Without, scratch files go where the system wants temporary files.
    #[must_use]
    pub fn writing_to(self, output: &'a Path) -> Self {
        Self { output: Some(output), ..self }
    }

    /// Renders an aligned panorama from the full-resolution photographs, within `stitch.memory`.
    ///
    /// # Errors
    /// Those of reading the photographs and of a scratch file; [`Error::Limits`] with the numbers, before any photograph is
    /// read, if the canvas is too large for the memory or the disk; [`Error::Cancelled`].
    pub fn compose(&self, alignment: &Alignment) -> Result<Panorama> {
        let layout = &alignment.layout;
        let scratch = self.scratch(layout)?;
        render::run_within(
            &Budget::new(self.options).composing(alignment.photographs.kept_bytes(), &scratch),
            layout,
            &alignment.corrections,
            alignment.photographs.as_ref(),
            (&self.options.render, &self.options.seam),
            self.context,
        )
    }

    /// The geometry that `project` records, over `images` with their `masks`: those used in it, in its order, or others of
    /// their sizes. The canvas is laid out anew if the options ask for another one, and the corrections estimated anew if
    /// they ask for that.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] if the project was damaged; [`Error::NotApplicable`] if a projection is asked
    /// for and the project has no cameras; those of the layout; [`Error::Limits`]; [`Error::Cancelled`].
    pub(crate) fn recall(&self, project: &Project, images: Vec<SourceImage>, masks: AllMasks) -> Result<Alignment> {
        self.options.validate()?;
        let mut clock = Clock::default();
        let Recorded { used, layout, corrections, reference } = Recorded::new(project)?;
        let measuring = Budget::new(self.options).measuring(&images, self.options)?;
        let colours = PhotographColours::survey(&images, self.context);
        let photographs = FilePhotographs::new(images, measuring.kept_bytes).in_colours(colours);
        let photographs = std::sync::Arc::new(photographs.with_masks(masks.masks));
        let arrangement =
            clock.time("canvas", || arrangement::recall(layout, reference, project, self.options, self.context))?;
        let corrections = match self.options.exposure == project.options.exposure {
            true => corrections,
            false => clock.time("exposure", || {
                self.correct_anew(&arrangement.plane, reference, (&photographs, measuring.at_once))
            })?,
        };
        let same_canvas = self.options.canvas == project.options.canvas;
        let mut project = Project { options: self.options.clone(), ..project.clone() };
        let images = photographs.images();
        record_composition(&mut project, &used, images, &masks.records, &arrangement, &corrections);
        project.colour_space = photographs.colours().map(PhotographColours::name).unwrap_or_default();
        if !same_canvas {
            project.measures = None;
        }
        let layout = arrangement.written;
        // Photographs are numbered by their place among those used.
        let corrections = corrections.of_placed(&layout, Some);
        let mut alignment = Alignment { project, layout, corrections, photographs, clock };
        alignment.record_findings(self.context.take_diagnostics());
        alignment.project.seconds.clone_from(alignment.clock.seconds());
        Ok(alignment)
    }

    /// What evens out the light of photographs that were only decoded, each placed once in `layout`.
    fn correct_anew(
        &self,
        layout: &CanvasLayout,
        reference: usize,
        (photographs, at_once): (&FilePhotographs, usize),
    ) -> Result<Corrections> {
        let images: Vec<&SourceImage> = photographs.images().iter().collect();
        let thumbnails = measure::thumbnails(photographs, at_once, self.options, self.context)?;
        let curve = photographs.transfer_curve();
        let thumbnails: Vec<Thumbnail> = thumbnails
            .iter()
            .zip(camera_groups(&images))
            .map(|((raster, frame), camera)| Thumbnail { raster, curve: &curve, frame: *frame, camera })
            .collect();
        Ok(exposure::run(layout, &thumbnails, reference, &self.options.exposure, self.context)?.corrections)
    }

    /// Where a scratch file would go. Refuses a panorama for which there is no room.
    fn scratch(&self, layout: &CanvasLayout) -> Result<ScratchFolder> {
        let named = Some(&self.options.stitch.scratch).filter(|named| !named.is_empty()).map(PathBuf::from);
        let Some(output) = self.output else {
            return Ok(ScratchFolder::new(named.unwrap_or_else(std::env::temp_dir)));
        };
        let folder = output.parent().unwrap_or(Path::new(""));
        let bytes = encode::expected_bytes(output, layout.width, layout.height, &self.options.output);
        check_room(folder, bytes, "the panorama")?;
        Ok(ScratchFolder::new(named.unwrap_or_else(|| folder.to_owned())).beside(folder, bytes))
    }

    /// What the panorama's file is to tell: its colour profile, and of its photographs what the options let pass.
    pub fn metadata(&self, alignment: &Alignment) -> Metadata {
        provenance::metadata(&alignment.project, alignment.photographs.colours(), &self.options.output)
    }

    /// Measures how true `panorama`, composed of `alignment`, is to its photographs: steps across its seams, and ghosts.
    /// Renders every photograph alone on the canvas, five bytes a pixel of each.
    ///
    /// # Errors
    /// Those of reading the photographs; [`Error::Input`] if the two do not belong together; [`Error::Cancelled`].
    pub fn fidelity(&self, alignment: &Alignment, panorama: &Panorama) -> Result<Fidelity> {
        let layout = &alignment.layout;
        let layers = (0..layout.placed.len())
            .map(|position| {
                self.context.check_cancelled()?;
                let photographs = alignment.photographs.as_ref();
                render::layer(layout, &alignment.corrections, position, photographs, &self.options.render)
            })
            .collect::<Result<Vec<_>>>()?;
        let (size, around) = ([layout.width, layout.height], layout.period.is_some());
        let shown = match panorama.seams() {
            Some(seams) => seams.on_canvas(size),
            None => fidelity::deepest(&layers, size, around)?,
        };
        fidelity::measure(panorama, &layers, &shown, around)
    }

    fn check_any(&self, sources: &Sources, inputs: &Inputs) -> Result<()> {
        if !sources.images.is_empty() {
            return Ok(());
        }
        if sources.rejected.is_empty() {
            return Err(Error::input(
                if inputs.photographs.is_empty() { "photographs".to_owned() } else { inputs.photographs.join(", ") },
                "no photographs were given",
                "Name at least two overlapping photographs, or a folder that holds them.",
            ));
        }
        Err(none_usable(sources.rejected.iter().cloned().map(reason_of_rejected).collect()))
    }

    fn known<'k>(&'k self, keys: &'k [Option<Key>]) -> Option<Known<'k>> {
        self.cache.filter(|_| !keys.is_empty()).map(|cache| Known { cache, keys })
    }

    fn match_all(
        &self,
        (sources, masks): (Sources, Vec<Vec<MaskRecord>>),
        photographs: &FilePhotographs,
        (known, at_once): (Option<Known<'_>>, usize),
        inputs: &Inputs,
        clock: &mut Clock,
    ) -> Result<Matched> {
        let names: Vec<String> = sources.images.iter().map(|image| image.name.clone()).collect();
        let graph_file = match &inputs.graph {
            None => GraphFile::default(),
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|error| Error::io("reading", path, error))?;
                parse_graph_file(&text, &names, &path.display().to_string())?
            }
        };
        let (mut measured, mut undecodable) = (Vec::new(), Vec::new());
        let known = known.as_ref();
        for outcome in measure::run(photographs, (known, at_once), self.options, self.context, clock)? {
            match outcome {
                Ok(one) => {
                    measured.push(Some(one));
                    undecodable.push(None);
                }
                Err(error) if measure::concerns_one_photograph(&error) => {
                    measured.push(None);
                    undecodable.push(Some(error));
                }
                Err(error) => return Err(error),
            }
        }
        let unmeasured = Features::default();
        let placeholder = WorkingFrame { width: 1.0, height: 1.0, working_from_full: 1.0 };
        let frames: Vec<WorkingFrame> =
            measured.iter().map(|one| one.as_ref().map_or(placeholder, |one| one.frame)).collect();
        let features: Vec<Features> = measured
            .iter_mut()
            .map(|one| one.as_mut().map_or(unmeasured.clone(), |one| std::mem::take(&mut one.features)))
            .collect();
        let pairs = clock.time("matching", || {
            let usable = |index: usize| measured[index].is_some();
            pairs::run(&features, &frames, &graph_file.edges, &usable, known, self.options, self.context)
        })?;
        let graph = StitchGraph::new(names.len(), &pairs);
        Ok(Matched { sources, measured, undecodable, pairs, graph, graph_file, masks })
    }

    /// The groups to be stitched: the largest, or all with at least two members; a single photograph is a group.
    fn components_to_stitch(&self, matched: &Matched, inputs: &Inputs) -> Result<Vec<Vec<usize>>> {
        let decodable: Vec<usize> =
            (0..matched.measured.len()).filter(|&index| matched.measured[index].is_some()).collect();
        match decodable.as_slice() {
            [] => return Err(matched.none_usable()),
            [only] => {
                let name = &matched.sources.images[*only].name;
                self.context.report(Diagnostic::warning(
                    "single-photograph",
                    name,
                    "there is only one photograph to use; it is written as it is",
                    "Name at least two overlapping photographs, or a folder that holds them.",
                ));
                return Ok(vec![vec![*only]]);
            }
            _ => {}
        }
        let mut joined: Vec<Vec<usize>> =
            matched.graph.components.iter().filter(|component| component.len() > 1).cloned().collect();
        if joined.is_empty() {
            return Err(no_overlap(matched));
        }
        if let Reference::Named(name) = &inputs.reference
            && !inputs.all
        {
            // The panorama that holds the named reference is the one that is wanted.
            let wanted = matched.picture_named(name)?;
            let Some(position) = joined.iter().position(|component| component.contains(&wanted)) else {
                return Err(Error::input(
                    name,
                    "it cannot be the reference because it overlaps no other photograph",
                    "Choose another reference, or leave --reference out.",
                ));
            };
            joined.swap(0, position);
        }
        if !inputs.all {
            joined.truncate(1);
        }
        Ok(joined)
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
            _ => Some(match (memory, self.known(&set.keys)) {
                (None, Some(known)) => {
                    align::run_or_recall(&component, self.options, self.context, &mut clock, &known, photographs)?
                }
                (memory, _) => {
                    align::run(&component, self.options, self.context, &mut clock, memory.as_ref(), photographs)?
                }
            }),
        };
        let placed = place(&component, geometry.as_ref());
        let sources = arrangement::Sources::of_geometry(placed, &component, geometry.as_ref());
        let arrangement = clock.time("canvas", || arrangement::run(sources, self.options, self.context))?;
        let curve = photographs.transfer_curve();
        let thumbnails: Vec<Thumbnail> = members
            .iter()
            .zip(component.camera_groups())
            .filter_map(|(&picture, camera)| Some((camera, matched.measured[picture].as_ref()?)))
            .map(|(camera, one)| Thumbnail {
                raster: &one.thumbnail,
                curve: &curve,
                frame: one.thumbnail_frame,
                camera,
            })
            .collect();
        let corrections = clock
            .time("exposure", || {
                exposure::run(
                    &arrangement.plane,
                    &thumbnails,
                    component.reference,
                    &self.options.exposure,
                    self.context,
                )
            })?
            .corrections;
        let mut project = matched.project(self.options, members, stitched);
        fill_geometry(&mut project, &component, geometry.as_ref(), &arrangement, &corrections);
        project.colour_space = photographs.colours().map(PhotographColours::name).unwrap_or_default();
        project.measures = geometry.as_ref().map(|geometry| {
            clock.time("measures", || measures::run(&component, geometry, &arrangement.plane, self.options))
        });
        project.seconds.clone_from(clock.seconds());
        let layout = arrangement.written;
        // A photograph may be placed several times, or not at all; its light is the same everywhere.
        let corrections = corrections.of_placed(&layout, |photograph| members.binary_search(&photograph).ok());
        Ok(Alignment { project, layout, corrections, photographs: photographs.clone(), clock })
    }

    fn report_left_out(&self, name: &str, left_out: &LeftOut) {
        self.context.report(Diagnostic::warning(left_out.code, name, &left_out.reason, &left_out.hint));
    }

    fn report_rejected(&self, rejected: &RejectedSource) {
        self.context.report(Diagnostic::warning(&rejected.code, &rejected.name, &rejected.reason, &rejected.hint));
    }
}
