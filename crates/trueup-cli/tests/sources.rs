//! What CONTRIBUTING.md says of source files, and rustfmt does not look at.

use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
/// Most lines of a file.
const MOST_LINES: usize = 600;
/// Most columns of a comment: as many as rustfmt leaves code (`max_width`).
const MOST_COLUMNS: usize = 120;

/// Adds the Rust files below a folder of the repository, but for what is built there.
fn add_sources(folder: &Path, sources: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry of it").path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target" && name != "node_modules") {
            add_sources(&path, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            sources.push(path);
        }
    }
}

#[test]
fn files_are_short_and_comments_are_wrapped() {
    let mut sources = Vec::new();
    for folder in ["crates", "tools", "fuzz"] {
        add_sources(&Path::new(ROOT).join(folder), &mut sources);
    }
    assert!(sources.len() > 100, "only {} source files were found", sources.len());
    let mut broken = Vec::new();
    for path in &sources {
        let text = fs::read_to_string(path).expect("a source file");
        if text.lines().count() > MOST_LINES {
            broken.push(format!("{}: more than {MOST_LINES} lines", path.display()));
        }
        let is_wide = |line: &str| line.trim_start().starts_with("//") && line.chars().count() > MOST_COLUMNS;
        let wide = text.lines().enumerate().filter(|(_, line)| is_wide(line));
        broken.extend(wide.map(|(index, _)| format!("{}:{}: a wide comment", path.display(), index + 1)));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
