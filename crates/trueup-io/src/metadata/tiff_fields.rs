//! Whole EXIF fields from a TIFF's own directories.

use std::io::{Read, Seek};

use exif::{Context, Field, In, Tag, Value};
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value as TiffValue;
use tiff::tags::{IfdPointer, Tag as TiffTag};

/// The fields of these tags.
pub(crate) fn read<R: Read + Seek>(decoder: &mut Decoder<R>, wanted: &[Tag]) -> Option<Vec<Field>> {
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
