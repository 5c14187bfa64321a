//! A focal length in pixels from what EXIF says of lens and sensor.

use trueup_core::source::{FocalPrior, FocalSource};

use super::exif_fields::ExifFields;

/// Diagonal of the 36 x 24 mm film frame, which "35 mm equivalent" refers to (CIPA DCG-001).
const FILM_DIAGONAL_MM: f64 = 43.266_615;

/// Believable focal lengths, as multiples of the photograph's long side: 118 degrees of view to 6 degrees.
const BELIEVABLE_FOCAL: std::ops::RangeInclusive<f64> = 0.3..=10.0;

/// Believable long sides of a sensor in millimetres, from small telephones to medium format. A focal plane resolution
/// that implies less was left behind by a program that reduced the photograph and rewrote only its pixel size.
const BELIEVABLE_SENSOR_MM: std::ops::RangeInclusive<f64> = 3.0..=60.0;

/// Long side of the sensor in millimetres by model name as EXIF has it (lower case), for cameras that write no 35 mm
/// equivalent. Manufacturers' specifications; the nominal size of the stated optical format for compact cameras.
const SENSOR_LONG_SIDE_MM: [(&str, f64); 10] = [
    ("canon digital ixus 860 is", 5.76),
    ("canon eos 5d", 35.8),
    ("canon eos 5d mark ii", 36.0),
    ("canon eos 5d mark iii", 36.0),
    ("canon powershot s45", 7.18),
    ("c5060wz", 7.18),
    ("dsc-p8", 5.37),
    ("dsc-w180", 6.17),
    ("htc one_m8", 5.38),
    ("mx5", 5.88),
];

/// The focal length that `exif` gives for a photograph stored as `width` x `height` pixels, if it gives a believable
/// one.
///
/// In this order: the 35 mm equivalent; the lens's focal length on the sensor of a known camera; the lens's focal
/// length on a sensor measured by the focal plane resolution. Every way gives the focal length relative to the whole
/// frame, so a photograph that was reduced since is served as well; a cropped one is not.
///
/// # Departures
/// A known camera outranks the focal plane resolution: programs that reduce a photograph often rewrite PixelXDimension
/// but not the resolution, and the two then describe a sensor that does not exist.
pub(crate) fn focal_prior(exif: &ExifFields, width: f64, height: f64) -> Option<FocalPrior> {
    let long_side = width.max(height);
    let candidates = [
        (FocalSource::Equivalent35mm, equivalent_35mm(exif, width, height)),
        (FocalSource::CameraModel, sensor_of_model(exif).and_then(|sensor| on_sensor(exif, sensor, long_side))),
        (FocalSource::FocalPlaneResolution, sensor_of_focal_plane(exif).and_then(|s| on_sensor(exif, s, long_side))),
    ];
    candidates.into_iter().find_map(|(source, focal_px)| {
        let focal_px = focal_px.filter(|focal_px| BELIEVABLE_FOCAL.contains(&(focal_px / long_side)))?;
        Some(FocalPrior { focal_px, source })
    })
}

/// f = f35 * diagonal / diagonal of the film frame.
fn equivalent_35mm(exif: &ExifFields, width: f64, height: f64) -> Option<f64> {
    Some(exif.focal_35mm? * width.hypot(height) / FILM_DIAGONAL_MM)
}

/// f = focal length * long side in pixels / long side of the sensor.
fn on_sensor(exif: &ExifFields, sensor_long_side_mm: f64, long_side: f64) -> Option<f64> {
    Some(exif.focal_mm? * long_side / sensor_long_side_mm)
}

fn sensor_of_model(exif: &ExifFields) -> Option<f64> {
    let model = exif.model.as_ref()?.to_lowercase();
    SENSOR_LONG_SIDE_MM.iter().find(|(name, _)| *name == model).map(|&(_, long_side)| long_side)
}

/// The sensor's long side in millimetres: the original's pixels over pixels per millimetre.
fn sensor_of_focal_plane(exif: &ExifFields) -> Option<f64> {
    let unit_mm = match exif.focal_plane_unit.unwrap_or(2) {
        2 => 25.4,
        3 => 10.0,
        4 => 1.0,
        5 => 0.001,
        _ => return None,
    };
    let original_long_side = exif.pixel_width?.max(exif.pixel_height?);
    let sensor_mm = original_long_side / exif.focal_plane_resolution? * unit_mm;
    BELIEVABLE_SENSOR_MM.contains(&sensor_mm).then_some(sensor_mm)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exif() -> ExifFields {
        ExifFields { pixel_width: Some(3264.0), pixel_height: Some(2448.0), ..ExifFields::default() }
    }

    #[test]
    fn equivalent_follows_the_diagonal() {
        // A 3:4 photograph has the diagonal 5/4 of its long side: 24 mm gives 24 / 43.2666 * 2000 = 1109.4.
        let prior = focal_prior(&ExifFields { focal_35mm: Some(24.0), ..exif() }, 1200.0, 1600.0).expect("a prior");
        assert_eq!(prior.source, FocalSource::Equivalent35mm);
        assert!((prior.focal_px - 1109.4).abs() < 0.05, "{prior:?}");
    }

    #[test]
    fn focal_plane_resolution_refers_to_the_original_size() {
        // 3264 px at 14506.67 px/inch are 5.715 mm; 4.6 mm on it, in a copy of 653 px: 525.6 px.
        let fields = ExifFields {
            focal_mm: Some(4.6),
            focal_plane_resolution: Some(14_506.666_7),
            focal_plane_unit: Some(2),
            ..exif()
        };
        let prior = focal_prior(&fields, 653.0, 490.0).expect("a prior");
        assert_eq!(prior.source, FocalSource::FocalPlaneResolution);
        assert!((prior.focal_px - 525.6).abs() < 0.1, "{prior:?}");
    }

    #[test]
    fn impossible_sensors_are_ignored() {
        // 720 px at 8114 px/inch would be a sensor of 2.3 mm: the photograph was reduced, the resolution kept.
        let reduced = ExifFields {
            pixel_width: Some(540.0),
            pixel_height: Some(720.0),
            focal_mm: Some(12.28),
            focal_plane_resolution: Some(8114.3),
            ..ExifFields::default()
        };
        assert_eq!(focal_prior(&reduced, 540.0, 720.0), None);
        let known = ExifFields { model: Some("Canon PowerShot S45".to_owned()), ..reduced };
        let prior = focal_prior(&known, 540.0, 720.0).expect("a prior");
        assert_eq!(prior.source, FocalSource::CameraModel);
        assert!((prior.focal_px - 1231.4).abs() < 0.1, "{prior:?}");
    }

    #[test]
    fn absurd_numbers_are_ignored() {
        for absurd in [0.0, -24.0, f64::NAN, f64::INFINITY, 1.0, 65535.0] {
            let fields = ExifFields {
                focal_35mm: Some(absurd),
                focal_mm: Some(absurd),
                focal_plane_resolution: Some(absurd),
                ..exif()
            };
            assert_eq!(focal_prior(&fields, 3264.0, 2448.0), None, "{absurd}");
        }
    }
}
