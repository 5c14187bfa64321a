//! The cameras of a panorama as a project of the Hugin stitcher, written and read (`read`, by the lines of `parse`;
//! drawn in `panorama`).
//!
//! # Source
//! The format: Hugin's own description of its project files (`doc/nona.txt` of panotools and the manual's page on
//! `.pto`). Angles: yaw to the right, pitch upwards, roll clockwise, applied in the order roll, pitch, yaw.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write;

use nalgebra::{Matrix3, Matrix4, Vector2, Vector3, Vector4};
use trueup_compose::exposure::Correction;
use trueup_core::geometry::{matrix_from_rows, wrap_angle};
use trueup_core::inset::Inset;
use trueup_core::lens::{Lens, LensProjection, LensTerms, PlacedLens};
use trueup_core::{Error, Result};

use super::record::{ImageRecord, Project};

mod masks;
mod panorama;
mod parse;
mod read;

pub use read::{HuginImage, HuginProject};

/// A camera's attitude in Hugin's angles, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Attitude {
    /// To the right.
    yaw: f64,
    /// Upwards.
    pitch: f64,
    /// Clockwise turn of the photograph.
    roll: f64,
}

impl Attitude {
    /// Of a camera with this rotation from the levelled world (y down) to the camera. Straight up or down, where yaw
    /// and roll are one, all of it is yaw.
    fn of(camera_from_level: &Matrix3<f64>) -> Self {
        let level_from_camera = camera_from_level.transpose();
        let forward = level_from_camera.column(2);
        // Roll from the levelled world's vertical, as long as the camera does not look along it.
        const STEEP: f64 = 1e-9;
        let (yaw, roll) = match forward.x.hypot(forward.z) > STEEP {
            true => (forward.x.atan2(forward.z), level_from_camera[(1, 0)].atan2(level_from_camera[(1, 1)])),
            false => ((-level_from_camera[(2, 0)]).atan2(level_from_camera[(0, 0)]), 0.0),
        };
        Self { yaw, pitch: (-forward.y).clamp(-1.0, 1.0).asin(), roll }
    }
}

/// A panorama's cameras, exposures and vignetting as a Hugin project, whose panorama is the whole sphere in
/// equirectangular projection at the pixel scale of the photographs' middles.
///
/// Images are named by the paths in the record and described as they are stored in their files: Hugin's renderer knows
/// no EXIF orientation, which goes into the roll. What lies beside an outline is masked. What the mesh does beyond the
/// cameras has no place in the format, nor have the matches, which the record does not hold: `cpfind` of Hugin finds
/// such again.
///
/// # Errors
/// [`Error::Input`] where the record has no cameras, they show a flat scene from many places, a photograph's
/// orientation mirrors it, or its path holds what ends a name there.
pub fn hugin_project(project: &Project) -> Result<String> {
    let missing =
        || Error::input("Hugin project", "the panorama has no cameras", "Stitch at least two overlapping photographs.");
    if project.flat_scene.is_some() {
        return Err(Error::input(
            "Hugin project",
            "the photographs show a flat scene from many places, which is written for rotating cameras only",
            "Stitch with cameras.scene = rotating, or leave the Hugin project out.",
        ));
    }
    let mut lines = String::new();
    let mut masks = String::new();
    let mut focal_sum = 0.0;
    for (number, image) in project.used_images().enumerate() {
        let (Some(rotation), Some(focal_px)) = (image.level_rotation(), image.focal_px) else { return Err(missing()) };
        focal_sum += focal_px;
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "{}", image_line(image, &matrix_from_rows(rotation), focal_px)?);
        masks.push_str(&masks::lines(number, image));
    }
    let count = project.used();
    if count == 0 {
        return Err(missing());
    }
    // A turn is 2 pi f pixels; an even number, so that the height is half of it.
    let height = (PI * focal_sum / count as f64).round().max(1.0);
    let header = format!(
        "# hugin project file, written by trueup {}\np f2 w{} h{height} v360 E0 R0 n\"TIFF_m c:LZW r:CROP\"\nm i0\n",
        env!("CARGO_PKG_VERSION"),
        2.0 * height,
    );
    Ok(format!("{header}{lines}v\n{masks}"))
}

