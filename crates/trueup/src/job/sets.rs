//! Which photographs of a tree of folders may make a panorama together: those of one folder that were taken one soon after
//! the other.
//!
//! What overlaps is found out by stitching: a set may make several panoramas, or none.

use std::path::{Path, PathBuf};

use trueup_core::{Error, Result, StageContext};
use trueup_io::source::{self, InMemory};

/// Folders within folders that are looked into: a tree that goes on for ever is a loop of links.
const DEEPEST: usize = 32;
/// Fewer photographs make no panorama.
const FEWEST: usize = 2;

/// Photographs that may make a panorama together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhotographsOfFolder {
    /// The folder below the one that was looked into, with `/` between folders, and `+2`, `+3` ... behind it for what was taken
    /// later in the same folder; `.` for the folder itself.
    pub name: String,
    /// The photographs, in the natural order of their names.
    pub photographs: Vec<PathBuf>,
}

impl PhotographsOfFolder {
    /// Whether there are too few of them for a panorama.
    pub fn is_alone(&self) -> bool {
        self.photographs.len() < FEWEST
    }
}

/// The sets of photographs in `root` and the folders within it, in the natural order of their names. Hidden folders and links to
/// folders are passed over, as is `except`, where panoramas are written. A folder's photographs are parted where nothing was
/// taken for longer than `gap_seconds`, if all of them say when they were taken.
///
/// # Errors
/// [`Error::Input`] if `root` is no folder; [`Error::Io`] if a folder cannot be read; [`Error::Cancelled`].
pub fn photograph_sets(
    root: &Path,
    except: &Path,
    gap_seconds: f64,
    context: &StageContext,
) -> Result<Vec<PhotographsOfFolder>> {
    if !root.is_dir() {
        return Err(Error::input(
            root.display(),
            "it is no folder",
            "Give the folder that holds the folders of photographs.",
        ));
    }
    let except = except.canonicalize().ok();
    let mut sets = Vec::new();
    let mut folders = vec![(root.to_owned(), Vec::new())];
    while let Some((folder, names)) = folders.pop() {
        context.check_cancelled()?;
        if except.is_some() && folder.canonicalize().ok() == except {
            continue;
        }
        sets.extend(sets_of(&folder, &names, gap_seconds));
        // The last is looked into first.
        folders.extend(folders_in(&folder, &names)?.into_iter().rev());
    }
    Ok(sets)
}

/// The folders in a folder, with their names from the root on.
fn folders_in(folder: &Path, names: &[String]) -> Result<Vec<(PathBuf, Vec<String>)>> {
    if names.len() >= DEEPEST {
        return Ok(Vec::new());
    }
    let wrong = |error| Error::io("reading", folder, error);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        // The type of a link is that of the link itself.
        if entry.file_type().map_err(wrong)?.is_dir() && !name.starts_with('.') {
            found.push((entry.path(), [names, &[name]].concat()));
        }
    }
    found.sort_by(|one, two| source::natural_order(&one.0, &two.0));
    Ok(found)
}

/// The photographs right in a folder, parted by time.
fn sets_of(folder: &Path, names: &[String], gap_seconds: f64) -> Vec<PhotographsOfFolder> {
    let photographs = source::files(&[folder.display().to_string()], &InMemory::default());
    let base = if names.is_empty() { ".".to_owned() } else { names.join("/") };
    let taken: Option<Vec<f64>> = photographs.iter().map(|path| trueup_io::provenance::seconds_taken(path)).collect();
    let parts = match taken {
        Some(taken) => parted(&taken, gap_seconds),
        None => vec![(0..photographs.len()).collect()],
    };
    let named = |(number, members): (usize, Vec<usize>)| PhotographsOfFolder {
        name: if number == 0 { base.clone() } else { format!("{base}+{}", number + 1) },
        photographs: members.into_iter().map(|member| photographs[member].clone()).collect(),
    };
    parts.into_iter().filter(|members| !members.is_empty()).enumerate().map(named).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_taken_soon_after_belongs_together() {
        assert_eq!(parted(&[100.0, 0.0, 103.0, 4.0, 9.0], 5.0), [vec![1, 3, 4], vec![0, 2]]);
        assert_eq!(parted(&[], 5.0), Vec::<Vec<usize>>::new());
        assert_eq!(parted(&[0.0, 5.0], 5.0), [vec![0, 1]]);
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
}
