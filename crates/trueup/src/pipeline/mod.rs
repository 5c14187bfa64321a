//! The order of the work, whole, and nowhere else:
//!
//! photographs -> [measure] -> [borders] -> [stacking] -> [carrier] -> [matching] -> [align] -> [arrange] -> [compose]
//! -> panorama
//!
//! A phase is a function of its input, its options and a context; what it told on the way comes beside its product.

pub(crate) mod align;
pub(crate) mod arrange;
mod borders;
mod budget;
mod carrier;
mod coarse;
pub(crate) mod compose;
mod frames;
pub(crate) mod light;
mod machine;
pub(crate) mod matched;
pub(crate) mod matching;
pub(crate) mod measure;
pub(crate) mod measured;
mod outside;
#[cfg(test)]
mod phases_tests;
pub(crate) mod photographs;
mod rearrange;
mod results;
mod scratch;
pub(crate) mod shelf;
mod stacking;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use trueup_align::vanishing::TriadOutcome;
use trueup_compose::crop::{Crop, Frame, Rectangle};
use trueup_compose::exposure::Corrections;
use trueup_compose::fidelity::{self, Fidelity};
use trueup_compose::layout::CanvasLayout;
use trueup_compose::render::{self, RenderHelpers, Rendered, Resources};
use trueup_core::diagnostics::Reported;
use trueup_core::scratch::ScratchSpace;
use trueup_core::source::{SourceImage, WorkingFrame};
use trueup_core::told_lens::ToldLens;
use trueup_core::{Error, Result, StageContext};
use trueup_io::color::PhotographColors;
use trueup_io::decode::FilePhotographs;
use trueup_io::encode::Metadata;
use trueup_vision::stacks::Fuse;

use self::align::component::{camera_groups, camera_prior};
use self::align::{AlignInput, Geometry};
pub use self::arrange::PROJECTION_CUT;
use self::arrange::{ArrangeInput, Arrangement};
use self::borders::{BordersInput, Unbordered};
use self::budget::Budget;
pub use self::carrier::CARRIER_LEFT_OUT;
use self::carrier::{CarrierInput, CarrierLeftOut};
use self::coarse::{CoarseFeatures, CoarseInput};
pub use self::compose::CROP_TOO_SMALL;
use self::compose::{ComposeInput, Composed, Destination, LightInput, SmallPhotograph};
pub use self::frames::FRAMES_PASSED_OVER;
use self::matched::Matched;
use self::matching::MatchInput;
use self::measure::MeasureInput;
use self::photographs::{FoundPhotographs, PhotographSet};
use self::shelf::{FeaturesOnShelf, Shelf};
use self::stacking::{Stacked, StackingInput};
use crate::inputs::Inputs;
use crate::memo::{KeyMaker, Memo, PhotographCache};
use crate::options::StitchOptions;
use crate::project::fill::{GeometryRecord, fill_geometry, place, record_composition, unfilled};
use crate::project::provenance;
use crate::project::read::{Recorded, knows_light};
use crate::project::record::{Canvas, CropRecord, Project};
use crate::report::evidence::Evidence;
use crate::report::{judgement, measuring, sideways};
use crate::workers::{Division, Workers};

pub(crate) use budget::memory_of_each;
pub use results::{Aligned, Alignment, MatchedPhotographs};
pub(crate) use scratch::folder as scratch_folder;

/// Runs the phases with one set of options.
///
/// ```
/// use trueup::{Inputs, RowSource, StageContext, StitchOptions, Stitcher};
/// # let room = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");
/// let mut options = StitchOptions::default();
/// options.set("canvas.scale=0.1")?;
/// let stitcher = Stitcher::new(&options, &StageContext::default());
/// let mut alignment = stitcher.align(&Inputs::new([room]))?.alignments.remove(0);
/// let rendered = stitcher.compose(&mut alignment)?;
/// assert_eq!(rendered.panorama.width(), alignment.project.canvas.width);
/// assert!(alignment.project.manhattan.accepted, "guided by vanishing points");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Stitcher<'a> {
    options: &'a StitchOptions,
    context: StageContext<'a>,
    cache: Option<&'a PhotographCache>,
    output: Option<&'a Path>,
    workers: Option<Division<'a>>,
}

