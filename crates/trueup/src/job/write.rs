//! From an aligned panorama to its files.

use std::borrow::Borrow;
use std::path::{Path, PathBuf};

use trueup_compose::render::Rendered;
use trueup_core::{Error, Result};
use trueup_io::{encode, source};

use super::outputs::{Outputs, ReadFile};
use super::side_outputs::{SideOutput, SideOutputWriter};
use crate::pipeline::{Alignment, Stitcher};
use crate::project::record::{ImageRecord, ImageStatus, Project};

/// A panorama that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Its files.
    pub outputs: Outputs,
    /// The size of the panorama's file in bytes.
    pub bytes: u64,
    /// The record.
    pub project: Project,
}

impl Outputs {
    /// Composes an aligned panorama and writes it and what is wanted beside it.
    ///
    /// # Errors
    /// Those of [`Stitcher::compose`] and of writing; [`trueup_core::Error::Input`] if a file is one of the photographs
    /// or their masks.
    pub fn write(&self, stitcher: &Stitcher, alignment: Alignment) -> Result<Written> {
        let written = self.write_pictures(stitcher, alignment)?;
        written.write_records().map(|()| written)
    }

    /// [`Self::write`] without the records, which are to follow by [`Written::write_records`].
    ///
    /// # Errors
    /// Those of [`Self::write`].
    pub(super) fn write_pictures(&self, stitcher: &Stitcher, mut alignment: Alignment) -> Result<Written> {
        self.refuse_read(&alignment)?;
        self.check_records(&alignment.project)?;
        let rendered = stitcher.writing_to(&self.panorama).compose(&mut alignment)?;
        self.write_pictures_of(stitcher, alignment, rendered)
    }

    /// Writes a panorama that was `rendered` of `alignment`, and what is wanted beside it. A panorama that is handed
    /// over, not lent, is let go before layers take its memory.
    ///
    /// # Errors
    /// Those of writing; [`trueup_core::Error::Input`] if a file is one of the photographs or their masks.
    pub fn write_composed(
        &self,
        stitcher: &Stitcher,
        alignment: Alignment,
        rendered: impl Borrow<Rendered>,
    ) -> Result<Written> {
        self.refuse_read(&alignment)?;
        self.check_records(&alignment.project)?;
        let written = self.write_pictures_of(stitcher, alignment, rendered)?;
        written.write_records().map(|()| written)
    }

    fn write_pictures_of(
        &self,
        stitcher: &Stitcher,
        mut alignment: Alignment,
        rendered: impl Borrow<Rendered>,
    ) -> Result<Written> {
        let written = stitcher.context().gather(|context| {
            context.time("output", || {
                let options = stitcher.output_options(&alignment, &self.panorama)?;
                let metadata = stitcher.metadata(&alignment);
                let panorama = &rendered.borrow().panorama;
                let bytes = encode::write(&self.panorama, panorama, &metadata, &options, context)?;
                for (kind, path) in &self.beside {
                    if let SideOutputWriter::Panorama(write) = kind.writer() {
                        write(stitcher, &alignment, rendered.borrow(), path)?;
                    }
                }
                drop(rendered);
                for (kind, path) in &self.beside {
                    if let SideOutputWriter::Photographs(write) = kind.writer() {
                        write(stitcher, &alignment, path)?;
                    }
                }
                Ok(bytes)
            })
        })?;
        let (bytes, told) = written.split();
        alignment.record(told);
        Ok(Written { outputs: self.clone(), bytes, project: alignment.project })
    }

    /// Refuses records that there cannot be of an aligned panorama, before it is composed.
    ///
    /// # Errors
    /// [`trueup_core::Error::Input`] that names the file.
    pub(super) fn check_records(&self, project: &Project) -> Result<()> {
        let of_file = |path: &Path, error| match error {
            Error::Input { subject, reason, hint } => {
                Error::input(format!("{}: {subject}", path.display()), reason, hint)
            }
            other => other,
        };
        self.beside.iter().try_for_each(|(kind, path)| match kind.writer() {
            SideOutputWriter::Record { check, .. } => check(project).map_err(|error| of_file(path, error)),
            SideOutputWriter::Panorama(_) | SideOutputWriter::Photographs(_) => Ok(()),
        })
    }

