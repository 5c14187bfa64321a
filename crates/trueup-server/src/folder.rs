//! The folder that was opened: what lies in it, and nothing else.

use std::path::{Component, Path, PathBuf};

use trueup::{Inputs, names_photograph};

use crate::limits::{MAX_NAME, MAX_PHOTOGRAPHS, MAX_PROJECT_BYTES};

/// How names of project files end.
const PROJECT: &str = "json";

/// A folder of photographs.
#[derive(Debug, Clone)]
pub(crate) struct Folder {
    /// As it was given, so that what is recorded of its photographs is what the command records.
    given: PathBuf,
    /// Without links.
    real: PathBuf,
}

impl Folder {
    /// Opens a folder.
    ///
    /// # Errors
    /// If it is none.
    pub(crate) fn open(given: &Path) -> std::io::Result<Self> {
        let real = given.canonicalize()?;
        // A file has no entries, which the system says better than we could.
        std::fs::read_dir(&real)?;
        Ok(Self { given: given.to_owned(), real })
    }

    /// Its name, for people.
    pub(crate) fn name(&self) -> String {
        self.real
            .file_name()
            .map_or_else(|| self.real.display().to_string(), |name| name.to_string_lossy().into_owned())
    }

    /// Where it is, as it was given.
    pub(crate) fn path(&self) -> &Path {
        &self.given
    }

    /// Whether a file lies in it once every link is followed.
    pub(crate) fn holds(&self, path: &Path) -> bool {
        path.canonicalize().is_ok_and(|real| real.starts_with(&self.real))
    }

    /// The folder `inside` it, named by its path from here.
    ///
    /// # Errors
    /// If it is none, or not inside.
    pub(crate) fn inside(&self, inside: &str) -> std::io::Result<Self> {
        let plain = Path::new(inside).components().all(|part| matches!(part, Component::Normal(_)));
        let path = self.given.join(inside);
        if !plain || !self.holds(&path) {
            return Err(std::io::ErrorKind::NotFound.into());
        }
        Self::open(&path)
    }

    /// Its path from `root`, as [`inside`](Self::inside) takes it: empty if it is `root` itself.
    pub(crate) fn path_from(&self, root: &Self) -> String {
        let path = self.given.strip_prefix(&root.given).unwrap_or(Path::new(""));
        let names: Vec<_> = path.iter().map(|name| name.to_string_lossy()).collect();
        names.join("/")
    }

    /// The photographs in it, in the order of the command, links to elsewhere left out, and of more than
    /// [`MAX_PHOTOGRAPHS`] the first.
    pub(crate) fn photographs(&self) -> Vec<PathBuf> {
        let files = Inputs::new([self.given.display().to_string()]).files();
        let own = files.into_iter().filter(|file| file.is_file() && names_photograph(file) && self.holds(file));
        own.take(MAX_PHOTOGRAPHS).collect()
    }

    /// The names of the folders in it that are no links and not hidden, sorted.
    pub(crate) fn folders(&self) -> Vec<String> {
        self.entries(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
    }

    /// The names of the files in it that may be projects, sorted.
    pub(crate) fn projects(&self) -> Vec<String> {
        self.entries(|entry| {
            let named = Path::new(&entry.file_name()).extension().is_some_and(|extension| extension == PROJECT);
            let fits = |entry: &std::fs::DirEntry| {
                entry.metadata().is_ok_and(|facts| facts.is_file() && facts.len() <= MAX_PROJECT_BYTES)
            };
            named && fits(entry)
        })
    }

    fn entries(&self, wanted: impl Fn(&std::fs::DirEntry) -> bool) -> Vec<String> {
        let entries = std::fs::read_dir(&self.real).into_iter().flatten().flatten();
        let names = entries.filter(wanted).filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
        names.sort();
        names
    }
}

/// A name for a file in a folder of ours, if `name` is one: no path, nothing hidden, nothing that commands a terminal.
pub(crate) fn plain_name(name: &str) -> Option<&str> {
    let harmless = |one: char| {
        !one.is_control() && !matches!(one, '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|' | '[' | ']')
    };
    let plain =
        !name.is_empty() && name.len() <= MAX_NAME && !name.starts_with(['.', ' ', '-']) && name.chars().all(harmless);
    plain.then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_outside_of_the_folder_is_in_it() {
        let desk = tempfile::tempdir().expect("a folder");
        let (inner, outer) = (desk.path().join("inner"), desk.path().join("outer"));
        for folder in [&inner, &outer, &inner.join("sub"), &inner.join("sub/sub")] {
            std::fs::create_dir(folder).expect("a folder");
        }
        std::fs::write(outer.join("secret.jpg"), "x").expect("a file");
        std::fs::write(inner.join("own.jpg"), "x").expect("a file");
        std::fs::write(inner.join("own.json"), "{}").expect("a file");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(outer.join("secret.jpg"), inner.join("link.jpg")).expect("a link");
            std::os::unix::fs::symlink(&outer, inner.join("way")).expect("a link");
        }
        let folder = Folder::open(&inner).expect("opened");
        assert_eq!(folder.photographs(), [inner.join("own.jpg")]);
        assert_eq!((folder.folders(), folder.projects()), (vec!["sub".to_owned()], vec!["own.json".to_owned()]));
        for path in ["", "sub", "sub/sub"] {
            assert_eq!(folder.inside(path).expect("inside").path_from(&folder), path);
        }
        let outside = outer.display().to_string();
        for name in ["..", "../outer", "way", "sub/../../outer", "/", outside.as_str(), "none", "."] {
            assert!(folder.inside(name).is_err(), "{name}");
        }
    }

    #[test]
    fn names_are_no_paths() {
        assert_eq!(plain_name("Größe 1.jpg"), Some("Größe 1.jpg"));
        for name in
            ["", ".hidden", "../x.jpg", "a/b.jpg", "a\\b.jpg", "a\0.jpg", "a\n.jpg", "C:x.jpg", "-o.jpg", "<b>.jpg"]
        {
            assert_eq!(plain_name(name), None, "{name:?}");
        }
    }
}
