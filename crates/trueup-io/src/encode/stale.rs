//! Temporary names, and what a program that was killed left behind under them.

use std::fs::File;
use std::path::Path;
use std::time::Duration;

/// How temporary names begin, and how those of what is not yet complete end.
pub(super) const PREFIX: &str = ".trueup-";
pub(super) const PART: &str = ".part";
/// Younger files may be of a program that has made but not yet marked them.
pub(super) const STALE_AGE: Duration = Duration::from_secs(60);

/// Marks a temporary file as that of a living program: a lock, which goes with the program however it ends. Where the
/// file system knows none, the file is never taken for stale either.
pub(super) fn mark_in_use(file: &File) {
    drop(file.try_lock());
}

/// Takes away the temporary files in `folder` that programs which were killed left behind, once nothing was written to
/// them for `age`: zero for a folder that nobody else writes into now. What cannot be taken away stays.
pub fn clear_parts(folder: &Path, age: Duration) {
    clear_stale(folder, age);
}

/// Takes away the temporary files and folders in `folder` that no living program has marked, once nothing was written
/// to them for `age`. What cannot be looked at or taken away stays.
pub(super) fn clear_stale(folder: &Path, age: Duration) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        let is_part = path.file_name().and_then(|name| name.to_str()).is_some_and(is_temporary);
        if is_part && is_stale(&path, age).unwrap_or(false) {
            drop(if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) });
        }
    }
}

fn is_temporary(name: &str) -> bool {
    name.starts_with(PREFIX) && name.ends_with(PART)
}

fn is_stale(path: &Path, age: Duration) -> std::io::Result<bool> {
    // Not followed: a link of that name is not of this program's making.
    let metadata = path.symlink_metadata()?;
    let is_old = metadata.modified()?.elapsed().is_ok_and(|elapsed| elapsed >= age);
    let is_of_nobody = || {
        // A folder, in which the tiles of a panorama were to be, is opened for nothing but its lock.
        let opened = if metadata.is_dir() { File::open(path) } else { File::options().write(true).open(path) };
        opened.is_ok_and(|opened| opened.try_lock().is_ok())
    };
    Ok((metadata.is_file() || metadata.is_dir()) && is_old && is_of_nobody())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::folder::PendingFolder;
    use crate::encode::pending::PendingFile;

    #[cfg(target_os = "linux")]
    #[test]
    fn folders_of_killed_programs_go_and_those_in_use_stay() {
        let desk = tempfile::tempdir().expect("a folder");
        let gone = desk.path().join(".trueup-gone.part");
        std::fs::create_dir_all(gone.join("0")).expect("a folder");
        std::fs::write(gone.join("0/0_0.jpg"), "left").expect("written");
        let pending = PendingFolder::create(&desk.path().join("pano_files")).expect("possible");
        clear_stale(desk.path(), STALE_AGE);
        assert!(gone.exists(), "too young to tell");
        clear_stale(desk.path(), Duration::ZERO);
        assert!(!gone.exists());
        pending.commit().expect("it is still there");
    }

    #[test]
    fn parts_of_killed_programs_go_and_those_in_use_stay() {
        let desk = tempfile::tempdir().expect("a folder");
        let at = |name: &str| desk.path().join(name);
        for name in [".trueup-gone.part", ".trueup-kept.txt", "trueup-own.part"] {
            std::fs::write(at(name), "left").expect("written");
        }
        let pending = PendingFile::create(&at("pano.jpg")).expect("possible");
        clear_stale(desk.path(), STALE_AGE);
        assert!(at(".trueup-gone.part").exists(), "too young to tell");
        clear_stale(desk.path(), Duration::ZERO);
        assert!(!at(".trueup-gone.part").exists());
        assert!(at(".trueup-kept.txt").exists() && at("trueup-own.part").exists());
        pending.commit().expect("its temporary file is still there");
    }
}
