//! What a saved project needs when this program has ended: masks that were painted and photographs that were dropped
//! lie in a temporary folder until then, so that they are put beside the project, which names them there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup::{Error, ImageRecord, MaskKind, Project, Result};

use crate::folder::plain_name;

/// Files that go with a project.
#[derive(Debug, Default)]
pub(crate) struct Companions {
    /// Their names from the project's folder, by where they are.
    files: BTreeMap<PathBuf, String>,
    /// What the project names them by, by what it named them by before.
    renamed: BTreeMap<String, String>,
    /// The folder of the masks in that of the project, if they have one of their own.
    masks_folder: Option<String>,
}

impl Companions {
    /// Those of the project of a panorama whose file is called `panorama`; `dropped` is where dropped photographs lie.
    /// In `among`, a folder of photographs, masks have a folder of their own: they are no photographs. What is to be
    /// fetched lies side by side, masks beside the project, and dropped photographs stay where whoever dropped them has
    /// them.
    pub(crate) fn of(project: &Project, panorama: &str, dropped: &Path, among: Option<&Path>) -> Self {
        let stem = panorama.rsplit_once('.').map_or(panorama, |(stem, _)| stem);
        let folder = format!("{stem}-masks");
        let mut all = Self::default();
        for (position, image) in project.images.iter().enumerate() {
            for (place, mask) in image.masks.iter().enumerate() {
                let number = image.masks[..place].iter().filter(|other| other.kind == mask.kind).count() + 1;
                let file = mask_name(stem, image, position, mask.kind, number);
                let name = if among.is_some() { format!("{folder}/{file}") } else { file };
                all.files.insert(PathBuf::from(&mask.path), name.clone());
                all.renamed.insert(mask.path.clone(), name);
                all.masks_folder = among.map(|_| folder.clone());
            }
            for (path, name) in image.files().filter(|(path, _)| Path::new(path).starts_with(dropped)) {
                // One that was saved there before need not be again.
                if among.is_some_and(|among| !is_copy(&among.join(name), Path::new(path))) {
                    all.files.insert(PathBuf::from(path), name.to_owned());
                }
                all.renamed.insert(path.clone(), name.to_owned());
            }
        }
        all
    }

    /// What the project names them by, by what it named them by before.
    pub(crate) fn renamed(&self) -> &BTreeMap<String, String> {
        &self.renamed
    }

    /// Their names from the project's folder.
    pub(crate) fn names(&self) -> impl Iterator<Item = &String> {
        self.files.values()
    }

    /// Copies them into the project's folder.
    ///
    /// # Errors
    /// [`Error::Input`] if there is something else of their names, before anything is copied; [`Error::Io`].
    pub(crate) fn copy_to(&self, folder: &Path) -> Result<()> {
        let taken =
            self.masks_folder.iter().chain(self.names()).find(|name| folder.join(name).symlink_metadata().is_ok());
        if let Some(name) = taken {
            return Err(Error::input(name, "there is a file of this name already", "Take another name."));
        }
        let copied = self.copy_all(folder);
        copied.inspect_err(|_| self.remove_from(folder))
    }

    fn copy_all(&self, folder: &Path) -> Result<()> {
        if let Some(masks) = &self.masks_folder {
            let masks = folder.join(masks);
            std::fs::create_dir(&masks).map_err(|error| Error::io("making the folder", &masks, error))?;
        }
        for (file, name) in &self.files {
            let place = folder.join(name);
            copy(file, &place).map_err(|error| Error::io("writing", &place, error))?;
        }
        Ok(())
    }

    /// Takes copies away again. What cannot be removed stays.
    pub(crate) fn remove_from(&self, folder: &Path) {
        for name in self.names() {
            drop(std::fs::remove_file(folder.join(name)));
        }
        if let Some(masks) = &self.masks_folder {
            drop(std::fs::remove_dir(folder.join(masks)));
        }
    }
}

/// What the copy of a mask is called, which is that `number` of its kind from 1 on: `panorama-02.jpg-use.png`.
fn mask_name(stem: &str, image: &ImageRecord, position: usize, kind: MaskKind, number: usize) -> String {
    let kind = match kind {
        MaskKind::Use => "use",
        MaskKind::Keep => "keep",
    };
    // Several of a kind are none that were painted here.
    let number = if number > 1 { format!("-{number}") } else { String::new() };
    let name = format!("{stem}-{}-{kind}{number}.png", image.file_name());
    match plain_name(&name) {
        Some(_) => name,
        None => format!("{stem}-photograph-{}-{kind}{number}.png", position + 1),
    }
}

/// Copies a file to a place where none is; it has that name when it is whole.
fn copy(file: &Path, place: &Path) -> std::io::Result<()> {
    let folder = place.parent().unwrap_or(Path::new("."));
    let begun = tempfile::Builder::new().prefix(".trueup-").tempfile_in(folder)?;
    std::fs::copy(file, begun.path())?;
    begun.into_temp_path().persist_noclobber(place).map_err(|error| error.error)
}

/// Whether the file `copy` has the bytes of `file`.
fn is_copy(copy: &Path, file: &Path) -> bool {
    let hash = |path: &Path| {
        let mut hasher = blake3::Hasher::new();
        std::io::copy(&mut std::fs::File::open(path)?, &mut hasher)?;
        Ok::<_, std::io::Error>(hasher.finalize())
    };
    let is_file = copy.symlink_metadata().is_ok_and(|facts| facts.is_file());
    is_file && hash(copy).ok().zip(hash(file).ok()).is_some_and(|(one, other)| one == other)
}
