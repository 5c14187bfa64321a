//! Requests to stop: what ends the command, with which status, and that nothing is left behind.
#![cfg(unix)]

use std::io::Read;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

use crate::pictures::noise;
use crate::run::{Desk, finish, trueup};

const PHOTOGRAPHS: [&str; 4] = ["1.jpg", "2.jpg", "3.jpg", "4.jpg"];

/// Photographs that are large enough to take a good while at full scale. One is enough to make them all: they differ in
/// a byte behind their end, for files of the same bytes are one photograph.
fn photographs() -> &'static [Vec<u8>] {
    static FILES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    FILES.get_or_init(|| {
        let whole = noise(1, 2400, 1800);
        (0..4).map(|number| [&whole[..], &[number]].concat()).collect()
    })
}

/// Sends signals, one soon after the other, while photographs are worked on; `script` starts the command by
/// `exec "$@"`. Returns the exit status and what was said, and fails the test if anything is left behind.
fn stopped_by(script: &str, signals: &[&str]) -> (Option<i32>, String) {
    let desk = Desk::new();
    for (name, bytes) in PHOTOGRAPHS.iter().zip(photographs()) {
        desk.put(name, bytes);
    }
    let mut command = Command::new("sh");
    command.current_dir(desk.path()).args(["-c", script, "sh", env!("CARGO_BIN_EXE_trueup"), "stitch"]);
    command.args(PHOTOGRAPHS).args(["-o", "pano.jpg", "--set", "working.pixels=4e6", "--threads", "1"]);
    let mut child = command.stderr(Stdio::piped()).spawn().expect("the command starts");
    std::thread::sleep(Duration::from_millis(400));
    for signal in signals {
        let kill = format!("kill -{signal} {}", child.id());
        let signalled = Command::new("sh").args(["-c", &kill]).status();
        assert!(signalled.expect("sh runs").success(), "the command was still at work");
        std::thread::sleep(Duration::from_millis(5));
    }
    let status = child.wait().expect("it ends");
    let mut said = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut said).expect("UTF-8");
    assert_eq!(desk.files(), PHOTOGRAPHS);
    (status.code(), said)
}

const PLAIN: &str = "exec \"$@\"";
const SAID: &str = "trueup: error: stopped on request\n";

#[test]
fn ctrl_c_leaves_nothing_behind() {
    assert_eq!(stopped_by(PLAIN, &["INT"]), (Some(130), SAID.to_owned()));
}

/// A limit of the size of files fails the write that exceeds it, and does not end the command with its file half
/// written.
#[test]
fn a_file_that_may_not_grow_leaves_nothing_behind() {
    let desk = Desk::new();
    for (name, bytes) in PHOTOGRAPHS.iter().zip(crate::pictures::street()) {
        desk.put(name, bytes);
    }
    let mut command = Command::new("sh");
    let script = "ulimit -f 8; exec \"$@\"";
    command.current_dir(desk.path()).args(["-c", script, "sh", env!("CARGO_BIN_EXE_trueup"), "stitch"]);
    let output = command.args(PHOTOGRAPHS).args(["-o", "pano.png"]).output().expect("the command starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("pano.png") && said.contains("File too large"), "{said}");
    assert_eq!(desk.files(), PHOTOGRAPHS);
}

/// Some programs send the request twice, such as `timeout`.
#[test]
fn a_request_to_terminate_leaves_nothing_behind() {
    assert_eq!(stopped_by(PLAIN, &["TERM"]), (Some(143), SAID.to_owned()));
    assert_eq!(stopped_by(PLAIN, &["TERM", "TERM"]), (Some(143), SAID.to_owned()));
}

/// As `nohup` starts it, the command outlives its terminal: here until Ctrl-C.
#[cfg(target_os = "linux")]
#[test]
fn the_end_of_the_terminal_stops_it_unless_that_is_ignored() {
    // Where these tests outlive their terminal, what they start does so, too, unless it is told not to.
    let heeding = "exec env --default-signal=HUP \"$@\"";
    assert_eq!(stopped_by(heeding, &["HUP"]), (Some(129), SAID.to_owned()));
    assert_eq!(stopped_by("trap '' HUP; exec \"$@\"", &["HUP", "INT"]), (Some(130), SAID.to_owned()));
}

/// Standard error that takes nothing, as of a terminal that is gone, changes no exit status.
#[cfg(target_os = "linux")]
#[test]
fn a_failure_that_cannot_be_told_is_still_a_failure() {
    let desk = Desk::new();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("a full device");
    let mut command = trueup(desk.path(), &["stitch", "none.jpg", "-o", "pano.jpg"]);
    command.stderr(full);
    assert_eq!(finish(command).status, 1);
}
