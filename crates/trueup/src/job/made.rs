//! A folder beside the panorama, for photographs that are made of inputs which cannot be read themselves: frames of
//! videos, developed camera raw.
//!
//! It takes its place when the panorama is there, and only ever the place of files that an earlier run made.

use std::collections::BTreeMap;
use std::fs::{DirEntry, File};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use trueup_core::diagnostics::Diagnostic;
use trueup_core::{Error, Result};
use trueup_io::encode::PendingFolder;

use super::outputs::Outputs;
use super::write::Written;
use crate::inputs::{Inputs, Reference};

/// The file that lists what was made in its folder. Hidden, so that the folder can be given as one of photographs.
const LIST: &str = ".made-by-trueup.json";

/// The `format` field of that file.
const LIST_FORMAT: &str = "trueup-made";

/// Inputs in which files that were made stand for what cannot be read itself, and what is said of them.
#[derive(Debug)]
pub(super) struct WithMade {
    /// What was made is files like other photographs, in the folder that is yet to take its place.
    pub(super) inputs: Inputs,
    /// Notes and warnings.
    pub(super) told: Vec<Diagnostic>,
    /// Where they are; `None` if nothing was made.
    pub(super) made: Option<MadeFolder>,
}

/// Files that were made for a panorama which is not written yet. Dropped, it is removed with everything in it, and an
/// older folder of its name stays.
#[derive(Debug)]
pub(super) struct MadeFolder {
    /// Where it will be.
    folder: PathBuf,
    pending: PendingFolder,
}

impl MadeFolder {
    /// Begins the folder that is called as the panorama and `end`.
    ///
    /// # Errors
    /// [`Error::Input`] if an older one holds what is not surely made by this program, one of the `inputs`, or one of
    /// the `outputs`, or there cannot be such a folder; [`Error::Io`].
    pub(super) fn begin(outputs: &Outputs, end: &str, inputs: &Inputs) -> Result<Self> {
        let folder = folder_beside(&outputs.panorama, end);
        refuse_inputs(&folder, inputs)?;
        refuse_outputs(&folder, outputs)?;
        refuse_other_files(&folder)?;
        Ok(Self { pending: PendingFolder::create(&folder)?, folder })
    }

    /// Where files are to be written now.
    pub(super) fn path(&self) -> &Path {
        self.pending.path()
    }

    /// Where they will be.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The same inputs where a photograph that was made and is named by the place where it will be is named by the
    /// place where it is.
    pub(super) fn named_in(&self, mut inputs: Inputs) -> Inputs {
        if let Reference::Named(name) = &mut inputs.reference {
            self.name_by_place(name);
        }
        inputs.masks.iter_mut().for_each(|mask| self.name_by_place(&mut mask.photograph));
        inputs
    }

    fn name_by_place(&self, name: &mut String) {
        let path = Path::new(name.as_str());
        let Some(file) = path.file_name() else { return };
        // A name without its folder is looked up as that of any photograph.
        let is_named = path.file_name() != Some(path.as_os_str()) && self.folder.join(file).ends_with(path);
        if is_named && self.path().join(file).is_file() {
            *name = self.path().join(file).display().to_string();
        }
    }

    /// Puts the folder in its place, with the list of what is in it; returns the paths that its files have from now on
    /// by those that they had.
    fn take_place(self) -> Result<BTreeMap<String, String>> {
        let Self { folder, pending } = self;
        let files = entries(pending.path())?;
        let digest_of = |entry: &DirEntry| Ok((name_of(entry), digest(&entry.path())?));
        let list = List { format: LIST_FORMAT.to_owned(), files: files.iter().map(digest_of).collect::<Result<_>>()? };
        let text = serde_json::to_string(&list).map_err(|error| Error::io("writing", &folder, error.into()))?;
        let place = pending.path().join(LIST);
        std::fs::write(&place, text).map_err(|error| Error::io("writing", &place, error))?;
        let moved = |entry: &DirEntry| {
            (entry.path().display().to_string(), folder.join(entry.file_name()).display().to_string())
        };
        let moved = files.iter().map(moved).collect();
        // The work took its time, in which somebody may have put something there.
        refuse_other_files(&folder)?;
        pending.commit()?;
        Ok(moved)
    }
}

/// Puts folders in their places, and names their files by these in the records of the panoramas that were written of
/// them. Without a panorama, nothing takes any place.
///
/// # Errors
/// [`Error::Input`] if the place has come to hold other files; [`Error::Io`]; [`Error::Cancelled`]. The old folder then
/// stays.
pub(super) fn settle(made: Vec<MadeFolder>, written: &mut [Written]) -> Result<()> {
    if written.is_empty() {
        return Ok(());
    }
    for folder in made {
        let moved = folder.take_place()?;
        written.iter_mut().for_each(|one| one.project.rename_files(&moved));
    }
    Ok(())
}

