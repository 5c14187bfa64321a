//! What one declaration says of a file format; [`crate::formats`] has the declarations.

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Seek, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exif::{Field, Tag};
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};

use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::{Depth, OutputOptions};
use crate::formats::decoded::damaged;
use crate::metadata::exif_fields::ExifFields;

/// One file format. Everything that depends on the format of a file asks its declaration.
pub(crate) struct Format {
    /// Its name, as people say it.
    pub(crate) name: &'static str,
    /// How the names of its files end, in lower case; the first is the one to propose.
    pub(crate) extensions: &'static [&'static str],
    /// Endings that are understood, too, but nowhere proposed.
    pub(crate) rare_extensions: &'static [&'static str],
    /// How photographs of this format are read; `None` if they are not.
    pub(crate) reading: Option<Reading>,
    /// How panoramas are written in this format; `None` if they are not.
    pub(crate) writing: Option<Writing>,
}

/// A file that is read, from its first byte on.
pub(crate) type Input = BufReader<File>;

/// How a format is read. Nothing but `pixels` reads pixels. What is read goes through the methods of the same names,
/// which contain panics of decoders.
pub(crate) struct Reading {
    /// Which photographs are read, for docs/formats.md.
    #[cfg_attr(not(test), expect(dead_code, reason = "for the page of formats, which a test compares"))]
    pub(crate) kinds: &'static str,
    /// Whether a file that begins with these bytes, [`SIGNATURE_BYTES`] or all of a shorter file, is of this format.
    pub(crate) has_signature: fn(&[u8]) -> bool,
    /// What the header states of the pixels.
    pub(crate) stored: fn(&mut Input) -> std::result::Result<StoredPixels, HeaderError>,
    /// The ICC profile, if there is one that can be read.
    pub(crate) icc: fn(&mut Input) -> Option<Vec<u8>>,
    /// The EXIF fields that measurement uses. Damaged EXIF counts as absent.
    pub(crate) exif: fn(&mut Input) -> Option<ExifFields>,
    /// The fields of these tags, whole. Damaged ones count as absent.
    pub(crate) whole_fields: fn(&mut Input, &[Tag]) -> Option<Vec<Field>>,
    /// The pixels as they are stored, before orientation. Refuses what is damaged, incomplete, or no longer of the size
    /// that was found when the photograph was examined.
    pub(crate) pixels: fn(&SourceImage, Input) -> Result<Photograph>,
    /// The pixels as they are stored, made smaller by the decoder itself, for people to look at; `None` if decoders of
    /// this format cannot do that.
    pub(crate) reduced: Option<ReducedPixels>,
    /// Bytes of a pixel on its way into memory: in the decoder, and in the photograph beside it. Of a file whose header
    /// cannot be read it does not matter.
    pub(crate) pixel_bytes: fn(&mut Input) -> usize,
}

/// Decodes a photograph as it is stored, with both sides divided by the same 1, 2, 4 or 8 and rounded up, of at least
/// the given columns and rows.
pub(crate) type ReducedPixels = fn(&SourceImage, Input, [usize; 2]) -> Result<Photograph>;

/// [`Reading::pixel_bytes`] of decoders that write samples as they are handed out: four channels of 8 bits, in the
/// decoder and in the photograph, or once with 16 bits.
pub(crate) const PLAIN_PIXEL_BYTES: usize = 8;

/// What is said of a file at which a decoder panicked.
const BROKE_DOWN: &str = "its decoder broke down";

/// What `work` makes of a file. A panic, which only a mistake in a decoder makes, costs the file and not the program.
fn contained<T>(work: impl FnOnce() -> T) -> std::result::Result<T, &'static str> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|_| BROKE_DOWN)
}

impl Reading {
    /// What the field `stored` reads.
    pub(crate) fn stored(&self, input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
        contained(|| (self.stored)(input)).unwrap_or_else(|words| Err(HeaderError::damaged(words)))
    }

