//! A painted wall photographed while walking along it, and sheets on a scanner: drawn as they lie in their plane.

use nalgebra::{Matrix2, Vector2, Vector3};
use trueup::Truth;
use trueup_scenes::{FlatSetKind, FlatTexture, flat_picture, flat_rig, truth_of};

use crate::pictures::jpeg;
use crate::run::{Desk, finish, trueup};

const SIZE: [usize; 2] = [480, 360];

/// A folder with the photographs, as `wall/00.jpg` and so on, and their cameras.
fn photographed(kind: FlatSetKind) -> (Desk, Truth) {
    let (texture, cameras) = (FlatTexture::painting(kind, 5), flat_rig(kind, 5, SIZE));
    let desk = Desk::new();
    std::fs::create_dir(desk.join("wall")).expect("made");
    let mut images = Vec::new();
    for (k, camera) in cameras.iter().enumerate() {
        let file = format!("{k:02}.jpg");
        desk.put(&format!("wall/{file}"), jpeg(flat_picture(&texture, camera).data(), SIZE[0], SIZE[1]));
        images.push(truth_of(camera, file));
    }
    (desk, Truth { source: String::new(), images, level: None })
}

/// How the panorama lies to the true plane.
struct OnPlane {
    /// Largest distance from a scaled, turned and moved copy of it, pixels.
    off_px: f64,
    /// Ratio of the scales along the true plane's rows and columns.
    aspect: f64,
    /// By how much the angle between these is no right one, degrees.
    shear_deg: f64,
    /// Clockwise, degrees.
    turned_deg: f64,
}

/// Of every vertex of the recorded grids, by the true cameras: where its pixel's ray meets the plane z = 0.
fn on_plane(project: &serde_json::Value, truth: &Truth) -> OnPlane {
    let pair = |value: &serde_json::Value| Vector2::new(value[0].as_f64().expect("x"), value[1].as_f64().expect("y"));
    let mut places: Vec<[Vector2<f64>; 2]> = Vec::new();
    for (image, truth) in project["images"].as_array().expect("images").iter().zip(&truth.images) {
        let center = Vector3::from(truth.center.expect("a place"));
        let world_from_camera = nalgebra::Matrix3::from_fn(|row, column| truth.rotation[column][row]);
        let vertices = image["mesh"]["source"].as_array().expect("sources").iter();
        for (source, target) in vertices.zip(image["mesh"]["target"].as_array().expect("targets")) {
            let middle = Vector2::new(truth.width as f64, truth.height as f64) / 2.0;
            let ray = world_from_camera * (pair(source) - middle).push(truth.focal_px);
            places.push([(center - ray * (center.z / ray.z)).xy(), pair(target)]);
        }
    }
    let count = places.len() as f64;
    let [true_mean, drawn_mean] = [0, 1].map(|which| places.iter().map(|one| one[which]).sum::<Vector2<f64>>() / count);
    let (mut square, mut product) = (Matrix2::zeros(), Matrix2::zeros());
    for [place, drawn] in &places {
        let (place, drawn) = (place - true_mean, drawn - drawn_mean);
        square += place * place.transpose();
        product += drawn * place.transpose();
    }
    let affine = product * square.try_inverse().expect("not on a line");
    let (right, down) = (affine.column(0).into_owned(), affine.column(1).into_owned());
    // The least-squares similarity: what of the moments is one.
    let (along, across) = (product.trace(), product[(1, 0)] - product[(0, 1)]);
    let similarity = Matrix2::new(along, -across, across, along) / square.trace();
    let off = places.iter().map(|[place, drawn]| (drawn - drawn_mean - similarity * (place - true_mean)).norm());
    OnPlane {
        off_px: off.fold(0.0, f64::max),
        aspect: right.norm() / down.norm(),
        shear_deg: (right.dot(&down) / right.norm() / down.norm()).asin().to_degrees(),
        turned_deg: right.y.atan2(right.x).to_degrees(),
    }
}