/// What was made in a folder: a file of another name or content is somebody's own.
#[derive(Debug, Serialize, Deserialize)]
struct List {
    /// [`LIST_FORMAT`].
    format: String,
    /// BLAKE3 of each file's content, in hexadecimal, by its name.
    files: BTreeMap<String, String>,
}

impl List {
    /// The list in a folder; an empty one if there is none that can be read.
    fn of(folder: &Path) -> Self {
        let read = || serde_json::from_slice(&std::fs::read(folder.join(LIST)).ok()?).ok();
        let list: Option<Self> = read();
        list.filter(|list| list.format == LIST_FORMAT).unwrap_or(Self { format: String::new(), files: BTreeMap::new() })
    }

    /// Whether an entry of its folder is the list, or as it was when the list was made.
    fn has(&self, entry: &DirEntry) -> Result<bool> {
        // A folder, or a link to a file elsewhere, was not made.
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        match self.files.get(&name_of(entry)) {
            Some(known) if is_file => Ok(digest(&entry.path())? == *known),
            _ => Ok(is_file && !self.files.is_empty() && name_of(entry) == LIST),
        }
    }
}

/// Where what was made for a panorama is kept.
fn folder_beside(panorama: &Path, end: &str) -> PathBuf {
    let mut name = panorama.file_stem().unwrap_or_default().to_owned();
    name.push(end);
    panorama.with_file_name(name)
}

fn name_of(entry: &DirEntry) -> String {
    entry.file_name().to_string_lossy().into_owned()
}

fn entries(folder: &Path) -> Result<Vec<DirEntry>> {
    let unreadable = |error| Error::io("reading", folder, error);
    std::fs::read_dir(folder).and_then(Iterator::collect).map_err(unreadable)
}

