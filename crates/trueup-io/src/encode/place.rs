//! Where files go: places told apart by what they are, not by how they are spelled, and those that are no files at all.

use std::fs::File;
use std::path::{Path, PathBuf};

use trueup_core::{Error, Result};

/// The name that stands for standard output, as in most commands.
const STANDARD_OUTPUT: &str = "-";

/// Whether `path` is standard output: `-`, or on Unix what leads to the same, such as `/dev/stdout`.
pub fn is_standard_output(path: &Path) -> bool {
    path.as_os_str() == STANDARD_OUTPUT || leads_to_standard_output(path)
}

/// Whether what is written to `path` is passed on and gone, as through a pipe or a device, instead of lying there as a
/// file.
pub fn passes_through(path: &Path) -> bool {
    is_standard_output(path) || path.metadata().is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// Whether two paths lead to one place, whether anything is there or not: links are followed, `./a` is `a`.
pub fn same_place(a: &Path, b: &Path) -> bool {
    match (is_standard_output(a), is_standard_output(b)) {
        (false, false) => resolved(a) == resolved(b),
        (a, b) => a && b,
    }
}

/// Most links that are followed one after the other, as Linux has it: more are a circle.
const MOST_LINKS: usize = 40;

/// A path free of links, "." and "..", as far as it leads: a link to a file that is not there yet is that file's place.
pub(super) fn resolved(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        if let Ok(place) = path.canonicalize() {
            return place;
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let (Ok(folder), Some(name)) = (folder.canonicalize(), path.file_name()) else { return path };
        let place = folder.join(name);
        match place.read_link() {
            // What it leads to is seen from its own folder.
            Ok(led_to) => path = folder.join(led_to),
            Err(_) => return place,
        }
    }
    path
}

/// Opens what is written through, to be called when all that goes there is known: a pipe waits for its reader.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn open_through(path: &Path) -> Result<File> {
    let opened = if is_standard_output(path) { standard_output() } else { File::options().write(true).open(path) };
    opened.map_err(|error| Error::io("writing", path, error))
}

/// Refuses what could be written through, but must not be: a disk whose first bytes are its table, a socket.
///
/// # Errors
/// [`Error::Input`].
pub(super) fn refuse_disk(path: &Path) -> Result<()> {
    match kind_refused(path) {
        Some(kind) if !is_standard_output(path) => {
            Err(Error::input(path.display(), format!("it is {kind}"), "Give the name of a file."))
        }
        _ => Ok(()),
    }
}

#[cfg(unix)]
fn kind_refused(path: &Path) -> Option<&'static str> {
    use std::os::unix::fs::FileTypeExt;
    let kind = path.metadata().ok()?.file_type();
    match (kind.is_block_device(), kind.is_socket()) {
        (true, _) => Some("a disk or another block device"),
        (_, true) => Some("a socket"),
        _ => None,
    }
}

#[cfg(not(unix))]
fn kind_refused(_path: &Path) -> Option<&'static str> {
    None
}

#[cfg(unix)]
fn standard_output() -> std::io::Result<File> {
    use std::os::fd::AsFd;
    Ok(File::from(std::io::stdout().as_fd().try_clone_to_owned()?))
}

#[cfg(windows)]
fn standard_output() -> std::io::Result<File> {
    use std::os::windows::io::AsHandle;
    Ok(File::from(std::io::stdout().as_handle().try_clone_to_owned()?))
}

#[cfg(unix)]
fn leads_to_standard_output(path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    let Ok(named) = path.metadata().map(identity) else { return false };
    standard_output().and_then(|file| file.metadata()).map(identity).is_ok_and(|own| own == named)
}

#[cfg(not(unix))]
fn leads_to_standard_output(_path: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_told_apart_by_what_they_are() {
        let desk = tempfile::tempdir().expect("a folder");
        let at = |name: &str| desk.path().join(name);
        std::fs::write(at("here"), "").expect("written");
        assert!(same_place(&at("here"), &at("./here")) && same_place(&at("new"), &at("../").join(at("new"))));
        assert!(!same_place(&at("here"), &at("new")) && !same_place(&at("none/a"), &at("none/b")));
        assert!(same_place(Path::new("-"), Path::new("-")) && !same_place(Path::new("-"), &at("here")));
        assert!(!passes_through(&at("here")) && !passes_through(&at("new")) && !passes_through(desk.path()));
        assert!(passes_through(Path::new("-")));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_what_it_leads_to() {
        let desk = tempfile::tempdir().expect("a folder");
        let at = |name: &str| desk.path().join(name);
        std::fs::write(at("here"), "").expect("written");
        std::os::unix::fs::symlink("here", at("link")).expect("linked");
        assert!(same_place(&at("here"), &at("link")));
        // What a link leads to need not be there, and may be a link; a circle leads nowhere.
        std::os::unix::fs::symlink("new", at("early")).expect("linked");
        std::os::unix::fs::symlink(at("early"), at("earlier")).expect("linked");
        std::os::unix::fs::symlink("circle", at("circle")).expect("linked");
        assert!(same_place(&at("new"), &at("early")) && same_place(&at("earlier"), &at("new")));
        assert!(!same_place(&at("early"), &at("here")) && !same_place(&at("circle"), &at("new")));
        assert!(passes_through(Path::new("/dev/null")));
    }
}
