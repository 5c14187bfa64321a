//! Sofas, table lamps, plants.

use nalgebra::Vector3;

use super::materials::RoomMaterials;
use super::pictures::picture;
use crate::scene::builder::Builder;
use crate::scene::wall::Wall;

/// A sofa with cushions, and a picture above.
pub(in crate::scene) fn sofa(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    let right = left + width;
    builder.piece(wall.span([left, right], [0.12, 0.3], [0.06, 0.86]), finish.fabric);
    builder.piece(wall.span([left, right], [0.12, 0.82], [0.06, 0.26]), finish.fabric);
    for side in [[left - 0.14, left], [right, right + 0.14]] {
        builder.piece(wall.span(side, [0.08, 0.6], [0.06, 0.88]), finish.fabric);
    }
    let seats = 3;
    for k in 0..seats {
        let (a, b) =
            (left + width * f64::from(k) / f64::from(seats), left + width * f64::from(k + 1) / f64::from(seats));
        builder.piece(wall.span([a + 0.006, b - 0.006], [0.3, 0.45], [0.26, 0.9]), finish.fabric);
        builder.piece(wall.span([a + 0.01, b - 0.01], [0.45, 0.88], [0.2, 0.36]), finish.fabric);
    }
    for at in [left + 0.3, right - 0.35] {
        let turn = builder.dice.range(-0.5, 0.5);
        builder.turned(
            wall.at(at, 0.64, 0.46),
            Vector3::new(0.2, 0.19, 0.07),
            turn + wall.out.x.asin(),
            finish.cushion,
        );
    }
    let size = [builder.dice.range(0.9, 1.3), builder.dice.range(0.6, 0.8)];
    picture(builder, wall, (left + right) / 2.0, 1.62, size, finish);
}

/// A plant in a pot.
pub(in crate::scene) fn plant(builder: &mut Builder, foot: Vector3<f64>, finish: &RoomMaterials) {
    builder.cylinder(foot, 0.16, 0.32, finish.ceramic);
    builder.cylinder(foot, 0.02, 0.9, finish.dark_timber);
    for _ in 0..26 {
        let (turn, up) = (builder.dice.range(0.0, std::f64::consts::TAU), builder.dice.range(0.5, 1.35));
        let reach = builder.dice.range(0.03, 0.28);
        let size = builder.dice.range(0.05, 0.13);
        let center = foot + Vector3::new(reach * turn.cos(), -up, reach * turn.sin());
        let half = Vector3::new(size, 0.35 * size, 0.6 * size);
        let leaf = builder.ellipsoid(center, half, finish.leaves);
        leaf.world_from_body =
            Some(trueup_core::geometry::rotation_about_y(-turn) * trueup_core::geometry::rotation_about_z(0.5));
    }
}

pub(super) fn table_lamp(builder: &mut Builder, foot: Vector3<f64>, finish: &RoomMaterials) {
    builder.cylinder(foot, 0.08, 0.02, finish.metal);
    builder.cylinder(foot, 0.015, 0.3, finish.metal);
    builder.cylinder(foot - Vector3::new(0.0, 0.28, 0.0), 0.13, 0.18, finish.shade);
}
