//! Panoramas that are divided among workers, which are in this program but see nothing but bytes.

use std::sync::Mutex;

use trueup_compose::render::Rendered;
use trueup_core::{Error, StageContext};
use trueup_io::decode;
use trueup_io::source::InMemory;
use trueup_vision::matching::Demand;

use super::*;
use crate::inputs::Inputs;
use crate::memo::PhotographCache;
use crate::options::StitchOptions;
use crate::pipeline::{Alignment, Stitcher};
use crate::test_room::{ROOM, TOO_FEW_FEATURES, room_with_a_blurred_photograph, samples_of};

/// Does tasks in the wrong order, each by a worker of its own.
#[derive(Default)]
struct Here {
    /// How many tasks were handed out.
    tasks: Mutex<usize>,
    /// Whether every task's last byte is lost.
    cuts: bool,
    /// Whether the last task is forgotten.
    forgets: bool,
}

impl Workers for Here {
    fn run(&self, common: &[u8], tasks: Vec<Vec<u8>>, take: TakeResult<'_>) -> Result<()> {
        *self.tasks.lock().expect("no test failed") += tasks.len();
        let context = StageContext::default();
        for (number, task) in tasks.into_iter().enumerate().rev().skip(usize::from(self.forgets)) {
            let mut result = Worker::new(common, &context)?.run(&task, &context)?;
            if self.cuts {
                result.pop();
            }
            take(number, result)?;
        }
        Ok(())
    }
}

fn options(assignments: &[&str]) -> StitchOptions {
    let mut options = StitchOptions::default();
    for assignment in ["canvas.scale=0.2"].iter().chain(assignments) {
        options.set(assignment).expect("an option");
    }
    options
}

fn stitched(
    inputs: &Inputs,
    options: &StitchOptions,
    cache: Option<&PhotographCache>,
    workers: Option<&dyn Workers>,
) -> Result<(Alignment, Rendered)> {
    let context = StageContext::default();
    let stitcher = Stitcher::new(options, &context).with_cache(cache).with_workers(workers);
    let mut alignment = stitcher.align(inputs)?.alignments.remove(0);
    let rendered = stitcher.compose(&mut alignment)?;
    Ok((alignment, rendered))
}

/// The record without what differs from run to run.
fn record(alignment: &Alignment) -> String {
    let mut project = alignment.project.clone();
    project.seconds.clear();
    project.to_json().expect("written")
}

#[test]
fn a_panorama_that_is_divided_is_the_same() {
    let inputs = Inputs::new([ROOM]);
    for assignments in
        [&[][..], &["render.blend=feather"], &["stitch.align=photometric"], &["pairing.exhaustive_up_to=2"]]
    {
        let options = options(assignments);
        let (alone, rendered) = stitched(&inputs, &options, None, None).expect("alone");
        let here = Here::default();
        let (divided, again) = stitched(&inputs, &options, None, Some(&here)).expect("divided");
        assert_eq!(record(&divided), record(&alone), "{assignments:?}");
        assert!(samples_of(&again.panorama) == samples_of(&rendered.panorama), "{assignments:?}");
        let least = if assignments == ["render.blend=feather"] { 2 } else { 4 };
        assert!(*here.tasks.lock().expect("no test failed") >= least, "{assignments:?}");
    }
}

#[test]
fn what_workers_found_is_kept_and_what_is_kept_is_not_handed_out() {
    let (inputs, options) = (Inputs::new([ROOM]), options(&["render.blend=feather"]));
    let desk = tempfile::tempdir().expect("a folder");
    let tasks = [2, 0].map(|wanted| {
        let cache = PhotographCache::open(desk.path(), 1e9).expect("a cache");
        let here = Here::default();
        stitched(&inputs, &options, Some(&cache), Some(&here)).expect("divided");
        (wanted, *here.tasks.lock().expect("no test failed"))
    });
    assert!(tasks.iter().all(|(wanted, tasks)| wanted == tasks), "{tasks:?}");
}

