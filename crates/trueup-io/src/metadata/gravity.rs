//! Which way was down when a photograph was taken.

use trueup_core::source::{GravitySource, RecordedGravity};

use super::exif_fields::ExifFields;
use super::pose::StatedPose;

/// Believable lengths of an acceleration vector, in g: a hand that moves adds little to gravity.
const BELIEVABLE_G: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// Cosine of the angle from up below which a picture stored without a turn lies on its head: it was turned since.
const ON_ITS_HEAD: f64 = -0.7;

/// How a picture's pixels came to be where they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelOrder {
    /// Width and height as they are stored.
    pub(crate) stored: [usize; 2],
    /// The orientation that the file states, 1 to 8; 1 if it states none.
    pub(crate) stated: u8,
    /// The orientation that is applied, 1 to 8.
    pub(crate) applied: u8,
}

/// Which way is down in the picture as it is shown, if its camera recorded it.
pub(crate) fn recorded_gravity(exif: &ExifFields, order: PixelOrder) -> Option<RecordedGravity> {
    let by_sensor = || apple(exif, order).map(|down| (down, GravitySource::AppleAcceleration));
    let by_pose = || exif.pose.map(|pose| (of_pose(pose), pose.source));
    let (down, source) = by_pose().or_else(by_sensor)?;
    Some(RecordedGravity { down, source })
}

/// Down for a camera turned by yaw, pitch and roll in that order: sin and cos of the roll share out what the pitch
/// leaves.
fn of_pose(pose: StatedPose) -> [f64; 3] {
    let (pitch_sine, pitch_cosine) = pose.pitch_deg.to_radians().sin_cos();
    let (roll_sine, roll_cosine) = pose.roll_deg.to_radians().sin_cos();
    [roll_sine * pitch_cosine, roll_cosine * pitch_cosine, -pitch_sine]
}

/// Down by the accelerometer of Apple's telephones, for the cameras in their backs.
///
/// Seen from the front, x of the vector grows to the left, y to the bottom, z into the face, and what an accelerometer
/// at rest feels is the ground's push, upward: down is (x, -y, -z) in axes to the right, to the bottom and out of the
/// back. The sensor's rows run from top to bottom of the upright telephone, and its first row lies on the right.
fn apple(exif: &ExifFields, order: PixelOrder) -> Option<[f64; 3]> {
    let is_front = |lens: &String| lens.to_lowercase().contains("front");
    if exif.lens_model.as_ref().is_some_and(is_front) {
        return None;
    }
    let [x, y, z] = exif.apple_acceleration?;
    let length = x.hypot(y).hypot(z);
    if !BELIEVABLE_G.contains(&length) {
        return None;
    }
    let on_sensor = [-y / length, -x / length, -z / length];
    let PixelOrder { stored: [width, height], stated, applied } = order;
    // Where the file itself says how it is turned, both are 1, and the turn is the one that EXIF recorded.
    let turned_by = exif.turned_by.and_then(|tag| u8::try_from(tag).ok());
    // Sensors are wider than tall: a program turned taller pixels, as the tag says that it left, or by a quarter that
    // put the picture upright.
    let shown = match (height > width, turned_by.unwrap_or(stated)) {
        (true, tag @ 5..=8) => shown(on_sensor, tag),
        (true, _) => {
            let [clockwise, counterclockwise] = [6, 8].map(|tag| shown(on_sensor, tag));
            if clockwise[1] >= counterclockwise[1] { clockwise } else { counterclockwise }
        }
        (false, tag @ 2..=4) if turned_by.is_some() => shown(on_sensor, tag),
        (false, 1) if on_sensor[1] < ON_ITS_HEAD => shown(on_sensor, 3),
        (false, _) => shown(on_sensor, applied),
    };
    Some(shown)
}

