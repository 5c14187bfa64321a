//! Pictures as text that a page holds.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use trueup::{Metadata, OutputOptions, Result, RowSource, StageContext, write_picture};
use trueup_core::Error;
use trueup_io::encode::{Background, OutputProfile};

/// A picture as a `data:` address, with its size in pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct EmbeddedPicture {
    pub address: String,
    pub width: usize,
    pub height: usize,
}

/// Quality that shows no artifacts at the size that pages show pictures in.
const JPEG_QUALITY: u8 = 84;

/// A picture as JPEG in sRGB; `icc` is the profile of its samples, `None` for sRGB.
///
/// # Errors
/// Those of the picture and of a temporary file.
pub(crate) fn embedded(
    picture: &dyn RowSource,
    icc: Option<Vec<u8>>,
    context: &StageContext,
) -> Result<EmbeddedPicture> {
    let folder = tempfile::tempdir().map_err(|error| Error::io("making", &std::env::temp_dir(), error))?;
    let path = folder.path().join("picture.jpg");
    let options = OutputOptions {
        jpeg_quality: JPEG_QUALITY,
        profile: OutputProfile::Srgb,
        // Seen as empty on light pages and on dark ones.
        background: Background::GRAY,
        ..OutputOptions::default()
    };
    write_picture(&path, picture, &Metadata { icc, ..Metadata::default() }, &options, context)?;
    let bytes = std::fs::read(&path).map_err(|error| Error::io("reading", &path, error))?;
    let address = format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes));
    Ok(EmbeddedPicture { address, width: picture.width(), height: picture.height() })
}
