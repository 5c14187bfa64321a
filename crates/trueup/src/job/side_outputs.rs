//! Files that can be wanted beside the panorama: each declared once, with its flag, its checks and its writer.

use std::path::Path;

use trueup_compose::render::Rendered;
use trueup_core::Result;
use trueup_io::encode;

use super::layers::no_seams;
use super::small_panorama;
use crate::options::StitchOptions;
use crate::pipeline::{Alignment, Stitcher};
use crate::project::hugin::hugin_project;
use crate::project::record::Project;

/// What a file beside the panorama is written from.
#[derive(Debug, Clone, Copy)]
pub(super) enum SideOutputWriter {
    /// The panorama, while it is at hand.
    Panorama(fn(&Stitcher, &Alignment, &Rendered, &Path) -> Result<()>),
    /// The aligned photographs, when the panorama is written.
    Photographs(fn(&Stitcher, &Alignment, &Path) -> Result<()>),
    /// The record, when all else is written: its text. Of what is `known` when all photographs have their places, it is
    /// refused before anything is written where there can be none.
    Record {
        /// The refusal.
        check: fn(known: &Project) -> Result<()>,
        /// The text.
        text: fn(&Project) -> Result<String>,
    },
}

macro_rules! side_outputs {
    ($($(#[doc = $doc:literal])* $variant:ident($flag:literal, $value:literal) checked by $check:expr, written by $writer:expr;)*) => {
        /// A file that can be wanted beside the panorama.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum SideOutput {
            $($(#[doc = $doc])* $variant,)*
        }

        impl SideOutput {
            /// All there are.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The name of the flag that asks for it, without dashes.
            pub fn flag(self) -> &'static str {
                match self { $(Self::$variant => $flag,)* }
            }

            /// What the flag's value is called.
            pub fn value_name(self) -> &'static str {
                match self { $(Self::$variant => $value,)* }
            }

            /// What it is, in words.
            pub fn meaning(self) -> String {
                match self { $(Self::$variant => trueup_core::options::joined(&[$($doc),*]),)* }
            }

            /// Refuses before work starts what could not be written to `path` when it is done.
            pub(super) fn check(self, path: &Path, options: &StitchOptions) -> Result<()> {
                let check: fn(&Path, &StitchOptions) -> Result<()> = match self { $(Self::$variant => $check,)* };
                check(path, options)
            }

            pub(super) fn writer(self) -> SideOutputWriter {
                match self { $(Self::$variant => $writer,)* }
            }
        }
    };
}

side_outputs! {
    /// Write the panorama's record (geometry, pairs, reasons, timings) as JSON
    Project("project", "FILE.json")
        checked by |path, _| encode::check_place(path),
        written by SideOutputWriter::Record { check: |_| Ok(()), text: Project::to_json };
    /// Write the cameras as a project of the Hugin stitcher
    HuginProject("pto", "FILE.pto")
        checked by |path, _| encode::check_place(path),
        written by SideOutputWriter::Record { check: |known| hugin_project(known).map(drop), text: hugin_project };
    /// Write the photographs as layers, aligned and corrected, one to a page (output.layer_extent)
    Layers("layers", "FILE.tif")
        checked by |path, _| encode::check_layers_place(path),
        written by SideOutputWriter::Photographs(|stitcher, alignment, path| stitcher.write_layers(alignment, path).map(drop));
    /// Write which photograph is shown where
    Seams("seams", "FILE.png")
        checked by |path, options| {
            encode::check_labels_place(path)?;
            if options.compose.render.blend.has_seams() { Ok(()) } else { Err(no_seams()) }
        },
        written by SideOutputWriter::Panorama(|stitcher, alignment, rendered, path| {
            stitcher.write_seams(alignment, rendered, path).map(drop)
        });
    /// Write a small copy of the panorama, at most 480 pixels wide and high; the extension chooses the format
    Thumbnail("thumbnail", "FILE")
        checked by |path, _| small_panorama::check(path),
        written by SideOutputWriter::Panorama(small_panorama::write);
}
