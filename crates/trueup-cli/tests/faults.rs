//! Faults on purpose: every call that makes, writes or renames a file fails once, memory and threads are refused, and
//! the command is killed at any moment. What was there before is there or replaced as a whole, and nothing is left
//! behind.
//!
//! A library that is loaded before the command has the kernel hand back the calls (`faults.c`). Of many calls some are
//! tried here, spread over all; with `TRUEUP_FAULTS=1000` as many of each command.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant, SystemTime};

use crate::pictures::street;
use crate::run::{Desk, FinishedRun, finish, trueup};

/// The golden ratio less one.
const GOLDEN: f64 = 0.618_034;

/// Calls of each command that are made to fail, unless the environment says how many.
const TRIED: usize = 6;

fn tried() -> usize {
    std::env::var("TRUEUP_FAULTS").ok().and_then(|count| count.parse().ok()).unwrap_or(TRIED)
}

/// The library, built once; what links Rust's programs builds it, too.
fn library() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("faults-{}.so", std::process::id()));
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults.c");
        let built = Command::new("cc").args(["-O1", "-shared", "-fPIC", "-o"]).args([&library]).arg(source).status();
        assert!(built.expect("a C compiler").success());
        library
    })
}

/// Runs a command whose call of this number fails, none if it is 0; `count` is a file that gets a letter for each.
fn run(desk: &Desk, arguments: &[&str], kind: &str, fault: usize, count: Option<&Path>) -> FinishedRun {
    let mut command = command(desk, arguments, kind, fault);
    if let Some(count) = count {
        command.env("TRUEUP_FAULT_COUNT", count);
    }
    finish(command)
}

/// A command whose call of this number fails.
fn command(desk: &Desk, arguments: &[&str], kind: &str, fault: usize) -> Command {
    let mut command = trueup(desk.path(), arguments);
    command.env("LD_PRELOAD", library()).env("TRUEUP_FAULT_KIND", kind).env("TRUEUP_FAULT", fault.to_string());
    command.env("TMPDIR", desk.path());
    command
}

/// A command with what it needs, and with older files where it is to write.
struct Trial {
    arguments: &'static [&'static str],
    prepare: fn(&Desk),
}

const OLD: [&str; 4] = ["pano.png", "project.json", "seams.png", "report.html"];

fn photographs(desk: &Desk) {
    for (name, bytes) in ["a.jpg", "b.jpg"].iter().zip(street()) {
        desk.put(name, bytes);
    }
}

const STITCH: Trial = Trial {
    arguments: &[
        "stitch",
        "a.jpg",
        "b.jpg",
        "-o",
        "pano.png",
        "--project",
        "project.json",
        "--seams",
        "seams.png",
        "--report",
        "report.html",
        "--scale",
        "0.5",
        "--quiet",
    ],
    prepare: |desk| {
        photographs(desk);
        OLD.iter().for_each(|name| desk.put(name, name));
    },
};

const TILES: Trial = Trial {
    arguments: &["stitch", "a.jpg", "b.jpg", "-o", "pano.dzi", "--scale", "0.5", "--quiet"],
    prepare: photographs,
};

const CACHE: Trial = Trial {
    arguments: &["stitch", "a.jpg", "b.jpg", "-o", "pano.png", "--scale", "0.5", "--quiet", "--cache", "cache"],
    prepare: STITCH.prepare,
};

const COMPOSE: Trial = Trial {
    arguments: &["compose", "made.json", "-o", "pano.png", "--project", "project.json", "--quiet"],
    prepare: |desk| {
        (STITCH.prepare)(desk);
        desk.put("made.json", project());
    },
};

const COMPARE: Trial = Trial {
    arguments: &["compare", "a.jpg", "b.jpg", "-o", "compared", "--methods", "vpg,homography", "--quiet"],
    prepare: photographs,
};

const BATCH: Trial = Trial {
    arguments: &["batch", "in", "-o", "out", "--set", "canvas.scale=0.5", "--quiet"],
    prepare: |desk| {
        std::fs::create_dir_all(desk.join("in/street")).expect("a folder");
        for (name, bytes) in ["in/street/a.jpg", "in/street/b.jpg"].iter().zip(street()) {
            desk.put(name, bytes);
        }
    },
};

/// The project of the two photographs.
fn project() -> &'static [u8] {
    static PROJECT: OnceLock<Vec<u8>> = OnceLock::new();
    PROJECT.get_or_init(|| {
        let desk = Desk::new();
        (STITCH.prepare)(&desk);
        finish(trueup(desk.path(), STITCH.arguments)).expect_success();
        desk.read("project.json")
    })
}

impl Trial {
    fn desk(&self) -> Desk {
        let desk = Desk::new();
        (self.prepare)(&desk);
        desk
    }

