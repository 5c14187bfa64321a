//! The EXIF block of a panorama.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{Field, In, Rational, Tag, Value};

use super::description::{PanoramaDescription, PanoramaPart, SOFTWARE};
use super::fields::is_of_place;
use super::taken::Moment;

/// What is kept of the reference photograph as it stands: who made it, and with what.
///
/// Left out on purpose: the focal length in 35 mm film and the subject's place, which speak of another field of view;
/// the thumbnail and the maker's notes, which speak of the photograph; identities of the one file and serial numbers.
const KEPT: [Tag; 28] = [
    Tag::Make,
    Tag::Model,
    Tag::Artist,
    Tag::Copyright,
    Tag::ExposureTime,
    Tag::FNumber,
    Tag::ExposureProgram,
    Tag::PhotographicSensitivity,
    Tag::SensitivityType,
    Tag::RecommendedExposureIndex,
    Tag::ShutterSpeedValue,
    Tag::ApertureValue,
    Tag::ExposureBiasValue,
    Tag::MaxApertureValue,
    Tag::MeteringMode,
    Tag::LightSource,
    Tag::Flash,
    Tag::FocalLength,
    Tag::SensingMethod,
    Tag::ExposureMode,
    Tag::WhiteBalance,
    Tag::SceneCaptureType,
    Tag::Contrast,
    Tag::Saturation,
    Tag::Sharpness,
    Tag::LensSpecification,
    Tag::LensMake,
    Tag::LensModel,
];

/// What is kept of the place. The direction of view and the speed are the one photograph's.
const PLACE: [Tag; 10] = [
    Tag::GPSVersionID,
    Tag::GPSLatitudeRef,
    Tag::GPSLatitude,
    Tag::GPSLongitudeRef,
    Tag::GPSLongitude,
    Tag::GPSAltitudeRef,
    Tag::GPSAltitude,
    Tag::GPSMapDatum,
    Tag::GPSTimeStamp,
    Tag::GPSDateStamp,
];

/// What is asked of the time and of the compass beside them.
const ASKED: [Tag; 4] = [Tag::DateTimeOriginal, Tag::SubSecTimeOriginal, Tag::OffsetTimeOriginal, Tag::GPSImgDirection];

/// All that is to be read of a photograph.
pub(super) fn read() -> Vec<Tag> {
    KEPT.into_iter().chain(PLACE).chain(ASKED).collect()
}

/// Fields longer than this are no camera's name nor number; bytes. With all of them, a block fits a JPEG segment.
const LONGEST: usize = 1024;

/// EXIF 2.32, whose fields are used.
const VERSION: &[u8] = b"0232";

/// The version that every block states.
const FLASHPIX: &[u8] = b"0100";
/// Color samples lie in the middle of the pixels they belong to, as means of them do.
const CENTERD: u16 = 1;
/// The order of components: Y, Cb, Cr, none.
const YCBCR: [u8; 4] = [1, 2, 3, 0];

/// ColorSpace of sRGB and of all others.
const SRGB: u16 = 1;
const UNCALIBRATED: u16 = 0xffff;

/// The panorama's own fields, and what is kept of the photographs': `reference` and `place` are the fields of those
/// that tell of the camera and the place.
pub(super) fn fields(
    panorama: &PanoramaDescription<'_>,
    reference: &[Field],
    place: &[Field],
    earliest: Option<&Moment>,
) -> Vec<Field> {
    let short_enough = |field: &&Field| length(&field.value) <= LONGEST && field.ifd_num == In::PRIMARY;
    let camera = reference.iter().filter(|field| KEPT.contains(&field.tag));
    let place = place.iter().filter(|field| is_of_place(field) && PLACE.contains(&field.tag));
    let mut fields: Vec<Field> = camera.chain(place).filter(short_enough).cloned().collect();

    let mut add = |tag, value| fields.push(Field { tag, ifd_num: In::PRIMARY, value });
    add(Tag::Software, ascii(SOFTWARE));
    add(Tag::Orientation, Value::Short(vec![1]));
    add(Tag::ExifVersion, Value::Undefined(VERSION.to_vec(), 0));
    add(Tag::ColorSpace, Value::Short(vec![if panorama.is_srgb { SRGB } else { UNCALIBRATED }]));
    for (tag, size) in [(Tag::PixelXDimension, panorama.width), (Tag::PixelYDimension, panorama.height)] {
        add(tag, Value::Long(vec![u32::try_from(size).unwrap_or(u32::MAX)]));
    }
    // Fields that every EXIF block has: without a meaning for a picture on a screen, the number is the usual one.
    const DOTS_PER_INCH: Rational = Rational { num: 72, denom: 1 };
    const INCH: u16 = 2;
    for tag in [Tag::XResolution, Tag::YResolution] {
        add(tag, Value::Rational(vec![DOTS_PER_INCH]));
    }
    add(Tag::ResolutionUnit, Value::Short(vec![INCH]));
    add(Tag::FlashpixVersion, Value::Undefined(FLASHPIX.to_vec(), 0));
    // How a JPEG stores colors; the other formats have no such thing, and readers pass over it.
    add(Tag::YCbCrPositioning, Value::Short(vec![CENTERD]));
    add(Tag::ComponentsConfiguration, Value::Undefined(YCBCR.to_vec(), 0));
    if let Some(moment) = earliest {
        add(Tag::DateTimeOriginal, ascii(&moment.local));
        if let Some(digits) = &moment.subseconds {
            add(Tag::SubSecTimeOriginal, ascii(digits));
        }
        if let Some(offset) = &moment.offset {
            add(Tag::OffsetTimeOriginal, ascii(offset));
        }
    }
    fields
}

fn ascii(text: &str) -> Value {
    Value::Ascii(vec![text.as_bytes().to_vec()])
}

/// The block that says what is written beside a panorama, and names this program as the maker.
pub(super) fn part_block(part: PanoramaPart) -> Option<Vec<u8>> {
    let texts = [(Tag::ImageDescription, part.description()), (Tag::Software, SOFTWARE)];
    block(&texts.map(|(tag, text)| Field { tag, ifd_num: In::PRIMARY, value: ascii(text) }))
}

/// The block of these fields; `None` if they cannot be written.
pub(super) fn block(fields: &[Field]) -> Option<Vec<u8>> {
    let mut writer = Writer::new();
    fields.iter().for_each(|field| writer.push_field(field));
    let mut bytes = Cursor::new(Vec::new());
    writer.write(&mut bytes, true).ok()?;
    Some(bytes.into_inner())
}

/// Bytes of a value, about; more than any limit for types that no kept field has.
fn length(value: &Value) -> usize {
    match value {
        Value::Byte(bytes) | Value::Undefined(bytes, _) => bytes.len(),
        Value::Ascii(texts) => texts.iter().map(|text| text.len() + 1).sum(),
        Value::Short(numbers) => 2 * numbers.len(),
        Value::Long(numbers) => 4 * numbers.len(),
        Value::Rational(ratios) => 8 * ratios.len(),
        Value::SRational(ratios) => 8 * ratios.len(),
        _ => usize::MAX,
    }
}
