//! Batches of the example's photographs: shared, stopped, begun again.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use trueup_core::context::{CancelToken, Silent};

use super::*;
use crate::inputs::Inputs;
use crate::job::{Outputs, StitchJob};
use crate::test_room::ROOM;

/// A tree of folders, each with three photographs of the room.
fn tree(folders: &[&str]) -> TempDir {
    let desk = tempfile::tempdir().expect("a folder");
    let room = Path::new(ROOM);
    for folder in folders {
        let folder = desk.path().join("in").join(folder);
        fs::create_dir_all(&folder).expect("a folder");
        for name in ["00.jpg", "01.jpg", "02.jpg"] {
            fs::copy(room.join(name), folder.join(name)).expect("copied");
        }
    }
    desk
}

fn job(desk: &TempDir) -> BatchJob {
    BatchJob { threads: 1, ..BatchJob::new(desk.path().join("in"), desk.path().join("out")) }
}

fn options() -> StitchOptions {
    let mut options = StitchOptions::default();
    for assignment in ["canvas.scale=0.2", "working.pixels=60000"] {
        options.set(assignment).expect("an option");
    }
    options
}

/// Runs a job; returns the names of the sets that it did, in that order.
fn run(job: BatchJob, options: &StitchOptions) -> Result<Vec<String>> {
    let context = StageContext::default();
    let told = Mutex::new(Vec::new());
    let tell = |record: &SetRecord| -> Result<()> {
        told.lock().expect("whole").push(record.set.clone());
        Ok(())
    };
    Batch::find(job, &context)?.run(options, &tell, &context)?;
    Ok(told.into_inner().expect("whole"))
}

fn bytes(desk: &TempDir, set: &str) -> Vec<u8> {
    fs::read(desk.path().join("out").join(set).join("panorama.jpg")).expect("a panorama")
}

#[test]
fn runs_that_share_a_folder_make_every_set_once_and_as_it_is_made_alone() {
    let folders = ["a", "b", "c", "d", "e", "f"];
    let desk = tree(&folders);
    let several = BatchJob { at_once: 2, threads: 2, ..job(&desk) };
    let mut done: Vec<String> = std::thread::scope(|scope| {
        let runs = [job(&desk), job(&desk), several].map(|job| scope.spawn(|| run(job, &options()).expect("done")));
        runs.into_iter().flat_map(|run| run.join().expect("no panic")).collect()
    });
    done.sort();
    assert_eq!(done, folders, "each of them once");
    let alone = desk.path().join("alone.jpg");
    let inputs = Inputs::new([desk.path().join("in/a").display().to_string()]);
    let job = StitchJob { inputs, outputs: Outputs::new(&alone), cache: None, threads: 0 };
    job.run(&options(), &StageContext::default()).expect("a panorama");
    let alone = fs::read(alone).expect("a panorama");
    for folder in folders {
        assert!(bytes(&desk, folder) == alone, "{folder} has other bytes");
    }
}