fn image_line(image: &ImageRecord, camera_from_level: &Matrix3<f64>, focal_px: f64) -> Result<String> {
    if image.path.contains(['"', '\n', '\r']) {
        let reason = "its name holds a quotation mark or a line break, which ends it in a Hugin project";
        return Err(Error::input(&image.path, reason, "Rename it and stitch again."));
    }
    let quarter_turns: u8 = match image.orientation {
        0 | 1 => 0,
        6 => 1,
        3 => 2,
        8 => 3,
        _ => {
            return Err(Error::input(
                &image.path,
                "its EXIF orientation mirrors it, which a Hugin project cannot say",
                "Store it upright and stitch again.",
            ));
        }
    };
    let [upright_width, upright_height] = image.inset.outer([image.width, image.height]);
    let (width, height) = match quarter_turns {
        1 | 3 => (upright_height, upright_width),
        _ => (upright_width, upright_height),
    };
    let turn = f64::from(quarter_turns) * FRAC_PI_2;
    let Attitude { yaw, pitch, roll } = Attitude::of(camera_from_level);
    let roll = wrap_angle(roll + turn);
    let stored = StoredPicture { width: width as f64, height: height as f64, turn };
    // Hugin counts from the middle of the picture in the file.
    let [right, down] = image.inset.offset();
    let lens = match image.lens {
        None if image.inset.is_none() => HuginLens::pinhole(focal_px, &stored),
        lens => {
            let lens = lens.unwrap_or_default();
            let [x, y] = lens.center_px;
            HuginLens::of(&PlacedLens { center_px: [x + right, y + down], ..lens }, focal_px, &stored)
        }
    };
    let crop = match image.inset.turned((4 - quarter_turns) % 4) {
        inset if inset.is_none() => String::new(),
        Inset { left, top, right, bottom } => {
            format!(" S{left},{},{top},{}", width.saturating_sub(right), height.saturating_sub(bottom))
        }
    };
    let HuginLens { format, field_of_view, radial: [a, b, c], center_px: [d, e] } = lens;
    let correction = image.correction.unwrap_or_else(|| Correction::uniform(image.gain.unwrap_or(1.0)));
    let [red, green, blue] = correction.gain;
    let [vb, vc, vd] = vignetting(&correction);
    // Hugin divides by the white balance, ours are factors; exposure values count stops by which a photograph is
    // brightened.
    Ok(format!(
        "i w{width} h{height} f{format} v{:.6} r{:.6} p{:.6} y{:.6} TrX0 TrY0 TrZ0 a{a} b{b} c{c} d{d} e{e} g0 t0 Eev{:.6} Er{:.6} \
         Eb{:.6} Ra0 Rb0 Rc0 Rd0 Re0 Va1 Vb{vb:.6} Vc{vc:.6} Vd{vd:.6} Vx0 Vy0 Vm5{crop} n\"{}\"",
        field_of_view.to_degrees(),
        roll.to_degrees(),
        pitch.to_degrees(),
        yaw.to_degrees(),
        green.log2(),
        green / red,
        green / blue,
        image.path,
    ))
}

/// A photograph as its file has it.
struct StoredPicture {
    width: f64,
    height: f64,
    /// Clockwise turn, radians, that stands it upright.
    turn: f64,
}

/// A lens in Hugin's terms: a pixel at the radius a r^4 + b r^3 + c r^2 + (1 - a - b - c) r, in units of half the
/// shorter side, where the projection alone has r, from a center moved by d and e pixels.
struct HuginLens {
    /// 0 rectilinear, 3 fisheye.
    format: u8,
    /// Across the stored picture, radians.
    field_of_view: f64,
    /// a, b and c.
    radial: [f64; 3],
    /// d and e.
    center_px: [f64; 2],
}

impl HuginLens {
    fn pinhole(focal_px: f64, stored: &StoredPicture) -> Self {
        let field_of_view = 2.0 * (0.5 * stored.width / focal_px).atan();
        Self { format: 0, field_of_view, radial: [0.0; 3], center_px: [0.0; 2] }
    }