    /// What the field `icc` reads.
    pub(crate) fn icc(&self, input: &mut Input) -> Option<Vec<u8>> {
        contained(|| (self.icc)(input)).unwrap_or_default()
    }

    /// What the field `exif` reads.
    pub(crate) fn exif(&self, input: &mut Input) -> Option<ExifFields> {
        contained(|| (self.exif)(input)).unwrap_or_default()
    }

    /// What the field `whole_fields` reads.
    pub(crate) fn whole_fields(&self, input: &mut Input, wanted: &[Tag]) -> Option<Vec<Field>> {
        contained(|| (self.whole_fields)(input, wanted)).unwrap_or_default()
    }

    /// What the field `pixel_bytes` says.
    pub(crate) fn pixel_bytes(&self, input: &mut Input) -> usize {
        contained(|| (self.pixel_bytes)(input)).unwrap_or(PLAIN_PIXEL_BYTES)
    }

    /// What the field `pixels` reads.
    pub(crate) fn pixels(&self, source: &SourceImage, input: Input) -> Result<Photograph> {
        contained(|| (self.pixels)(source, input)).unwrap_or_else(|words| Err(damaged(source, words)))
    }

    /// What the field `reduced` reads of at least `least` columns and rows; all pixels where decoders make nothing
    /// smaller.
    pub(crate) fn reduced(&self, source: &SourceImage, input: Input, least: [usize; 2]) -> Result<Photograph> {
        let Some(reduced) = self.reduced else { return self.pixels(source, input) };
        contained(|| reduced(source, input, least)).unwrap_or_else(|words| Err(damaged(source, words)))
    }
}

/// How many bytes of a file's start [`Reading::has_signature`] sees: a dozen brands of a HEIF.
pub(crate) const SIGNATURE_BYTES: usize = 64;

/// What a header states of the pixels, before orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StoredPixels {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Bits of a sample; of the colors of a palette.
    pub(crate) bits: u16,
    /// Whether samples are floating point numbers.
    pub(crate) is_float: bool,
}

/// Why a header gives no picture; the codec's words.
#[derive(Debug, Clone)]
pub(crate) enum HeaderError {
    /// The header contradicts its format.
    Damaged(String),
    /// The picture is well formed, but of a kind that is not read.
    Unsupported(String),
    /// The form is this format's, what is in it another's.
    Foreign(&'static Foreign),
}

/// A format of photographs that is not read.
#[derive(Debug)]
pub(crate) struct Foreign {
    /// What a file of it is, for messages.
    pub(crate) what: &'static str,
    /// How the names of its files end, in lower case. In a folder such files are named in a rejection, while files that
    /// are no photographs at all are passed over in silence.
    pub(crate) extensions: &'static [&'static str],
    /// Whether a file that begins with these bytes, [`SIGNATURE_BYTES`] or all of a shorter file, is of this format.
    pub(crate) has_signature: fn(&[u8]) -> bool,
    /// A command that makes a photograph of one that can be read.
    pub(crate) command: &'static str,
    /// Whether it is what the sensor saw, which [`crate::developing`] has developed by a program that is installed.
    pub(crate) is_raw: bool,
}

impl HeaderError {
    /// A header that the codec cannot make sense of.
    pub(crate) fn damaged(words: impl fmt::Display) -> Self {
        Self::Damaged(words.to_string())
    }

    /// Why, without more.
    pub(crate) fn words(&self) -> &str {
        match self {
            Self::Damaged(words) | Self::Unsupported(words) => words,
            Self::Foreign(foreign) => foreign.what,
        }
    }
}

