//! The EXIF fields that matter here, read alike from a TIFF's own directories and from an embedded EXIF block.

use std::io::{Read, Seek};

use exif::{Exif, In, Tag, Value};
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value as TiffValue;
use tiff::tags::Tag as TiffTag;

use super::maker_note;
use super::pose::StatedPose;
use crate::provenance::description::SOFTWARE;

/// EXIF 3.0 tag numbers read from a TIFF's EXIF directory (section 4.6).
const FOCAL_LENGTH: u16 = 0x920a;
const COLOR_SPACE: u16 = 0xa001;
const PIXEL_X_DIMENSION: u16 = 0xa002;
const PIXEL_Y_DIMENSION: u16 = 0xa003;
const FOCAL_PLANE_X_RESOLUTION: u16 = 0xa20e;
const FOCAL_PLANE_RESOLUTION_UNIT: u16 = 0xa210;
const CUSTOM_RENDERED: u16 = 0xa401;
const FOCAL_LENGTH_IN_35MM_FILM: u16 = 0xa405;
const LENS_MODEL: u16 = 0xa434;

/// CustomRendered of the panoramas that Apple's cameras make; EXIF 3.0 knows 0 and 1 alone.
const RENDERED_AS_PANORAMA: u32 = 6;
/// How what programs that stitch write as Software begins, in lower case; none of them writes photographs.
const STITCHERS: [&str; 7] =
    ["hugin", "ptgui", "microsoft ice", "image composite editor", "autopano", "kolor", "panoramastudio"];

/// EXIF fields as written, unjudged: numbers may be zero, infinite or absurd.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ExifFields {
    /// Orientation, 1 to 8 where valid.
    pub(crate) orientation: Option<u32>,
    /// PixelXDimension, pixels. Tools that reduce a photograph often leave it at the original's size.
    pub(crate) pixel_width: Option<f64>,
    /// PixelYDimension, pixels.
    pub(crate) pixel_height: Option<f64>,
    /// FocalLength, millimetres.
    pub(crate) focal_mm: Option<f64>,
    /// FocalLengthIn35mmFilm, millimetres.
    pub(crate) focal_35mm: Option<f64>,
    /// FocalPlaneXResolution, pixels per unit.
    pub(crate) focal_plane_resolution: Option<f64>,
    /// FocalPlaneResolutionUnit: 2 inch (also where absent), 3 centimetre, 4 millimetre, 5 micrometre.
    pub(crate) focal_plane_unit: Option<u32>,
    /// Make, trimmed.
    pub(crate) make: Option<String>,
    /// Model, trimmed.
    pub(crate) model: Option<String>,
    /// LensModel, trimmed.
    pub(crate) lens_model: Option<String>,
    /// Software, trimmed.
    pub(crate) software: Option<String>,
    /// CustomRendered: 0 by the common processing, others by a special one.
    pub(crate) custom_rendered: Option<u32>,
    /// ColorSpace: 1 sRGB, 65535 uncalibrated, by some cameras 2 for Adobe RGB.
    pub(crate) color_space: Option<u32>,
    /// InteroperabilityIndex, trimmed; not read from a TIFF's own directories.
    pub(crate) interoperability: Option<String>,
    /// The acceleration vector of Apple's maker note, in g; not read from a TIFF's own directories.
    pub(crate) apple_acceleration: Option<[f64; 3]>,
    /// How the camera was held, as XMP beside the EXIF has it; read from JPEG alone.
    pub(crate) pose: Option<StatedPose>,
}

impl ExifFields {
    /// The fields of an EXIF block.
    pub(crate) fn from_exif(exif: &Exif) -> Self {
        let value = |tag| exif.get_field(tag, In::PRIMARY).map(|field| &field.value);
        let number = |tag| value(tag).and_then(first_number);
        let text = |tag| match value(tag)? {
            Value::Ascii(lines) => trimmed(&String::from_utf8_lossy(lines.first()?)),
            _ => None,
        };
        Self {
            orientation: value(Tag::Orientation).and_then(|value| value.get_uint(0)),
            pixel_width: number(Tag::PixelXDimension),
            pixel_height: number(Tag::PixelYDimension),
            focal_mm: number(Tag::FocalLength),
            focal_35mm: number(Tag::FocalLengthIn35mmFilm),
            focal_plane_resolution: number(Tag::FocalPlaneXResolution),
            focal_plane_unit: value(Tag::FocalPlaneResolutionUnit).and_then(|value| value.get_uint(0)),
            make: text(Tag::Make),
            model: text(Tag::Model),
            lens_model: text(Tag::LensModel),
            software: text(Tag::Software),
            custom_rendered: value(Tag::CustomRendered).and_then(|value| value.get_uint(0)),
            color_space: value(Tag::ColorSpace).and_then(|value| value.get_uint(0)),
            interoperability: text(Tag::InteroperabilityIndex),
            apple_acceleration: match value(Tag::MakerNote) {
                Some(Value::Undefined(note, _)) => maker_note::apple_acceleration(note),
                _ => None,
            },
            pose: None,
        }
    }

