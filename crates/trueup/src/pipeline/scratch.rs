//! Where what does not fit into memory goes.

use std::path::{Path, PathBuf};

use trueup_compose::layout::CanvasLayout;
use trueup_core::Result;
use trueup_io::encode;
use trueup_io::scratch::{ScratchFolder, check_room};

use crate::options::StitchOptions;

/// Where what is measured of photographs goes that does not fit, of a panorama to be written to `output`, if that is known and a file.
pub(crate) fn while_measuring(options: &StitchOptions, output: Option<&Path>) -> ScratchFolder {
    let beside = output.filter(|output| !encode::passes_through(output)).and_then(Path::parent);
    ScratchFolder::new(named(options).or(beside.map(Path::to_owned)).unwrap_or_else(std::env::temp_dir))
}

/// The folder that the options name.
fn named(options: &StitchOptions) -> Option<PathBuf> {
    Some(&options.run.resources.scratch).filter(|named| !named.is_empty()).map(PathBuf::from)
}

/// Where the scratch file of a panorama on `layout` would go that is to be written to `output`, if that is known and a file.
///
/// # Errors
/// [`trueup_core::Error::Limits`] if there is no room for the panorama.
pub(crate) fn folder(layout: &CanvasLayout, options: &StitchOptions, output: Option<&Path>) -> Result<ScratchFolder> {
    let named = named(options);
    let Some(output) = output.filter(|output| !encode::passes_through(output)) else {
        return Ok(ScratchFolder::new(named.unwrap_or_else(std::env::temp_dir)));
    };
    let folder = output.parent().unwrap_or(Path::new(""));
    let bytes = encode::expected_bytes(output, layout.width, layout.height, &options.compose.output);
    check_room(folder, bytes, "the panorama")?;
    Ok(ScratchFolder::new(named.unwrap_or_else(|| folder.to_owned())).beside(folder, bytes))
}
