//! From an aligned panorama to its files.

use std::borrow::Borrow;
use std::path::{Path, PathBuf};

use trueup_compose::render::Rendered;
use trueup_core::Result;
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
    /// Those of [`Stitcher::compose`] and of writing; [`trueup_core::Error::Input`] if a file is one of the photographs.
    pub fn write(&self, stitcher: &Stitcher, mut alignment: Alignment) -> Result<Written> {
        self.refuse_photographs(&alignment)?;
        let rendered = stitcher.writing_to(&self.panorama).compose(&mut alignment)?;
        self.write_composed(stitcher, alignment, rendered)
    }

    /// Writes a panorama that was `rendered` of `alignment`, and what is wanted beside it. A panorama that is handed over,
    /// not lent, is let go before layers take its memory.
    ///
    /// # Errors
    /// Those of writing; [`trueup_core::Error::Input`] if a file is one of the photographs.
    pub fn write_composed(
        &self,
        stitcher: &Stitcher,
        mut alignment: Alignment,
        rendered: impl Borrow<Rendered>,
    ) -> Result<Written> {
        self.refuse_photographs(&alignment)?;
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
        let project = alignment.project;
        for (kind, path) in &self.beside {
            if let SideOutputWriter::Record(text) = kind.writer() {
                encode::write_atomically(path, text(&project)?.as_bytes())?;
            }
        }
        Ok(Written { outputs: self.clone(), bytes, project })
    }

    fn refuse_photographs(&self, alignment: &Alignment) -> Result<()> {
        let photographs = alignment.project.images.iter().filter(|image| !is_older_panorama(image));
        self.refuse_over(photographs.map(|image| (Path::new(&image.path), ReadFile::Photograph)))
    }
}

/// Whether a photograph was left out because it is none: a panorama of an earlier run, which may be written over.
fn is_older_panorama(image: &ImageRecord) -> bool {
    image.status == ImageStatus::LeftOut && source::is_own_panorama(Path::new(&image.path))
}

impl Written {
    /// The project's file, if one was wanted.
    pub fn project_file(&self) -> Option<&Path> {
        self.outputs.beside.get(&SideOutput::Project).map(PathBuf::as_path)
    }
}
