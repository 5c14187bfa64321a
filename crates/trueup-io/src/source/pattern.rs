//! The files that a pattern matches.
//!
//! Patterns are those of the `glob` crate, whose own search ends the program at the first name that is not UTF-8,
//! whether the pattern means it or not.

use std::path::{Component, Path, PathBuf};

use glob::{MatchOptions, Pattern, PatternError};

const OPTIONS: MatchOptions =
    MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: true };

/// What begins a part of a pattern that is no plain name.
pub(super) const WILDCARDS: [char; 3] = ['*', '?', '['];

/// Whether a name begins with a dot, so that neither folders nor patterns mean it unasked.
pub(super) fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

/// What one component of a pattern stands for.
enum Part {
    Literal(PathBuf),
    /// Names in a folder.
    Names(Pattern),
    /// `**`: a folder and all folders in it.
    Folders,
}

/// The paths of what a pattern matches, in any order. Folders that cannot be read hold nothing; names that are not
/// UTF-8 are matched with the replacement character in place of what is not.
///
/// # Errors
/// Of a pattern that is malformed.
pub(super) fn matches(pattern: &str) -> Result<Vec<PathBuf>, PatternError> {
    // As a whole first: what is wrong is told by its place in what the user typed.
    Pattern::new(pattern)?;
    let parts = Path::new(pattern).components().map(part).collect::<Result<Vec<Part>, PatternError>>()?;
    let mut found = Vec::new();
    descend(PathBuf::new(), &parts, &mut found);
    Ok(found)
}

fn part(component: Component<'_>) -> Result<Part, PatternError> {
    let Component::Normal(name) = component else { return Ok(Part::Literal(component.as_os_str().into())) };
    match name.to_str() {
        Some("**") => Ok(Part::Folders),
        Some(name) if name.contains(WILDCARDS) => Ok(Part::Names(Pattern::new(name)?)),
        _ => Ok(Part::Literal(name.into())),
    }
}

/// Adds what the parts match below a folder (the current one if it is empty).
fn descend(folder: PathBuf, parts: &[Part], found: &mut Vec<PathBuf>) {
    match parts.split_first() {
        None if folder.exists() => found.push(folder),
        None => {}
        Some((Part::Literal(name), rest)) => descend(folder.join(name), rest, found),
        Some((Part::Names(pattern), rest)) => {
            for entry in entries(&folder) {
                let is_meant =
                    entry.file_name().is_some_and(|name| pattern.matches_with(&name.to_string_lossy(), OPTIONS));
                if is_meant {
                    descend(entry, rest, found);
                }
            }
        }
        Some((Part::Folders, rest)) => {
            descend(folder.clone(), rest, found);
            for entry in entries(&folder) {
                // A link may lead back to where it is.
                let is_folder = entry.symlink_metadata().is_ok_and(|metadata| metadata.is_dir());
                if is_folder && !is_hidden(&entry) {
                    descend(entry, parts, found);
                }
            }
        }
    }
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let listed = std::fs::read_dir(if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    let folder = folder.to_path_buf();
    listed.into_iter().flatten().filter_map(move |entry| Some(folder.join(entry.ok()?.file_name())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files and folders below a new folder, and what a pattern finds of them, sorted.
    fn found(files: &[&str], pattern: &str) -> Vec<String> {
        let folder = tempfile::tempdir().expect("a folder");
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().expect("in a folder")).expect("made");
            std::fs::write(path, "").expect("written");
        }
        let root = Pattern::escape(folder.path().to_str().expect("UTF-8"));
        let paths = matches(&format!("{root}/{pattern}")).expect("well formed");
        let below = |path: &PathBuf| path.strip_prefix(folder.path()).expect("below").display().to_string();
        let mut names: Vec<String> = paths.iter().map(below).collect();
        names.sort();
        names
    }

    #[test]
    fn names_and_folders_are_matched() {
        let files = ["a/1.jpg", "a/2.jpg", "a/10.png", "b/1.jpg", ".c/1.jpg", "a/.3.jpg", "a/deep/er/4.jpg"];
        assert_eq!(found(&files, "a/*.jpg"), ["a/1.jpg", "a/2.jpg"]);
        assert_eq!(found(&files, "*/1.jpg"), ["a/1.jpg", "b/1.jpg"]);
        assert_eq!(found(&files, "a/[12].*"), ["a/1.jpg", "a/2.jpg"]);
        assert_eq!(found(&files, "**/?.jpg"), ["a/1.jpg", "a/2.jpg", "a/deep/er/4.jpg", "b/1.jpg"]);
        assert_eq!(found(&files, "a/../b/*"), ["a/../b/1.jpg"]);
        assert_eq!(found(&files, "z/*"), [""; 0]);
        assert!(matches("a/[").is_err() && matches("a**/b").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_not_utf8_end_nothing() {
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().expect("a folder");
        for name in [&b"1.jpg"[..], b"n\xff.txt", b"n\xff.jpg"] {
            std::fs::write(folder.path().join(std::ffi::OsStr::from_bytes(name)), "").expect("written");
        }
        let root = Pattern::escape(folder.path().to_str().expect("UTF-8"));
        assert_eq!(matches(&format!("{root}/*.jpg")).expect("well formed").len(), 2);
        assert_eq!(matches(&format!("{root}/1*")).expect("well formed").len(), 1);
    }
}