fn check(kind: FlatSetKind, cameras: &str) -> Desk {
    let (desk, truth) = photographed(kind);
    let run =
        finish(trueup(desk.path(), &["stitch", "wall", "-o", "wall.png", "--project", "wall.json", "--require-all"]));
    let told = run.expect_success();
    assert!(told.contains(&format!("a flat scene, {cameras}")) && told.contains("drawn as a plane"), "{told}");
    let OnPlane { off_px, aspect, shear_deg, turned_deg } = on_plane(&desk.json("wall.json"), &truth);
    // Photographs of 480 pixels, some 1600 together: what a match is off is not to add up.
    assert!(off_px < 3.0, "{off_px} px off a similarity");
    assert!((aspect - 1.0).abs() < 2e-3 && shear_deg.abs() < 0.1, "{aspect} {shear_deg}");
    assert!(turned_deg.abs() < 0.3, "turned by {turned_deg} degrees though its tiles tell");
    desk
}

#[test]
fn a_wall_is_drawn_as_it_lies_and_can_be_composed_again() {
    let desk = check(FlatSetKind::Mural, "seen by moving cameras");
    let project = desk.json("wall.json");
    assert_eq!(project["flat_scene"]["told"], false);
    let depths: Vec<f64> = project["images"]
        .as_array()
        .expect("images")
        .iter()
        .map(|image| image["place"][2].as_f64().expect("a place"))
        .collect();
    assert!(depths.iter().all(|&depth| depth < 0.0), "{depths:?}");

    let again = finish(trueup(desk.path(), &["compose", "wall.json", "-o", "again.png"]));
    again.expect_success();
    let bytes = |file: &str| std::fs::read(desk.join(file)).expect("written");
    assert!(bytes("wall.png") == bytes("again.png"), "composed again, it is another");

    // There is no view to turn, which is said.
    let turned = finish(trueup(desk.path(), &["compose", "wall.json", "-o", "turned.png", "--yaw", "20", "--quiet"]));
    assert_eq!((turned.status, turned.stdout.as_str()), (0, ""));
    assert!(turned.stderr.contains("projection.yaw = 20: the photographs show a flat scene"), "{}", turned.stderr);
    assert!(bytes("wall.png") == bytes("turned.png"), "it is turned");

    let other =
        finish(trueup(desk.path(), &["compose", "wall.json", "-o", "other.png", "--projection", "cylindrical"]));
    other.expect_failure(1, &["projection.kind = cylindrical", "flat scene", "cameras.scene = rotating"]);
    let hugin = finish(trueup(desk.path(), &["compose", "wall.json", "-o", "other.png", "--pto", "wall.pto"]));
    hugin.expect_failure(1, &["Hugin project", "flat scene"]);
}

#[test]
fn scans_are_drawn_as_they_lie() {
    check(FlatSetKind::Scans, "scanned");
}

#[test]
fn a_flat_scene_can_be_forbidden_and_asked_for() {
    let (desk, _) = photographed(FlatSetKind::Scans);
    let rotating = finish(trueup(desk.path(), &["stitch", "wall", "-o", "a.png", "--scene", "rotating"]));
    assert!(!rotating.expect_success().contains("flat scene"), "{}", rotating.stdout);
    let told = finish(trueup(desk.path(), &["stitch", "wall", "-o", "b.png", "--scene", "plane"]));
    assert!(told.expect_success().contains("told; the plane explains"), "{}", told.stdout);
    let warp = finish(trueup(desk.path(), &["stitch", "wall", "-o", "c.png", "--scene", "plane", "--method", "apap"]));
    warp.expect_failure(1, &["cameras.scene = plane", "the method apap"]);
}

/// There is no Hugin project of a flat scene: that is found before the panorama is made.
#[test]
fn what_cannot_be_recorded_of_a_flat_scene_is_refused_before_anything_is_written() {
    let (desk, _) = photographed(FlatSetKind::Mural);
    let run = finish(trueup(desk.path(), &["stitch", "wall", "-o", "pano.jpg", "--pto", "pano.pto", "--scale", "0.5"]));
    run.expect_failure(1, &["trueup: error: pano.pto: Hugin project: the photographs show a flat scene"]);
    assert_eq!(desk.files(), ["wall"]);
}
