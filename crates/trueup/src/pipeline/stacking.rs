//! The stacking phase: photographs of one view at several exposures become one.

use std::collections::BTreeMap;

use rayon::prelude::*;
use trueup_align::stitch_graph::GraphFile;
use trueup_core::color::LightRange;
use trueup_core::diagnostics::{Diagnostic, Reported, Subject};
use trueup_core::geometry::Homography;
use trueup_core::source::{PhotographSource, SourceImage, StackMember, WorkingFrame};
use trueup_core::{Result, StageContext};
use trueup_io::source::RejectedSource;
use trueup_vision::stacks::{self, FoundMember, FoundStack, Fuse, MemberPair, StackCandidate, Unaligned};

use super::align::component::{camera_groups, lens_groups};
use super::light::{self, WantedLight};
use super::measure::{self, MeasureInput, Measurements, THUMBNAIL_PIXELS, concerns_one_photograph};
use super::photographs::{FoundPhotographs, PhotographSet};
use super::shelf::Shelf;
use crate::inputs::AllMasks;
use crate::memo::{Key, KeyMaker, Memo, STACKS};
use crate::options::StitchOptions;

const STAGE: &str = "stacks";

/// The code of an exposure that is in no panorama because it does not lie on the others of its stack.
const NOT_ALIGNED: &str = "stack-member-not-aligned";

/// The code of an exposure that is in no panorama because its stack has more than enough of them.
const SPARE: &str = "stack-member-spare";

/// What the phase works on.
pub(super) struct StackingInput<'a> {
    /// The photographs as they were given, and what was told of them.
    pub found: Reported<PhotographSet>,
    pub measurements: Reported<Measurements>,
    pub graph_file: GraphFile,
    pub memo: Memo<'a>,
    pub shelf: &'a Shelf<'a>,
    pub keep_grays: bool,
    /// Whether the panorama will be written with what is brighter than white.
    pub keeps_light: bool,
}

/// Photographs of which each stack is one.
pub(super) struct Stacked {
    pub set: PhotographSet,
    pub measurements: Measurements,
    pub graph_file: GraphFile,
}

/// A stack whose members lie on its reference.
struct AlignedStack {
    reference: usize,
    members: Vec<(FoundMember, StackMember)>,
    left_out: Vec<(FoundMember, LeftOut)>,
}

/// Why an exposure of a stack is not fused with it.
#[derive(Debug, Clone, Copy)]
enum LeftOut {
    NotAligned(Unaligned),
    Spare,
}

impl AlignedStack {
    fn numbers(&self) -> impl Iterator<Item = usize> {
        let members = self.members.iter().map(|(found, _)| found.photograph);
        members.chain(self.left_out.iter().map(|(found, _)| found.photograph))
    }
}

/// Finds stacks among the photographs, aligns their members, and measures what they are fused to; without any,
/// everything stays as it was.
///
/// # Errors
/// [`trueup_core::Error::Limits`]; [`trueup_core::Error::Cancelled`].
pub(super) fn run(input: StackingInput, options: &StitchOptions, context: &StageContext) -> Result<Stacked> {
    let StackingInput { found, measurements, graph_file, memo, shelf, keep_grays, keeps_light } = input;
    let stacks = match options.measure.stacks.fuse {
        Fuse::Auto | Fuse::Light => {
            context.time(STAGE, || aligned_stacks(&found.value, &measurements.value, memo, options, context))?
        }
        Fuse::None => Vec::new(),
    };
    if stacks.is_empty() {
        let (set, measurements) = (context.absorb(found), context.absorb(measurements));
        return Ok(Stacked { set, measurements, graph_file });
    }
    let (old, told_of_files) = found.split();
    let (old_measurements, mut told_of_pixels) = measurements.split();
    let light = old.files.light().or_else(|| {
        let is_wanted = keeps_light || options.measure.stacks.fuse == Fuse::Light;
        if is_wanted { range_of_light(&stacks, &old, &old_measurements) } else { None }
    });
    // Photographs beside the stacks are handed out in other samples then.
    let is_new_light = light != old.files.light();
    let numbering = Numbering::new(old.images.len(), &stacks);
    // What was told of an exposure's own features says nothing of the stack.
    let is_of_a_stack =
        |one: &Diagnostic| matches!(one.subject, Subject::Photograph(number) if numbering.is_of_a_stack(number));
    told_of_pixels.findings.retain(|one| !is_new_light && !is_of_a_stack(one));
    context.absorb(told_of_files.renumbered(|number| numbering.new_of(number)));
    context.absorb(told_of_pixels.renumbered(|number| numbering.new_of(number)));
    let (set, fused) = stacked_set(old, &stacks, &numbering, light, options, context)?;
    for (&number, stack) in fused.iter().zip(&stacks) {
        context.report(fused_note(number, stack, &set));
    }
    let input = MeasureInput { set: &set, memo, shelf, keep_grays, workers: None };
    let anew: Vec<usize> = if is_new_light { (0..set.images.len()).collect() } else { fused };
    let measured = context.absorb(measure::some(&input, &anew, &options.measure, context)?);
    let Measurements { photographs, keys } = old_measurements;
    let mut new =
        Measurements { photographs: numbering.those_that_stay(photographs), keys: numbering.those_that_stay(keys) };
    for (number, (one, key)) in anew.into_iter().zip(measured.photographs.into_iter().zip(measured.keys)) {
        new.photographs[number] = one;
        new.keys[number] = key;
    }
    Ok(Stacked { set, measurements: new, graph_file: numbering.graph_file(graph_file) })
}

