//! Which photographs of a tree of folders may make a panorama together: those of one folder that were taken one soon
//! after the other.
//!
//! What overlaps is found out by stitching: a set may make several panoramas, or none.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::{Error, Result, StageContext};
use trueup_io::provenance::seconds_taken;
use trueup_io::source::{self, InMemory};

use super::names::{self, ROOT};

/// Folders within folders that are looked into: deeper ones are of no photographer's making.
const DEEPEST: usize = 32;
/// Fewer photographs make no panorama.
const FEWEST: usize = 2;
/// Why a name is of no use.
const NO_UTF8: &str = "its name is no UTF-8";

/// Photographs that may make a panorama together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhotographsOfFolder {
    /// The folder below the one that was looked into, with `/` between folders, and `+2`, `+3` ... behind it for what
    /// was taken later in the same folder; `.` for the folder itself, `+2` for what was taken later there. No two sets
    /// have one name.
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

/// The sets of photographs in `root` and the folders within it, in the natural order of their names. Hidden folders and
/// links to folders are passed over, as are `except`, where panoramas are written, and pictures that say that they are
/// panoramas. A folder's photographs are parted where nothing was taken for longer than `gap_seconds`, if all of them
/// say when they were taken.
///
/// A folder that cannot be read is passed over with the warning `folder-unreadable`, a photograph whose name is no
/// UTF-8 with `photograph-name-unreadable`. Where there are photographs in `except`, the warning
/// `output-holds-photographs` says so.
///
/// # Errors
/// [`Error::Input`] if `root` is no folder, or its name is no UTF-8; [`Error::Io`] if it cannot be read;
/// [`Error::Cancelled`].
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
    // Photographs are told to the library by texts.
    if root.to_str().is_none() {
        return Err(Error::input(root.display(), NO_UTF8, "Rename it, or give it by another name."));
    }
    let except = except.canonicalize().ok();
    let mut found = Vec::new();
    let mut folders = vec![Folder { path: root.to_owned(), names: Vec::new() }];
    while let Some(folder) = folders.pop() {
        context.check_cancelled()?;
        if except.is_some() && folder.path.canonicalize().ok() == except {
            if let Some(photograph) = folder.some_photograph(context)? {
                context.report(passed_over(&folder.path, &photograph));
            }
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
        found.extend(folder.parts(gap_seconds, context));
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

/// Photographs are told to the library by texts: one that is called otherwise would not be found.
fn without_name(photograph: &Path) -> Diagnostic {
    Diagnostic::warning(
        "photograph-name-unreadable",
        Subject::file(photograph.display()),
        format!("it is passed over: {NO_UTF8}"),
        "Rename it.",
    )
}

fn passed_over(output: &Path, photograph: &Path) -> Diagnostic {
    let example = photograph.strip_prefix(output).unwrap_or(photograph).display();
    Diagnostic::warning(
        "output-holds-photographs",
        Subject::file(output.display()),
        format!("the photographs in it ({example}) are passed over, since the panoramas are written there"),
        "Choose another folder for the panoramas.",
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
            return Err(std::io::Error::other(NO_UTF8));
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

    /// The photographs right in it. Folders and pipes may be called like photographs, and are none; a link that leads
    /// nowhere was meant as one.
    fn photographs(&self) -> Vec<PathBuf> {
        let mut photographs = source::files(&[self.path.display().to_string()], &InMemory::default());
        photographs.retain(|path| (path.is_file() || !path.exists()) && !source::is_marked_panorama(path));
        photographs
    }

    /// A photograph in it or in a folder within that is not of a batch's making; `None` if there is none, or none that
    /// can be found.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    fn some_photograph(&self, context: &StageContext) -> Result<Option<PathBuf>> {
        // Panoramas may have been written without metadata, by which they would be known.
        let is_made = |path: &Path| path.file_name().and_then(|name| name.to_str()).is_some_and(names::is_of_set);
        let mut folders = vec![Self { path: self.path.clone(), names: Vec::new() }];
        while let Some(folder) = folders.pop() {
            context.check_cancelled()?;
            let Ok(within) = folder.folders_within() else { continue };
            if let Some(photograph) = folder.photographs().into_iter().find(|path| !is_made(path)) {
                return Ok(Some(photograph));
            }
            folders.extend(within.into_iter().rev().filter(|folder| !is_made(&folder.path)));
        }
        Ok(None)
    }

    /// The photographs right in it, parted by time.
    fn parts(&self, gap_seconds: f64, context: &StageContext) -> Vec<Part> {
        let (photographs, nameless): (Vec<_>, Vec<_>) =
            self.photographs().into_iter().partition(|path| path.to_str().is_some());
        nameless.iter().for_each(|path| context.report(without_name(path)));
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

/// Gives every part a name of its own: the first of a folder that of the folder, the others a number behind it that
/// makes the name of no folder.
fn named(parts: Vec<Part>) -> Vec<PhotographsOfFolder> {
    let mut taken: BTreeSet<String> = parts.iter().map(|part| part.folder.clone()).collect();
    let mut begun = BTreeSet::new();
    let mut sets = Vec::new();
    for Part { folder, photographs } in parts {
        let name = if begun.insert(folder.clone()) {
            folder
        } else {
            // The folder itself has no name, and one that began with a point would be hidden.
            let stem = if folder == ROOT { "" } else { &folder };
            let mut numbered = (2..).map(|number| format!("{stem}+{number}"));
            numbered.find(|name| taken.insert(name.clone())).unwrap_or(folder)
        };
        sets.push(PhotographsOfFolder { name, photographs });
    }
    sets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_room::ROOM;

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
        assert_eq!(names(&[".", ".", "a", "a", "a"]), [".", "+2", "a", "a+2", "a+3"]);
        assert_eq!(names(&[".", ".", "+2"]), [".", "+3", "+2"]);
        assert_eq!(names(&["a", "a", "a+2", "a+2"]), ["a", "a+3", "a+2", "a+2+2"]);
    }

    #[test]
    fn folders_are_sets_in_natural_order_without_what_is_hidden_linked_or_written() {
        let desk = tempfile::tempdir().expect("a folder");
        let room = Path::new(ROOM);
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
        let room = Path::new(ROOM).join("00.jpg");
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

    /// Codes of what is found in a tree beside its sets, with what each is about.
    fn found(root: &Path, output: &Path) -> (Vec<PhotographsOfFolder>, Vec<(String, String)>) {
        let context = StageContext::default();
        let sets = photograph_sets(root, output, 300.0, &context).expect("sets");
        let none: &[&str] = &[];
        let told = context.findings().into_iter().map(|one| (one.code.clone(), one.subject.named(none) + &one.message));
        (sets, told.collect())
    }

    #[test]
    fn a_folder_that_is_called_like_a_photograph_is_none() {
        let desk = tempfile::tempdir().expect("a folder");
        let room = Path::new(ROOM);
        std::fs::create_dir_all(desk.path().join("x/a.jpg")).expect("a folder");
        std::fs::create_dir(desk.path().join("b.jpg")).expect("a folder");
        for name in ["00.jpg", "01.jpg"] {
            std::fs::copy(room.join(name), desk.path().join("x").join(name)).expect("copied");
        }
        let (sets, _) = found(desk.path(), &desk.path().join("out"));
        let counted: Vec<(&str, usize)> = sets.iter().map(|set| (set.name.as_str(), set.photographs.len())).collect();
        assert_eq!(counted, [("x", 2)]);
    }

    #[test]
    fn photographs_where_panoramas_are_written_are_told() {
        let desk = tempfile::tempdir().expect("a folder");
        let room = Path::new(ROOM);
        let output = desk.path().join("day");
        for folder in ["other", "day/set/panorama_files", "day/within"] {
            std::fs::create_dir_all(desk.path().join(folder)).expect("a folder");
        }
        for copy in ["other/0.jpg", "day/set/panorama-1.jpg", "day/set/thumbnail.jpg", "day/set/panorama_files/0.jpg"] {
            std::fs::copy(room.join("00.jpg"), desk.path().join(copy)).expect("copied");
        }
        let (sets, told) = found(desk.path(), &output);
        assert_eq!(
            (sets.len(), told.len()),
            (1, 0),
            "what a batch makes, even without metadata, is no photograph: {told:?}"
        );
        std::fs::copy(room.join("00.jpg"), output.join("within/0.jpg")).expect("copied");
        let (sets, told) = found(desk.path(), &output);
        assert_eq!((sets.len(), told.len()), (1, 1));
        assert_eq!(told[0].0, "output-holds-photographs");
        assert!(told[0].1.contains("day") && told[0].1.contains("0.jpg"), "{told:?}");
    }

    /// On Linux, file names are bytes.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_photograph_whose_name_is_no_text_is_told() {
        use std::os::unix::ffi::OsStrExt;
        let desk = tempfile::tempdir().expect("a folder");
        let room = Path::new(ROOM).join("00.jpg");
        for name in [&b"a.jpg"[..], b"b\xff.jpg"] {
            std::fs::copy(&room, desk.path().join(std::ffi::OsStr::from_bytes(name))).expect("copied");
        }
        let (sets, told) = found(desk.path(), &desk.path().join("out"));
        assert_eq!(sets[0].photographs, [desk.path().join("a.jpg")]);
        assert_eq!(told.len(), 1);
        assert_eq!(told[0].0, "photograph-name-unreadable");
        assert!(told[0].1.contains(NO_UTF8), "{told:?}");
    }
}
