//! What one person works on: their photographs, what they wish of the panorama, and what was made so far.
//!
//! All of it is behind one lock, which nobody holds while anything takes time. Whoever changes it tells the page by a
//! number that grows.

mod history;
mod listed;
mod wishes;

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tempfile::TempDir;
use tokio::sync::watch;
use trueup::{Alignment, CancelToken, StitchOptions, thread_pool};

use crate::denial::{Denial, Trouble};
use crate::folder::Folder;
use crate::layers::Underlay;

pub(crate) use history::History;
pub(crate) use listed::Listed;
pub(crate) use wishes::{Offered, PaintedMasks, Wishes, is_offered, offered};

/// The geometry of a panorama, and what it was made by.
#[derive(Debug, Clone)]
pub(crate) struct Stitched {
    pub number: u64,
    pub alignment: Arc<Alignment>,
    /// As it was stitched.
    pub options: StitchOptions,
    /// What was wished when it was stitched.
    pub wishes: Wishes,
}

/// What keeps the machine busy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Task {
    /// A panorama is stitched.
    Stitch,
    /// Tiles of the whole panorama are made.
    Tiles,
    /// Files are written.
    Export,
    /// A project is opened.
    Reopen,
}

/// A part of a task.
#[derive(Debug, Clone, serde::Serialize)]
pub(crate) struct Stage {
    pub name: String,
    pub done: u64,
    pub total: u64,
    pub finished: bool,
}

/// A task that is not finished.
#[derive(Debug, Clone)]
pub(crate) struct Work {
    pub task: Task,
    pub stages: Vec<Stage>,
    pub cancel: Arc<CancelToken>,
}

/// Tiles of the whole panorama.
#[derive(Debug, Clone)]
pub(crate) struct Tiles {
    pub number: u64,
    pub folder: PathBuf,
    /// What drawings over them are made from.
    pub underlay: Arc<Underlay>,
    /// Which panorama, and what was wished when it was composed.
    pub stitched: u64,
    pub wishes: Wishes,
}

/// Files that were made to be fetched, or saved.
#[derive(Debug, Clone)]
pub(crate) struct Export {
    pub number: u64,
    /// Where they are, if they are to be fetched.
    pub folder: Option<PathBuf>,
    /// Their names and lengths in bytes.
    pub files: Vec<ExportedFile>,
}

/// One of them.
#[derive(Debug, Clone, serde::Serialize)]
pub(crate) struct ExportedFile {
    pub name: String,
    pub bytes: u64,
}

/// A preview that was drawn.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    pub bytes: Vec<u8>,
    pub media_type: &'static str,
    /// What drawings over it are made from.
    pub underlay: Arc<Underlay>,
}

/// Previews that are kept: the page fetches each at once.
const MAX_DRAWN: usize = 4;

/// All that can change.
#[derive(Debug, Default)]
pub(crate) struct State {
    pub folder: Option<Folder>,
    pub photographs: Vec<Listed>,
    pub dropped_bytes: u64,
    /// The options that are not offered on the page: the program's, or those of a project that was opened.
    pub base: StitchOptions,
    pub history: History,
    pub stitched: Option<Stitched>,
    pub work: Option<Work>,
    pub trouble: Option<Trouble>,
    pub tiles: Option<Tiles>,
    pub exports: Vec<Export>,
    /// The last number that something was given.
    pub last_number: u64,
}

impl State {
    /// A number that nothing else has.
    pub(crate) fn number(&mut self) -> u64 {
        self.last_number += 1;
        self.last_number
    }

    /// The options that are wished for now.
    ///
    /// # Errors
    /// Those of the options.
    pub(crate) fn options(&self) -> trueup::Result<StitchOptions> {
        self.history.now().options(&self.base)
    }
}

/// What one person works on, for all who serve them.
#[derive(Debug)]
pub(crate) struct Studio {
    /// The folder that was opened when the program began: no other than those inside it can be.
    pub root: Option<Folder>,
    /// Where dropped photographs, masks, previews and exports lie until the program ends.
    pub desk: TempDir,
    pub pool: rayon::ThreadPool,
    /// Held while a preview is drawn.
    pub drawing: Mutex<()>,
    state: Mutex<State>,
    /// The sizes of photographs that were made small, by the names of their small pictures.
    small: Mutex<BTreeMap<String, [usize; 2]>>,
    /// By number, the oldest first. No news: the page knows what it asked for.
    drawn: Mutex<VecDeque<(u64, Drawn)>>,
    news: watch::Sender<u64>,
}