/// A direction of the stored picture in the picture that orientation `tag` shows.
///
/// # Source
/// EXIF 3.0 section 4.6.5.1: which sides of the shown picture row 0 and column 0 are.
fn shown([x, y, z]: [f64; 3], tag: u8) -> [f64; 3] {
    match tag {
        2 => [-x, y, z],
        3 => [-x, -y, z],
        4 => [x, -y, z],
        5 => [y, x, z],
        6 => [-y, x, z],
        7 => [-y, -x, z],
        8 => [y, -x, z],
        _ => [x, y, z],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exif(vector: [f64; 3]) -> ExifFields {
        ExifFields { apple_acceleration: Some(vector), ..ExifFields::default() }
    }

    fn down(vector: [f64; 3], stored: [usize; 2], stated: u8, applied: u8) -> [f64; 3] {
        let found = recorded_gravity(&exif(vector), PixelOrder { stored, stated, applied }).expect("down");
        assert_eq!(found.source, GravitySource::AppleAcceleration);
        found.down
    }

    fn assert_close(found: [f64; 3], expected: [f64; 3]) {
        assert!(found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-12), "{found:?}");
    }

    /// A telephone held upright and level, in each of the four ways: every picture is shown with down below. At rest
    /// the vector points up: to the top is -y, to the left +x.
    #[test]
    fn telephones_held_level_show_down_below() {
        let landscape = [4032, 3024];
        for (vector, tag) in [([0.0, -1.0, 0.0], 6), ([0.0, 1.0, 0.0], 8), ([-1.0, 0.0, 0.0], 1), ([1.0, 0.0, 0.0], 3)]
        {
            assert_close(down(vector, landscape, tag, tag), [0.0, 1.0, 0.0]);
        }
    }

    /// Tilted back, so that its camera looks up by 30 degrees, the ground pushes out of the back rather than into it:
    /// down has a part behind the camera. Dipped to the right by 30 degrees, down moves to the right in the picture.
    #[test]
    fn tilted_telephones_tell_their_angles() {
        let (sine, cosine) = 30_f64.to_radians().sin_cos();
        assert_close(down([0.0, -cosine, sine], [4032, 3024], 6, 6), [0.0, cosine, -sine]);
        assert_close(down([sine, -cosine, 0.0], [4032, 3024], 6, 6), [sine, cosine, 0.0]);
    }

    #[test]
    fn pixels_that_a_program_turned_are_recognized() {
        let (sine, cosine) = 10_f64.to_radians().sin_cos();
        let upright = [0.0, cosine, sine];
        let vector = [0.0, -cosine, -sine];
        // The tag left behind, and taken away.
        assert_close(down(vector, [3024, 4032], 6, 1), upright);
        assert_close(down(vector, [3024, 4032], 1, 1), upright);
        // Held on its head and turned by half.
        assert_close(down([cosine, 0.0, -sine], [4032, 3024], 1, 1), upright);
        // The tag lost, the pixels as the sensor has them: the picture lies on its side.
        assert_close(down(vector, [4032, 3024], 1, 1), [cosine, 0.0, sine]);
    }

    /// Held on its head, and tilted so far that up hardly shows in the picture: what the file turned it by is what EXIF
    /// recorded.
    #[test]
    fn what_the_file_turned_itself_is_turned_as_recorded() {
        let (sine, cosine) = 50_f64.to_radians().sin_cos();
        let of = |vector: [f64; 3], turned_by: u32, stored: [usize; 2]| {
            let exif = ExifFields { turned_by: Some(turned_by), ..exif(vector) };
            recorded_gravity(&exif, PixelOrder { stored, stated: 1, applied: 1 }).expect("down").down
        };
        let upright = [0.0, cosine, sine];
        assert_close(of([cosine, 0.0, -sine], 3, [4032, 3024]), upright);
        assert_close(of([-cosine, 0.0, -sine], 1, [4032, 3024]), upright);
        assert_close(of([0.0, -cosine, -sine], 6, [3024, 4032]), upright);
        assert_close(of([0.0, cosine, -sine], 8, [3024, 4032]), upright);
        // A turn that the picture's sides contradict, and one that is none.
        assert_close(of([-cosine, 0.0, -sine], 6, [4032, 3024]), upright);
        assert_close(of([-cosine, 0.0, -sine], 9, [4032, 3024]), upright);
    }

    #[test]
    fn what_moves_and_looks_at_its_user_tells_nothing() {
        let order = PixelOrder { stored: [4032, 3024], stated: 1, applied: 1 };
        for vector in [[0.0, -2.0, 0.0], [0.0, -0.3, 0.0], [f64::NAN, -1.0, 0.0], [0.0; 3]] {
            assert_eq!(recorded_gravity(&exif(vector), order), None, "{vector:?}");
        }
        let front = ExifFields { lens_model: Some("iPhone 12 front camera".to_owned()), ..exif([-1.0, 0.0, 0.0]) };
        assert_eq!(recorded_gravity(&front, order), None);
    }

    /// A camera that looks up by 20 degrees sees the ground behind its back; turned clockwise by 30, it sees it move to
    /// the right.
    #[test]
    fn stated_poses_turn_down() {
        let of = |pitch_deg, roll_deg| {
            let pose = StatedPose { pitch_deg, roll_deg, source: GravitySource::DjiGimbal };
            let exif = ExifFields { pose: Some(pose), ..ExifFields::default() };
            recorded_gravity(&exif, PixelOrder { stored: [3, 2], stated: 1, applied: 1 }).expect("down").down
        };
        assert_close(of(20.0, 0.0), [0.0, 20_f64.to_radians().cos(), -20_f64.to_radians().sin()]);
        assert_close(of(0.0, 30.0), [0.5, 0.75_f64.sqrt(), 0.0]);
        assert_close(of(-90.0, 0.0), [0.0, 0.0, 1.0]);
    }
}
