//! Which photographs of a tree of folders may make a panorama together: those of one folder that were taken one soon after
//! the other.
//!
//! What overlaps is found out by stitching: a set may make several panoramas, or none.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::provenance::seconds_taken;
use trueup_io::source::{self, InMemory};

/// Folders within folders that are looked into: deeper ones are of no photographer's making.
const DEEPEST: usize = 32;
/// Fewer photographs make no panorama.
const FEWEST: usize = 2;
/// The name of the set in the folder itself.
const ROOT: &str = ".";

/// Photographs that may make a panorama together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhotographsOfFolder {
    /// The folder below the one that was looked into, with `/` between folders, and `+2`, `+3` ... behind it for what was taken
    /// later in the same folder; `.` for the folder itself. No two sets have one name.
    pub name: String,
    /// The photographs, in the natural order of their names.
    pub photographs: Vec<PathBuf>,
}

impl PhotographsOfFolder {
    /// Whether there are too few of them for a panorama.
    pub fn is_alone(&self) -> bool {
        self.photographs.len() < FEWEST
    }

    /// The folder for what is made of them, within `output`.
    pub(super) fn folder_in(&self, output: &Path) -> PathBuf {
        if self.name == ROOT { output.to_owned() } else { output.join(&self.name) }
    }
}

/// The sets of photographs in `root` and the folders within it, in the natural order of their names. Hidden folders and links to
/// folders are passed over, as are `except`, where panoramas are written, and pictures that say that they are panoramas. A
/// folder's photographs are parted where nothing was taken for longer than `gap_seconds`, if all of them say when they were taken.
///
/// A folder that cannot be read is passed over with the warning `folder-unreadable`.
///
/// # Errors
/// [`Error::Input`] if `root` is no folder; [`Error::Io`] if it cannot be read; [`Error::Cancelled`].
pub(super) fn photograph_sets(
    root: &Path,
    except: &Path,
    gap_seconds: f64,
    context: &StageContext,
) -> Result<Vec<PhotographsOfFolder>> {
    if !root.is_dir() {
        let hint = "Give the folder that holds the photographs, or folders of them.";
        return Err(Error::input(root.display(), "it is no folder", hint));
    }
    let except = except.canonicalize().ok();
    let mut found = Vec::new();
    let mut folders = vec![Folder { path: root.to_owned(), names: Vec::new() }];
    while let Some(folder) = folders.pop() {
        context.check_cancelled()?;
        if except.is_some() && folder.path.canonicalize().ok() == except {
            continue;
        }
        match folder.folders_within() {
            // The last is looked into first.
            Ok(within) => folders.extend(within.into_iter().rev()),
            Err(error) if folder.names.is_empty() => return Err(Error::io("reading", root, error)),
            Err(error) => {
                context.report(unreadable(&folder.path, &error));
                continue;
            }
        }
        found.extend(folder.parts(gap_seconds));
    }
    Ok(named(found))
}

fn unreadable(folder: &Path, error: &std::io::Error) -> Diagnostic {
    Diagnostic::warning(
        "folder-unreadable",
        Subject::file(folder.display()),
        format!("it is passed over: it cannot be read ({error})"),
        "Check its permissions and its name.",
    )
}

/// A folder of the tree.
struct Folder {
    path: PathBuf,
    /// The names of the folders that lead to it, from the root on.
    names: Vec<String>,
}

/// Photographs of a folder that were taken one soon after the other.
struct Part {
    /// What the folder is called.
    folder: String,
    photographs: Vec<PathBuf>,
}

impl Folder {
    /// The folders in it, in natural order.
    fn folders_within(&self) -> std::io::Result<Vec<Self>> {
        // Photographs are told to the library by texts.
        if self.path.to_str().is_none() {
            return Err(std::io::Error::other("its name is no UTF-8"));
        }
        let mut found = Vec::new();
        for entry in std::fs::read_dir(&self.path)? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            // The type of a link is that of the link itself.
            if entry.file_type()?.is_dir() && !name.starts_with('.') && self.names.len() < DEEPEST {
                found.push(Self { path: entry.path(), names: [&self.names[..], &[name]].concat() });
            }
        }
        found.sort_by(|one, two| source::natural_order(&one.path, &two.path));
        Ok(found)
    }

    /// The photographs right in it, parted by time.
    fn parts(&self, gap_seconds: f64) -> Vec<Part> {
        let mut photographs = source::files(&[self.path.display().to_string()], &InMemory::default());
        photographs.retain(|path| !source::is_marked_panorama(path));
        let taken: Option<Vec<f64>> = photographs.iter().map(|path| seconds_taken(path)).collect();
        let parts = match taken {
            Some(taken) => parted(&taken, gap_seconds),
            None => vec![(0..photographs.len()).collect()],
        };
        let folder = if self.names.is_empty() { ROOT.to_owned() } else { self.names.join("/") };
        let part = |members: Vec<usize>| Part {
            folder: folder.clone(),
            photographs: members.into_iter().map(|member| photographs[member].clone()).collect(),
        };
        parts.into_iter().filter(|members| !members.is_empty()).map(part).collect()
    }
}

