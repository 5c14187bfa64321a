//! `trueup serve` as it is started and ended; what it serves is tested where it is made.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use crate::run::{Desk, finish, trueup};

/// `trueup serve` with its temporary files on the desk, and the first line that it prints.
fn served(desk: &Desk, argument: &str) -> (Child, String) {
    let mut command = trueup(desk.path(), &["serve", argument]);
    command.env("TMPDIR", desk.path()).stdout(Stdio::piped());
    let mut child = command.spawn().expect("the command starts");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("piped")).read_line(&mut line).expect("UTF-8");
    (child, line)
}

#[test]
fn it_prints_an_address_and_leaves_nothing_behind() {
    let desk = Desk::new();
    let (mut child, line) = served(&desk, ".");
    assert!(line.starts_with("Open http://127.0.0.1:") && line.contains("/?token="), "{line}");
    assert_eq!(desk.files().len(), 1, "its temporary files");
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().expect("sh runs").success());
    assert_eq!(child.wait().expect("it ends").code(), Some(0), "that is how it is ended");
    assert!(desk.files().is_empty(), "{:?}", desk.files());
}

/// Some programs send several requests to terminate.
#[cfg(unix)]
#[test]
fn a_second_request_to_terminate_leaves_nothing_behind() {
    let desk = Desk::new();
    let (mut child, _) = served(&desk, ".");
    assert_eq!(desk.files().len(), 1, "its temporary files");
    // The second comes before the server looks whether it is to stop, which it does ten times a second; later ones find
    // nobody.
    let kill = format!("for i in 1 2 3 4 5; do kill -TERM {}; sleep 0.02; done 2>/dev/null; true", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().expect("sh runs").success());
    assert_eq!(child.wait().expect("it ends").code(), Some(0), "as by one");
    assert!(desk.files().is_empty(), "{:?}", desk.files());
}

#[test]
fn programs_are_told_the_address_as_json() {
    let desk = Desk::new();
    let (mut child, line) = served(&desk, "--json");
    let told: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    assert_eq!((&told["format"], &told["version"]), (&"trueup-serve".into(), &1.into()));
    assert!(told["address"].as_str().is_some_and(|one| one.starts_with("http://127.0.0.1:")), "{told}");
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().expect("sh runs").success());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
}

#[test]
fn others_are_let_in_by_a_long_password_only() {
    let desk = Desk::new();
    desk.put("short.txt", "secret\nand more");
    finish(trueup(desk.path(), &["serve", "--listen", "127.0.0.1"])).expect_failure(2, &["--password-file"]);
    let short = ["serve", "--listen", "127.0.0.1", "--password-file", "short.txt"];
    finish(trueup(desk.path(), &short)).expect_failure(1, &["password: it is shorter than 12 characters"]);
    let none = ["serve", "--listen", "127.0.0.1", "--password-file", "none.txt"];
    finish(trueup(desk.path(), &none)).expect_failure(1, &["none.txt"]);
    finish(trueup(desk.path(), &["serve", "nowhere"])).expect_failure(1, &["nowhere"]);
}