impl<'a> Stitcher<'a> {
    /// A stitcher with these options, whose progress goes where that of `context` goes and which stops with it.
    /// Parallel work runs on the current thread pool.
    pub fn new(options: &'a StitchOptions, context: &StageContext<'a>) -> Self {
        let context = context.seeded(options.matching.random.seed);
        Self { options, context, cache: None, output: None, workers: None }
    }

    /// The same stitcher, which finds results of earlier runs in `cache` and keeps its own there. They decide how long
    /// the work takes, never what comes of it.
    #[must_use]
    pub fn with_cache(self, cache: Option<&'a PhotographCache>) -> Self {
        Self { cache, ..self }
    }

    /// The same stitcher, which has `workers` measure and match photographs, make them small and finish the canvas, as
    /// far as the photographs are files without masks; and of blends those along seams. The panorama is the same.
    #[must_use]
    pub fn with_workers(self, workers: Option<&'a dyn Workers>) -> Self {
        Self { workers: workers.map(|workers| Division::new(workers, self.options)), ..self }
    }

    /// The same stitcher for panoramas that will be written to `output`: where that keeps light, stacks are merged to
    /// light, unless `stacks.fuse` says otherwise; scratch files go into the same folder, unless `resources.scratch`
    /// names one, and leave room for them. Without, scratch files go where the system wants temporary files.
    #[must_use]
    pub fn writing_to<'b>(&self, output: &'b Path) -> Stitcher<'b>
    where
        'a: 'b,
    {
        let Self { options, cache, workers, .. } = *self;
        Stitcher { options, context: self.context.seeded(self.context.seed()), cache, output: Some(output), workers }
    }

    /// The options of all phases.
    pub fn options(&self) -> &'a StitchOptions {
        self.options
    }

    /// Finds, measures and matches the photographs and estimates the panoramas' geometry:
    /// [`Stitcher::match_photographs`], then [`Stitcher::align_matched`].
    ///
    /// # Errors
    /// Those of the two.
    pub fn align(&self, inputs: &Inputs) -> Result<Aligned> {
        self.align_matched(&self.match_photographs(inputs)?, inputs)
    }

    /// Finds, measures and matches the photographs. What comes of it can be aligned several times, with other
    /// references or other options of the later phases.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] when no photograph can be read, or the graph or the reference does not fit
    /// the photographs; [`Error::Limits`]; [`Error::Cancelled`].
    pub fn match_photographs(&self, inputs: &Inputs) -> Result<MatchedPhotographs> {
        self.options.validate()?;
        let found = self.context.gather(|context| {
            let memo = Memo { disk: self.cache, memory: None };
            let found = context.gather(|context| PhotographSet::find(inputs, self.options, context))?;
            let paths: Vec<&Path> = found.value.images.iter().map(|image| image.path.as_path()).collect();
            let graph_file = inputs.graph_file(&paths)?;
            let keep_grays = align::needs_pixels(&self.options.align);
            let scratch = scratch::while_measuring(self.options, self.output);
            let shelf = Shelf::new(&scratch, found.value.images.len(), found.value.measuring.held_features);
            let shelf = &shelf;
            let input = MeasureInput { set: &found.value, memo, shelf, keep_grays, workers: self.workers };
            let measurements = measure::run(&input, &self.options.measure, context)?;
            let keeps_light = self.output.is_some_and(|path| self.options.compose.output.keeps_light(path));
            let input = BordersInput { found, measurements, memo, shelf, keep_grays };
            let Unbordered { found, measurements } = borders::run(input, self.options, context)?;
            let input = StackingInput { found, measurements, graph_file, memo, shelf, keep_grays, keeps_light };
            let Stacked { set, measurements, graph_file } = stacking::run(input, self.options, context)?;
            let CarrierLeftOut { set, measurements } =
                carrier::run(CarrierInput { set, measurements, shelf }, self.options, context)?;
            let mut matched = Matched::unmatched(set, measurements, graph_file)?;
            let looked_at = matched.take_features();
            let cameras = &self.options.align.cameras;
            let told = |(image, &frame): (&SourceImage, &WorkingFrame)| camera_prior(image, frame).told_lens(cameras);
            let told: Vec<ToldLens> = matched.set.images.iter().zip(&looked_at.frames).map(told).collect();
            let features = FeaturesOnShelf(looked_at.features.iter().map(Option::as_ref).collect());
            let coarse = CoarseInput {
                fine: &features,
                frames: &looked_at.frames,
                files: &matched.set.files,
                shelf,
                options: &self.options.measure.features,
            };
            let input = MatchInput {
                features: &features,
                coarse: &CoarseFeatures::new(coarse, context),
                frames: &looked_at.frames,
                told: &told,
                usable: &looked_at.usable,
                wished: &matched.graph_file.edges,
                images: &matched.set.images,
                marked: &matched.set.marked(),
                copies: self.options.measure.stacks.fuse != Fuse::None,
                keys: &matched.keys,
                memo,
                workers: self.workers,
            };
            let matches = context.absorb(matching::run(&input, &self.options.matching, context)?);
            matched.pairs = matches.pairs;
            matched.strangers = matches.strangers;
            matched.graph = matches.graph;
            self.report_cache(context);
            Ok(matched)
        })?;
        let (matched, told) = found.split();
        Ok(MatchedPhotographs { matched, told, memory: None })
    }

    /// Estimates the geometry of the panoramas that matched photographs make.
    ///
    /// Of `inputs`, the photographs and the graph are those that were matched; the reference, `all` and `require_all`
    /// are heeded.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] when the reference does not fit the photographs, or `require_all` is not
    /// met; [`Error::Unsolvable`] when no two photographs overlap; [`Error::Cancelled`].
    pub fn align_matched(&self, set: &MatchedPhotographs, inputs: &Inputs) -> Result<Aligned> {
        self.align_groups(set, inputs, None)
    }

    /// [`Self::align_matched`] with vanishing directions that are known already, in place of those that the
    /// photographs' lines tell: `directions` holds one entry for each photograph of the largest group, as
    /// [`Alignment::directions`] has them.
    ///
    /// # Errors
    /// Those of [`Self::align_matched`]; [`Error::Input`] if there are more or fewer directions than photographs.
    pub fn align_along(
        &self,
        set: &MatchedPhotographs,
        inputs: &Inputs,
        directions: &[TriadOutcome],
    ) -> Result<Aligned> {
        self.align_groups(set, &Inputs { all: false, ..inputs.clone() }, Some(directions))
    }

    fn align_groups(
        &self,
        set: &MatchedPhotographs,
        inputs: &Inputs,
        directions: Option<&[TriadOutcome]>,
    ) -> Result<Aligned> {
        self.options.validate()?;
        let shared = self.context.gather(|context| {
            let groups = set.matched.groups(inputs, context)?;
            if inputs.require_all {
                set.matched.require_all(&groups)?;
            }
            set.matched.report_left_out(&groups, context);
            Ok(groups)
        })?;
        let (groups, told) = shared.split();
        let align = |group: &Vec<usize>| {
            let found = self.context.gather(|context| {
                let alignment = self
                    .align_group(group, &groups, set, inputs, directions, context)
                    .map_err(|error| set.matched.of_group(error, group, &groups))?;
                self.report_cache(context);
                Ok(alignment)
            })?;
            let (mut alignment, own) = found.split();
            [set.told.clone(), told.clone(), own].into_iter().for_each(|told| alignment.record(told));
            Ok(alignment)
        };
        Ok(Aligned { alignments: groups.iter().map(align).collect::<Result<_>>()? })
    }

    fn align_group(
        &self,
        members: &[usize],
        groups: &[Vec<usize>],
        set: &MatchedPhotographs,
        inputs: &Inputs,
        directions: Option<&[TriadOutcome]>,
        context: &StageContext,
    ) -> Result<Alignment> {
        let fixed = self.options.fixed_by_method();
        let (matched, photographs) = (&set.matched, &set.matched.set.files);
        let component = matched.component(members, inputs)?;
        let memo = Memo { disk: self.cache, memory: set.memory.as_ref() };
        let input = AlignInput {
            component: &component,
            photographs,
            directions: known_directions(directions, members)?,
            key: matched.key_of(members).map(|key: KeyMaker| key.part(&self.options.matching)),
            memo,
        };
        let geometry: Option<Geometry> = match members.len() {
            1 => None,
            _ => {
                let found = align::run(&input, &fixed.align, context)?;
                Some(context.absorb(found.renumbered(|local| members[local])))
            }
        };
        let input = ArrangeInput::of_geometry(place(&component, geometry.as_ref()), &component, geometry.as_ref());
        let arrangement = context.absorb(arrange::run(input, &fixed.arrange, memo, context)?);
        let light = LightInput {
            layout: &arrangement.lit_plane(),
            small: matched.small_photographs(&component),
            reference: component.reference,
            photographs,
        };
        let key = matched.key_of(members);
        let mut project = unfilled(matched, &fixed, members, groups);
        let geometry = geometry.as_ref();
        // Neither asks for the other, and both leave a core waiting here and there.
        let start = Instant::now();
        let (corrections, measured) = rayon::join(
            || compose::known_light(&light, key, memo, &self.options.compose, context),
            || {
                let start = Instant::now();
                let measured = geometry.map(|geometry| {
                    let evidence = Evidence::of(&component, geometry);
                    let measures = measuring::run(&evidence, &arrangement, &project.images);
                    (evidence, measures)
                });
                (measured, start.elapsed())
            },
        );
        let (Reported { value: corrections, findings, seconds }, (measured, measuring)) = (corrections?, measured);
        let exposing = Duration::from_secs_f64(seconds.values().sum());
        context.share(start.elapsed(), &[("exposure", exposing), ("measures", measuring)]);
        findings.into_iter().for_each(|finding| context.report(finding));
        let found =
            GeometryRecord { component: &component, geometry, arrangement: &arrangement, corrections: &corrections };
        fill_geometry(&mut project, &found);
        project.color_space = photographs.colors().map(PhotographColors::name).unwrap_or_default();
        project.light = photographs.light();
        let (evidence, measures) = measured.unzip();
        project.measures = measures;
        let on_side = geometry.and_then(|geometry| {
            let down = geometry.prior.level_from_world().row(1).transpose();
            sideways::warning(&geometry.cameras.cameras, &down, members)
        });
        let looked_at = judgement::warnings(&project, &context.findings());
        looked_at.into_iter().chain(on_side).for_each(|warning| context.report(warning));
        let layout = arrangement.drawn;
        let corrections = corrections.of_placed(&layout, |photograph| members.binary_search(&photograph).ok());
        let directions = geometry.map(|geometry| geometry.triads.clone()).unwrap_or_default();
        let photographs = photographs.clone();
        let evidence = evidence.map(Arc::new);
        Ok(Alignment { project, layout, kept: None, corrections, photographs, directions, positions: None, evidence })
    }

    /// The geometry that `project` records, over the photographs that were `found`: those used in it, in its order, or
    /// others of their sizes. The canvas is laid out anew if the options ask for another one, and the light evened out
    /// anew if they ask for that. Another view is measured by the `evidence`, or not at all.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] if the project was damaged; [`Error::NotApplicable`] if a projection is
    /// asked for and the project has no cameras; those of the layout; [`Error::Limits`]; [`Error::Cancelled`].
    pub(crate) fn recall(
        &self,
        project: &Project,
        found: FoundPhotographs,
        evidence: Option<Arc<Evidence>>,
    ) -> Result<Alignment> {
        self.options.validate()?;
        let recalled = self.context.gather(|context| {
            let Recorded { used, layout, corrections, reference } = Recorded::new(project)?;
            let set = PhotographSet::open(found, self.options, context)?;
            let fixed = self.options.fixed_by_method();
            let arrangement = arrange::recall(layout, reference, project, &fixed.arrange, context)?;
            let arrangement: Arrangement = context.absorb(arrangement);
            let [own, recorded] = [&self.options.compose, &project.options.compose];
            let same_light =
                own.exposure == recorded.exposure && own.render.look == recorded.render.look && knows_light(project);
            let corrections = match same_light {
                true => corrections,
                false => self.light_anew(&set, &arrangement, reference, context)?,
            };
            let same_view = fixed.arrange == project.options.arrange;
            let recorded_crop = project.crop.map(|crop| (crop, project.canvas));
            let mut project = Project { options: fixed, seconds: Default::default(), ..project.clone() };
            record_composition(&mut project, &used, &set, &arrangement, &corrections);
            project.color_space = set.files.colors().map(PhotographColors::name).unwrap_or_default();
            project.light = set.files.light();
            if !same_view {
                measure_anew(&mut project, evidence.as_deref(), &arrangement, context);
            }
            let layout = arrangement.drawn;
            let kept = if same_view { kept_in_record(recorded_crop, &layout)? } else { None };
            // Photographs are numbered by their place among those used.
            let corrections = corrections.of_placed(&layout, Some);
            let (photographs, directions) = (set.files, Vec::new());
            let positions = Some(used);
            Ok(Alignment { project, layout, kept, corrections, photographs, directions, positions, evidence })
        })?;
        let (mut alignment, told) = recalled.split();
        alignment.record(told);
        Ok(alignment)
    }

    /// What evens out the light of photographs that were only decoded, each placed once.
    fn light_anew(
        &self,
        set: &PhotographSet,
        arrangement: &Arrangement,
        reference: usize,
        context: &StageContext,
    ) -> Result<Corrections> {
        let copies = measure::thumbnails(set, &self.options.measure, context)?;
        let cameras = camera_groups(&set.images.iter().collect::<Vec<_>>());
        let small = copies.iter().zip(cameras).map(|(copy, camera)| SmallPhotograph {
            thumbnail: &copy.thumbnail,
            frame: copy.frame,
            camera,
        });
        let layout = &arrangement.lit_plane();
        let light = LightInput { layout, small: small.collect(), reference, photographs: &set.files };
        Ok(context.absorb(compose::light(&light, &self.options.compose, context)?))
    }

    /// Renders an aligned panorama from the full-resolution photographs, within `resources.memory`, and crops it. What
    /// was found on the way and how long it took goes into the alignment's record, and so does what of the canvas was
    /// kept: an alignment that is composed again keeps the same.
    ///
    /// # Errors
    /// Those of reading the photographs and of a scratch file; [`Error::Limits`] with the numbers, before any
    /// photograph is read, if the canvas is too large for the memory or the disk; [`Error::Cancelled`].
    pub fn compose(&self, alignment: &mut Alignment) -> Result<Rendered> {
        let scratch = scratch::folder(&alignment.layout, self.options, self.output)?;
        let divided = self
            .workers
            .and_then(|workers| workers.rendering(&alignment.photographs, &alignment.layout, &alignment.corrections));
        let mut canvas = self.options.arrange.canvas.clone();
        let turn = alignment.layout.period;
        let is_sphere =
            alignment.project.projection.is_some_and(|one| one.is_whole_sphere(alignment.layout.height, turn));
        if is_sphere && canvas.crop == Crop::Auto {
            // Viewers want all of it, whatever is missing at a pole.
            canvas.crop = Crop::None;
        }
        let input = ComposeInput {
            render: alignment.render_input(),
            resources: Resources {
                helpers: divided.as_ref().map(|divided| divided as &dyn RenderHelpers),
                ..composing_resources(self.options, &alignment.photographs, &scratch)
            },
            canvas: &canvas,
            kept: alignment.kept.clone(),
            destination: self.output.map(|path| Destination { path, options: &self.options.compose.output }),
        };
        let composed =
            self.context.gather(|context| Ok(context.absorb(compose::run(&input, &self.options.compose, context)?)))?;
        let (Composed { rendered, kept, lost, filled }, told) = composed.split();
        alignment.record(told);
        if let Some(kept) = kept {
            alignment.keep(kept, lost, filled);
        }
        Ok(rendered)
    }

    /// What the panorama's file is to tell: its color profile, and of its photographs what the options let pass.
    pub fn metadata(&self, alignment: &Alignment) -> Metadata {
        provenance::metadata(&alignment.project, alignment.photographs.colors(), &self.options.compose.output)
    }

    /// Measures how true what was `rendered` of `alignment` is to its photographs: steps across its seams, and ghosts.
    /// Renders every photograph alone on the canvas, nine bytes a pixel of each.
    ///
    /// # Errors
    /// Those of reading the photographs; [`Error::Input`] if the two do not belong together; [`Error::Cancelled`].
    pub fn fidelity(&self, alignment: &Alignment, rendered: &Rendered) -> Result<Fidelity> {
        let (all, kept) = (&alignment.layout, alignment.kept());
        let layout = &alignment.kept_layout();
        let layers = (0..layout.placed.len())
            .map(|position| {
                self.context.check_cancelled()?;
                render::layer(&alignment.render_input_on(layout), position, &self.options.compose.render)
            })
            .collect::<Result<Vec<_>>>()?;
        let (size, around) = ([layout.width, layout.height], layout.period.is_some());
        let shown = match &rendered.seams {
            Some(seams) => seams.on_canvas(&kept, [all.width, all.height]),
            None => fidelity::deepest(&layers, size, around)?,
        };
        fidelity::measure(&rendered.panorama, &layers, &shown, around)
    }

    /// What the stitcher reports to beside its results: progress, and whether to stop.
    pub(crate) fn context(&self) -> &StageContext<'a> {
        &self.context
    }

    fn report_cache(&self, context: &StageContext) {
        if let Some(cache) = self.cache {
            cache.report(context);
        }
    }
}