/// Which moments follow each other within the gap: their positions, ascending; the earliest first.
fn parted(taken: &[f64], gap_seconds: f64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..taken.len()).collect();
    order.sort_by(|&one, &two| taken[one].total_cmp(&taken[two]));
    let parts = order.chunk_by(|&one, &two| taken[two] - taken[one] <= gap_seconds);
    let ascending = |part: &[usize]| {
        let mut part = part.to_vec();
        part.sort_unstable();
        part
    };
    parts.map(ascending).collect()
}

/// Gives every part a name of its own: the first of a folder that of the folder, the others a number behind it that makes the
/// name of no folder.
fn named(parts: Vec<Part>) -> Vec<PhotographsOfFolder> {
    let mut taken: BTreeSet<String> = parts.iter().map(|part| part.folder.clone()).collect();
    let mut begun = BTreeSet::new();
    let mut sets = Vec::new();
    for Part { folder, photographs } in parts {
        let name = if begun.insert(folder.clone()) {
            folder
        } else {
            let mut numbered = (2..).map(|number| format!("{folder}+{number}"));
            numbered.find(|name| taken.insert(name.clone())).unwrap_or(folder)
        };
        sets.push(PhotographsOfFolder { name, photographs });
    }
    sets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_taken_soon_after_belongs_together() {
        assert_eq!(parted(&[100.0, 0.0, 103.0, 4.0, 9.0], 5.0), [vec![1, 3, 4], vec![0, 2]]);
        assert_eq!(parted(&[], 5.0), Vec::<Vec<usize>>::new());
        assert_eq!(parted(&[0.0, 5.0], 5.0), [vec![0, 1]]);
        assert_eq!(parted(&[0.0, 1e9], f64::INFINITY), [vec![0, 1]]);
    }

    #[test]
    fn no_two_sets_have_one_name() {
        let part = |folder: &str| Part { folder: folder.to_owned(), photographs: Vec::new() };
        let names = |folders: &[&str]| {
            let sets = named(folders.iter().map(|folder| part(folder)).collect());
            sets.into_iter().map(|set| set.name).collect::<Vec<_>>()
        };
        assert_eq!(names(&[".", ".", "a", "a", "a"]), [".", ".+2", "a", "a+2", "a+3"]);
        assert_eq!(names(&["a", "a", "a+2", "a+2"]), ["a", "a+3", "a+2", "a+2+2"]);
    }

    #[test]
    fn folders_are_sets_in_natural_order_without_what_is_hidden_linked_or_written() {
        let desk = tempfile::tempdir().expect("a folder");
        let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/room");
        for folder in ["b10", "b9", ".hidden", "b9/deep", "out"] {
            std::fs::create_dir_all(desk.path().join(folder)).expect("a folder");
            for name in ["00.jpg", "01.jpg"] {
                std::fs::copy(room.join(name), desk.path().join(folder).join(name)).expect("copied");
            }
        }
        std::fs::copy(room.join("02.jpg"), desk.path().join("single.jpg")).expect("copied");
        #[cfg(unix)]
        std::os::unix::fs::symlink(desk.path(), desk.path().join("b9/loop")).expect("a link");
        let found = photograph_sets(desk.path(), &desk.path().join("out"), 300.0, &StageContext::default());
        let found = found.expect("sets");
        let names: Vec<(&str, bool)> = found.iter().map(|set| (set.name.as_str(), set.is_alone())).collect();
        assert_eq!(names, [(".", true), ("b9", false), ("b9/deep", false), ("b10", false)]);
        let error = photograph_sets(&room.join("00.jpg"), desk.path(), 300.0, &StageContext::default());
        assert!(error.expect_err("no folder").to_string().contains("it is no folder"));
    }

    /// On Linux, file names are bytes.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_cannot_be_read_is_told_and_stops_nothing() {
        use std::os::unix::ffi::OsStrExt;
        let desk = tempfile::tempdir().expect("a folder");
        let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/room/00.jpg");
        for folder in [&b"\xff"[..], b"good"] {
            let folder = desk.path().join(std::ffi::OsStr::from_bytes(folder));
            std::fs::create_dir(&folder).expect("a folder");
            std::fs::copy(&room, folder.join("00.jpg")).expect("copied");
        }
        let context = StageContext::default();
        let found = photograph_sets(desk.path(), &desk.path().join("out"), 300.0, &context).expect("sets");
        assert_eq!(found.iter().map(|set| set.name.as_str()).collect::<Vec<_>>(), ["good"]);
        let codes: Vec<String> = context.findings().into_iter().map(|one| one.code).collect();
        assert_eq!(codes, ["folder-unreadable"]);
    }
}