    /// The letters of its calls, and what is there afterwards.
    #[track_caller]
    fn whole(&self, kind: &str) -> (String, BTreeMap<String, Vec<u8>>) {
        let (desk, counts) = (self.desk(), Desk::new());
        let whole = run(&desk, self.arguments, kind, 0, Some(&counts.join("count")));
        assert_eq!((whole.status, whole.stderr.as_str()), (0, ""));
        let letters = String::from_utf8(counts.read("count")).expect("letters");
        assert!(!letters.is_empty(), "calls are counted");
        (letters, files(&desk))
    }
}

/// All files below a desk, by their paths.
fn files(desk: &Desk) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![desk.path().to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("readable") {
            let path = entry.expect("readable").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(desk.path()).expect("below").display().to_string();
                found.insert(name, std::fs::read(&path).expect("readable"));
            }
        }
    }
    found
}

/// What a file says may depend on the run: times, and what is said of them.
fn tells_times(name: &str) -> bool {
    [".json", ".jsonl", ".html", ".csv", ".md"].iter().any(|end| name.ends_with(end))
}

/// Fails the test unless each file is as it was or as it should be, and none is left that should not be.
#[track_caller]
fn check_files(
    before: &BTreeMap<String, Vec<u8>>,
    after: &BTreeMap<String, Vec<u8>>,
    whole: &BTreeMap<String, Vec<u8>>,
    said: &str,
) {
    assert!(before.keys().all(|name| after.contains_key(name)), "{said}: lost of {:?}", before.keys());
    for (name, bytes) in after {
        let Some(wanted) = whole.get(name) else {
            assert_eq!(before.get(name), Some(bytes), "{said}: {name} is left behind");
            continue;
        };
        let is_whole = match name.rsplit_once('.') {
            // Entries of a cache hold the times of the work.
            Some((_, "trueup")) => bytes.starts_with(b"trueup cache "),
            Some((_, "json")) => serde_json::from_slice::<serde_json::Value>(bytes).is_ok(),
            // A line for every panorama that was made: none, where none was.
            Some((_, "jsonl")) => bytes.is_empty() || bytes.ends_with(b"}\n"),
            _ => bytes == wanted || (tells_times(name) && !bytes.is_empty()),
        };
        assert!(is_whole || before.get(name) == Some(bytes), "{said}: {name} is not whole");
    }
}

/// Makes calls for files fail, each in a run of its own. `bears` are the statuses beside that of an error with which a
/// run may end that does without the file.
#[track_caller]
fn check_files_fail(trial: &Trial, bears: &[i32]) {
    let (letters, whole) = trial.whole("files");
    let step = letters.len().div_ceil(tried()).max(1);
    for fault in (1..=letters.len()).step_by(step) {
        let desk = trial.desk();
        let before = files(&desk);
        let ended = run(&desk, trial.arguments, "files", fault, None);
        let said = format!("call {fault} of {letters}: {} {}", ended.status, ended.stderr);
        let is_named = ended.status == 1
            && ended.stderr.contains("trueup: error: ")
            && ["(os error 28)", "(os error 5)"].iter().any(|reason| ended.stderr.contains(reason));
        assert!(is_named || bears.contains(&ended.status), "{said}");
        check_files(&before, &files(&desk), &whole, &said);
    }
}

#[test]
fn a_stitch_bears_every_failure_of_a_file() {
    check_files_fail(&STITCH, &[]);
}

#[test]
fn tiles_bear_every_failure_of_a_file() {
    check_files_fail(&TILES, &[]);
}

#[test]
fn a_cache_that_takes_nothing_stops_no_stitch() {
    check_files_fail(&CACHE, &[0]);
}

#[test]
fn composing_bears_every_failure_of_a_file() {
    check_files_fail(&COMPOSE, &[]);
}

#[test]
fn a_comparison_bears_every_failure_of_a_file() {
    check_files_fail(&COMPARE, &[]);
}

/// A set that could not be written is a set that failed: the batch goes on, and says so by its status.
#[test]
fn a_batch_bears_every_failure_of_a_file() {
    check_files_fail(&BATCH, &[0, 3]);
}

/// What becomes of runs in which one call is refused each: how many ended by an error, and how many did without.
#[derive(Default)]
struct Tally {
    points: usize,
    runs: usize,
    failed: usize,
    borne: usize,
}

