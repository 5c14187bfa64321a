//! What is not complete yet, known to the whole program: so that one that must end at once leaves nothing half done.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use trueup_core::{Error, Result};

/// The files and folders of this program. Decoders and encoders of other people's making cannot be asked to stop, and a
/// program that ends drops nothing: the list is the one way to clean up behind them.
pub(super) static UNFINISHED: Unfinished = Unfinished::new();

/// Takes away every file and folder that is not complete yet and lets none be begun or completed from then on: for a
/// program that is about to end without waiting for its work. What is complete stays.
pub fn abandon_unfinished() {
    UNFINISHED.abandon();
}

/// The same for a program that cannot wait: what another thread is just beginning or completing is waited for no longer
/// than a second. What it holds then stays under its temporary name, and the next program clears it away.
pub fn abandon_unfinished_soon() {
    UNFINISHED.abandon_soon();
}

/// Files and folders under their temporary names.
#[derive(Debug)]
pub(super) struct Unfinished(Mutex<List>);

#[derive(Debug)]
struct List {
    abandoned: bool,
    paths: Vec<PathBuf>,
}

impl Unfinished {
    const fn new() -> Self {
        Self(Mutex::new(List { abandoned: false, paths: Vec::new() }))
    }

    fn list(&self) -> MutexGuard<'_, List> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a file or folder: `make` makes it, `path` tells where.
    ///
    /// # Errors
    /// Those of `make`; [`Error::Cancelled`] if all was abandoned.
    pub(super) fn begin<T>(
        &self,
        make: impl FnOnce() -> Result<T>,
        path: fn(&T) -> &Path,
    ) -> Result<(T, UnfinishedEntry<'_>)> {
        let mut list = self.list();
        if list.abandoned {
            return Err(Error::Cancelled);
        }
        let made = make()?;
        let path = path(&made).to_owned();
        list.paths.push(path.clone());
        Ok((made, UnfinishedEntry { unfinished: self, path }))
    }

    /// Gives something its name by `finish`, which nothing interrupts.
    ///
    /// # Errors
    /// Those of `finish`; [`Error::Cancelled`] if all was abandoned.
    pub(super) fn complete<T>(&self, finish: impl FnOnce() -> Result<T>) -> Result<T> {
        let list = self.list();
        if list.abandoned { Err(Error::Cancelled) } else { finish() }
    }

    fn abandon(&self) {
        Self::abandon_all(&mut self.list());
    }

    fn abandon_soon(&self) {
        /// Waits between looks, and how many: a second.
        const WAIT: Duration = Duration::from_millis(10);
        const LOOKS: usize = 100;
        for _ in 0..LOOKS {
            match self.0.try_lock() {
                Ok(mut list) => return Self::abandon_all(&mut list),
                Err(TryLockError::Poisoned(poisoned)) => return Self::abandon_all(&mut poisoned.into_inner()),
                Err(TryLockError::WouldBlock) => std::thread::sleep(WAIT),
            }
        }
    }

    fn abandon_all(list: &mut List) {
        /// Threads at work may put files into a folder while it is emptied.
        const TRIES: usize = 10;
        list.abandoned = true;
        for path in list.paths.drain(..) {
            if path.is_dir() {
                let _ = (0..TRIES).any(|_| std::fs::remove_dir_all(&path).is_ok());
            } else {
                drop(std::fs::remove_file(&path));
            }
        }
    }
}

/// A place in the list, left when this is dropped.
#[derive(Debug)]
pub(super) struct UnfinishedEntry<'a> {
    unfinished: &'a Unfinished,
    path: PathBuf,
}

impl Drop for UnfinishedEntry<'_> {
    fn drop(&mut self) {
        let paths = &mut self.unfinished.list().paths;
        if let Some(position) = paths.iter().position(|path| *path == self.path) {
            paths.swap_remove(position);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_abandoned_is_gone_and_nothing_follows() {
        let desk = tempfile::tempdir().expect("a folder");
        let unfinished = Unfinished::new();
        let begin = |name: &str, folder: bool| {
            let path = desk.path().join(name);
            let make = || match folder {
                true => std::fs::create_dir(&path),
                false => std::fs::write(&path, name),
            };
            unfinished.begin(
                || make().map(|()| path.clone()).map_err(|error| Error::io("making", &path, error)),
                PathBuf::as_path,
            )
        };
        let (done, entry) = begin("done", false).expect("begun");
        drop(entry);
        let (file, _file) = begin("file", false).expect("begun");
        let (folder, _folder) = begin("folder", true).expect("begun");
        std::fs::write(folder.join("inside"), "inside").expect("written");
        assert_eq!(unfinished.complete(|| Ok(7)).expect("not abandoned"), 7);
        let held = unfinished.list();
        unfinished.abandon_soon();
        assert!(file.exists(), "who holds the list is waited for in vain");
        drop(held);
        unfinished.abandon_soon();
        assert!(done.exists() && !file.exists() && !folder.exists());
        assert!(matches!(begin("late", false), Err(Error::Cancelled)));
        assert!(matches!(unfinished.complete(|| Ok(())), Err(Error::Cancelled)));
        assert!(!desk.path().join("late").exists());
    }
}
