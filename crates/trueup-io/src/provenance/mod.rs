//! What a panorama tells of the photographs it is made of: EXIF and XMP; and what is written beside it, of its maker
//! ([`of_part`]).
//!
//! [`describe`] gathers it from the files. Of the reference photograph come camera, lens and exposure; the time is that
//! of the earliest photograph, and the place the reference's, or that of the first photograph that knows it.

pub(crate) mod description;
mod fields;
mod gpano;
mod record;
mod taken;
#[cfg(test)]
mod tests;

use std::path::Path;

use exif::{Field, Tag, Value};
use rayon::prelude::*;

use crate::encode::metadata::Metadata;
use crate::encode::options::MetadataKept;
use crate::metadata::header::read_fields;
use fields::value;
use taken::Moment;

pub use description::{PanoramaDescription, PanoramaPart, SOFTWARE};

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

/// When a photograph was taken by its camera's clock, as its EXIF has it: seconds since the beginning of the year 1970
/// in local time; `None` if it does not say.
pub fn seconds_taken(path: &Path) -> Option<f64> {
    Moment::of(&read_fields(path, &record::read()))?.seconds()
}

/// The metadata of a panorama but for its color profile. Photographs whose EXIF cannot be read tell nothing.
pub fn describe(panorama: &PanoramaDescription<'_>, kept: MetadataKept) -> Metadata {
    if kept == MetadataKept::None {
        let nothing = gpano::Facts::default();
        let xmp = panorama.spherical.and_then(|frame| gpano::packet(panorama, Some(&frame), &nothing));
        return Metadata { xmp, ..Metadata::default() };
    }
    let told: Vec<Told> = panorama.photographs.par_iter().map(|path| Told::of(path)).collect();
    let (earliest, latest) = taken::span(told.iter().filter_map(|one| one.moment.as_ref()));
    let reference = told.get(panorama.reference);
    let place = reference.filter(|one| one.knows_place()).or_else(|| told.iter().find(|one| one.knows_place()));
    let with_place = kept == MetadataKept::Keep;
    let fields = record::fields(
        panorama,
        reference.map_or(&[], |one| &one.fields),
        place.filter(|_| with_place).map_or(&[], |one| &one.fields),
        earliest.as_ref(),
    );
    let facts = gpano::Facts {
        photographs: panorama.photographs.len(),
        software: Some(SOFTWARE),
        earliest,
        latest,
        world_heading_deg: if with_place { world_heading_deg(&told, panorama.yaws) } else { None },
    };
    let xmp = gpano::packet(panorama, panorama.spherical.as_ref(), &facts);
    Metadata { exif: record::block(&fields), icc: None, xmp }
}

/// The metadata of a picture that is written beside a panorama and is none itself, but for its color profile: what it
/// is and that this program made it, so that a later run does not take it for a photograph.
pub fn of_part(part: PanoramaPart, kept: MetadataKept) -> Metadata {
    match kept {
        MetadataKept::None => Metadata::default(),
        MetadataKept::Keep | MetadataKept::NoLocation => {
            Metadata { exif: record::part_block(part), ..Metadata::default() }
        }
    }
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
