//! The directory of a page of a TIFF.

use std::io::{Seek, Write};

use tiff::encoder::{DirectoryEncoder, Rational, TiffKind};
use tiff::tags::{
    CompressionMethod, ExtraSamples, PhotometricInterpretation, PlanarConfiguration, Predictor, ResolutionUnit,
    SampleFormat, Tag,
};

use super::blocks::{BlockForm, StoredBlocks, failure};
use super::metadata::{Ascii, HangingDirectories, write_tags};
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::Depth;
use crate::encode::samples::RGBA;

/// How a page is cut into blocks.
#[derive(Debug, Clone, Copy)]
pub(super) enum BlockLayout {
    /// Strips of so many rows.
    Strips(usize),
    /// Square tiles of this side.
    Tiles(usize),
}

/// What a page is, beside its pixels.
#[derive(Clone, Copy)]
pub(super) struct PageTags<'a> {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Whether it is a smaller copy of the page before.
    pub(super) is_reduced: bool,
    pub(super) blocks: BlockLayout,
    pub(super) form: BlockForm,
    pub(super) place: Option<&'a PagePlace<'a>>,
    /// What it tells beside its pixels.
    pub(super) metadata: Option<PageMetadata<'a>>,
}

/// What a page tells of its picture.
#[derive(Clone, Copy)]
pub(super) struct PageMetadata<'a> {
    pub(super) metadata: &'a Metadata,
    /// The directories of it that are in the file already.
    pub(super) hanging: &'a HangingDirectories,
}

/// Where a page lies among others.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PagePlace<'a> {
    pub(crate) name: &'a str,
    /// Number of the page, from 0, and of all.
    pub(crate) number: [u16; 2],
    /// Its corner in the whole picture, in pixels.
    pub(crate) corner: [u32; 2],
    /// Size of the whole picture.
    pub(crate) whole: [u32; 2],
}

/// Pixels per inch that pages with a place state: the place is told in inches, as a fraction with this denominator,
/// which gives back whole pixels.
const PIXELS_PER_INCH: u32 = 72;

/// Tags of TIFF 6.0 section 12 that the `tiff` crate has no names for.
const PAGE_NAME: Tag = Tag::Unknown(285);
const X_POSITION: Tag = Tag::Unknown(286);
const Y_POSITION: Tag = Tag::Unknown(287);
const PAGE_NUMBER: Tag = Tag::Unknown(297);
/// Size of the picture that a page was cropped from: tags that Pixar registered and stitchers use.
const FULL_WIDTH: Tag = Tag::Unknown(33300);
const FULL_HEIGHT: Tag = Tag::Unknown(33301);

/// NewSubfileType of a smaller copy of another page, and of one of several pages (TIFF 6.0 section 8).
const REDUCED: u32 = 1;
const ONE_OF_SEVERAL: u32 = 2;