/// Which number the photographs get when those of a stack have one.
struct Numbering {
    new: Vec<usize>,
    /// Whether a photograph has a number of its own.
    stays: Vec<bool>,
    is_of_a_stack: Vec<bool>,
}

impl Numbering {
    fn new(count: usize, stacks: &[AlignedStack]) -> Self {
        let reference_of: BTreeMap<usize, usize> =
            stacks.iter().flat_map(|stack| stack.numbers().map(|number| (number, stack.reference))).collect();
        let stays: Vec<bool> = (0..count).map(|number| !reference_of.contains_key(&number)).collect();
        let mut own = Vec::with_capacity(count);
        let mut next = 0;
        for &stays in &stays {
            own.push(next);
            next += usize::from(stays);
        }
        let new = (0..count).map(|number| own[reference_of.get(&number).copied().unwrap_or(number)]).collect();
        let mut is_of_a_stack: Vec<bool> = stays.iter().map(|stays| !stays).collect();
        stacks.iter().for_each(|stack| is_of_a_stack[stack.reference] = true);
        Self { new, stays, is_of_a_stack }
    }

    fn new_of(&self, number: usize) -> usize {
        self.new.get(number).copied().unwrap_or(number)
    }

    /// Of what is known of each photograph, that of those that have a number of their own, by these.
    fn those_that_stay<T>(&self, all: Vec<T>) -> Vec<T> {
        all.into_iter().zip(&self.stays).filter(|(_, stays)| **stays).map(|(one, _)| one).collect()
    }

    fn is_of_a_stack(&self, number: usize) -> bool {
        self.is_of_a_stack.get(number).is_some_and(|&is| is)
    }

    /// The same wishes of stacks in place of their members.
    fn graph_file(&self, graph_file: GraphFile) -> GraphFile {
        let edge = |&(a, b): &(usize, usize)| {
            let (a, b) = (self.new_of(a), self.new_of(b));
            (a != b).then_some((a.min(b), a.max(b)))
        };
        let mut edges: Vec<(usize, usize)> = graph_file.edges.iter().filter_map(edge).collect();
        edges.sort_unstable();
        edges.dedup();
        GraphFile { edges, reference: graph_file.reference.map(|number| self.new_of(number)), ..graph_file }
    }
}