    /// The polynomial nearest to the lens over the photograph, by least squares on radii; tangential terms have no
    /// place in the format. The coefficient of r is made what Hugin wants of it by the unit of r, which the focal
    /// length takes up.
    fn of(lens: &PlacedLens, focal_px: f64, stored: &StoredPicture) -> Self {
        const SAMPLES: usize = 128;
        const STEPS: usize = 20;
        let LensTerms { projection, radial, .. } = lens.terms;
        let radially = Lens::new(LensTerms { projection, radial, tangential: [0.0; 2] });
        let (unit_px, farthest) = (0.5 * stored.width.min(stored.height), 0.5 * stored.width.hypot(stored.height));
        let (mut normal, mut right) = (Matrix4::<f64>::zeros(), Vector4::zeros());
        for step in 1..=SAMPLES {
            let distorted_px = farthest * step as f64 / SAMPLES as f64;
            let ray = radially.ray(Vector2::new(distorted_px / focal_px, 0.0));
            let alone = match projection {
                LensProjection::Rectilinear => ray.x / ray.z,
                LensProjection::Equidistant => ray.x.atan2(ray.z),
            };
            let r = alone * focal_px / unit_px;
            let powers = Vector4::new(r.powi(4), r.powi(3), r * r, r);
            normal += powers * powers.transpose();
            right += powers * (distorted_px / unit_px);
        }
        let Some(inverse) = normal.try_inverse() else { return Self::pinhole(focal_px, stored) };
        let fitted = inverse * right;
        // With r = s / stretch the coefficients are to add up to 1.
        let scaled = |stretch: f64| std::array::from_fn::<f64, 4, _>(|k| fitted[k] / stretch.powi(4 - k as i32));
        let mut stretch = fitted[3].max(f64::MIN_POSITIVE);
        for _ in 0..STEPS {
            let terms = scaled(stretch);
            let sum: f64 = terms.iter().sum();
            let slope: f64 = (0..4).map(|k| -(4.0 - k as f64) * terms[k] / stretch).sum();
            stretch -= (sum - 1.0) / slope;
        }
        let [a, b, c, _] = scaled(stretch);
        let half = 0.5 * stored.width / (focal_px * stretch);
        let (format, field_of_view) = match projection {
            LensProjection::Rectilinear => (0, 2.0 * half.atan()),
            LensProjection::Equidistant => (3, 2.0 * half),
        };
        // From the upright photograph back to the stored one.
        let (sine, cosine) = stored.turn.sin_cos();
        let [x, y] = lens.center_px;
        Self { format, field_of_view, radial: [a, b, c], center_px: [x * cosine + y * sine, y * cosine - x * sine] }
    }
}

