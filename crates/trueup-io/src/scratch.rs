//! Files for what does not fit in memory, and how much room disks have.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use trueup_core::memory::{needed_in_words, room_in_words};
use trueup_core::scratch::{ScratchFile, ScratchSpace};
use trueup_core::{Error, Result};

use crate::encode::pending::takes_nothing;

/// A folder for scratch files. They have no name where the operating system allows, and are removed by it when the
/// program ends, however it does.
#[derive(Debug, Clone)]
pub struct ScratchFolder {
    folder: PathBuf,
    /// The folder of what is written afterwards, and how many bytes it is expected to take.
    output: Option<(PathBuf, u64)>,
}

impl ScratchFolder {
    /// Scratch files in `folder`, which must exist.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), output: None }
    }

    /// Leaves room for `bytes` that are to be written into `folder` while scratch files exist.
    #[must_use]
    pub fn beside(self, folder: impl Into<PathBuf>, bytes: u64) -> Self {
        Self { output: Some((folder.into(), bytes)), ..self }
    }
}

impl ScratchSpace for ScratchFolder {
    fn create(&self, bytes: u64) -> Result<Box<dyn ScratchFile>> {
        let (mut needed, mut what) = (bytes, "the scratch file");
        if let Some((folder, output)) = &self.output
            && on_one_disk(folder, &self.folder)
        {
            needed = needed.saturating_add(*output);
            what = "the scratch file and the panorama";
        }
        check_room(&self.folder, needed, what)?;
        Ok(Box::new(FileOnDisk { file: scratch_file(&self.folder)?, folder: self.folder.clone() }))
    }
}

/// Checks that scratch files could be made in `folder`, before the long work that may need one. Nothing is left behind.
///
/// # Errors
/// [`Error::Input`] if it is no folder or takes no files.
pub fn check_scratch(folder: &Path) -> Result<()> {
    if !folder.is_dir() {
        let reason = "there is no such folder for scratch files";
        return Err(Error::input(folder.display(), reason, "Create it or choose another folder (--scratch)."));
    }
    scratch_file(folder).map(drop)
}

fn scratch_file(folder: &Path) -> Result<File> {
    tempfile::tempfile_in(folder).map_err(|error| takes_nothing(existing(folder), &error))
}

/// Refuses to put `needed` bytes of `what` into `folder` if its disk has not so much room. Where the operating system
/// does not say how much there is, nothing is refused.
///
/// # Errors
/// [`Error::Limits`] with the numbers.
pub fn check_room(folder: &Path, needed: u64, what: &str) -> Result<()> {
    match fs4::available_space(existing(folder)) {
        Ok(free) if free < needed => Err(Error::Limits {
            subject: format!("disk of {}", existing(folder).display()),
            needed: format!("{} for {what}", needed_in_words(needed)),
            allowed: format!("{} free", room_in_words(free)),
            hint: "Free some room, choose another folder (--scratch for the scratch file), or make a smaller panorama \
                   (--scale)."
                .to_owned(),
        }),
        _ => Ok(()),
    }
}

/// An empty path is the current folder.
fn existing(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

/// Whether two folders share their room.
fn on_one_disk(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let device = |folder: &Path| existing(folder).metadata().map(|metadata| metadata.dev()).ok();
        device(a) == device(b)
    }
    #[cfg(not(unix))]
    {
        // No two disks have the same size and the same room, to the byte.
        let disk = |folder: &Path| {
            let folder = existing(folder);
            fs4::total_space(folder).ok().zip(fs4::available_space(folder).ok())
        };
        disk(a) == disk(b)
    }
}

#[derive(Debug)]
struct FileOnDisk {
    file: File,
    folder: PathBuf,
}

impl ScratchFile for FileOnDisk {
    fn write_at(&self, bytes: &[u8], offset: u64) -> Result<()> {
        write_all_at(&self.file, bytes, offset)
            .map_err(|error| Error::io("writing the scratch file in", existing(&self.folder), error))
    }

    fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<()> {
        read_exact_at(&self.file, bytes, offset)
            .map_err(|error| Error::io("reading the scratch file in", existing(&self.folder), error))
    }
}

#[cfg(unix)]
fn write_all_at(file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

#[cfg(windows)]
fn write_all_at(file: &File, mut bytes: &[u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_write(file, bytes, offset) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(written) => {
                bytes = &bytes[written..];
                offset += written as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut bytes: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, bytes, offset) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(read) => {
                bytes = &mut bytes[read..];
                offset += read as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_back_and_nothing_is_left() {
        let folder = tempfile::tempdir().expect("a folder");
        let scratch = ScratchFolder::new(folder.path()).create(1000).expect("room for a thousand bytes");
        scratch.write_at(b"later", 500).expect("written");
        scratch.write_at(b"first", 0).expect("written");
        let mut read = [0; 5];
        scratch.read_at(&mut read, 500).expect("read");
        assert_eq!(&read, b"later");
        scratch.read_at(&mut read, 0).expect("read");
        assert_eq!(&read, b"first");
        let past_the_end = scratch.read_at(&mut read, 503).expect_err("nothing there").to_string();
        assert!(past_the_end.starts_with("reading the scratch file in "), "{past_the_end}");
        drop(scratch);
        assert_eq!(folder.path().read_dir().expect("our own folder").count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_scratch_file_has_no_name_even_while_it_is_used() {
        let folder = tempfile::tempdir().expect("a folder");
        let _scratch = ScratchFolder::new(folder.path()).create(1000).expect("room for a thousand bytes");
        assert_eq!(folder.path().read_dir().expect("our own folder").count(), 0);
    }

    #[test]
    fn what_a_disk_cannot_hold_is_refused_with_the_numbers() {
        let folder = tempfile::tempdir().expect("a folder");
        let space = ScratchFolder::new(folder.path());
        let refused = space.create(u64::MAX).expect_err("no disk is so large").to_string();
        assert!(
            refused.contains("18446744073.7 GB for the scratch file needed") && refused.contains(" free "),
            "{refused}"
        );
        let both = space.beside(folder.path(), u64::MAX).create(8).expect_err("no disk is so large").to_string();
        assert!(both.contains("the scratch file and the panorama"), "{both}");
        let missing = ScratchFolder::new(folder.path().join("absent")).create(8);
        assert!(matches!(missing, Err(Error::Input { .. })), "{missing:?}");
        assert!(check_scratch(&folder.path().join("absent")).is_err() && check_scratch(folder.path()).is_ok());
    }
}