#[test]
fn a_set_that_another_program_is_at_is_waited_for_and_taken_over_when_that_one_is_killed() {
    let desk = tree(&["a", "b"]);
    let folder = desk.path().join("out/a");
    let elsewhere = Claim::take(&folder).expect("possible").expect("nobody has it");
    std::thread::scope(|scope| {
        let running = scope.spawn(|| run(job(&desk), &options()).expect("done"));
        let patience = Instant::now() + Duration::from_secs(300);
        while !desk.path().join("out/b/record.json").exists() && Instant::now() < patience {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(!running.is_finished(), "it waits for the other");
        assert!(!folder.join("panorama.jpg").exists());
        // As when it is killed: the lock goes, the file stays.
        drop(elsewhere);
        assert_eq!(running.join().expect("no panic"), ["b", "a"]);
    });
    assert!(!Claim::is_begun(&folder));
}

#[test]
fn a_set_that_kills_the_program_comes_last_and_is_given_up() {
    let desk = tree(&["a", "b"]);
    let out = desk.path().join("out");
    for _ in 0..4 {
        drop(Claim::take(&out.join("a")).expect("possible").expect("nobody has it"));
    }
    assert_eq!(run(job(&desk), &options()).expect("done"), ["b", "a"]);
    let made = bytes(&desk, "a");
    let read = |set: &str| SetRecord::read(&out.join(set)).expect("a record");
    assert!(!read("a").has_failed());

    fs::remove_file(out.join("a/record.json")).expect("removed");
    for _ in 0..5 {
        drop(Claim::take(&out.join("a")).expect("possible").expect("nobody has it"));
    }
    assert_eq!(run(job(&desk), &options()).expect("done"), ["a"]);
    let SetOutcome::Failed { error, hint, .. } = read("a").outcome else { panic!("it is given up") };
    assert!(error.contains("ended 5 times") && hint.contains("--retry"), "{error} {hint}");
    // It is not tried again but on request, from the beginning.
    assert!(run(job(&desk), &options()).expect("done").is_empty());
    assert_eq!(run(BatchJob { retry: true, ..job(&desk) }, &options()).expect("done"), ["a"]);
    assert!(bytes(&desk, "a") == made);
}

#[test]
fn what_may_have_passed_is_tried_again_once_a_run() {
    let desk = tree(&["a"]);
    let little = {
        let mut options = options();
        options.set("resources.memory=100MB").expect("an option");
        options
    };
    let record = || SetRecord::read(&desk.path().join("out/a")).expect("a record");
    for _ in 0..2 {
        assert_eq!(run(job(&desk), &little).expect("done"), ["a"]);
        assert!(record().may_pass(), "{:?}", record());
    }
    // The memory decides no panorama: it is tried because memory may be had by now.
    assert_eq!(run(job(&desk), &options()).expect("done"), ["a"]);
    assert!(!record().has_failed());
    assert!(run(job(&desk), &little).expect("done").is_empty(), "it is made");
}

#[test]
fn a_set_is_made_anew_when_what_decides_it_changes() {
    let desk = tree(&["a"]);
    let again = |job: BatchJob, options: &StitchOptions| run(job, options).expect("done").len();
    assert_eq!((again(job(&desk), &options()), again(job(&desk), &options())), (1, 0));
    let threads = BatchJob { threads: 2, gap_seconds: 5.0, ..job(&desk) };
    assert_eq!(again(threads, &options()), 0, "how the work is done decides nothing");
    let mut other = options();
    other.set("canvas.scale=0.1").expect("an option");
    assert_eq!((again(job(&desk), &other), again(job(&desk), &other)), (1, 0));
    fs::remove_file(desk.path().join("out/a/panorama.jpg")).expect("removed");
    assert_eq!(again(job(&desk), &other), 1);
    fs::remove_file(desk.path().join("in/a/02.jpg")).expect("removed");
    assert_eq!(again(job(&desk), &other), 1);
    assert_eq!(again(BatchJob { extension: "png".to_owned(), ..job(&desk) }, &other), 1);
    // Mounted elsewhere, the tree is the same.
    let moved = tempfile::tempdir().expect("a folder");
    fs::rename(desk.path().join("in"), moved.path().join("in")).expect("moved");
    fs::rename(desk.path().join("out"), moved.path().join("out")).expect("moved");
    assert_eq!(again(BatchJob { extension: "png".to_owned(), ..job(&moved) }, &other), 0);
}

#[test]
fn a_request_to_stop_ends_the_batch_and_leaves_the_set_to_the_next_run() {
    let desk = tree(&["a", "b"]);
    let (silent, token) = (Silent, CancelToken::default());
    let context = StageContext::new(&silent, &token);
    let batch = Batch::find(job(&desk), &context).expect("sets");
    let tell = |_: &SetRecord| -> Result<()> {
        token.cancel();
        Ok(())
    };
    assert!(matches!(batch.run(&options(), &tell, &context), Err(Error::Cancelled)));
    assert_eq!(batch.records().map(|record| record.set).collect::<Vec<_>>(), ["a"]);
    assert!(!Claim::is_begun(&desk.path().join("out/b")));
    assert_eq!(run(job(&desk), &options()).expect("done"), ["b"]);
}

#[test]
fn what_could_never_come_to_panoramas_is_refused_at_once() {
    let desk = tree(&["a"]);
    let refused = |job: BatchJob| match run(job, &options()) {
        Err(error) => error.to_string(),
        Ok(done) => panic!("{done:?}"),
    };
    let same = BatchJob { output: desk.path().join("in/."), ..job(&desk) };
    assert!(refused(same).contains("it is the folder of the photographs"));
    let unknown = BatchJob { extension: "gif".to_owned(), ..job(&desk) };
    assert!(refused(unknown).contains("not supported"));
    fs::create_dir(desk.path().join("none")).expect("a folder");
    let empty = BatchJob { folder: desk.path().join("none"), ..job(&desk) };
    assert!(refused(empty).contains("there are no photographs in it"));
    assert!(!desk.path().join("out").exists());
}

#[test]
fn shards_share_all_sets_and_none_twice() {
    for position in 0..10 {
        let holding = (1..=3).filter(|&number| Shard { number, count: 3 }.holds(position));
        assert_eq!(holding.count(), 1);
    }
    assert!((0..10).all(|position| Shard::WHOLE.holds(position)));
}

/// A set whose folder takes nothing, one where the batch's own files lie and one where another set's do: they fail, and
/// the others are made. In the next run, too.
#[test]
fn a_set_that_can_have_no_folder_fails_alone() {
    let desk = tree(&["a", "b", "batch.csv", "b/panorama.jpg", "b/at-work"]);
    let out = desk.path().join("out");
    fs::create_dir(&out).expect("a folder");
    fs::write(out.join("a"), "a file where the folder is to be").expect("written");
    let context = StageContext::default();
    for told in [5, 4] {
        let batch = Batch::find(job(&desk), &context).expect("sets");
        let heard = Mutex::new(0);
        let tell = |_: &SetRecord| -> Result<()> {
            *heard.lock().expect("whole") += 1;
            Ok(())
        };
        batch.run(&options(), &tell, &context).expect("no set stops it");
        assert_eq!(heard.into_inner().expect("whole"), told, "all but what is made already");
        let records: Vec<SetRecord> = batch.records().collect();
        let failed: Vec<&str> = records.iter().filter(|one| one.has_failed()).map(|one| one.set.as_str()).collect();
        assert_eq!(failed, ["a", "b/at-work", "b/panorama.jpg", "batch.csv"]);
        assert_eq!(records.len(), 5);
        for record in records.iter().filter(|one| one.has_failed()) {
            let SetOutcome::Failed { error, hint, .. } = &record.outcome else { panic!("it failed") };
            assert!(error.contains(&record.set) && hint.ends_with('.'), "{error} {hint}");
        }
    }
    assert!(out.join("b/panorama.jpg").is_file() && !out.join("batch.csv").exists());
}

/// Files of another program, or of a person, in the folder of a set: before it was ever made, and afterwards.
#[test]
fn what_no_batch_has_written_in_the_folder_of_a_set_is_never_replaced() {
    let desk = tree(&["a"]);
    let folder = desk.path().join("out/a");
    fs::create_dir_all(&folder).expect("a folder");
    let refused = |job: BatchJob, name: &str| {
        fs::write(folder.join(name), "mine").expect("written");
        let context = StageContext::default();
        let batch = Batch::find(job, &context).expect("a set");
        batch.run(&options(), &|_| Ok::<(), Error>(()), &context).expect("a set that fails stops nothing");
        let record = batch.record_of(0).expect("what became of it");
        let SetOutcome::Failed { error, hint, may_pass } = record.outcome else { panic!("{name} was written over") };
        assert!(error.contains(name) && error.contains("that no batch has written"), "{error}");
        assert!(hint.contains("Move it away") && may_pass, "{hint}");
        assert_eq!(fs::read(folder.join(name)).expect("readable"), b"mine");
        fs::remove_file(folder.join(name)).expect("removed");
    };
    for name in ["panorama.jpg", "panorama-2.json", "thumbnail.jpg", "record.json", "at-work"] {
        refused(job(&desk), name);
        assert_eq!(fs::read_dir(&folder).expect("readable").count(), 0, "{name}: nothing beside it");
    }
    assert_eq!(run(job(&desk), &options()).expect("done"), ["a"]);
    // A photograph that has changed asks for the set again.
    fs::copy(desk.path().join("in/a/02.jpg"), desk.path().join("in/a/03.jpg")).expect("copied");
    refused(job(&desk), "panorama-7.jpg");
    // What would not be written over may lie there.
    fs::write(folder.join("panorama.txt"), "mine").expect("written");
    assert_eq!(run(job(&desk), &options()).expect("done"), ["a"]);
    assert_eq!(fs::read(folder.join("panorama.txt")).expect("readable"), b"mine");
    // A record that was taken away asks for the set again, too.
    fs::remove_file(folder.join("record.json")).expect("removed");
    assert_eq!(run(job(&desk), &options()).expect("done"), ["a"]);
}

#[test]
fn a_panorama_that_was_cut_short_is_made_again() {
    let desk = tree(&["a"]);
    assert_eq!(run(job(&desk), &options()).expect("done"), ["a"]);
    let whole = bytes(&desk, "a");
    let again = || run(job(&desk), &options()).expect("done").len();
    fs::write(desk.path().join("out/a/panorama.jpg"), &whole[..whole.len() / 2]).expect("written");
    assert_eq!((again(), again()), (1, 0));
    assert!(bytes(&desk, "a") == whole);
    for file in ["panorama.json", "thumbnail.jpg"] {
        fs::remove_file(desk.path().join("out/a").join(file)).expect("removed");
        assert_eq!((again(), again()), (1, 0), "{file}");
    }
}

#[test]
fn what_an_earlier_attempt_made_is_told_from_what_is_made_now() {
    let desk = tree(&["a"]);
    let record = || SetRecord::read(&desk.path().join("out/a")).expect("a record");
    run(job(&desk), &options()).expect("done");
    assert!(record().outdated.is_empty());
    run(BatchJob { extension: "png".to_owned(), ..job(&desk) }, &options()).expect("done");
    assert_eq!(record().outdated, ["a/panorama.jpg"]);
    for name in ["01.jpg", "02.jpg"] {
        fs::remove_file(desk.path().join("in/a").join(name)).expect("removed");
    }
    run(job(&desk), &options()).expect("done");
    assert_eq!((record().outcome, record().outdated.len()), (SetOutcome::Alone, 2));
}

/// The folder of the batch is that of the set in the root of the tree: what others write there stays, what a killed
/// program left goes.
#[test]
fn what_was_half_written_in_the_folder_of_the_batch_goes() {
    let desk = tree(&[""]);
    let out = desk.path().join("out");
    drop(Claim::take(&out).expect("possible").expect("nobody has it"));
    let left = out.join(".trueup-left.part");
    fs::write(&left, "half").expect("written");
    assert_eq!(run(job(&desk), &options()).expect("done"), ["."]);
    assert!(!left.exists());
}

#[test]
fn a_file_where_the_folder_for_the_panoramas_is_to_be_is_refused() {
    let desk = tree(&["a"]);
    fs::write(desk.path().join("out"), "a file").expect("written");
    let refused = run(job(&desk), &options()).expect_err("it is no folder").to_string();
    assert!(refused.contains("it is no folder, but a file") && refused.contains("another folder"), "{refused}");
}

#[test]
fn a_pair_with_a_damaged_photograph_makes_no_panorama() {
    let desk = tree(&["a"]);
    fs::remove_file(desk.path().join("in/a/02.jpg")).expect("removed");
    let whole = fs::read(desk.path().join("in/a/01.jpg")).expect("a photograph");
    fs::write(desk.path().join("in/a/01.jpg"), &whole[..whole.len() / 2]).expect("cut");
    assert_eq!(run(job(&desk), &options()).expect("done"), ["a"]);
    let out = desk.path().join("out/a");
    let record = SetRecord::read(&out).expect("a record");
    let SetOutcome::Failed { error, .. } = &record.outcome else { panic!("{record:?}") };
    assert!(error.contains("00.jpg: it is the only photograph") && error.contains("01.jpg: "), "{error}");
    assert!(names::panoramas_in(&out).is_empty());
}