/// Refuses calls of a kind that has nothing to do with files, each in a run of its own. A run ends by an error with
/// status 1, or with one of `bears` if it does without; nothing is lost, half or left behind, but what a batch tells of
/// work that did not come to an end.
#[track_caller]
fn check_refusals(trial: &Trial, kind: &str, bears: &[i32]) {
    let (letters, whole) = trial.whole(kind);
    let mut tally = Tally { points: letters.len(), ..Tally::default() };
    for fault in (1..=letters.len()).step_by(letters.len().div_ceil(tried()).max(1)) {
        let desk = trial.desk();
        let before = files(&desk);
        let ended = run(&desk, trial.arguments, kind, fault, None);
        let said = format!("{kind} {fault} of {}: {} {}", letters.len(), ended.status, ended.stderr);
        let is_named = ended.status == 1 && ended.stderr.contains("trueup: error: ");
        assert!(is_named || bears.contains(&ended.status), "{said}");
        tally.runs += 1;
        *if is_named { &mut tally.failed } else { &mut tally.borne } += 1;
        let mut after = files(&desk);
        after.retain(|name, _| !name.ends_with("/at-work"));
        if ended.status != 1 {
            // A photograph that could not be decoded is left out, which is said though `--quiet` is given; the panorama
            // is that of the other then.
            let is_whole = after.get("pano.png") == whole.get("pano.png");
            assert!(
                is_whole || ended.stderr.contains("trueup: warning: "),
                "{said}: nothing is said of what is missing"
            );
            after.retain(|_, bytes| !is_picture(bytes));
            let lost = before.keys().find(|name| !desk.join(name).exists());
            assert_eq!(lost, None, "{said}");
        }
        let kept = before.iter().filter(|(name, _)| after.contains_key(*name) || ended.status == 1);
        let kept = kept.map(|(name, bytes)| (name.clone(), bytes.clone())).collect();
        check_files(&kept, &after, &whole, &said);
    }
    let Tally { points, runs, failed, borne } = tally;
    println!("{} {kind}: {points} points, {runs} runs, {failed} ended by an error, {borne} borne", trial.arguments[0]);
}

/// Whether these are all bytes of a JPEG or a PNG.
fn is_picture(bytes: &[u8]) -> bool {
    let is_jpeg = bytes.starts_with(b"\xff\xd8") && bytes.ends_with(b"\xff\xd9");
    is_jpeg || image::load_from_memory(bytes).is_ok()
}

/// A megabyte or more of memory is refused once: the command ends by an error, wherever that was, unless a library does
/// without.
#[test]
fn a_stitch_that_is_refused_memory_ends_by_an_error() {
    check_refusals(&STITCH, "memory", &[0]);
}

#[test]
fn composing_that_is_refused_memory_ends_by_an_error() {
    check_refusals(&COMPOSE, "memory", &[0]);
}

#[test]
fn a_comparison_that_is_refused_memory_ends_by_an_error() {
    check_refusals(&COMPARE, "memory", &[0]);
}

#[test]
fn a_batch_that_is_refused_memory_ends_by_an_error() {
    check_refusals(&BATCH, "memory", &[0, 3]);
}

/// A thread does not start: the command ends by an error, or does with fewer.
#[test]
fn threads_that_do_not_start_cost_no_file() {
    for (trial, bears) in [(&STITCH, &[0][..]), (&COMPOSE, &[0]), (&COMPARE, &[0]), (&BATCH, &[0, 3])] {
        check_refusals(trial, "threads", bears);
    }
}

/// Killed at a call for a file: each file is the old or the new one, and the next run comes to the same with nothing
/// left behind. Where there is a cache, these calls are the end of each phase: before what it found is kept, and after.
#[track_caller]
fn check_kills_at_calls(trial: &Trial) {
    let (letters, whole) = trial.whole("files");
    let mut runs = 0;
    for fault in (1..=letters.len()).step_by(letters.len().div_ceil(tried()).max(1)) {
        let desk = trial.desk();
        let before = files(&desk);
        // What a program that is killed leaves in the system's folder for temporary files is the system's to clear
        // away.
        let temporary = Desk::new();
        let mut killed = command(&desk, trial.arguments, "kill", fault);
        let killed = killed.env("TMPDIR", temporary.path()).stderr(Stdio::null()).status().expect("it ends");
        let said = format!("{} killed at call {fault} of {}", trial.arguments[0], letters.len());
        assert_eq!(killed.code(), None, "{said}");
        check_killed(&desk, &before, &whole, &said);
        check_made_again(trial, &desk, &before, &whole, &said);
        runs += 1;
    }
    println!("{}: {} points, {runs} kills", trial.arguments[0], letters.len());
}

#[test]
fn a_stitch_killed_at_a_call_for_a_file_is_made_again() {
    check_kills_at_calls(&STITCH);
}

#[test]
fn tiles_killed_at_a_call_for_a_file_are_made_again() {
    check_kills_at_calls(&TILES);
}

#[test]
fn a_stitch_killed_at_the_end_of_a_phase_goes_on_from_its_cache() {
    check_kills_at_calls(&CACHE);
}

#[test]
fn a_composition_killed_at_a_call_for_a_file_is_made_again() {
    check_kills_at_calls(&COMPOSE);
}