    fn refuse_read(&self, alignment: &Alignment) -> Result<()> {
        self.refuse_over_recorded(&alignment.project, |path| Some(PathBuf::from(path)))
    }

    /// Refuses to write over what `project` records as read: its photographs, the other exposures of their stacks and
    /// their masks, each at the `place` of its recorded path. `None` is nowhere.
    ///
    /// # Errors
    /// [`trueup_core::Error::Input`] that names the file and what it is.
    pub(super) fn refuse_over_recorded(
        &self,
        project: &Project,
        place: impl Fn(&str) -> Option<PathBuf>,
    ) -> Result<()> {
        let of_image = |image: &ImageRecord| {
            let own = place(&image.path).filter(|path| !is_older_output(image, path));
            let others = image.stack.iter().filter_map(|member| place(&member.path));
            let photographs = own.into_iter().chain(others).map(|path| (path, ReadFile::Photograph));
            let masks = image.masks.iter().filter_map(|mask| Some((place(&mask.path)?, ReadFile::Mask)));
            photographs.chain(masks).collect::<Vec<_>>()
        };
        let read: Vec<(PathBuf, ReadFile)> = project.images.iter().flat_map(of_image).collect();
        self.refuse_over(read.iter().map(|(path, what)| (path.as_path(), *what)))
    }
}

/// Whether a photograph, at `path`, was left out because it is none: a panorama of an earlier run or a part of it,
/// which may be written over.
fn is_older_output(image: &ImageRecord, path: &Path) -> bool {
    image.status == ImageStatus::LeftOut && source::is_own_output(path)
}

impl Written {
    /// Writes the records that are wanted beside the panorama.
    ///
    /// # Errors
    /// Those of writing.
    pub(super) fn write_records(&self) -> Result<()> {
        for (kind, path) in &self.outputs.beside {
            if let SideOutputWriter::Record { text, .. } = kind.writer() {
                encode::write_atomically(path, text(&self.project)?.as_bytes())?;
            }
        }
        Ok(())
    }

    /// The project's file, if one was wanted.
    pub fn project_file(&self) -> Option<&Path> {
        self.outputs.beside.get(&SideOutput::Project).map(PathBuf::as_path)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// A stack, with a mask, and a photograph that was left out; their paths are looked up in a folder.
    #[test]
    fn nothing_that_a_panorama_was_made_of_is_written_over() {
        let matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
        let image = |path: &str, status: &str| json!({"path": path, "width": 8, "height": 6, "status": status, "reason": "", "hint": ""});
        let mut stack = image("s/1.jpg", "used");
        stack["stack"] = json!([{"path": "s/0.jpg", "reference_from_member": matrix}]);
        stack["masks"] = json!([{"path": "m.png", "kind": "use"}]);
        let project = json!({
            "format": "trueup-project", "version": 2, "method": "vpg", "options": {}, "reference": "s/1.jpg",
            "images": [stack, image("out.jpg", "left_out")], "pairs": [],
            "manhattan": {"threshold": 0.1, "accepted": false, "inliers": []},
            "canvas": {"width": 14, "height": 6}, "seconds": {}, "diagnostics": []
        });
        let project = Project::from_json(&project.to_string(), "p.json").expect("a project");
        let desk = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(desk.path().join("s")).expect("made");
        let refused = |name: &str| {
            std::fs::write(desk.path().join(name), "").expect("written");
            let outputs = Outputs::new(desk.path().join(name));
            outputs.refuse_over_recorded(&project, |path| Some(desk.path().join(path)))
        };
        for (name, what) in [
            ("s/0.jpg", "one of the photographs"),
            ("s/1.jpg", "one of the photographs"),
            ("out.jpg", "one of the photographs"),
            ("m.png", "one of the masks"),
        ] {
            let message = refused(name).expect_err("it is read").to_string();
            assert!(message.contains(name) && message.contains(what), "{message}");
        }
        refused("older.jpg").expect("nobody's");
    }
}
