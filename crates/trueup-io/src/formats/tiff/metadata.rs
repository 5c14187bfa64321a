//! Metadata in TIFF: tags of the picture's directory, and directories of their own for EXIF and the place.

use std::borrow::Cow;
use std::io::{Seek, Write};

use exif::{Context, Field, In, Value};
use tiff::encoder::{DirectoryEncoder, Rational, SRational, TiffEncoder, TiffKind, TiffValue};
use tiff::tags::{Tag, Type};
use tiff::{TiffError, TiffResult};

use crate::encode::metadata::Metadata;

/// Tag of the ICC profile (ICC.1:2022, annex B.5).
const ICC_PROFILE: u16 = 34_675;
/// Tag of the XMP packet (XMP specification part 3, section 3.1).
const XMP: u16 = 700;
/// Tags that point to directories (EXIF 3.0, section 4.6.3).
const EXIF_DIRECTORY: u16 = 34_665;
const GPS_DIRECTORY: u16 = 34_853;

/// Fields that describe how a JPEG is stored (EXIF 3.0, section 4.6.8); a TIFF has tags of its own for it.
pub(crate) const OF_JPEG: [exif::Tag; 4] = [
    exif::Tag::YCbCrPositioning,
    exif::Tag::ComponentsConfiguration,
    exif::Tag::PixelXDimension,
    exif::Tag::PixelYDimension,
];

/// Where the directories that hang on the picture's were written.
#[derive(Debug, Default)]
pub(super) struct HangingDirectories {
    fields: Vec<Field>,
    exif: Option<u64>,
    gps: Option<u64>,
}

/// Writes the directories of EXIF and place; to be called before the picture's directory is begun. An EXIF block that
/// cannot be read is left out.
pub(super) fn write_directories<W: Write + Seek, K: TiffKind>(
    encoder: &mut TiffEncoder<W, K>,
    metadata: &Metadata,
) -> TiffResult<HangingDirectories> {
    let exif = metadata.exif.clone().and_then(|bytes| exif::Reader::new().read_raw(bytes).ok());
    let Some(exif) = exif else { return Ok(HangingDirectories::default()) };
    let of = |context: Context| -> Vec<Field> {
        let wanted = exif.fields().filter(|field| {
            field.ifd_num == In::PRIMARY && field.tag.context() == context && !OF_JPEG.contains(&field.tag)
        });
        wanted.cloned().collect()
    };
    Ok(HangingDirectories {
        fields: of(Context::Tiff),
        exif: directory(encoder, &of(Context::Exif))?,
        gps: directory(encoder, &of(Context::Gps))?,
    })
}

fn directory<W: Write + Seek, K: TiffKind>(
    encoder: &mut TiffEncoder<W, K>,
    fields: &[Field],
) -> TiffResult<Option<u64>> {
    if fields.is_empty() {
        return Ok(None);
    }
    let mut directory = encoder.extra_directory()?;
    fields.iter().try_for_each(|field| write_field(&mut directory, field))?;
    Ok(Some(directory.finish_with_offsets()?.pointer.0))
}

/// Adds the metadata's tags to the picture's directory, the profile unless the samples are linear light. Tags that
/// describe the picture's storage are the writer's own.
pub(super) fn write_tags<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    metadata: &Metadata,
    hanging: &HangingDirectories,
    with_profile: bool,
) -> TiffResult<()> {
    hanging.fields.iter().try_for_each(|field| write_field(directory, field))?;
    for (tag, place) in [(EXIF_DIRECTORY, hanging.exif), (GPS_DIRECTORY, hanging.gps)] {
        let Some(place) = place else { continue };
        match u32::try_from(place) {
            Ok(place) => directory.write_tag(Tag::Unknown(tag), place)?,
            Err(_) => directory.write_tag(Tag::Unknown(tag), place)?,
        }
    }
    if with_profile {
        directory.write_tag(Tag::Unknown(ICC_PROFILE), Undefined(metadata.profile()))?;
    }
    if let Some(xmp) = &metadata.xmp {
        directory.write_tag(Tag::Unknown(XMP), xmp.as_bytes())?;
    }
    Ok(())
}

/// Bytes without a type.
struct Undefined<'a>(&'a [u8]);

impl TiffValue for Undefined<'_> {
    const BYTE_LEN: u8 = 1;
    const FIELD_TYPE: Type = Type::UNDEFINED;

    fn count(&self) -> usize {
        self.0.len()
    }

    fn data(&self) -> Cow<'_, [u8]> {
        self.0.into()
    }
}

/// Text as EXIF has it: bytes that a zero ends.
pub(super) struct Ascii(pub(super) Vec<u8>);

impl TiffValue for Ascii {
    const BYTE_LEN: u8 = 1;
    const FIELD_TYPE: Type = Type::ASCII;

    fn count(&self) -> usize {
        self.0.len()
    }

    fn data(&self) -> Cow<'_, [u8]> {
        (&self.0[..]).into()
    }
}

fn write_field<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    field: &Field,
) -> Result<(), TiffError> {
    let tag = Tag::from_u16_exhaustive(field.tag.number());
    match &field.value {
        Value::Byte(bytes) => directory.write_tag(tag, &bytes[..]),
        Value::Ascii(texts) => {
            let mut bytes: Vec<u8> = texts.join(&0);
            bytes.push(0);
            directory.write_tag(tag, Ascii(bytes))
        }
        Value::Short(numbers) => directory.write_tag(tag, &numbers[..]),
        Value::Long(numbers) => directory.write_tag(tag, &numbers[..]),
        Value::Rational(ratios) => {
            let ratios: Vec<Rational> = ratios.iter().map(|one| Rational { n: one.num, d: one.denom }).collect();
            directory.write_tag(tag, &ratios[..])
        }
        Value::SRational(ratios) => {
            let ratios: Vec<SRational> = ratios.iter().map(|one| SRational { n: one.num, d: one.denom }).collect();
            directory.write_tag(tag, &ratios[..])
        }
        Value::Undefined(bytes, _) => directory.write_tag(tag, Undefined(bytes)),
        // The panorama's EXIF has no others.
        _ => Ok(()),
    }
}
