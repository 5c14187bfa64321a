//! What a panorama tells of the photographs it is made of: EXIF and XMP.
//!
//! [`describe`] gathers it from the files. Of the reference photograph come camera, lens and exposure; the time is that of
//! the earliest photograph, and the place the reference's, or that of the first photograph that knows it.

mod gpano;
mod record;
mod taken;
#[cfg(test)]
mod tests;

use std::path::Path;

use exif::{Context, Field, In, Tag, Value};
use rayon::prelude::*;
use trueup_core::spherical::SphericalFrame;

use crate::encode::{Metadata, MetadataKept};
use crate::metadata::read_fields;
use taken::Moment;

/// The name the panorama bears as its maker.
pub const SOFTWARE: &str = concat!("trueup ", env!("CARGO_PKG_VERSION"));

/// A finished panorama, as its metadata see it.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The files of the photographs in it.
    pub photographs: &'a [&'a Path],
    /// Position of the reference among them.
    pub reference: usize,
    /// Direction of each photograph in the levelled world, radians to the right of its z axis; `None` where unknown.
    pub yaws: &'a [Option<f64>],
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Whether it is written in sRGB.
    pub is_srgb: bool,
    /// Where it lies on the sphere, if viewers are to know.
    pub spherical: Option<SphericalFrame>,
    /// How the whole sphere's middle is turned against the level world, degrees: upwards, and clockwise as a head is, so
    /// that the horizon turns anticlockwise. Zero for a panorama that stands upright.
    pub pose_deg: [f64; 2],
}

/// What one photograph's EXIF tells.
struct Told {
    fields: Vec<Field>,
    moment: Option<Moment>,
}

impl Told {
    fn of(path: &Path) -> Self {
        let fields = read_fields(path, &record::read());
        let moment = Moment::of(&fields);
        Self { fields, moment }
    }

    fn knows_place(&self) -> bool {
        [Tag::GPSLatitude, Tag::GPSLongitude].iter().all(|&tag| value(&self.fields, tag).is_some())
    }

    /// Direction of view, degrees clockwise from true north. Magnetic north is another by some degrees, unknown here.
    fn heading_deg(&self) -> Option<f64> {
        let Value::Rational(ratios) = value(&self.fields, Tag::GPSImgDirection)? else { return None };
        let heading = ratios.first()?.to_f64();
        (0.0..=360.0).contains(&heading).then_some(heading)
    }
}

/// The metadata of a panorama but for its color profile. Photographs whose EXIF cannot be read tell nothing.
pub fn describe(subject: &Subject<'_>, kept: MetadataKept) -> Metadata {
    if kept == MetadataKept::None {
        let nothing = gpano::Facts::default();
        let xmp = subject.spherical.and_then(|frame| gpano::packet(subject, Some(&frame), &nothing));
        return Metadata { xmp, ..Metadata::default() };
    }
    let told: Vec<Told> = subject.photographs.par_iter().map(|path| Told::of(path)).collect();
    let (earliest, latest) = taken::span(told.iter().filter_map(|one| one.moment.as_ref()));
    let reference = told.get(subject.reference);
    let place = reference.filter(|one| one.knows_place()).or_else(|| told.iter().find(|one| one.knows_place()));
    let with_place = kept == MetadataKept::Keep;
    let fields = record::fields(
        subject,
        reference.map_or(&[], |one| &one.fields),
        place.filter(|_| with_place).map_or(&[], |one| &one.fields),
        earliest.as_ref(),
    );
    let facts = gpano::Facts {
        photographs: subject.photographs.len(),
        software: Some(SOFTWARE),
        earliest,
        latest,
        world_heading_deg: if with_place { world_heading_deg(&told, subject.yaws) } else { None },
    };
    let xmp = gpano::packet(subject, subject.spherical.as_ref(), &facts);
    Metadata { exif: record::block(&fields), icc: None, xmp }
}

/// Compass heading of the levelled world's z axis: what the photographs' compasses say, each less its own direction in
/// that world; their mean, since compasses in telephones are off by degrees.
fn world_heading_deg(told: &[Told], yaws: &[Option<f64>]) -> Option<f64> {
    let turns = told.iter().zip(yaws).filter_map(|(one, yaw)| Some(one.heading_deg()?.to_radians() - (*yaw)?));
    let (mut sine, mut cosine) = (0.0, 0.0);
    for turn in turns {
        sine += turn.sin();
        cosine += turn.cos();
    }
    // Compasses that contradict each other tell nothing.
    const LEAST: f64 = 1e-6;
    (f64::hypot(sine, cosine) > LEAST).then(|| sine.atan2(cosine).to_degrees().rem_euclid(360.0))
}

/// The value of a field of the picture itself, not of its thumbnail.
fn value(fields: &[Field], tag: Tag) -> Option<&Value> {
    fields.iter().find(|field| field.tag == tag && field.ifd_num == In::PRIMARY).map(|field| &field.value)
}

/// The text of a field.
fn text(fields: &[Field], tag: Tag) -> Option<String> {
    let Value::Ascii(lines) = value(fields, tag)? else { return None };
    let text = String::from_utf8_lossy(lines.first()?).trim().to_owned();
    (!text.is_empty()).then_some(text)
}

/// Whether a field belongs to the place.
fn is_of_place(field: &Field) -> bool {
    field.tag.context() == Context::Gps
}
