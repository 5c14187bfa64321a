//! Pictures as text that a page holds.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use trueup::{Metadata, OutputOptions, Raster, Result, RowSource, StageContext, write_picture};
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

/// A reduced photograph, handed out in rows.
#[derive(Debug)]
pub(crate) struct ReducedPhotograph(pub Raster<u8>);

impl RowSource for ReducedPhotograph {
    fn width(&self) -> usize {
        self.0.width()
    }

    fn height(&self) -> usize {
        self.0.height()
    }

    fn is_opaque(&self) -> bool {
        true
    }

    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        for (pixel, color) in row.chunks_exact_mut(4).zip(self.0.row(y).chunks_exact(3)) {
            pixel[..3].copy_from_slice(color);
            pixel[3] = u8::MAX;
        }
        Ok(())
    }

    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        for (pixel, color) in row.chunks_exact_mut(4).zip(self.0.row(y).chunks_exact(3)) {
            for (sample, &level) in pixel.iter_mut().zip(color) {
                *sample = u16::from(level) * 257;
            }
            pixel[3] = u16::MAX;
        }
        Ok(())
    }

    fn linear_row(&self, _: usize, _: &mut [f32]) -> Result<()> {
        let hint = "Ask for 8 or 16 bits.".to_owned();
        Err(Error::Unsupported { what: "linear light of a reduced photograph".to_owned(), hint })
    }
}