/// The stacks, in the order of their references, each with a member at least that lies on it.
fn aligned_stacks(
    set: &PhotographSet,
    measurements: &Measurements,
    memo: Memo,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Vec<AlignedStack>> {
    let images: Vec<&SourceImage> = set.images.iter().collect();
    let cameras = camera_groups(&images).into_iter().zip(lens_groups(&images));
    let mut known: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let candidates: Vec<StackCandidate> = cameras
        .zip(&measurements.photographs)
        .enumerate()
        .map(|(number, (camera, measured))| {
            let count = known.len();
            let camera = *known.entry(camera).or_insert(count);
            // Marks and outlines are of one exposure's pixels.
            let masks = set.files.given_masks(number);
            let is_marked = masks.ignored.is_some() || masks.kept.is_some() || set.images[number].outline.is_some();
            let thumbnail = measured.as_ref().ok().filter(|_| !is_marked).map(|measured| &measured.thumbnail);
            StackCandidate { thumbnail, camera, recorded_stops: set.images[number].exposure.stops }
        })
        .collect();
    let found = known_stacks(&candidates, &measurements.keys, memo)?;
    let mut aligned = Vec::new();
    // As many as may be measured at once, each of which reads two photographs at a time.
    for group in found.chunks((set.measuring.at_once / 2).max(1)) {
        context.check_cancelled()?;
        let stacks: Vec<Option<AlignedStack>> =
            group.par_iter().map(|stack| aligned_stack(stack, set, options, context)).collect::<Result<_>>()?;
        aligned.extend(stacks.into_iter().flatten());
    }
    aligned.sort_by_key(|stack| stack.reference);
    Ok(aligned)
}

/// The stacks among the candidates, whose measurements are decided by `keys`, unless an earlier run found them among
/// the same ones in the same order.
fn known_stacks(candidates: &[StackCandidate], keys: &[Option<Key>], memo: Memo) -> Result<Vec<FoundStack>> {
    let of_one = |maker: KeyMaker, (candidate, key): (&StackCandidate, &Option<Key>)| {
        let StackCandidate { thumbnail, camera, recorded_stops } = candidate;
        Some(maker.key(key.as_ref()?).part(&(thumbnail.is_some(), camera, recorded_stops)))
    };
    let content = candidates.iter().zip(keys).try_fold(KeyMaker::new(), of_one);
    let key = memo.key(STACKS, content, &());
    let is_among = |stack: &FoundStack| {
        let others = stack.others.iter().chain(&stack.spare).map(|other| other.photograph);
        let mut numbers = others.chain([stack.reference]);
        numbers.all(|number| number < candidates.len())
    };
    let is_whole = |known: &Vec<FoundStack>| known.iter().all(is_among);
    memo.found_or_made(STACKS, key.as_ref(), is_whole, || Ok(stacks::find(candidates)))
}

/// `None` where no member lies on the reference, or a file can no longer be read: each photograph then stands for
/// itself.
fn aligned_stack(
    found: &FoundStack,
    set: &PhotographSet,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Option<AlignedStack>> {
    let image = &set.images[found.reference];
    let frame = WorkingFrame::new(image.width, image.height, options.measure.working.pixels);
    let gray = |number: usize| {
        context.check_cancelled()?;
        match set.files.working(number, &frame, THUMBNAIL_PIXELS) {
            Ok(picture) => Ok(Some(picture.gray)),
            Err(error) if concerns_one_photograph(&error) => Ok(None),
            Err(error) => Err(error),
        }
    };
    let Some(reference) = gray(found.reference)? else { return Ok(None) };
    let focal_px = image.focal_prior.map(|prior| prior.focal_px * frame.working_from_full);
    let mut members = Vec::new();
    let mut left_out: Vec<(FoundMember, LeftOut)> = found.spare.iter().map(|&spare| (spare, LeftOut::Spare)).collect();
    for member in &found.others {
        let Some(gray) = gray(member.photograph)? else { return Ok(None) };
        let FoundMember { stops, shift, photograph, is_sure } = *member;
        let pair = MemberPair { reference: &reference, member: &gray, stops, shift, focal_px };
        match stacks::align(&pair) {
            Ok(aligned) => {
                let source = set.images[photograph].clone();
                let full = in_full_pixels(&aligned.reference_from_member, frame.working_from_full);
                members.push((*member, StackMember { source, reference_from_member: full.to_rows() }));
            }
            Err(reason) if is_sure => left_out.push((*member, LeftOut::NotAligned(reason))),
            // It only looked like an exposure of this view, and stands for itself.
            Err(_) => {}
        }
    }
    Ok((!members.is_empty()).then_some(AlignedStack { reference: found.reference, members, left_out }))
}

/// A map between pictures that were both reduced by `scale`, between the whole ones.
fn in_full_pixels(map: &Homography, scale: f64) -> Homography {
    let mut full = map.0;
    for axis in 0..2 {
        full[(axis, 2)] /= scale;
        full[(2, axis)] *= scale;
    }
    Homography(full)
}

/// The range of the light that stacks are merged to.
fn range_of_light(stacks: &[AlignedStack], set: &PhotographSet, measurements: &Measurements) -> Option<LightRange> {
    let of_stack = |stack: &AlignedStack| {
        let thumbnail = &measurements.photographs[stack.reference].as_ref().ok()?.thumbnail;
        let darkest = stack.members.iter().map(|(found, _)| found.stops).fold(0.0, f64::min);
        Some((thumbnail, darkest))
    };
    light::of_stacks(stacks.iter().filter_map(of_stack), &set.files.transfer_curve())
}

/// The set in which each stack is one photograph, and the numbers of these.
fn stacked_set(
    old: PhotographSet,
    stacks: &[AlignedStack],
    numbering: &Numbering,
    light: Option<LightRange>,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<(PhotographSet, Vec<usize>)> {
    let mut found = old.into_found();
    let FoundPhotographs { images, rejected, .. } = &mut found;
    for stack in stacks {
        let reference = &images[stack.reference].name;
        rejected.extend(
            stack.left_out.iter().map(|(found, reason)| left_out(&images[found.photograph], reference, *reason)),
        );
        images[stack.reference].stack = stack.members.iter().map(|(_, member)| member.clone()).collect();
    }
    let found = FoundPhotographs {
        images: numbering.those_that_stay(found.images),
        masks: AllMasks {
            masks: numbering.those_that_stay(found.masks.masks),
            records: numbering.those_that_stay(found.masks.records),
        },
        light: WantedLight::Known(light),
        ..found
    };
    let fused = stacks.iter().map(|stack| numbering.new_of(stack.reference)).collect();
    Ok((PhotographSet::reopened(found, options, context)?, fused))
}

fn left_out(image: &SourceImage, reference: &str, reason: LeftOut) -> RejectedSource {
    // Where the reason is the same for every stack, it does not name the stack: exposures of one reason are told
    // together.
    let of_any = |why: &str| format!("it is an exposure of a stack, but {why}");
    let of_this = |why: String| format!("it is an exposure of the stack of {reference}, but {why}");
    let (code, reason) = match reason {
        LeftOut::Spare => (SPARE, of_any("those before and after it are enough")),
        LeftOut::NotAligned(Unaligned::NoPicture) => (NOT_ALIGNED, of_any("it is too small to be aligned")),
        LeftOut::NotAligned(Unaligned::OtherDetails(correlation)) => (
            NOT_ALIGNED,
            of_this(format!("its details are others once it is aligned (they correlate by {correlation:.2})")),
        ),
        LeftOut::NotAligned(Unaligned::TooFar(share)) => {
            (NOT_ALIGNED, of_this(format!("it lies {:.0} % of a side away", 100.0 * share)))
        }
    };
    RejectedSource {
        path: image.path.clone(),
        name: image.name.clone(),
        code: code.to_owned(),
        reason,
        hint: "Give --stacks none to have every photograph stitched by itself.".to_owned(),
    }
}

fn fused_note(number: usize, stack: &AlignedStack, set: &PhotographSet) -> Diagnostic {
    let member =
        |(found, member): &(FoundMember, StackMember)| format!("{} ({:+.1} stops)", member.source.name, found.stops);
    let members: Vec<String> = stack.members.iter().map(member).collect();
    let message = format!(
        "{} exposures of one view were {} in its frame: itself, {}",
        set.images[number].stack.len() + 1,
        if set.files.light().is_some() { "merged to light" } else { "fused" },
        members.join(", ")
    );
    Diagnostic::note(
        "stack-fused",
        Subject::Photograph(number),
        message,
        "Give --stacks none to have each of them stitched by itself.",
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use trueup_core::raster::{Photograph, Raster, RowSource};
    use trueup_io::decode;
    use trueup_io::source::{InMemory, SourceOptions, scan};

    use super::*;
    use crate::inputs::{Inputs, Reference};
    use crate::memo::PhotographCache;
    use crate::pipeline::Stitcher;
    use crate::test_room::{ROOM, samples_of};

    /// Those of one reason are told in one line.
    #[test]
    fn spare_exposures_of_several_stacks_have_one_reason() {
        let spare = SourceImage::unknown("spare.jpg", "spare.jpg", [40, 30]);
        let reason = |reference: &str, reason: LeftOut| left_out(&spare, reference, reason).reason;
        assert_eq!(reason("a.jpg", LeftOut::Spare), reason("b.jpg", LeftOut::Spare));
        let far = |reference: &str| reason(reference, LeftOut::NotAligned(Unaligned::TooFar(0.3)));
        assert!(far("a.jpg").contains("the stack of a.jpg") && far("b.jpg").contains("the stack of b.jpg"));
    }

    const GAINS: [f32; 3] = [1.0, 0.4, 2.2];

    /// Two photographs of the room, each at three exposures, as if their names were those of files.
    fn brackets() -> (Vec<String>, InMemory) {
        let room = Path::new(ROOM);
        let (mut names, mut in_memory) = (Vec::new(), InMemory::default());
        for number in ["02", "03"] {
            let path = room.join(format!("{number}.jpg")).display().to_string();
            let file =
                scan(&[path], &SourceOptions::default(), &StageContext::default()).expect("the room").photographs;
            let Photograph::Eight(picture) = decode::photograph(&file[0]).expect("decoded") else { panic!("8 bits") };
            for (exposure, gain) in GAINS.iter().enumerate() {
                let levels = picture.data().iter().map(|&level| (f32::from(level) * gain + 0.5) as u8).collect();
                let picture = Raster::from_data(picture.width(), picture.height(), picture.channels(), levels);
                let name = format!("{number}-{exposure}");
                in_memory.insert(&name, Photograph::Eight(picture.expect("samples")));
                names.push(name);
            }
        }
        (names, in_memory)
    }

    #[test]
    fn brackets_are_stitched_as_two_photographs_and_found_again_in_the_cache() {
        let (names, in_memory) = brackets();
        // An exposure is as good a name for its stack as the reference is.
        let reference = Reference::Named("03-2".to_owned());
        let inputs = Inputs { in_memory, reference, ..Inputs::new(names) };
        let mut options = StitchOptions::default();
        options.set("canvas.scale=0.1").expect("an option");
        let context = StageContext::default();
        let desk = tempfile::tempdir().expect("a folder");
        let cache = PhotographCache::open(desk.path(), 1e9).expect("a cache");
        let mut pictures = Vec::new();
        for _ in 0..2 {
            let stitcher = Stitcher::new(&options, &context).with_cache(Some(&cache));
            let mut alignment = stitcher.align(&inputs).expect("aligned").alignments.remove(0);
            let project = &alignment.project;
            assert_eq!((project.used(), project.images.len()), (2, 2));
            assert!(project.reference.starts_with("03-"), "{}", project.reference);
            for image in &project.images {
                assert_eq!(image.stack.len(), 2);
                for member in &image.stack {
                    let map = Homography::from_rows(&member.reference_from_member);
                    let corner = [image.width as f64, image.height as f64].into();
                    assert!((map.apply(corner) - corner).norm() < 0.2, "they were not moved: {map:?}");
                }
            }
            let told = project.diagnostics.iter().filter(|one| one.code == "stack-fused").count();
            assert_eq!(told, 2);
            assert!(project.diagnostics.iter().all(|one| one.code != "near-duplicate"), "{:?}", project.diagnostics);
            pictures.push(samples_of(&stitcher.compose(&mut alignment).expect("composed").panorama));
            let mut again = stitcher.rearrange(&alignment, None).expect("rearranged");
            pictures.push(samples_of(&stitcher.compose(&mut again).expect("composed").panorama));
        }
        assert!(pictures.iter().all(|picture| *picture == pictures[0]));
        let used = cache.uses().get("measured").map_or([0, 0], |one| [one.found, one.made]);
        assert_eq!(used, [8, 8], "six exposures and two stacks, found the second time");

        options.set("stacks.fuse=none").expect("an option");
        let alignment = Stitcher::new(&options, &context).align(&inputs).expect("aligned").alignments.remove(0);
        assert!(alignment.project.used() > 2 && alignment.project.images.len() == 6);
    }

    /// The brightest light of a panorama.
    fn brightest(panorama: &dyn RowSource) -> f32 {
        let mut row = vec![0.0; panorama.width() * 4];
        let mut most = 0.0_f32;
        for y in 0..panorama.height() {
            panorama.linear_row(y, &mut row).expect("a row");
            most = row.chunks_exact(4).flat_map(|pixel| &pixel[..3]).fold(most, |most, &light| most.max(light));
        }
        most
    }

    #[test]
    fn brackets_are_merged_to_light_where_the_panorama_keeps_it() {
        let (names, in_memory) = brackets();
        let inputs = Inputs { in_memory, ..Inputs::new(names) };
        let mut options = StitchOptions::default();
        options.set("canvas.scale=0.1").expect("an option");
        let context = StageContext::default();
        let picture = Stitcher::new(&options, &context).writing_to(Path::new("pano.jpg"));
        let mut fused = picture.align(&inputs).expect("aligned").alignments.remove(0);
        assert_eq!(fused.project.light, None);
        let fused = picture.compose(&mut fused).expect("composed").panorama;
        assert!(brightest(&fused) <= 1.0);

        let light = Stitcher::new(&options, &context).writing_to(Path::new("pano.exr"));
        let mut merged = light.align(&inputs).expect("aligned").alignments.remove(0);
        let range = merged.project.light.expect("light");
        assert!(range.peak > range.white && merged.project.used() == 2, "{range:?}");
        let panorama = light.compose(&mut merged).expect("composed").panorama;
        // In the unit of the reference, which is the darkest here: what is white in it.
        assert!((0.9..range.peak as f32).contains(&brightest(&panorama)), "{}", brightest(&panorama));
        assert_ne!(samples_of(&panorama), samples_of(&fused));
        let mut again = light.rearrange(&merged, None).expect("rearranged");
        assert_eq!(again.project.light, Some(range));
        assert_eq!(samples_of(&light.compose(&mut again).expect("composed").panorama), samples_of(&panorama));
        // For a panorama that does not keep it, it must be asked for.
        options.set("stacks.fuse=light").expect("an option");
        let asked = Stitcher::new(&options, &context).align(&inputs).expect("aligned").alignments.remove(0);
        assert_eq!(asked.project.light, Some(range));
    }

    #[test]
    fn photographs_keep_their_order_and_wishes_name_stacks() {
        let member = |photograph| FoundMember { photograph, stops: 1.0, shift: [0.0; 2], is_sure: true };
        let stack = AlignedStack {
            reference: 2,
            members: Vec::new(),
            left_out: [1, 3].map(|k| (member(k), LeftOut::NotAligned(Unaligned::NoPicture))).into(),
        };
        let numbering = Numbering::new(6, &[stack]);
        let new: Vec<usize> = (0..6).map(|number| numbering.new_of(number)).collect();
        assert_eq!(new, [0, 1, 1, 1, 2, 3]);
        let graph =
            GraphFile { edges: vec![(0, 1), (0, 3), (1, 2), (3, 5)], reference: Some(3), ..GraphFile::default() };
        let graph = numbering.graph_file(graph);
        assert_eq!((graph.edges, graph.reference), (vec![(0, 1), (1, 3)], Some(1)));
    }

    #[test]
    fn a_map_of_reduced_pictures_is_one_of_the_whole_ones() {
        // x' = (x + 3) / (1 + 0.01 x) of pictures at half the size: at 20 whole pixels, 13 / 1.1 of these, 26 / 1.1
        // whole ones.
        let small = Homography::from_rows(&[[1.0, 0.0, 3.0], [0.0, 1.0, 0.0], [0.01, 0.0, 1.0]]);
        let place = in_full_pixels(&small, 0.5).apply([20.0, 0.0].into());
        assert!((place.x - 26.0 / 1.1).abs() < 1e-12);
    }
}
