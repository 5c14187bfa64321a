//! What the files of a batch are called: names that no folder of a set can have.

use std::path::{Path, PathBuf};

use trueup_io::encode::{self, OutputOptions};
use trueup_io::source;

use super::Batch;

/// The name of the set of the photographs that lie in the folder itself.
pub(super) const ROOT: &str = ".";
/// The file in a set's folder that is there while a program works at it, and after one that was killed at it.
pub(super) const CLAIM: &str = "at-work";
/// The file in a set's folder that says what became of it.
pub(super) const RECORD: &str = "record.json";
/// What a set's panorama is called in its folder, without extension.
pub(super) const PANORAMA: &str = "panorama";
/// What its small copy is called, without extension.
const THUMBNAIL: &str = "thumbnail";
/// The extension of small copies.
const THUMBNAIL_EXTENSION: &str = "jpg";
/// The extension of projects.
const PROJECT_EXTENSION: &str = "json";
/// What the folder of a panorama's tiles is called behind the panorama's name.
const TILES: &str = "_files";

/// The file of a set's project, numbered where there are several.
pub(super) fn project() -> String {
    format!("{PANORAMA}.{PROJECT_EXTENSION}")
}

/// The file of a set's small copy, numbered where there are several.
pub(super) fn thumbnail() -> String {
    format!("{THUMBNAIL}.{THUMBNAIL_EXTENSION}")
}

/// The folder of the tiles of a panorama that consists of them; `None` for one that is a file alone.
pub(super) fn tiles(panorama: &Path) -> Option<PathBuf> {
    let is_pyramid = panorama.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("dzi"));
    let stem = panorama.file_stem().filter(|_| is_pyramid)?;
    let mut name = stem.to_owned();
    name.push(TILES);
    Some(panorama.with_file_name(name))
}

/// Whether a batch may write a file or folder of this name into the folder of a set. Case counts for nothing: there are
/// file systems that know none.
pub(super) fn is_of_set(name: &str) -> bool {
    let name = name.to_lowercase();
    let has_stem = |stem: &str, extension: &str| {
        name.strip_suffix(extension).and_then(|rest| rest.strip_suffix('.')).is_some_and(|rest| is_numbered(rest, stem))
    };
    name == CLAIM
        || name == RECORD
        || is_panorama(&name)
        || has_stem(PANORAMA, PROJECT_EXTENSION)
        || has_stem(THUMBNAIL, THUMBNAIL_EXTENSION)
        || name.strip_suffix(TILES).is_some_and(|rest| is_numbered(rest, PANORAMA))
}

/// Whether a panorama of a set may be called so.
pub(super) fn is_panorama(name: &str) -> bool {
    let path = Path::new(name);
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    is_numbered(stem, PANORAMA) && encode::check_format(path, &OutputOptions::default()).is_ok()
}

/// Whether `text` is `stem`, or that with `-` and a number behind it.
fn is_numbered(text: &str, stem: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    text.strip_prefix(stem).is_some_and(|rest| rest.is_empty() || rest.strip_prefix('-').is_some_and(is_number))
}

/// The panoramas that lie in the folder of a set, of whatever attempt, in natural order. None where it cannot be read.
pub(super) fn panoramas_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_one =
        |path: &PathBuf| path.file_name().and_then(|name| name.to_str()).is_some_and(is_panorama) && path.is_file();
    let mut found: Vec<PathBuf> = paths.filter(is_one).collect();
    found.sort_by(|one, two| source::natural_order(one, two));
    found
}

/// The part of a set's name at which the batch writes a file, so that no folder can be there; `is_set` says whether a
/// set has a name. Folders of photographs may be called anything, as `batch.csv`, or `panorama.jpg` within one that is
/// a set itself.
pub(super) fn place_of_a_file(set: &str, is_set: impl Fn(&str) -> bool) -> Option<&str> {
    let ends = set.match_indices('/').map(|(end, _)| end).chain([set.len()]);
    ends.map(|end| &set[..end]).find(|place| {
        let (folder, name) = place.rsplit_once('/').unwrap_or((ROOT, place));
        let is_of_all = folder == ROOT && Batch::FILES.iter().any(|file| name.eq_ignore_ascii_case(file));
        is_of_all || (is_of_set(name) && is_set(folder))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_told_from_those_of_folders() {
        for name in ["at-work", "record.json", "Panorama.JPG", "panorama-12.tif", "panorama-2.json", "panorama_files"] {
            assert!(is_of_set(name), "{name}");
        }
        for name in ["panorama", "panorama-.jpg", "panoramas.jpg", "panorama-2", "thumbnail.png", "at-work.jpg", "a"] {
            assert!(!is_of_set(name), "{name}");
        }
        assert!(is_of_set(&thumbnail()) && is_of_set(&project()));
        assert_eq!(tiles(Path::new("a/panorama.dzi")), Some(PathBuf::from("a/panorama_files")));
        assert_eq!(tiles(Path::new("a/panorama.jpg")), None);
    }

    #[test]
    fn a_set_is_refused_only_where_a_file_comes_to_lie() {
        let place = |set: &'static str| place_of_a_file(set, |name| name == "plain" || name == "plain/deep");
        assert_eq!(place("batch.csv"), Some("batch.csv"));
        assert_eq!(place("index.html/within"), Some("index.html"));
        assert_eq!(place("plain/panorama.jpg/a"), Some("plain/panorama.jpg"));
        assert_eq!(place("plain/deep/at-work"), Some("plain/deep/at-work"));
        for free in ["other/panorama.jpg", "plain/batch.csv", "record.json", ".", "plain"] {
            assert_eq!(place(free), None, "{free}");
        }
    }
}
