//! Room on disk for what does not fit in memory.
//!
//! The crate that works with pixels opens no files; whoever calls it hands it a place to put them.

use std::fmt::Debug;

use crate::error::{Error, Result};

/// A file that is there while it is used and gone afterwards, however the program ends.
pub trait ScratchFile: Debug + Send + Sync {
    /// Writes all of `bytes` from `offset` on. Several threads may write different places at once.
    ///
    /// # Errors
    /// [`Error::Io`], as on a full disk.
    fn write_at(&self, bytes: &[u8], offset: u64) -> Result<()>;

    /// Fills `bytes` from `offset` on with what was written there.
    ///
    /// # Errors
    /// [`Error::Io`].
    fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<()>;
}

/// A place for scratch files.
pub trait ScratchSpace: Sync {
    /// An empty file that will take up to `bytes` bytes.
    ///
    /// # Errors
    /// [`Error::Limits`] with the numbers if there is not so much room, [`Error::Io`] if the operating system refuses.
    fn create(&self, bytes: u64) -> Result<Box<dyn ScratchFile>>;
}

/// No scratch files: everything is held in memory.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoScratch;

impl ScratchSpace for NoScratch {
    fn create(&self, bytes: u64) -> Result<Box<dyn ScratchFile>> {
        Err(Error::Limits {
            subject: "scratch file".to_owned(),
            needed: crate::memory::needed_in_words(bytes),
            allowed: "none".to_owned(),
            hint: "Allow more memory.".to_owned(),
        })
    }
}