#[test]
fn photographs_that_only_one_program_holds_are_not_handed_out() {
    let options = options(&[]);
    let (alone, rendered) = stitched(&Inputs::new([ROOM]), &options, None, None).expect("alone");
    let mut in_memory = InMemory::default();
    let names: Vec<String> = alone.photographs().sources().iter().map(|source| source.name.clone()).collect();
    for source in alone.photographs().sources() {
        in_memory.insert(&source.name, decode::photograph(source).expect("decoded"));
    }
    let here = Here::default();
    let inputs = Inputs { in_memory, ..Inputs::new(names) };
    let (_, again) = stitched(&inputs, &options, None, Some(&here)).expect("divided");
    assert!(samples_of(&again.panorama) == samples_of(&rendered.panorama));
    assert_eq!(*here.tasks.lock().expect("no test failed"), 1, "pairs alone: features can be handed over");
}

/// What is coarse is found here, and compared elsewhere.
#[test]
fn a_photograph_that_is_looked_at_again_is_handed_out_again() {
    let (inputs, options) = (room_with_a_blurred_photograph(), options(&[TOO_FEW_FEATURES]));
    let (alone, _) = stitched(&inputs, &options, None, None).expect("alone");
    let here = Here::default();
    let (divided, _) = stitched(&inputs, &options, None, Some(&here)).expect("divided");
    assert_eq!(alone.project.used(), 5);
    assert_eq!(record(&divided), record(&alone));
    assert_eq!(*here.tasks.lock().expect("no test failed"), 2, "all pairs, then those of the photograph");
}

#[test]
fn a_photograph_that_cannot_be_read_is_told_as_ever() {
    let desk = tempfile::tempdir().expect("a folder");
    for photograph in std::fs::read_dir(ROOM).expect("the room").flatten() {
        std::fs::copy(photograph.path(), desk.path().join(photograph.file_name())).expect("room");
    }
    let broken = desk.path().join("04.jpg");
    let bytes = std::fs::read(&broken).expect("a photograph");
    std::fs::write(&broken, &bytes[..bytes.len() / 3]).expect("room");
    let (inputs, options) = (Inputs::new([desk.path().display().to_string()]), options(&[]));
    let (alone, _) = stitched(&inputs, &options, None, None).expect("alone");
    let (divided, _) = stitched(&inputs, &options, None, Some(&Here::default())).expect("divided");
    assert_eq!(record(&divided), record(&alone));
}

#[test]
fn what_is_lost_or_damaged_on_the_way_is_an_error() {
    let (inputs, options) = (Inputs::new([ROOM]), options(&[]));
    for (here, word) in [
        (Here { cuts: true, ..Here::default() }, "cannot be read"),
        (Here { forgets: true, ..Here::default() }, "tasks that were not done"),
    ] {
        let refused = stitched(&inputs, &options, None, Some(&here)).map(drop).expect_err("a fault");
        assert!(matches!(refused, Error::Input { .. }) && refused.to_string().contains(word), "{refused}");
    }
    let context = StageContext::default();
    assert!(Worker::new(b"nothing", &context).is_err());
}

#[test]
fn another_version_is_refused() {
    let context = StageContext::default();
    let mut common = tasks::Common::new(&options(&[]), Vec::new(), tasks::Kind::Match);
    assert!(Worker::new(&tasks::written(&common).expect("written"), &context).is_ok());
    common.program = "trueup 0.0.1".into();
    let refused = Worker::new(&tasks::written(&common).expect("written"), &context).expect_err("another one");
    assert!(refused.to_string().contains("handed out by trueup 0.0.1"), "{refused}");
    let worker = Worker::new(
        &tasks::written(&tasks::Common::new(&options(&[]), Vec::new(), tasks::Kind::Match)).expect("written"),
        &context,
    )
    .expect("a worker");
    let stranger: tasks::MatchTask =
        tasks::MatchTask { photographs: Vec::new(), pairs: vec![(0, 1)], demand: Demand::Test };
    assert!(worker.run(&tasks::written(&stranger).expect("written"), &context).is_err(), "no such photographs");
}