    /// The fields of a TIFF's first directory and of the EXIF directory it points to.
    pub(crate) fn from_tiff<R: Read + Seek>(decoder: &mut Decoder<R>) -> Option<Self> {
        let text = |value: Option<TiffValue>| trimmed(&value?.into_string().ok()?);
        let mut fields = Self {
            orientation: decoder.find_tag_unsigned(TiffTag::Orientation).ok().flatten(),
            make: text(decoder.find_tag(TiffTag::Make).ok().flatten()),
            model: text(decoder.find_tag(TiffTag::Model).ok().flatten()),
            software: text(decoder.find_tag(TiffTag::Software).ok().flatten()),
            ..Self::default()
        };
        let pointer = decoder.find_tag(TiffTag::ExifDirectory).ok().flatten();
        let Some(pointer) = pointer.and_then(|value| value.into_ifd_pointer().ok()) else { return Some(fields) };
        let Ok(directory) = decoder.read_directory(pointer) else { return Some(fields) };
        let mut tags = decoder.read_directory_tags(&directory);
        fields.lens_model = text(tags.find_tag(TiffTag::from_u16_exhaustive(LENS_MODEL)).ok().flatten());
        let mut number = |tag| {
            let value = tags.find_tag(TiffTag::from_u16_exhaustive(tag)).ok().flatten()?;
            first_tiff_number(value)
        };
        fields.pixel_width = number(PIXEL_X_DIMENSION);
        fields.pixel_height = number(PIXEL_Y_DIMENSION);
        fields.focal_mm = number(FOCAL_LENGTH);
        fields.focal_35mm = number(FOCAL_LENGTH_IN_35MM_FILM);
        fields.focal_plane_resolution = number(FOCAL_PLANE_X_RESOLUTION);
        fields.color_space = number(COLOR_SPACE).map(|space| space as u32);
        fields.custom_rendered = number(CUSTOM_RENDERED).map(|rendered| rendered as u32);
        fields.focal_plane_unit = number(FOCAL_PLANE_RESOLUTION_UNIT).map(|unit| unit as u32);
        Some(fields)
    }

    /// Whether the picture names this program, of any version, as its maker.
    pub(crate) fn is_by_this_program(&self) -> bool {
        let program = SOFTWARE.split_whitespace().next();
        self.software.as_deref().is_some_and(|software| software.split_whitespace().next() == program)
    }

    /// Whether the picture names another program, or a camera's own processing, that makes panoramas.
    pub(crate) fn is_panorama_of_others(&self) -> bool {
        let software = self.software.as_deref().unwrap_or_default().to_lowercase();
        self.custom_rendered == Some(RENDERED_AS_PANORAMA) || STITCHERS.iter().any(|name| software.starts_with(name))
    }

    /// Make and model in one line. A model that names its maker already ("NIKON CORPORATION", "NIKON D7000") stands alone.
    pub(crate) fn camera_model(&self) -> Option<String> {
        let (Some(make), Some(model)) = (&self.make, &self.model) else {
            return self.model.clone().or_else(|| self.make.clone());
        };
        let maker = make.split_whitespace().next().unwrap_or_default();
        let names_maker = model.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case(maker));
        Some(if names_maker { model.clone() } else { format!("{make} {model}") })
    }
}

/// The first number of an EXIF value of any numeric type.
fn first_number(value: &Value) -> Option<f64> {
    match value {
        Value::Rational(ratios) => ratios.first().map(exif::Rational::to_f64),
        Value::SRational(ratios) => ratios.first().map(exif::SRational::to_f64),
        Value::Float(numbers) => numbers.first().map(|&number| f64::from(number)),
        Value::Double(numbers) => numbers.first().copied(),
        other => other.get_uint(0).map(f64::from),
    }
}

fn first_tiff_number(value: TiffValue) -> Option<f64> {
    match value {
        TiffValue::List(values) => first_tiff_number(values.into_iter().next()?),
        TiffValue::Rational(numerator, denominator) => Some(f64::from(numerator) / f64::from(denominator)),
        TiffValue::SRational(numerator, denominator) => Some(f64::from(numerator) / f64::from(denominator)),
        TiffValue::Float(number) => Some(f64::from(number)),
        TiffValue::Double(number) => Some(number),
        other => other.into_u32().ok().map(f64::from),
    }
}

/// Cameras pad these fields with blanks and zero bytes.
fn trimmed(text: &str) -> Option<String> {
    let text = text.trim_matches(|character: char| character.is_whitespace() || character == '\0');
    (!text.is_empty()).then(|| text.to_owned())
}
