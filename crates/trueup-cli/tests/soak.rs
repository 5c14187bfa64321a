//! Many runs: in one process they take no more memory than a few, and side by side on one cache they do not disturb
//! each other.

use std::process::{Command, Stdio};

use trueup::{InMemory, Inputs, Photograph, Raster, RowSource, StageContext, StitchOptions, Stitcher};

use crate::pictures::{HEIGHT, WIDTH, street_desk, street_pixels};
use crate::run::{Desk, finish, trueup};

/// Runs in one process, unless the environment says how many.
const RUNS: usize = 12;

/// Names the number of runs.
const VARIABLE: &str = "TRUEUP_SOAK";

/// Share of the runs after which memory is to stand still: allocators keep what the first ones took.
const SETTLED: f64 = 0.2;

/// Most that memory may grow from there on, in bytes: a tenth of what one of these runs takes. A leak of a feature a
/// run would be more after 500.
const MOST_GROWTH: u64 = 16 << 20;

/// Programs at one cache.
const PROGRAMS: usize = 8;

/// Bytes of a page of memory.
const PAGE: u64 = 4096;

/// Memory of this process that is in use, in bytes.
fn resident() -> u64 {
    let pages = std::fs::read_to_string("/proc/self/statm").expect("Linux tells");
    pages.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok()).expect("the second number") * PAGE
}

/// A stitch of two photographs in memory, aligned and composed.
fn stitch_once() -> usize {
    let mut options = StitchOptions::default();
    options.set("canvas.scale=0.5").expect("an option");
    let mut in_memory = InMemory::default();
    for (name, pixels) in ["a", "b"].iter().zip(street_pixels()) {
        let raster = Raster::from_data(WIDTH, HEIGHT, 3, pixels.clone()).expect("of that size");
        in_memory.insert(*name, Photograph::Eight(raster));
    }
    let inputs = Inputs { in_memory, ..Inputs::new(["a", "b"]) };
    let context = StageContext::default();
    let stitcher = Stitcher::new(&options, &context);
    let mut aligned = stitcher.align(&inputs).expect("aligned").alignments;
    let alignment = aligned.first_mut().expect("a panorama");
    stitcher.compose(alignment).expect("composed").panorama.width()
}

/// What [`many_runs_in_one_process_take_no_more_memory`] starts, alone in a process.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "it is run by another test, in a process of its own"]
fn many_runs() {
    let runs = std::env::var(VARIABLE).ok().and_then(|runs| runs.parse().ok()).unwrap_or(RUNS);
    let settled = (runs as f64 * SETTLED).ceil() as usize;
    let mut after_settling = 0;
    let width = stitch_once();
    for run in 1..runs {
        assert_eq!(stitch_once(), width, "run {run}");
        if run == settled {
            after_settling = resident();
        }
    }
    let end = resident();
    println!("after {settled} runs {} MB, after {runs} {} MB", after_settling >> 20, end >> 20);
    assert!(end < after_settling + MOST_GROWTH, "memory grows from {after_settling} to {end} bytes over {runs} runs");
}

/// With `TRUEUP_SOAK=500`, so many.
#[cfg(target_os = "linux")]
#[test]
fn many_runs_in_one_process_take_no_more_memory() {
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.args(["--exact", "soak::many_runs", "--include-ignored", "--nocapture"]);
    let run = finish(command);
    assert_eq!(run.status, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains(" runs ") && run.stdout.contains("1 passed"), "{}", run.stdout);
    println!("{}", run.stdout);
}

/// Started at once on the same photographs, with an empty cache: all come to the same bytes, and to those without a
/// cache; and what they left is whole.
#[test]
fn eight_programs_at_one_cache_come_to_the_same_bytes() {
    let desk = street_desk();
    let stitch = |number: usize, more: &[&str]| {
        let output = format!("pano-{number}.png");
        let arguments = ["stitch", "a.jpg", "b.jpg", "-o", &output, "--scale", "0.5", "--threads", "1"];
        trueup(desk.path(), &[&arguments[..], more].concat())
    };
    let cached = ["--cache", "kept"];
    let running: Vec<_> = (0..PROGRAMS)
        .map(|number| {
            let mut command = stitch(number, &cached);
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started")
        })
        .collect();
    for program in running {
        let output = program.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !said.contains("damaged") && !said.contains("could not be kept"), "{said}");
    }
    finish(stitch(PROGRAMS, &[])).expect_success();
    let wanted = desk.read(&format!("pano-{PROGRAMS}.png"));
    assert!((0..PROGRAMS).all(|number| desk.read(&format!("pano-{number}.png")) == wanted), "other bytes");
    let said = finish(stitch(0, &cached));
    assert!(!said.expect_success().contains("damaged"), "{}", said.stdout);
    assert!(kept(&desk).iter().all(|name| !name.ends_with(".part")), "{:?}", kept(&desk));
}

fn kept(desk: &Desk) -> Vec<String> {
    let files = std::fs::read_dir(desk.join("kept")).expect("a folder");
    files.map(|file| file.expect("readable").file_name().to_string_lossy().into_owned()).collect()
}
