use nalgebra::{Matrix3, Vector2};
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};

use super::*;

const SIZE: [f64; 2] = [800.0, 600.0];
const FOCAL_PX: f64 = 700.0;
const SKY: [u8; 3] = [190, 205, 225];
const GROUND: [u8; 3] = [70, 90, 100];

/// What is painted: the color of a direction of the level world, whose y points down, and the edges in it.
struct Painted {
    color: fn(&Vector3<f64>) -> [u8; 3],
    /// Height of the edge at an azimuth, radians above level; `None` where there is none.
    edge: fn(f64) -> Option<f64>,
}

fn azimuth(direction: &Vector3<f64>) -> f64 {
    direction.x.atan2(direction.z)
}

fn height(direction: &Vector3<f64>) -> f64 {
    -direction.y.asin()
}

/// Open sea, with rocks of 0.2 radians before it on the right.
const SEA: Painted = Painted {
    color: |direction| match (azimuth(direction), height(direction)) {
        (azimuth, height) if azimuth > 0.5 && height < 0.1 => [120, 110, 90],
        (_, height) if height > 0.0 => SKY,
        _ => GROUND,
    },
    edge: |azimuth| (azimuth < 0.5).then_some(0.0),
};

/// The straight edge of a long roof whose nearest point is 6 degrees up, from 40 degrees on the left to 30 on the
/// right; sky beside it.
const ROOF: Painted = Painted {
    color: |direction| {
        let azimuth = azimuth(direction);
        let is_roof = (-0.7..0.52).contains(&azimuth) && height(direction) < roof(azimuth);
        if is_roof || height(direction) < -0.15 { GROUND } else { SKY }
    },
    edge: |azimuth| (-0.7..0.52).contains(&azimuth).then(|| roof(azimuth)),
};

fn roof(azimuth: f64) -> f64 {
    (0.105_f64.tan() * azimuth.cos()).atan()
}

/// A rail before a slope of stones: what is above it is no sky.
const RAIL: Painted = Painted {
    color: |direction| {
        let stone = (40.0 * azimuth(direction)).floor() + (40.0 * height(direction)).floor();
        match height(direction) > 0.0 {
            true if stone.rem_euclid(2.0) == 0.0 => [200, 200, 190],
            true => [120, 115, 100],
            false => GROUND,
        }
    },
    edge: |_| Some(0.0),
};

/// Photographs of a painted world, rolled and looking up in turns, and their cameras in a common frame that is turned
/// by `gauge`.
struct Taken {
    cameras: Vec<Camera>,
    curves: Vec<Vec<EdgeCurve>>,
    thumbnails: Vec<Raster<u8>>,
}

const FRAME: WorkingFrame = WorkingFrame { width: SIZE[0], height: SIZE[1], working_from_full: 1.0 };
const THUMBNAIL: WorkingFrame = WorkingFrame { width: 200.0, height: 150.0, working_from_full: 0.25 };

fn gauge() -> Matrix3<f64> {
    rotation_about_z(0.3) * rotation_about_x(-0.4)
}

/// Photographs that look to these azimuths, degrees.
fn taken(painted: &Painted, azimuths_deg: &[f64]) -> Taken {
    let mut all = Taken { cameras: Vec::new(), curves: Vec::new(), thumbnails: Vec::new() };
    for (k, azimuth_deg) in azimuths_deg.iter().enumerate() {
        let (roll, pitch) = (0.08 * (k as f64).sin(), 0.05 * (2.0 * k as f64).cos());
        let level = rotation_about_z(roll) * rotation_about_x(pitch) * rotation_about_y(-azimuth_deg.to_radians());
        let in_level = Camera::new(FOCAL_PX, SIZE[0], SIZE[1], &level);
        let mut thumbnail = Raster::new(200, 150, 3);
        for y in 0..150 {
            for x in 0..200 {
                let pixel = Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * 4.0;
                thumbnail.pixel_mut(x, y).copy_from_slice(&(painted.color)(&in_level.world_direction(pixel)));
            }
        }
        // Steps of a degree, a few to a curve, as where boats cross.
        let places: Vec<Option<[f64; 2]>> = (-180..180)
            .map(|degree| {
                let azimuth = f64::from(degree).to_radians();
                let height = (painted.edge)(azimuth)?;
                let flat = height.cos();
                let direction = Vector3::new(azimuth.sin() * flat, -height.sin(), azimuth.cos() * flat);
                let pixel = in_level.shows(direction, SIZE).then(|| in_level.project(level * direction)).flatten()?;
                Some(pixel.into())
            })
            .collect();
        let runs = places.chunks(12).map(|run| EdgeCurve { places: run.iter().flatten().copied().collect() });
        all.curves.push(runs.filter(|curve| curve.places.len() > 1).collect());
        all.thumbnails.push(thumbnail);
        all.cameras.push(Camera::new(FOCAL_PX, SIZE[0], SIZE[1], &(level * gauge())));
    }
    all
}

