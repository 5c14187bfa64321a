//! Which sets are stitched.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use trueup::{Error, Result};

use crate::sets::{TRUTH_FILE, truth_folders};

/// The table a set belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// Its cameras are known.
    Known,
    /// Nothing is known of it.
    Photographs,
}

impl StitchSet {
    /// Name and kind in one.
    pub(super) fn title(&self) -> String {
        if self.kind.is_empty() { self.name.clone() } else { format!("{} {}", self.name, self.kind) }
    }
}

impl Part {
    /// Both, in the order of the page.
    pub(super) const ALL: [Self; 2] = [Self::Known, Self::Photographs];

    /// Its name in the CSV file and in the page's markers.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Known => "known",
            Self::Photographs => "photographs",
        }
    }

    /// The option that names its folders.
    pub(super) fn option(self) -> &'static str {
        match self {
            Self::Known => "--truth-sets",
            Self::Photographs => "--real",
        }
    }
}

/// A folder to be stitched.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StitchSet {
    /// Its table.
    pub part: Part,
    /// The folder's name; of sets with known cameras without the kind.
    pub name: String,
    /// `row`, `grid`, `multi`, `pair` ...; empty if nobody has said.
    pub kind: String,
    /// The folder.
    pub folder: PathBuf,
}

/// The kinds of real sets that are stitched.
const STITCHED_KINDS: [&str; 2] = ["multi", "pair"];
/// The list of real sets looked for beside their folder.
const MANIFEST: &str = "MANIFEST.tsv";

/// The sets in the given folders.
///
/// # Errors
/// [`Error::Io`] for folders that cannot be read; [`Error::Input`] for a manifest without the columns.
pub(super) fn find_sets(truth: &[PathBuf], real: &[PathBuf], manifest: Option<&Path>) -> Result<Vec<StitchSet>> {
    let mut sets = Vec::new();
    for parent in truth {
        sets.extend(truth_folders(parent)?.into_iter().map(known_set));
    }
    sets.sort_by(|a, b| (&a.kind, &a.name).cmp(&(&b.kind, &b.name)));
    for parent in real {
        sets.extend(real_sets(parent, manifest)?);
    }
    Ok(sets)
}

/// `library-row` is the scene `library` in the kind `row`; a name without a hyphen has no kind.
fn known_set(folder: PathBuf) -> StitchSet {
    let name = name_of(&folder);
    let (name, kind) = match name.rsplit_once('-') {
        Some((scene, kind)) => (scene.to_owned(), kind.to_owned()),
        None => (name, String::new()),
    };
    StitchSet { part: Part::Known, name, kind, folder }
}

fn real_sets(parent: &Path, manifest: Option<&Path>) -> Result<Vec<StitchSet>> {
    let entries = fs::read_dir(parent).map_err(|error| Error::io("reading the folder", parent, error))?;
    let mut folders: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_dir()).collect();
    folders.sort();
    let beside = [parent.join(MANIFEST), parent.parent().unwrap_or(parent).join(MANIFEST)];
    let manifest = manifest.map(Path::to_owned).or_else(|| beside.into_iter().find(|path| path.is_file()));
    let kinds = manifest.map(|path| read_kinds(&path)).transpose()?;
    let mut sets = Vec::new();
    for folder in folders.into_iter().filter(|folder| !folder.join(TRUTH_FILE).exists()) {
        let name = name_of(&folder);
        let kind = match &kinds {
            None => String::new(),
            Some(kinds) => match kinds.get(&name) {
                Some(kind) if STITCHED_KINDS.contains(&kind.as_str()) => kind.clone(),
                _ => continue,
            },
        };
        sets.push(StitchSet { part: Part::Photographs, name, kind, folder });
    }
    sets.sort_by(|a, b| (&a.kind, &a.name).cmp(&(&b.kind, &b.name)));
    Ok(sets)
}

/// Kind by set of a tab-separated list.
fn read_kinds(path: &Path) -> Result<BTreeMap<String, String>> {
    let text = fs::read_to_string(path).map_err(|error| Error::io("reading", path, error))?;
    kinds_of(&text).ok_or_else(|| {
        let hint = "Its first line must name the columns `set` and `kind`, separated by tabs.";
        Error::input(path.display(), "it is no list of sets", hint)
    })
}

fn kinds_of(text: &str) -> Option<BTreeMap<String, String>> {
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next()?.split('\t').collect();
    let place = |name| heads.iter().position(|head| *head == name);
    let (set, kind) = (place("set")?, place("kind")?);
    let rows = lines.map(|line| line.split('\t').collect::<Vec<&str>>());
    Some(rows.filter_map(|cells| Some((cells.get(set)?.to_string(), cells.get(kind)?.to_string()))).collect())
}

fn name_of(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_is_read_by_its_columns() {
        let kinds = kinds_of("note\tset\tkind\nx\ta\tmulti\ny\tb\tequirect\n").expect("columns");
        assert_eq!(kinds["a"], "multi");
        assert_eq!(kinds_of("set,kind\n"), None);
    }

    #[test]
    fn only_listed_sets_of_stitched_kinds_are_taken_and_grouped_by_kind() {
        let parent = tempfile::tempdir().expect("folder");
        for name in ["a", "b", "c", "d"] {
            fs::create_dir(parent.path().join(name)).expect("folder");
        }
        fs::write(parent.path().join(MANIFEST), "set\tkind\na\tpair\nb\tmulti\nc\tequirect\n").expect("list");
        let sets = find_sets(&[], &[parent.path().to_owned()], None).expect("readable");
        let names: Vec<(&str, &str)> = sets.iter().map(|set| (set.name.as_str(), set.kind.as_str())).collect();
        assert_eq!(names, [("b", "multi"), ("a", "pair")]);
    }

    #[test]
    fn the_kind_is_the_last_part_of_a_name() {
        let set = known_set(PathBuf::from("cut/chester-112362-row"));
        assert_eq!((set.name.as_str(), set.kind.as_str()), ("chester-112362", "row"));
        assert_eq!(known_set(PathBuf::from("room")).kind, "");
    }
}