#[test]
fn a_comparison_killed_at_a_call_for_a_file_is_made_again() {
    check_kills_at_calls(&COMPARE);
}

#[test]
fn a_batch_killed_at_a_call_for_a_file_is_made_again() {
    check_kills_at_calls(&BATCH);
}

/// Nothing is half where a program was killed, but for what it had not given a name.
#[track_caller]
fn check_killed(desk: &Desk, before: &BTreeMap<String, Vec<u8>>, whole: &BTreeMap<String, Vec<u8>>, said: &str) {
    let mut left = files(desk);
    left.retain(|name, _| !name.contains(PART) && !name.ends_with("/at-work"));
    check_files(before, &left, whole, said);
}

/// The next run makes what was to be made, and removes what was left.
#[track_caller]
fn check_made_again(
    trial: &Trial,
    desk: &Desk,
    before: &BTreeMap<String, Vec<u8>>,
    whole: &BTreeMap<String, Vec<u8>>,
    said: &str,
) {
    age_parts(desk);
    let mut arguments = trial.arguments.to_vec();
    arguments.retain(|argument| *argument != "--quiet");
    let again = finish(trueup(desk.path(), &arguments));
    assert_eq!((again.status, again.stderr.as_str()), (0, ""), "{said}");
    assert!(!again.stdout.contains("damaged"), "{said}: {}", again.stdout);
    let made = files(desk);
    assert!(made.keys().eq(whole.keys()), "{said}: {:?}", made.keys());
    check_files(before, &made, whole, said);
    // All that is made is made anew, but for what a batch finds done.
    let pictures = whole.iter().filter(|(name, _)| !tells_times(name) && !name.ends_with(".trueup"));
    let other: Vec<&String> =
        pictures.filter(|(name, bytes)| made.get(*name) != Some(bytes)).map(|(name, _)| name).collect();
    assert!(other.is_empty(), "{said}: {other:?} are not as they would have been");
}

/// How temporary names end.
const PART: &str = ".part";

/// As if a minute had passed: younger ones may be of a program that has not marked them yet.
fn age_parts(desk: &Desk) {
    let files = files(desk);
    let parts = files.keys().filter_map(|name| Some(&name[..name.find(PART)? + PART.len()]));
    for path in parts.map(|name| desk.join(name)) {
        // Folders are opened for reading only.
        let part = std::fs::File::options().read(true).write(!path.is_dir()).open(&path).expect("it can be opened");
        part.set_modified(SystemTime::now() - Duration::from_secs(120)).expect("its time can be set");
    }
}

/// Kills after which a run has to finish what is left to it.
const KILLS_IN_A_ROW: usize = 4;

/// Commands that are killed at any moment, which share the kills.
const KILLED_AT_MOMENTS: usize = 4;

/// Killed at moments spread over a whole run: each file is the old or the new one, a cache goes on to the same bytes,
/// and what was not complete is gone.
#[track_caller]
fn check_kills_at_moments(trial: &Trial) {
    let (_, whole) = trial.whole("files");
    let started = Instant::now();
    finish(trueup(trial.desk().path(), trial.arguments)).expect_success();
    let whole_run = started.elapsed().as_secs_f64();
    let (mut kills, mut moments) = (0, 0);
    while kills < tried().div_ceil(KILLED_AT_MOMENTS) {
        let desk = trial.desk();
        let before = files(&desk);
        for _ in 0..KILLS_IN_A_ROW {
            // Multiples of the golden ratio are spread evenly, however many there are.
            let share = (f64::from(moments) * GOLDEN).fract();
            moments += 1;
            let mut command = trueup(desk.path(), trial.arguments);
            let mut running = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("started");
            std::thread::sleep(Duration::from_secs_f64(whole_run * share));
            running.kill().expect("killed, or done");
            // What was quicker than the first run is done.
            kills += usize::from(running.wait().expect("it ends").code().is_none());
            check_killed(&desk, &before, &whole, &format!("{} killed at {share}", trial.arguments[0]));
        }
        check_made_again(trial, &desk, &before, &whole, trial.arguments[0]);
    }
    println!("{}: {kills} kills at {moments} moments", trial.arguments[0]);
}

#[test]
fn a_stitch_killed_at_any_moment_leaves_no_half_file_and_goes_on_to_the_same_bytes() {
    check_kills_at_moments(&CACHE);
}

#[test]
fn a_composition_killed_at_any_moment_leaves_no_half_file() {
    check_kills_at_moments(&COMPOSE);
}

#[test]
fn a_comparison_killed_at_any_moment_leaves_no_half_file() {
    check_kills_at_moments(&COMPARE);
}

#[test]
fn a_batch_killed_at_any_moment_leaves_no_half_file() {
    check_kills_at_moments(&BATCH);
}