fn found(taken: &Taken) -> Option<FarHorizon> {
    found_where(taken, |_| true)
}

fn found_where(taken: &Taken, is_plausible: fn(&Vector3<f64>) -> bool) -> Option<FarHorizon> {
    let photographs: Vec<ShownPhotograph> = taken
        .curves
        .iter()
        .zip(&taken.thumbnails)
        .map(|(curves, thumbnail)| ShownPhotograph { frame: &FRAME, curves, thumbnail, thumbnail_frame: &THUMBNAIL })
        .collect();
    // What cameras expect is off by five degrees.
    let expected = gauge().transpose() * rotation_about_z(0.06) * rotation_about_x(0.06) * Vector3::y();
    find(&photographs, &taken.cameras, &expected, is_plausible)
}

const ROW: [f64; 4] = [-60.0, -30.0, 0.0, 30.0];

#[test]
fn the_sea_tells_the_vertical_beside_rocks() {
    let horizon = found(&taken(&SEA, &ROW)).expect("a horizon");
    let truth = gauge().transpose() * Vector3::y();
    // It has no dip, of which 0.08 degrees are expected.
    assert!(horizon.down.angle(&truth).to_degrees() < 0.12, "{}", horizon.down.angle(&truth).to_degrees());
    assert!(horizon.photographs >= 3);
    // Nothing is told of a turn about the vertical.
    assert!((horizon.information * horizon.down).norm() < 1e-6 * horizon.information.norm());
}

#[test]
fn a_roof_beyond_whose_end_is_sky_is_no_horizon() {
    assert!(found(&taken(&ROOF, &ROW)).is_none());
    // The same edges with ground all along below them are one, though tilted: nothing tells that but the sky beside it.
    let wide = Painted {
        color: |direction| if height(direction) < roof_everywhere(direction) { GROUND } else { SKY },
        edge: |azimuth| Some(roof(azimuth)),
    };
    assert!(found(&taken(&wide, &ROW)).is_some());
}

fn roof_everywhere(direction: &Vector3<f64>) -> f64 {
    roof(azimuth(direction))
}

#[test]
fn a_rail_without_sky_above_is_no_horizon() {
    assert!(found(&taken(&RAIL, &ROW)).is_none());
}

#[test]
fn too_little_of_a_horizon_does_not_tell() {
    // One photograph, and two that look the same way: 59.5 degrees, of which 75 are needed between the ends.
    assert!(found(&taken(&SEA, &[-30.0])).is_none());
    assert!(found(&taken(&SEA, &[-30.0, -30.0])).is_none());
    assert!(found(&taken(&SEA, &[-50.0, -20.0])).is_some());
    // Nor does one that cannot be level.
    let held = taken(&SEA, &ROW);
    assert!(found_where(&held, |_| false).is_none());
    // No edges, and no photographs.
    let mut without = taken(&SEA, &ROW);
    without.curves.iter_mut().for_each(Vec::clear);
    assert!(found(&without).is_none());
    assert!(find(&[], &[], &Vector3::y(), |_| true).is_none());
}

/// A camera that looks at rocks alone, away from the others, sees none of it, and of a small copy that is smaller than
/// it says the last pixels stand for what is missing.
#[test]
fn views_of_something_else_do_not_tell() {
    let held = taken(&SEA, &[-60.0, -30.0, 0.0, 120.0]);
    assert_eq!(found(&held).expect("a horizon").photographs, 3);
    for (width, height, channels) in [(0, 0, 3), (1, 1, 3), (1, 1, 1), (200, 1, 3)] {
        let mut other = taken(&SEA, &ROW);
        other.thumbnails.iter_mut().for_each(|thumbnail| *thumbnail = Raster::new(width, height, channels));
        assert!(found(&other).is_none());
    }
}