/// BLAKE3 of a file's content, in hexadecimal.
fn digest(path: &Path) -> Result<String> {
    let mut hasher = blake3::Hasher::new();
    let read = File::open(path).and_then(|file| hasher.update_reader(file).map(drop));
    read.map_err(|error| Error::io("reading", path, error))?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// A folder with anything but what is listed there as made is somebody's own.
fn refuse_other_files(folder: &Path) -> Result<()> {
    // Whether there can be such a folder is found when it is begun.
    if !folder.is_dir() {
        return Ok(());
    }
    let list = List::of(folder);
    for entry in entries(folder)? {
        if !list.has(&entry)? {
            let reason = format!(
                "what is made for the panorama belongs there, and it holds other files, or changed ones ({})",
                name_of(&entry)
            );
            return Err(Error::input(folder.display(), reason, "Give the panorama another name, or the folder."));
        }
    }
    Ok(())
}

/// A folder that is read from is not replaced, whoever made its files: the panorama of them would have none.
fn refuse_inputs(folder: &Path, inputs: &Inputs) -> Result<()> {
    let Ok(place) = folder.canonicalize() else { return Ok(()) };
    let masks = inputs.masks.iter().map(|mask| mask.file.clone());
    let others = masks.chain(inputs.graph.clone()).chain(inputs.lens_from.clone());
    let is_there = |path: &PathBuf| path.canonicalize().is_ok_and(|path| path.starts_with(&place));
    match inputs.files().into_iter().chain(others).find(is_there) {
        None => Ok(()),
        Some(path) => Err(Error::input(
            path.display(),
            format!("it is to be read, and lies in {}, which what is made for the panorama replaces", folder.display()),
            "Give the panorama another name, or move what is to be read to another folder.",
        )),
    }
}

/// What is written into a folder that is replaced thereafter would be gone with it.
fn refuse_outputs(folder: &Path, outputs: &Outputs) -> Result<()> {
    let Ok(place) = folder.canonicalize() else { return Ok(()) };
    // The folder of a file may be there before the file is; that of a name alone is the current one.
    let folder_of = |path: &Path| Path::new(".").join(path).parent().and_then(|parent| parent.canonicalize().ok());
    let is_there = |path: &&Path| folder_of(path).is_some_and(|parent| parent.starts_with(&place));
    match outputs.files().find(is_there) {
        None => Ok(()),
        Some(path) => Err(Error::input(
            path.display(),
            format!("it cannot lie in {}, which what is made for the panorama replaces", folder.display()),
            "Give it another folder.",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inputs::MaskFile;
    use crate::project::record::MaskKind;

    /// A run for `pano.jpg` on the desk, which reads `photographs` there.
    fn begin(desk: &Path, photographs: &[&str]) -> Result<MadeFolder> {
        let inputs = Inputs::new(photographs.iter().map(|name| desk.join(name).display().to_string()));
        MadeFolder::begin(&Outputs::new(desk.join("pano.jpg")), "-frames", &inputs)
    }

    fn make(desk: &Path, files: &[(&str, &str)]) {
        let made = begin(desk, &[]).expect("it may be");
        for (name, content) in files {
            std::fs::write(made.path().join(name), content).expect("written");
        }
        made.take_place().expect("in its place");
    }

    #[test]
    fn it_lies_beside_the_panorama_and_is_replaced_only_as_it_was_made() {
        assert_eq!(folder_beside(Path::new("out/pano.jpg"), "-frames"), Path::new("out/pano-frames"));
        let desk = tempfile::tempdir().expect("a folder");
        let desk = desk.path();
        let folder = desk.join("pano-frames");
        make(desk, &[("clip-000001.png", "one"), ("clip-000009.png", "nine")]);
        make(desk, &[("clip-000002.png", "two")]);
        assert!(folder.join("clip-000002.png").is_file() && !folder.join("clip-000001.png").exists());

        let refused = || begin(desk, &[]).expect_err("somebody's own").to_string();
        std::fs::write(folder.join("letter.png"), "").expect("written");
        assert!(refused().contains("letter.png"), "{}", refused());
        std::fs::remove_file(folder.join("letter.png")).expect("removed");
        std::fs::write(folder.join("clip-000002.png"), "retouched").expect("written");
        assert!(refused().contains("clip-000002.png"), "{}", refused());
        std::fs::write(folder.join("clip-000002.png"), "two").expect("written");
        std::fs::create_dir(folder.join("more")).expect("made");
        assert!(refused().contains("more"), "{}", refused());
    }

    /// Names tell nothing: other programs number frames in the same way.
    #[test]
    fn frames_that_another_program_took_out_are_not_replaced() {
        let desk = tempfile::tempdir().expect("a folder");
        let folder = desk.path().join("pano-frames");
        std::fs::create_dir(&folder).expect("made");
        begin(desk.path(), &[]).expect("an empty folder is nobody's");
        for list in [None, Some("{}"), Some("{\"format\":\"trueup-made\",\"files\":{}}")] {
            std::fs::write(folder.join("frame-000001.png"), "own").expect("written");
            list.into_iter().for_each(|list| std::fs::write(folder.join(LIST), list).expect("written"));
            begin(desk.path(), &[]).expect_err("somebody's own");
        }
    }

    #[test]
    fn what_is_read_or_written_there_is_not_replaced() {
        let desk = tempfile::tempdir().expect("a folder");
        let desk = desk.path();
        make(desk, &[("clip-000001.png", "one")]);
        for photographs in ["pano-frames", "pano-frames/clip-000001.png", "pano-frames/*.png"] {
            let refused = begin(desk, &[photographs]).expect_err("read").to_string();
            assert!(refused.contains("clip-000001.png: it is to be read"), "{refused}");
        }
        let outputs = Outputs::new(desk.join("pano.jpg"));
        let outputs = outputs.with(crate::SideOutput::Layers, desk.join("pano-frames/layers.tif"));
        let refused = MadeFolder::begin(&outputs, "-frames", &Inputs::default()).expect_err("written").to_string();
        assert!(refused.contains("layers.tif: it cannot lie in"), "{refused}");
    }

    #[test]
    fn it_takes_its_place_only_with_a_panorama_and_not_that_of_what_came_meanwhile() {
        let desk = tempfile::tempdir().expect("a folder");
        let desk = desk.path();
        make(desk, &[("clip-000001.png", "one")]);
        let made = begin(desk, &[]).expect("it may be");
        std::fs::write(made.path().join("clip-000002.png"), "two").expect("written");
        settle(vec![made], &mut []).expect("nothing to do");
        assert!(desk.join("pano-frames/clip-000001.png").is_file());
        let made = begin(desk, &[]).expect("it may be");
        std::fs::write(desk.join("pano-frames/letter.txt"), "").expect("written");
        made.take_place().expect_err("somebody's own");
        assert!(desk.join("pano-frames/letter.txt").is_file());
        assert_eq!(desk.read_dir().expect("readable").count(), 1, "nothing is left behind");
    }

    #[test]
    fn what_was_made_is_named_by_where_it_will_be() {
        let desk = tempfile::tempdir().expect("a folder");
        let made = begin(desk.path(), &[]).expect("it may be");
        std::fs::write(made.path().join("clip-000001.png"), "one").expect("written");
        let place = made.path().join("clip-000001.png").display().to_string();
        let named = |name: &str| {
            let mask = MaskFile { photograph: name.to_owned(), file: "m.png".into(), kind: MaskKind::Use };
            let reference = Reference::Named(name.to_owned());
            let inputs = made.named_in(Inputs { reference, masks: vec![mask], ..Inputs::default() });
            let Reference::Named(reference) = inputs.reference else { panic!("it is named") };
            assert_eq!(reference, inputs.masks[0].photograph);
            reference
        };
        assert_eq!(named("pano-frames/clip-000001.png"), place);
        for other in ["clip-000001.png", "pano-frames/clip-000002.png", "other/clip-000001.png", ".."] {
            assert_eq!(named(other), other);
        }
    }
}
