//! What CONTRIBUTING.md says of source files and documents, and rustfmt does not look at.

use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
/// Most lines of a file.
const MOST_LINES: usize = 600;
/// Most columns of a comment: as many as rustfmt leaves code (`max_width`).
const MOST_COLUMNS: usize = 120;

/// Most columns of a document's prose.
const MOST_PROSE_COLUMNS: usize = 140;
/// Documents that a program writes.
const WRITTEN_BY_PROGRAMS: [&str; 2] = ["docs/paper/report.md", "docs/quality.md"];

/// Adds the files of a kind below a folder of the repository, but for what is built there.
fn add_files(folder: &Path, kind: &str, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry of it").path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target" && name != "node_modules") {
            add_files(&path, kind, files);
        } else if path.extension().is_some_and(|extension| extension == kind) {
            files.push(path);
        }
    }
}

#[test]
fn files_are_short_and_comments_are_wrapped() {
    let mut sources = Vec::new();
    for folder in ["crates", "tools", "fuzz"] {
        add_files(&Path::new(ROOT).join(folder), "rs", &mut sources);
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

/// The numbers of lines of prose that are wider than they should be: not of tables, nor of what is shown as it is.
fn wide_prose(text: &str) -> Vec<usize> {
    let mut is_shown = false;
    let mut wide = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let written = line.trim_start();
        if written.starts_with("```") {
            is_shown = !is_shown;
        } else if !is_shown && !written.starts_with('|') && line.chars().count() > MOST_PROSE_COLUMNS {
            wide.push(index + 1);
        }
    }
    wide
}

#[test]
fn prose_is_wrapped() {
    let root = Path::new(ROOT);
    let mut documents: Vec<PathBuf> =
        ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "GLOSSARY.md", "README.md"]
            .map(|name| root.join(name))
            .into();
    add_files(&root.join("docs"), "md", &mut documents);
    documents.retain(|path| !WRITTEN_BY_PROGRAMS.iter().any(|written| path.ends_with(written)));
    assert!(documents.len() > 20, "only {} documents were found", documents.len());
    let broken = documents.iter().flat_map(|path| {
        let text = fs::read_to_string(path).expect("a document");
        wide_prose(&text).into_iter().map(move |line| format!("{}:{line}", path.display()))
    });
    let broken: Vec<String> = broken.collect();
    assert!(broken.is_empty(), "wider than {MOST_PROSE_COLUMNS} columns:\n{}", broken.join("\n"));
}