/// How a format is written, and what it can hold.
pub(crate) struct Writing {
    /// The depths it has, [`Depth::Auto`] left out.
    pub(crate) depths: &'static [Depth],
    pub(crate) transparency: Transparency,
    pub(crate) sides: SideLimit,
    /// Whether files hold a color profile; where they do not, panoramas are converted to sRGB.
    pub(crate) has_profile: bool,
    /// Memory beside the canvas, for docs/formats.md.
    #[cfg_attr(not(test), expect(dead_code, reason = "for the page of formats, which a test compares"))]
    pub(crate) memory: &'static str,
    /// Bytes that a pixel of a panorama of photographs takes: exact where nothing is compressed and nothing
    /// transparent, else at the low end, so that what is refused would not have fitted.
    pub(crate) bytes_per_pixel: fn(&OutputOptions) -> f64,
    pub(crate) writer: Writer,
}

/// Bytes a pixel of lossily compressed panoramas, see [`Writing::bytes_per_pixel`].
pub(crate) const LOSSY_BYTES: f64 = 0.1;
/// The same without loss, for every byte of a sample.
pub(crate) const LOSSLESS_BYTES: f64 = 0.8;

/// Whether a format has transparency.
#[derive(Clone, Copy)]
pub(crate) enum Transparency {
    Never,
    Always,
    /// With some options.
    With {
        /// Whether it has it with these.
        has: fn(&OutputOptions) -> bool,
        /// In which case, for docs/formats.md.
        #[cfg_attr(not(test), expect(dead_code, reason = "for the page of formats, which a test compares"))]
        case: &'static str,
        /// How the user gets it.
        advice: &'static str,
    },
}

/// The longest side that a format can hold.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SideLimit {
    /// In pixels.
    pub(crate) largest: usize,
    /// What to do about a longer one.
    pub(crate) advice: &'static str,
}

/// A file that is written.
pub(crate) trait Output: Write + Seek {}

impl<W: Write + Seek> Output for W {}

/// Writes a panorama, with what is to be told of it, into an empty file.
pub(crate) type FileWriter = fn(
    &mut dyn Output,
    &dyn RowSource,
    &Metadata,
    &OutputOptions,
    &StageContext<'_>,
) -> std::result::Result<(), WriteFailure>;

/// What makes the files of a panorama.
#[derive(Clone, Copy)]
pub(crate) enum Writer {
    /// Writes one file, from its start.
    File(FileWriter),
    /// Makes several files and folders beside each other.
    Files {
        /// Writes them all; returns their bytes together.
        write: fn(&Path, &dyn RowSource, &OutputOptions, &StageContext<'_>) -> Result<u64>,
        /// Checks that they could be put in their places, and leaves nothing behind.
        check_places: fn(&Path) -> Result<()>,
    },
}

impl Format {
    /// Whether this is how its photographs are read.
    pub(crate) fn is_read_by(&self, reading: &Reading) -> bool {
        self.reading.as_ref().is_some_and(|own| std::ptr::eq(own, reading))
    }

    /// Whether the extension of `path` names this format, in any case.
    pub(crate) fn names(&self, path: &Path) -> bool {
        lower_extension(path).is_some_and(|found| {
            self.extensions.iter().chain(self.rare_extensions).any(|extension| *extension == found)
        })
    }
}

/// The extension of `path` in lower case.
pub(crate) fn lower_extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

impl fmt::Debug for Format {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_that_panics_costs_its_file_alone() {
        let file = tempfile::tempfile().expect("a file");
        let mut input = BufReader::new(file);
        let broken = Reading {
            kinds: "none",
            has_signature: |_| true,
            stored: |_| panic!("stored"),
            icc: |_| panic!("icc"),
            exif: |_| panic!("exif"),
            whole_fields: |_, _| panic!("fields"),
            pixels: |_, _| panic!("pixels"),
            reduced: None,
            pixel_bytes: |_| PLAIN_PIXEL_BYTES,
        };
        let stored = broken.stored(&mut input).map_err(|error| error.words().to_owned());
        assert_eq!(stored, Err("its decoder broke down".to_owned()));
        assert!(broken.icc(&mut input).is_none() && broken.exif(&mut input).is_none());
        assert!(broken.whole_fields(&mut input, &[]).is_none());
    }
}