/// Writes the directory of a page whose pixels are in the file.
pub(super) fn write_directory<W: Write + Seek, K: TiffKind>(
    mut directory: DirectoryEncoder<'_, W, K>,
    page: PageTags<'_>,
    stored: &StoredBlocks,
) -> Result<(), WriteFailure> {
    let channels = page.form.channels;
    let is_float = page.form.depth == Depth::Float;
    let bits = 8 * u16::from(page.form.depth.sample_bytes());
    let (method, predictor) = match page.form.deflate {
        true if is_float => (CompressionMethod::Deflate, Predictor::FloatingPoint),
        true => (CompressionMethod::Deflate, Predictor::Horizontal),
        false => (CompressionMethod::None, Predictor::None),
    };
    let codes = [
        (Tag::Compression, method.to_u16()),
        (Tag::Predictor, predictor.to_u16()),
        (Tag::PhotometricInterpretation, PhotometricInterpretation::RGB.to_u16()),
        (Tag::SamplesPerPixel, channels as u16),
        (Tag::PlanarConfiguration, PlanarConfiguration::Chunky.to_u16()),
    ];
    for (tag, code) in codes {
        directory.write_tag(tag, code).map_err(failure)?;
    }
    if channels == RGBA {
        directory.write_tag(Tag::ExtraSamples, ExtraSamples::UnassociatedAlpha.to_u16()).map_err(failure)?;
    }
    let subfile = match (page.is_reduced, page.place) {
        (true, _) => REDUCED,
        (false, Some(_)) => ONE_OF_SEVERAL,
        (false, None) => 0,
    };
    let sizes = [(Tag::NewSubfileType, subfile), (Tag::ImageWidth, page.width), (Tag::ImageLength, page.height)];
    for (tag, size) in sizes {
        directory.write_tag(tag, size).map_err(failure)?;
    }
    directory.write_tag(Tag::BitsPerSample, &vec![bits; channels][..]).map_err(failure)?;
    let sample_format = if is_float { SampleFormat::IEEEFP } else { SampleFormat::Uint };
    directory.write_tag(Tag::SampleFormat, &vec![sample_format; channels][..]).map_err(failure)?;
    write_blocks(&mut directory, page.blocks, stored)?;
    if let Some(place) = page.place {
        write_place(&mut directory, place)?;
    }
    if let Some(PageMetadata { metadata, hanging }) = page.metadata {
        // A profile describes encoded samples; floating point numbers are linear light.
        write_tags(&mut directory, metadata, hanging, !is_float).map_err(failure)?;
    }
    directory.finish().map_err(failure)
}

fn write_blocks<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    blocks: BlockLayout,
    stored: &StoredBlocks,
) -> Result<(), WriteFailure> {
    let (offsets, lengths) = match blocks {
        BlockLayout::Strips(rows) => {
            directory.write_tag(Tag::RowsPerStrip, rows as u32).map_err(failure)?;
            (Tag::StripOffsets, Tag::StripByteCounts)
        }
        BlockLayout::Tiles(side) => {
            directory.write_tag(Tag::TileWidth, side as u32).map_err(failure)?;
            directory.write_tag(Tag::TileLength, side as u32).map_err(failure)?;
            (Tag::TileOffsets, Tag::TileByteCounts)
        }
    };
    write_numbers(directory, offsets, &stored.offsets)?;
    write_numbers(directory, lengths, &stored.lengths)
}

/// Writes offsets or lengths in 32 bits where they fit, as classic TIFF demands, else in 64.
fn write_numbers<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    tag: Tag,
    values: &[u64],
) -> Result<(), WriteFailure> {
    let short: Result<Vec<u32>, _> = values.iter().map(|&value| u32::try_from(value)).collect();
    match short {
        Ok(values) => directory.write_tag(tag, &values[..]),
        Err(_) => directory.write_tag(tag, values),
    }
    .map_err(failure)
}

fn write_place<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    place: &PagePlace<'_>,
) -> Result<(), WriteFailure> {
    let resolution = Rational { n: PIXELS_PER_INCH, d: 1 };
    let inches = |pixels: u32| Rational { n: pixels, d: PIXELS_PER_INCH };
    let rationals = [
        (Tag::XResolution, resolution.clone()),
        (Tag::YResolution, resolution),
        (X_POSITION, inches(place.corner[0])),
        (Y_POSITION, inches(place.corner[1])),
    ];
    for (tag, value) in rationals {
        directory.write_tag(tag, value).map_err(failure)?;
    }
    directory.write_tag(Tag::ResolutionUnit, ResolutionUnit::Inch).map_err(failure)?;
    directory.write_tag(PAGE_NUMBER, &place.number[..]).map_err(failure)?;
    directory.write_tag(FULL_WIDTH, place.whole[0]).map_err(failure)?;
    directory.write_tag(FULL_HEIGHT, place.whole[1]).map_err(failure)?;
    // Names beyond ASCII are written in UTF-8, as programs do although the standard has no word for it.
    let bytes: Vec<u8> = place.name.bytes().filter(|&byte| byte != 0).chain([0]).collect();
    directory.write_tag(PAGE_NAME, Ascii(bytes)).map_err(failure)
}
