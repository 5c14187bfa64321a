//! Whole EXIF fields of a file, to be handed on.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use exif::{Context, Field, In, Tag, Value};
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value as TiffValue;
use tiff::tags::{IfdPointer, Tag as TiffTag};

use super::read_exif_block;
use crate::format::{PictureFormat, read_start};

/// The fields of these tags that a file has, of the picture itself. A file that cannot be read has none; damaged fields are
/// left out.
pub(crate) fn read_fields(path: &Path, wanted: &[Tag]) -> Vec<Field> {
    try_read(path, wanted).unwrap_or_default()
}

fn try_read(path: &Path, wanted: &[Tag]) -> Option<Vec<Field>> {
    let mut file = File::open(path).ok()?;
    let format = PictureFormat::of_content(&read_start(&mut file).ok()?)?;
    let mut reader = BufReader::new(file);
    reader.rewind().ok()?;
    if format == PictureFormat::Tiff {
        return from_tiff(&mut Decoder::new(reader).ok()?, wanted);
    }
    let exif = read_exif_block(&mut reader)?;
    let fields = wanted.iter().filter_map(|&tag| exif.get_field(tag, In::PRIMARY)).cloned();
    Some(fields.collect())
}

/// From a TIFF's own directories.
fn from_tiff<R: Read + Seek>(decoder: &mut Decoder<R>, wanted: &[Tag]) -> Option<Vec<Field>> {
    let mut fields = Vec::new();
    for &tag in wanted.iter().filter(|tag| tag.context() == Context::Tiff) {
        let value = decoder.find_tag(TiffTag::from_u16_exhaustive(tag.number())).ok().flatten();
        fields.extend(value.and_then(converted).map(|value| Field { tag, ifd_num: In::PRIMARY, value }));
    }
    for (context, pointer) in [(Context::Exif, TiffTag::ExifDirectory), (Context::Gps, TiffTag::GpsDirectory)] {
        let pointer: Option<IfdPointer> =
            decoder.find_tag(pointer).ok().flatten().and_then(|value| value.into_ifd_pointer().ok());
        let Some(Ok(directory)) = pointer.map(|pointer| decoder.read_directory(pointer)) else { continue };
        let mut tags = decoder.read_directory_tags(&directory);
        for &tag in wanted.iter().filter(|tag| tag.context() == context) {
            let value = tags.find_tag(TiffTag::from_u16_exhaustive(tag.number())).ok().flatten();
            fields.extend(value.and_then(converted).map(|value| Field { tag, ifd_num: In::PRIMARY, value }));
        }
    }
    Some(fields)
}

/// The same value in the words of the EXIF library; `None` for types that EXIF has not, or lists of several.
fn converted(value: TiffValue) -> Option<Value> {
    let values = match value {
        TiffValue::Ascii(text) => {
            let text = text.trim_end_matches('\0').as_bytes().to_vec();
            return Some(Value::Ascii(vec![text]));
        }
        TiffValue::List(values) => values,
        one => vec![one],
    };
    match values.first()? {
        TiffValue::Byte(_) => all(values, |value| value.into_u8().ok()).map(Value::Byte),
        TiffValue::Short(_) => all(values, |value| value.into_u16().ok()).map(Value::Short),
        TiffValue::Unsigned(_) => all(values, |value| value.into_u32().ok()).map(Value::Long),
        TiffValue::Rational(..) => all(values, |value| match value {
            TiffValue::Rational(num, denom) => Some(exif::Rational { num, denom }),
            _ => None,
        })
        .map(Value::Rational),
        TiffValue::SRational(..) => all(values, |value| match value {
            TiffValue::SRational(num, denom) => Some(exif::SRational { num, denom }),
            _ => None,
        })
        .map(Value::SRational),
        _ => None,
    }
}

fn all<T>(values: Vec<TiffValue>, convert: impl Fn(TiffValue) -> Option<T>) -> Option<Vec<T>> {
    values.into_iter().map(convert).collect()
}
