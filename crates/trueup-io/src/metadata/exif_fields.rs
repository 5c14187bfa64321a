//! The EXIF fields that matter here, read alike from a TIFF's own directories and from an embedded EXIF block.

use std::io::{Read, Seek};

use exif::{Exif, In, Tag, Value};
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value as TiffValue;
use tiff::tags::Tag as TiffTag;
use trueup_core::source::RecordedExposure;

use super::maker_note;
use super::pose::StatedPose;
use crate::provenance::description::{PanoramaPart, SOFTWARE};

/// EXIF 3.0 tag numbers read from a TIFF's EXIF directory (section 4.6).
const EXPOSURE_TIME: u16 = 0x829a;
const F_NUMBER: u16 = 0x829d;
const SENSITIVITY: u16 = 0x8827;
const DATE_TIME_ORIGINAL: u16 = 0x9003;
const SUBSECONDS_ORIGINAL: u16 = 0x9291;
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
    /// The orientation that was recorded, where the file says itself how its pixels are turned, and this is not
    /// applied: gravity was recorded before that turn.
    pub(crate) turned_by: Option<u32>,
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
    /// ExposureTime, seconds.
    pub(crate) exposure_time: Option<f64>,
    /// FNumber.
    pub(crate) f_number: Option<f64>,
    /// PhotographicSensitivity (ISO).
    pub(crate) sensitivity: Option<f64>,
    /// DateTimeOriginal, trimmed.
    pub(crate) taken: Option<String>,
    /// SubSecTimeOriginal, trimmed: digits behind the seconds' decimal point.
    pub(crate) taken_subseconds: Option<String>,
    /// Make, trimmed.
    pub(crate) make: Option<String>,
    /// Model, trimmed.
    pub(crate) model: Option<String>,
    /// LensModel, trimmed.
    pub(crate) lens_model: Option<String>,
    /// ImageDescription, trimmed.
    pub(crate) description: Option<String>,
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
            turned_by: None,
            pixel_width: number(Tag::PixelXDimension),
            pixel_height: number(Tag::PixelYDimension),
            focal_mm: number(Tag::FocalLength),
            focal_35mm: number(Tag::FocalLengthIn35mmFilm),
            focal_plane_resolution: number(Tag::FocalPlaneXResolution),
            focal_plane_unit: value(Tag::FocalPlaneResolutionUnit).and_then(|value| value.get_uint(0)),
            exposure_time: number(Tag::ExposureTime),
            f_number: number(Tag::FNumber),
            sensitivity: number(Tag::PhotographicSensitivity),
            taken: text(Tag::DateTimeOriginal),
            taken_subseconds: text(Tag::SubSecTimeOriginal),
            make: text(Tag::Make),
            model: text(Tag::Model),
            lens_model: text(Tag::LensModel),
            description: text(Tag::ImageDescription),
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
            description: text(decoder.find_tag(TiffTag::ImageDescription).ok().flatten()),
            software: text(decoder.find_tag(TiffTag::Software).ok().flatten()),
            ..Self::default()
        };
        let pointer = decoder.find_tag(TiffTag::ExifDirectory).ok().flatten();
        let Some(pointer) = pointer.and_then(|value| value.into_ifd_pointer().ok()) else { return Some(fields) };
        let Ok(directory) = decoder.read_directory(pointer) else { return Some(fields) };
        let mut tags = decoder.read_directory_tags(&directory);
        let mut text_of = |tag| text(tags.find_tag(TiffTag::from_u16_exhaustive(tag)).ok().flatten());
        fields.lens_model = text_of(LENS_MODEL);
        fields.taken = text_of(DATE_TIME_ORIGINAL);
        fields.taken_subseconds = text_of(SUBSECONDS_ORIGINAL);
        let mut number = |tag| {
            let value = tags.find_tag(TiffTag::from_u16_exhaustive(tag)).ok().flatten()?;
            first_tiff_number(value)
        };
        fields.exposure_time = number(EXPOSURE_TIME);
        fields.f_number = number(F_NUMBER);
        fields.sensitivity = number(SENSITIVITY);
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

    /// The same of a file whose pixels are turned as it says itself.
    pub(crate) fn turned_already(self) -> Self {
        Self { orientation: None, turned_by: self.orientation, ..self }
    }

    /// The same without a color space: of a file that says itself what its colors are, or whose pixels are handed out
    /// in others.
    pub(crate) fn without_color_space(self) -> Self {
        Self { color_space: None, interoperability: None, ..self }
    }

    /// How it was exposed. Moments without a digit other than 0 are those of a clock that was never set.
    pub(crate) fn exposure(&self) -> RecordedExposure {
        let positive = |value: Option<f64>| value.filter(|value| value.is_finite() && *value > 0.0);
        let light = positive(self.exposure_time)
            .zip(positive(self.sensitivity))
            .zip(positive(self.f_number))
            .map(|((seconds, sensitivity), f_number)| (seconds * sensitivity / (f_number * f_number)).log2());
        let is_set = |text: &&String| text.bytes().any(|byte| (b'1'..=b'9').contains(&byte));
        let taken = self.taken.as_ref().filter(is_set).map(|second| match &self.taken_subseconds {
            Some(fraction) => format!("{second}.{fraction}"),
            None => second.clone(),
        });
        RecordedExposure { stops: light.filter(|stops| stops.is_finite()), taken }
    }

    /// Whether the picture names this program, of any version, as its maker.
    pub(crate) fn is_by_this_program(&self) -> bool {
        let program = SOFTWARE.split_whitespace().next();
        self.software.as_deref().is_some_and(|software| software.split_whitespace().next() == program)
    }

    /// What of this program's the picture is, for a sentence, if it names it as its maker.
    pub(crate) fn own_output(&self) -> Option<&'static str> {
        let description = self.description.as_deref();
        let part = PanoramaPart::ALL.into_iter().find(|part| description == Some(part.description()));
        self.is_by_this_program().then_some(match part {
            None => "it is a panorama that this program made",
            Some(PanoramaPart::Layers) => "it holds the layers of a panorama that this program made",
            Some(PanoramaPart::Seams) => "it shows the seams of a panorama that this program made",
        })
    }

    /// Whether the picture names another program, or a camera's own processing, that makes panoramas.
    pub(crate) fn is_panorama_of_others(&self) -> bool {
        let software = self.software.as_deref().unwrap_or_default().to_lowercase();
        self.custom_rendered == Some(RENDERED_AS_PANORAMA) || STITCHERS.iter().any(|name| software.starts_with(name))
    }

    /// Make and model in one line. A model that names its maker already ("NIKON CORPORATION", "NIKON D7000") stands
    /// alone.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// 1/250 s at ISO 200 and f/4: 0.8 / 16 = 0.05, of which the logarithm to base 2 is -4.3219.
    #[test]
    fn an_exposure_is_told_in_stops_and_its_moment_with_its_fraction() {
        let fields = ExifFields {
            exposure_time: Some(1.0 / 250.0),
            sensitivity: Some(200.0),
            f_number: Some(4.0),
            taken: Some("2024:05:04 10:00:01".to_owned()),
            taken_subseconds: Some("25".to_owned()),
            ..ExifFields::default()
        };
        let exposure = fields.exposure();
        assert!(exposure.stops.is_some_and(|stops| (stops + 4.321_928).abs() < 1e-6), "{exposure:?}");
        assert_eq!(exposure.taken.as_deref(), Some("2024:05:04 10:00:01.25"));
        let unset = ExifFields { f_number: Some(0.0), taken: Some("0000:00:00 00:00:00".to_owned()), ..fields };
        assert_eq!(unset.exposure(), RecordedExposure::default());
    }
}
