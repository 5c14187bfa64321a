//! Results on disk, one JSON object a line, written as they come: an interrupted run goes on where it stopped.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use trueup::{Error, Result};

use crate::trial::{Row, TrialKey};

/// The results known so far, and the file they are appended to. Shared by all workers.
#[derive(Debug)]
pub(crate) struct ResultStore {
    path: PathBuf,
    resumed: usize,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    file: File,
    rows: BTreeMap<TrialKey, Row>,
}

impl ResultStore {
    /// Opens the file, which is made if need be, and reads what it holds: results of the build `version` alone. A last
    /// line that was cut off is dropped.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read or written; [`Error::Input`] if it holds results of another build.
    pub(crate) fn open(path: &Path, version: &str) -> Result<Self> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(Error::io("reading", path, error)),
        };
        let rows: Vec<Row> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        if let Some(other) = rows.iter().find(|row| row.key.version != version) {
            let count = rows.iter().filter(|row| row.key.version != version).count();
            return Err(Error::input(
                path.display(),
                format!("{count} of its results are of another build ({}); this one is {version}", other.key.version),
                "Name another folder with --out (and the sets with --data), or begin anew with --anew.",
            ));
        }
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .map_err(|error| Error::io("opening", path, error))?;
        if !text.is_empty() && !text.ends_with('\n') {
            file.write_all(b"\n").map_err(|error| Error::io("writing", path, error))?;
        }
        let rows: BTreeMap<TrialKey, Row> = rows.into_iter().map(|row| (row.key.clone(), row)).collect();
        Ok(Self { path: path.to_owned(), resumed: rows.len(), state: Mutex::new(State { file, rows }) })
    }

    /// How many results there are.
    pub(crate) fn count(&self) -> usize {
        self.locked().rows.len()
    }

    /// How many results there were when the file was opened: of a run that was stopped.
    pub(crate) fn resumed(&self) -> usize {
        self.resumed
    }

    /// The stored result of this run, if there is one.
    pub(crate) fn get(&self, key: &TrialKey) -> Option<Row> {
        self.locked().rows.get(key).cloned()
    }

    /// Stores a result.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written.
    pub(crate) fn add(&self, row: Row) -> Result<()> {
        let line = serde_json::to_string(&row)
            .map_err(|error| Error::io("writing", &self.path, std::io::Error::other(error)))?;
        let mut state = self.locked();
        state.file.write_all((line + "\n").as_bytes()).map_err(|error| Error::io("writing", &self.path, error))?;
        state.rows.insert(row.key.clone(), row);
        Ok(())
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, State> {
        // A worker that panicked has at worst left its own row out.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::Trial;

    fn row(set: &str) -> Row {
        let key = Trial::new("test", set, "plain", &[]).key("content", "1");
        Row { key, measures: BTreeMap::from([("gdic_deg".to_owned(), 0.5)]), note: String::new() }
    }

    #[test]
    fn what_was_stored_is_known_after_opening_again() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("rows.jsonl");
        let store = ResultStore::open(&path, "1").expect("opens");
        assert_eq!(store.get(&row("01").key), None);
        store.add(row("01")).expect("writes");
        drop(store);
        let again = ResultStore::open(&path, "1").expect("opens");
        assert_eq!(again.get(&row("01").key), Some(row("01")));
        assert_eq!(again.get(&row("02").key), None);
    }

    #[test]
    fn results_of_another_build_are_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("rows.jsonl");
        ResultStore::open(&path, "1").expect("opens").add(row("01")).expect("writes");
        let said = ResultStore::open(&path, "2").expect_err("another build").to_string();
        assert!(said.contains("1 of its results are of another build (1); this one is 2"), "{said}");
        assert!(ResultStore::open(&path, "1").expect("the same build").get(&row("01").key).is_some());
    }

    #[test]
    fn a_line_that_was_cut_off_is_run_again_and_spoils_no_other() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("rows.jsonl");
        ResultStore::open(&path, "1").expect("opens").add(row("01")).expect("writes");
        let whole = std::fs::read_to_string(&path).expect("text");
        std::fs::write(&path, format!("{whole}{}", &whole[..whole.len() / 2])).expect("writes");
        let store = ResultStore::open(&path, "1").expect("opens");
        store.add(row("02")).expect("writes");
        drop(store);
        let again = ResultStore::open(&path, "1").expect("opens");
        assert_eq!(again.get(&row("01").key), Some(row("01")));
        assert_eq!(again.get(&row("02").key), Some(row("02")));
    }
}