/// Measures another view of the panorama that `project` records by the `evidence`, and says anew what of it is to be
/// looked at; without evidence nothing is known of it.
fn measure_anew(project: &mut Project, evidence: Option<&Evidence>, arrangement: &Arrangement, context: &StageContext) {
    project.diagnostics.retain(|told| !judgement::is_of_measures(told));
    let measure = |evidence| context.time("measures", || measuring::run(evidence, arrangement, &project.images));
    project.measures = evidence.map(measure);
    judgement::warnings(project, &project.diagnostics).into_iter().for_each(|warning| context.report(warning));
}

/// What composing these photographs may take of this machine.
pub(crate) fn composing_resources<'a>(
    options: &StitchOptions,
    photographs: &FilePhotographs,
    scratch: &'a dyn ScratchSpace,
) -> Resources<'a> {
    Budget::new(&options.run.resources).composing(photographs, scratch)
}

/// What became of a canvas by what a project records.
///
/// # Errors
/// [`Error::Input`] if what was kept is no part of it.
fn kept_in_record(recorded: Option<(CropRecord, Canvas)>, layout: &CanvasLayout) -> Result<Option<Frame>> {
    let Some((CropRecord { left, top, filled, .. }, Canvas { width, height, .. })) = recorded else { return Ok(None) };
    let stretch = |start: usize, length: usize, whole: usize| {
        let end = start.checked_add(length).filter(|&end| length > 0 && end <= whole)?;
        Some(start..end)
    };
    match (stretch(left, width, layout.width), stretch(top, height, layout.height)) {
        (Some(columns), Some(rows)) => {
            let part = Rectangle { columns, rows };
            // What was kept whole without filling anything stays as it is, whatever no photograph covers of it.
            let is_as_it_was = filled == 0.0 && part == Rectangle::whole([layout.width, layout.height]);
            Ok(Some(if is_as_it_was { Frame::Whole } else { Frame::Part(part) }))
        }
        _ => Err(Error::input(
            "the project",
            format!("its panorama of {width} x {height} px is no part of its canvas"),
            "Give a project file as `trueup stitch --project` wrote it.",
        )),
    }
}

/// Directions for the group `members`, if any are known.
fn known_directions<'d>(
    directions: Option<&'d [TriadOutcome]>,
    members: &[usize],
) -> Result<Option<&'d [TriadOutcome]>> {
    match directions {
        Some(known) if known.len() != members.len() => Err(Error::input(
            "directions",
            format!("{} of them for {} photographs", known.len(), members.len()),
            "Give one for each photograph of the panorama.",
        )),
        known => Ok(known),
    }
}
