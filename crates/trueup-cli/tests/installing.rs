//! What belongs to an installed command.

use std::process::Command;

use crate::run::{Desk, finish, trueup};

const SUBCOMMANDS: [&str; 11] = [
    "stitch",
    "compose",
    "compare",
    "batch",
    "serve",
    "inspect",
    "evaluate",
    "report",
    "options",
    "completions",
    "manual",
];

#[test]
fn every_shell_completes_commands_flags_and_choices() {
    let desk = Desk::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let run = finish(trueup(desk.path(), &["completions", shell]));
        let text = run.expect_success();
        for word in SUBCOMMANDS.iter().chain(&["projection", "require-all"]) {
            assert!(text.contains(word), "{shell} does not know {word}");
        }
        // What is generated for the other two has no values.
        if ["bash", "fish", "zsh"].contains(&shell) {
            assert!(text.contains("equirectangular"), "{shell} does not know a value");
        }
    }
    finish(trueup(desk.path(), &["completions", "dos"])).expect_failure(2, &["dos", "bash"]);
}

/// As bash does when Tab is pressed. Where there is no bash, nobody presses it.
#[test]
fn bash_takes_its_completions() {
    let desk = Desk::new();
    let script = finish(trueup(desk.path(), &["completions", "bash"]));
    desk.put("trueup.bash", script.expect_success());
    for (typed, expected) in [
        ("trueup comple", "completions"),
        ("trueup stitch --proj", "--project --projection"),
        ("trueup stitch --projection equi", "equirectangular"),
    ] {
        let words: Vec<&str> = typed.split(' ').collect();
        let ask = format!(
            "source ./trueup.bash; COMP_WORDS=({typed}); COMP_CWORD={}; _trueup trueup {} {}; echo \"${{COMPREPLY[*]}}\"",
            words.len() - 1,
            words[words.len() - 1],
            words[words.len() - 2],
        );
        let Ok(answer) = Command::new("bash").current_dir(desk.path()).args(["-c", &ask]).output() else { return };
        assert_eq!(String::from_utf8_lossy(&answer.stdout).trim(), expected, "{typed}: {answer:?}");
    }
}

#[test]
fn the_manual_has_a_page_for_every_command_with_every_flag() {
    let desk = Desk::new();
    assert_eq!(finish(trueup(desk.path(), &["manual", "."])).expect_success(), "");
    let mut expected: Vec<String> = SUBCOMMANDS.iter().map(|name| format!("trueup-{name}.1")).collect();
    expected.push("trueup.1".to_owned());
    expected.sort();
    assert_eq!(desk.files(), expected);
    let page = |name: &str| String::from_utf8(desk.read(name)).expect("UTF-8");
    let stitch = page("trueup-stitch.1").replace("\\-", "-");
    assert!(stitch.contains(".TH trueup-stitch 1"), "{stitch}");
    let help = finish(trueup(desk.path(), &["stitch", "--help"]));
    let flags = help.expect_success().split_whitespace().filter(|word| word.starts_with("--") && word.len() > 2);
    let mut count = 0;
    for flag in flags {
        let flag = flag.trim_end_matches(|end: char| !end.is_ascii_alphanumeric());
        assert!(stitch.contains(flag), "{flag} is not in the manual");
        count += 1;
    }
    assert!(count > 20, "{count} flags");
    assert!(page("trueup.1").contains("trueup\\-stitch(1)"));
    finish(trueup(desk.path(), &["manual", "none"])).expect_failure(1, &["none"]);
}