impl Studio {
    /// A studio with the photographs of `folder`, if there is one.
    ///
    /// # Errors
    /// If there can be no temporary folder or no threads.
    pub(crate) fn new(root: Option<Folder>) -> trueup::Result<Self> {
        let failed = |error| trueup::Error::io("making a folder in", &std::env::temp_dir(), error);
        let desk = tempfile::Builder::new().prefix("trueup-").tempdir().map_err(failed)?;
        for folder in [Self::DROPPED, Self::MASKS, Self::PICTURES, Self::EXPORTS] {
            std::fs::create_dir(desk.path().join(folder)).map_err(failed)?;
        }
        let mut state = State { folder: root.clone(), ..State::default() };
        state.photographs =
            root.iter().flat_map(Folder::photographs).map(|path| Listed { path, dropped: false }).collect();
        let (state, pool) = (Mutex::new(state), thread_pool(0)?);
        Ok(Self {
            root,
            desk,
            pool,
            drawing: Mutex::default(),
            drawn: Mutex::default(),
            small: Mutex::default(),
            state,
            news: watch::Sender::new(1),
        })
    }

    const DROPPED: &str = "dropped";
    const MASKS: &str = "masks";
    const PICTURES: &str = "pictures";
    const EXPORTS: &str = "exports";

    /// Where dropped photographs lie.
    pub(crate) fn dropped(&self) -> PathBuf {
        self.desk.path().join(Self::DROPPED)
    }

    /// Where a photograph of this name is to lie that is dropped: in the first folder there that has none. Older ones
    /// of its name stay, which the list has forgotten; those that are dropped together lie together, by which frames of
    /// a video are known.
    pub(crate) fn place_of_dropped(&self, name: &str) -> PathBuf {
        let mut folder = 0_u64;
        loop {
            let place = self.dropped().join(folder.to_string()).join(name);
            if place.symlink_metadata().is_err() {
                return place;
            }
            folder += 1;
        }
    }

    /// Where masks lie.
    pub(crate) fn masks(&self) -> PathBuf {
        self.desk.path().join(Self::MASKS)
    }

    /// Where pictures for the page lie.
    pub(crate) fn pictures(&self) -> PathBuf {
        self.desk.path().join(Self::PICTURES)
    }

    /// Where files lie that are to be fetched.
    pub(crate) fn exports(&self) -> PathBuf {
        self.desk.path().join(Self::EXPORTS)
    }

    /// What there is, for a moment.
    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        // Changes are small and whole: what a panic left is as good as before it.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what there is, and tells the page.
    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        let changed = change(&mut self.state());
        self.news.send_modify(|number| *number += 1);
        changed
    }

    /// The number that grows with every change.
    pub(crate) fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    /// Keeps a preview for the page; returns its number.
    pub(crate) fn keep_drawn(&self, drawn: Drawn) -> u64 {
        let number = self.state().number();
        let mut kept = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push_back((number, drawn));
        let too_many = kept.len().saturating_sub(MAX_DRAWN);
        kept.drain(..too_many);
        number
    }

    /// The preview of this number, if it is still there.
    pub(crate) fn drawn(&self, number: u64) -> Option<Drawn> {
        let kept = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|(known, _)| *known == number).map(|(_, drawn)| drawn.clone())
    }

    /// The size of the photograph whose small picture has this name, if it was made.
    pub(crate) fn small_size(&self, name: &str) -> Option<[usize; 2]> {
        self.small.lock().unwrap_or_else(PoisonError::into_inner).get(name).copied()
    }

    /// Keeps the size of a photograph whose small picture of this name was made.
    pub(crate) fn keep_small(&self, name: String, size: [usize; 2]) {
        self.small.lock().unwrap_or_else(PoisonError::into_inner).insert(name, size);
    }

    /// Whether a file is one of those that this session may read: in the folder opened, or on the desk.
    pub(crate) fn may_read(&self, path: &Path) -> bool {
        let on_desk = || {
            let (path, desk) = (path.canonicalize().ok(), self.desk.path().canonicalize().ok());
            path.zip(desk).is_some_and(|(path, desk)| path.starts_with(desk))
        };
        self.root.as_ref().is_some_and(|root| root.holds(path)) || on_desk()
    }

    /// A photograph by its number.
    ///
    /// # Errors
    /// If there is none.
    pub(crate) fn photograph(&self, number: usize) -> Result<Listed, Denial> {
        self.state().photographs.get(number).cloned().ok_or_else(|| Denial::missing("photograph"))
    }
}
