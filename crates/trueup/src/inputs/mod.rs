//! What is to be stitched, and what the user wants of it.

mod lens_from;
mod masks;
mod names;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use trueup_align::stitch_graph::{GraphFile, parse_graph_file};
use trueup_core::Result;
use trueup_io::source::{self, InMemory, RejectedSource};

pub(crate) use lens_from::tell_lenses;
pub(crate) use masks::AllMasks;
pub use masks::MaskFile;
pub(crate) use names::reference_named;

/// Which photograph sets the panorama's pixel scale and stays in place.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Reference {
    /// The photograph in the middle of the stitch graph.
    #[default]
    Auto,
    /// The photograph of this name (file name, or path as given).
    Named(String),
}

/// Photographs and wishes that are no tuning.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Inputs {
    /// Files, folders, glob patterns, and names of photographs in memory, in the user's order.
    pub photographs: Vec<String>,
    /// The photographs that are no files, and the masks.
    pub in_memory: InMemory,
    /// Which photograph is the reference.
    pub reference: Reference,
    /// A stitch graph in a text file: only its pairs are matched.
    pub graph: Option<PathBuf>,
    /// A project of other photographs through the same lens, which is taken from there.
    pub lens_from: Option<PathBuf>,
    /// Stitch every group of overlapping photographs, not only the largest.
    pub all: bool,
    /// Pictures that mark what is to be ignored or kept of the photographs.
    pub masks: Vec<MaskFile>,
    /// Fail unless every photograph given is used.
    pub require_all: bool,
    /// Fail where only one photograph can be used, which is written as it is otherwise.
    pub refuse_single: bool,
    /// Files that the photographs name and that are passed over, since others among the photographs stand for them:
    /// camera raw that was developed.
    pub stood_for: BTreeSet<PathBuf>,
    /// Files that the photographs name and that cannot be used for a reason which their content alone does not tell:
    /// videos that no frames could be taken out of.
    pub unusable: Vec<RejectedSource>,
}

impl Inputs {
    /// What the graph file says of the photographs at these paths; nothing without one.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read; [`Error::Input`] if it is no text, or no graph of these photographs.
    pub(crate) fn graph_file(&self, photographs: &[&Path]) -> Result<GraphFile> {
        let Some(path) = &self.graph else { return Ok(GraphFile::default()) };
        let hint = "Save it as text in UTF-8, with one pair per line as NAME -- NAME.";
        let text = trueup_io::text::read_named(path, hint)?;
        parse_graph_file(&text, photographs, &path.display().to_string())
    }

    /// The files that the photographs' names, folders and patterns stand for, in their order, whether or not they are
    /// photographs. Of folders and patterns, panoramas that this program made are left out.
    pub fn files(&self) -> Vec<PathBuf> {
        source::files(&self.photographs, &self.in_memory)
    }

    /// Photographs with no further wishes.
    pub fn new<S: Into<String>>(photographs: impl IntoIterator<Item = S>) -> Self {
        Self { photographs: photographs.into_iter().map(Into::into).collect(), ..Self::default() }
    }
}
