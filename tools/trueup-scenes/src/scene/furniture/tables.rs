//! Desks, tables and chairs.

use nalgebra::Vector3;

use super::living::table_lamp;
use super::materials::RoomMaterials;
use super::pictures::frame;
use crate::color::srgb;
use crate::portal::Portal;
use crate::scene::builder::Builder;
use crate::scene::wall::{Opening, Wall};

/// A desk with drawers, a screen, papers, a chair, and a notice board above.
pub(in crate::scene) fn desk(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    let (right, height, depth) = (left + width, 0.74, 0.66);
    builder.piece(wall.span([left, right], [height - 0.035, height], [0.0, depth]), finish.timber);
    builder.piece(wall.span([left + 0.02, left + 0.44], [0.06, height - 0.035], [0.02, depth - 0.04]), finish.timber);
    for k in 0..3 {
        let up = 0.08 + 0.205 * f64::from(k);
        builder.piece(
            wall.span([left + 0.03, left + 0.43], [up, up + 0.19], [depth - 0.04, depth - 0.02]),
            finish.white_paint,
        );
        builder
            .piece(wall.span([left + 0.17, left + 0.29], [up + 0.13, up + 0.145], [depth - 0.02, depth]), finish.metal);
    }
    for out in [[0.03, 0.08], [depth - 0.08, depth - 0.03]] {
        builder.piece(wall.span([right - 0.08, right - 0.03], [0.0, height - 0.035], out), finish.dark_timber);
    }
    let middle = left + 0.62 * width;
    builder.piece(wall.span([middle - 0.28, middle + 0.28], [height + 0.1, height + 0.44], [0.2, 0.23]), finish.metal);
    builder.piece(
        wall.span([middle - 0.265, middle + 0.265], [height + 0.115, height + 0.425], [0.2, 0.234]),
        finish.page,
    );
    builder.piece(wall.span([middle - 0.03, middle + 0.03], [height, height + 0.1], [0.18, 0.22]), finish.metal);
    builder.piece(wall.span([middle - 0.2, middle + 0.2], [height, height + 0.02], [0.36, 0.5]), finish.white_paint);
    table_lamp(builder, wall.at(left + 0.2, height, 0.25), finish);
    let board = Opening { left: left + 0.1, right: right - 0.1, foot: 1.35, head: 1.95 };
    frame(builder, wall, board, 0.03, [0.0, 0.025], finish.timber);
    builder.piece(wall.span([board.left, board.right], [board.foot, board.head], [0.0, 0.01]), finish.cushion);
    let mut at = board.left + 0.06;
    while at < board.right - 0.25 {
        let (wide, up) = (builder.dice.range(0.14, 0.21), builder.dice.range(1.42, 1.6));
        builder.piece(wall.span([at, at + wide], [up, up + 1.4 * wide], [0.0, 0.013]), finish.page);
        at += wide + builder.dice.range(0.02, 0.08);
    }
    chair(builder, wall.at(middle, 0.0, depth + 0.25), finish);
}

/// A plain chair.
pub(super) fn chair(builder: &mut Builder, foot: Vector3<f64>, finish: &RoomMaterials) {
    let yaw = builder.dice.range(-0.5, 0.5);
    let rotation = trueup_core::geometry::rotation_about_y(yaw);
    let mut part = |x: f64, up: f64, z: f64, half: [f64; 3], material| {
        let center = foot + rotation * Vector3::new(x, -up, z);
        builder.turned(center, Vector3::from(half), yaw, material);
    };
    for (x, z) in [(-0.19, -0.19), (0.19, -0.19), (-0.19, 0.19), (0.19, 0.19)] {
        part(x, 0.22, z, [0.02, 0.22, 0.02], finish.dark_timber);
    }
    part(0.0, 0.455, 0.0, [0.22, 0.02, 0.22], finish.timber);
    for x in [-0.19, 0.19] {
        part(x, 0.68, 0.2, [0.02, 0.22, 0.015], finish.dark_timber);
    }
    for up in [0.62, 0.75, 0.87] {
        part(0.0, up, 0.2, [0.19, 0.03, 0.01], finish.timber);
    }
}

/// A dining table with chairs, a bowl, and a lamp hanging above.
pub(in crate::scene) fn table(builder: &mut Builder, foot: Vector3<f64>, ceiling: f64, finish: &RoomMaterials) {
    let corner = |x: f64, up: f64, z: f64| foot + Vector3::new(x, -up, z);
    builder.piece([corner(-0.75, 0.71, -0.45), corner(0.75, 0.75, 0.45)], finish.timber);
    builder.piece([corner(-0.68, 0.63, -0.38), corner(0.68, 0.71, 0.38)], finish.dark_timber);
    for (x, z) in [(-0.7, -0.4), (0.64, -0.4), (-0.7, 0.34), (0.64, 0.34)] {
        builder.piece([corner(x, 0.0, z), corner(x + 0.06, 0.71, z + 0.06)], finish.dark_timber);
    }
    builder.cylinder(corner(0.15, 0.75, 0.05), 0.14, 0.06, finish.ceramic);
    for k in 0..5 {
        let turn = f64::from(k) * 1.26;
        builder.ellipsoid(
            corner(0.15 + 0.07 * turn.cos(), 0.83, 0.05 + 0.07 * turn.sin()),
            Vector3::repeat(0.045),
            finish.cushion,
        );
    }
    builder.piece([corner(-0.55, 0.75, -0.3), corner(-0.25, 0.756, 0.1)], finish.page);
    for (x, z) in [(-0.35, -0.65), (0.4, -0.7), (-0.4, 0.7), (0.35, 0.68), (-1.05, 0.0)] {
        chair(builder, foot + Vector3::new(x, 0.0, z), finish);
    }
    let hang = corner(0.0, ceiling - 0.72, 0.0);
    builder.cylinder(hang, 0.005, 0.72, finish.metal);
    builder.cylinder(hang, 0.24, 0.2, finish.shade);
    let size = 0.3;
    builder.portals.push(Portal {
        corner: hang + Vector3::new(-size / 2.0, 0.01, -size / 2.0),
        side_s: Vector3::new(size, 0.0, 0.0),
        side_t: Vector3::new(0.0, 0.0, size),
        normal: Vector3::y(),
        radiance: Some(srgb(0xff_e6c0) * 3.0),
    });
}
