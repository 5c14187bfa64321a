//! A coast without lines: three photographs that lean and look up, level by the horizon of the sea, and stood up by
//! their light where they lie on their side.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use trueup_scenes::camera_from_world;

use crate::pictures::{jpeg, scramble};
use crate::run::{Desk, finish, trueup};

const SIZE: [usize; 2] = [640, 480];
/// 62 degrees across.
const FOCAL_PX: f64 = 532.6;
/// Yaw, pitch (up) and roll of the photographs, degrees.
const LOOKS: [[f64; 3]; 3] = [[-26.0, 4.0, 5.0], [0.0, 7.0, 3.0], [26.0, 5.0, 7.0]];

/// Smooth noise in 0 to 1: random numbers at the corners of unit cells, and in between by their distance.
fn noise(place: Vector3<f64>, seed: u64) -> f64 {
    let base = place.map(f64::floor);
    let part = (place - base).map(|t| t * t * (3.0 - 2.0 * t));
    let corner = |index: usize| {
        let on = [index & 1, index >> 1 & 1, index >> 2 & 1];
        let cell = [0, 1, 2].map(|axis| (base[axis] as i64 + on[axis] as i64 + 512) as u64);
        let weight: f64 = (0..3).map(|axis| if on[axis] == 1 { part[axis] } else { 1.0 - part[axis] }).product();
        weight * scramble(seed << 48 | cell[0] << 32 | cell[1] << 16 | cell[2])
    };
    (0..8).map(corner).sum()
}

/// Sea below the sky, and rocks before it that end below the horizon; the world's y points down.
fn color(direction: Vector3<f64>) -> [f64; 3] {
    let height = -direction.y.asin();
    let shore = -0.14 + 0.16 * (noise(direction * 6.0, 1) - 0.5);
    if height < shore {
        let grain = [16.0, 32.0, 64.0, 128.0].map(|finer| noise(direction * finer, 2) - 0.5).iter().sum::<f64>();
        return [120.0, 108.0, 90.0].map(|one| one + 60.0 * grain);
    }
    if height < 0.0 {
        let wave = noise(direction.component_mul(&Vector3::new(40.0, 240.0, 40.0)), 3) - 0.5;
        return [62.0, 86.0, 108.0].map(|one| one + 20.0 * wave * (-height / 0.1).min(1.0));
    }
    let cloud = (noise(direction * 9.0, 4) + noise(direction * 18.0, 5) - 1.0).max(0.0) * (height / 0.1).min(1.0);
    [178.0, 198.0, 222.0].map(|one| one + 40.0 * cloud)
}

fn photograph(camera_from_world: &Matrix3<f64>) -> Vec<u8> {
    let middle = SIZE.map(|side| side as f64 / 2.0);
    let mut pixels = Vec::with_capacity(SIZE[0] * SIZE[1] * 3);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let mut sum = [0.0; 3];
            // Four samples soften the edges.
            for [right, down] in [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]] {
                let ray = Vector3::new(x as f64 + right - middle[0], y as f64 + down - middle[1], FOCAL_PX);
                let sample = color(camera_from_world.tr_mul(&ray).normalize());
                sum.iter_mut().zip(sample).for_each(|(sum, sample)| *sum += 0.25 * sample);
            }
            pixels.extend(sum.map(|one| one.clamp(0.0, 255.0) as u8));
        }
    }
    jpeg(&pixels, SIZE[0], SIZE[1])
}

/// How far the recorded upright photographs are from upright, in the mean, degrees.
fn off_upright(project: &serde_json::Value, truth: &[Matrix3<f64>]) -> f64 {
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let off = project["images"].as_array().expect("images").iter().zip(truth).map(|(image, truth)| {
        let upright = &image["upright_rotation"];
        let recorded = Vector3::from_fn(|row, _| number(&upright[row][1]));
        recorded.angle(&truth.column(1).into_owned()).to_degrees()
    });
    off.sum::<f64>() / truth.len() as f64
}

fn stitched(folder: &Path, more: &[&str]) -> String {
    let names = ["0.jpg", "1.jpg", "2.jpg", "-o", "pano.jpg", "--project", "pano.json"];
    finish(trueup(folder, &[&["stitch"], &names[..], more].concat())).expect_success().to_owned()
}

#[test]
fn a_coast_is_level_by_its_horizon() {
    let desk = Desk::new();
    let truth = LOOKS.map(|[yaw, pitch, roll]| camera_from_world(yaw, pitch, roll));
    for (k, camera) in truth.iter().enumerate() {
        desk.put(&format!("{k}.jpg"), photograph(camera));
    }
    let said = stitched(desk.path(), &[]);
    assert!(said.contains("the far horizon in 3 photographs"), "{said}");
    let project = desk.json("pano.json");
    let level = project["manhattan"]["level"].as_array().expect("what told");
    let horizon = level.iter().find(|one| one["source"] == "horizon").expect("the horizon");
    assert!(horizon["share"].as_f64().expect("a share") > 0.95, "{level:?}");
    let with = off_upright(&project, &truth);
    // Without it the cameras' level stays: they were all rolled to one side.
    let said = stitched(desk.path(), &["--set", "similarity.far_horizon=false"]);
    assert!(!said.contains("horizon in"), "{said}");
    let without = off_upright(&desk.json("pano.json"), &truth);
    assert!(with < 0.3 && without > 2.0, "{with} and {without} degrees");
}

/// Of cameras that did not know how they were held, the files lie on their side.
#[test]
fn a_coast_on_its_side_is_stood_up_by_its_light() {
    let desk = Desk::new();
    let truth = LOOKS.map(|[yaw, pitch, roll]| camera_from_world(yaw, pitch, roll + 90.0));
    for (k, camera) in truth.iter().enumerate() {
        desk.put(&format!("{k}.jpg"), photograph(camera));
    }
    let said = stitched(desk.path(), &[]);
    assert!(said.contains("0.jpg, 1.jpg, 2.jpg: it lies on its side in its file"), "{said}");
    let with = off_upright(&desk.json("pano.json"), &truth);
    let said = stitched(desk.path(), &["--set", "similarity.turned_photographs=false"]);
    assert!(!said.contains("in its file"), "{said}");
    let without = off_upright(&desk.json("pano.json"), &truth);
    assert!(with < 0.3 && without > 70.0, "{with} and {without} degrees");
}
