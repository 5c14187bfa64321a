//! Where what does not fit into memory goes.

use std::path::{Path, PathBuf};

use trueup_compose::layout::CanvasLayout;
use trueup_core::Result;
use trueup_io::encode;
use trueup_io::scratch::{ScratchFolder, check_room};

use crate::options::StitchOptions;

/// Where what is measured of photographs goes that does not fit, of a panorama to be written to `output`, if that is
/// known and a file.
pub(crate) fn while_measuring(options: &StitchOptions, output: Option<&Path>) -> ScratchFolder {
    let named = Some(Path::new(&options.run.resources.scratch)).filter(|named| !named.as_os_str().is_empty());
    let beside = output.filter(|output| !encode::passes_through(output)).and_then(Path::parent);
    ScratchFolder::new(named.or(beside).map_or_else(std::env::temp_dir, PathBuf::from))
}

/// Where the scratch file of a panorama on `layout` would go that is to be written to `output`, if that is known and a
/// file.
///
/// # Errors
/// [`trueup_core::Error::Limits`] if there is no room for the panorama.
pub(crate) fn folder(layout: &CanvasLayout, options: &StitchOptions, output: Option<&Path>) -> Result<ScratchFolder> {
    let scratch = while_measuring(options, output);
    let Some(output) = output.filter(|output| !encode::passes_through(output)) else { return Ok(scratch) };
    let folder = output.parent().unwrap_or(Path::new(""));
    let bytes = encode::expected_bytes(output, layout.width, layout.height, &options.compose.output);
    check_room(folder, bytes, "the panorama")?;
    Ok(scratch.beside(folder, bytes))
}