/// Coefficients of r^2, r^4 and r^6 in Hugin's polynomial, by which it divides and whose constant is 1: fitted to the
/// inverse of our factor over the photograph by least squares.
fn vignetting(correction: &Correction) -> [f64; 3] {
    if correction.vignetting.iter().all(|&coefficient| coefficient == 0.0) {
        return [0.0; 3];
    }
    const SAMPLES: usize = 64;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for step in 0..=SAMPLES {
        let r2 = step as f64 / SAMPLES as f64;
        let powers = Vector3::new(r2, r2 * r2, r2 * r2 * r2);
        normal += powers * powers.transpose();
        right += powers * (1.0 / correction.at_radius(r2) - 1.0);
    }
    normal.try_inverse().map_or([0.0; 3], |inverse| (inverse * right).into())
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

    use super::*;

    fn degrees(attitude: Attitude) -> [f64; 3] {
        [attitude.yaw, attitude.pitch, attitude.roll].map(f64::to_degrees)
    }

    #[test]
    fn angles_are_those_of_hand_computed_cameras() {
        let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        // A level camera looking along x, to the right of z: its x is the world's -z, its z the world's x.
        let right = Matrix3::new(0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
        assert!(close(degrees(Attitude::of(&right)), [90.0, 0.0, 0.0]));
        // Looking 30 degrees up: forward is (0, -1/2, sqrt(3)/2), the photograph's down (0, sqrt(3)/2, 1/2).
        let half_root = 0.75_f64.sqrt();
        let up = Matrix3::new(1.0, 0.0, 0.0, 0.0, half_root, 0.5, 0.0, -0.5, half_root);
        assert!(close(degrees(Attitude::of(&up)), [0.0, 30.0, 0.0]));
        // Held a quarter turn anticlockwise: the world's down is the camera's right, and its photograph is to be turned
        // clockwise, which takes right to down.
        let held = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        assert!(close(degrees(Attitude::of(&held)), [0.0, 0.0, 90.0]));
        // Straight up, the photograph's top to the back.
        let zenith = rotation_about_x(-FRAC_PI_2);
        assert!((degrees(Attitude::of(&zenith))[1].abs() - 90.0).abs() < 1e-6);
    }

    #[test]
    fn angles_put_the_camera_together_again() {
        for (yaw, pitch, roll) in [(0.3, 0.2, -0.4), (-2.9, -1.2, 3.0), (1.6, 0.0, 0.01)] {
            let level_from_camera = rotation_about_y(yaw) * rotation_about_x(pitch) * rotation_about_z(roll);
            let found = Attitude::of(&level_from_camera.transpose());
            let error = (found.yaw - yaw).abs() + (found.pitch - pitch).abs() + (found.roll - roll).abs();
            assert!(error < 1e-12, "{found:?}");
        }
    }

    /// Radii by Hugin's formula against the lens's own, all over the photograph.
    #[test]
    fn lenses_are_handed_on_to_a_fifth_of_a_pixel() {
        let stored = StoredPicture { width: 800.0, height: 600.0, turn: FRAC_PI_2 };
        for (projection, focal_px, k1, k2) in [
            (LensProjection::Rectilinear, 670.0, -0.065, 0.012),
            (LensProjection::Rectilinear, 670.0, 0.08, 0.0),
            (LensProjection::Equidistant, 310.0, -0.015, 0.002),
        ] {
            let terms = LensTerms { projection, radial: [k1, k2, 0.0, 0.0], tangential: [0.0; 2] };
            let record = PlacedLens { terms, center_px: [5.0, 2.0] };
            let HuginLens { format, field_of_view, radial: [a, b, c], center_px } =
                HuginLens::of(&record, focal_px, &stored);
            // The quarter turn took the stored picture's right to down: what is right in the upright one was up.
            assert!((center_px[0] - 2.0).abs() < 1e-12 && (center_px[1] + 5.0).abs() < 1e-12, "{center_px:?}");
            for step in 0..=20 {
                let angle = f64::from(step) / 20.0 * (500.0_f64 / focal_px).atan();
                let (hugin_focal, alone) = match format {
                    0 => (400.0 / (field_of_view / 2.0).tan(), angle.tan()),
                    _ => (800.0 / field_of_view, angle),
                };
                let r = hugin_focal * alone / 300.0;
                let by_hugin = 300.0 * r * (a * r.powi(3) + b * r * r + c * r + 1.0 - a - b - c);
                let ray = Vector3::new(angle.sin(), 0.0, angle.cos());
                let by_lens = focal_px * Lens::new(terms).place(ray).expect("in front").x;
                assert!((by_hugin - by_lens).abs() < 0.2, "{projection:?} {angle}: {by_hugin} {by_lens}");
            }
        }
    }

    /// What is written is read again as it was: angles, field of view, lens and center of a photograph held upright.
    #[test]
    fn what_is_written_is_read_again() {
        let terms = LensTerms { radial: [-0.065, 0.012, 0.0, 0.0], ..LensTerms::default() };
        let lens = PlacedLens { terms, center_px: [5.0, 2.0] };
        let level_from_camera = rotation_about_y(0.7) * rotation_about_x(-0.2) * rotation_about_z(0.1);
        let camera_from_level = level_from_camera.transpose();
        let record = ImageRecord {
            width: 600,
            height: 800,
            orientation: 6,
            lens: Some(lens),
            ..ImageRecord::left_out("a b.jpg".to_owned(), String::new(), String::new())
        };
        let line = image_line(&record, &camera_from_level, 670.0).expect("a line");
        let read = HuginProject::parse(&format!("# hugin project file\n{line}\n"), "a.pto").expect("a project");
        let HuginImage { path, width, height, focal_px, lens: found, inset, attitude } = &read.images[0];
        assert_eq!((path.as_str(), *width, *height, *inset), ("a b.jpg", 800, 600, Inset::default()));
        let upright = found.expect("a lens").turned(1);
        assert!((upright.center_px[0] - 5.0).abs() < 1e-9 && (upright.center_px[1] - 2.0).abs() < 1e-9, "{upright:?}");
        let [yaw, pitch, roll] = attitude;
        let angles = [yaw - 0.7, pitch + 0.2, roll - 0.1 - FRAC_PI_2];
        assert!(angles.iter().all(|angle| angle.abs() < 1e-6), "{angles:?}");
        for step in 0..=10 {
            let ray = Vector3::new(0.07 * f64::from(step), 0.0, 1.0);
            let [written, read] = [(lens.terms, 670.0), (upright.terms, *focal_px)]
                .map(|(terms, focal_px)| focal_px * Lens::new(terms).place(ray).expect("in front").x);
            assert!((written - read).abs() < 0.3, "{step}: {written} {read}");
        }
    }

    #[test]
    fn names_that_end_early_are_refused() {
        for name in ["a\".jpg", "a\n.jpg"] {
            let record = ImageRecord::left_out(name.to_owned(), String::new(), String::new());
            let refused = image_line(&record, &Matrix3::identity(), 670.0).expect_err("not readable").to_string();
            assert!(refused.contains("ends it in a Hugin project"), "{refused}");
        }
    }

    #[test]
    fn vignetting_is_the_inverse_polynomial() {
        let correction = Correction { gain: [1.0; 3], vignetting: [0.3, -0.1, 0.05], ..Correction::default() };
        let [b, c, d] = vignetting(&correction);
        for r2 in [0.1_f64, 0.5, 1.0] {
            let dims = 1.0 + b * r2 + c * r2 * r2 + d * r2 * r2 * r2;
            assert!((dims * (0.3 * r2 - 0.1 * r2 * r2 + 0.05 * r2 * r2 * r2).exp() - 1.0).abs() < 1e-3);
        }
        assert_eq!(vignetting(&Correction::uniform(2.0)), [0.0; 3]);
    }
}
