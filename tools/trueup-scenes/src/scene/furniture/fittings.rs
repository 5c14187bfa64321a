//! What makes kitchens, offices, galleries and workshops.

use nalgebra::Vector3;

use super::materials::RoomMaterials;
use super::pictures::{frame, picture};
use super::tables::chair;
use crate::color::srgb;
use crate::material::{MaterialId, Pattern, SurfaceMaterial};
use crate::portal::Portal;
use crate::scene::builder::Builder;
use crate::scene::wall::{Opening, Wall};

/// Base units under a worktop, sink and hob, a tiled wall, wall units and things that stand about.
pub(in crate::scene) fn worktop(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    const DEPTH: f64 = 0.6;
    const TOP: f64 = 0.9;
    let right = left + width;
    let fronts = [0x5a_7468, 0xd8_d0bc, 0x8a_5a3a, 0x3c_4c60];
    let color = fronts[builder.dice.index(fronts.len())];
    let pattern = if color == 0x8a_5a3a { Pattern::Wood } else { Pattern::Paint };
    let front = builder.material(SurfaceMaterial::new(pattern, 1.0, [color; 3]).glossy(0.02));
    let stone = builder.material(SurfaceMaterial::new(Pattern::Rock, 0.05, [0x6a_6662, 0x84_807a, 0]).glossy(0.04));
    let tile =
        builder.material(SurfaceMaterial::new(Pattern::Tiles, 0.1, [0xe8_e2d0, 0x5a_8aa0, 0xb0_aca0]).glossy(0.06));
    builder.piece(wall.span([left, right], [0.1, TOP - 0.04], [0.0, DEPTH - 0.02]), finish.dark_timber);
    builder.piece(wall.span([left, right], [0.0, 0.1], [0.0, DEPTH - 0.08]), finish.iron);
    builder.piece(wall.span([left - 0.01, right + 0.01], [TOP - 0.04, TOP], [0.0, DEPTH + 0.02]), stone);
    builder.piece(wall.span([left, right], [TOP, 1.45], [0.0, 0.012]), tile);
    let units = (width / 0.6).round().max(1.0);
    for k in 0..units as usize {
        let (a, b) = (left + width * k as f64 / units, left + width * (k + 1) as f64 / units);
        unit(builder, wall, [a, b], [0.12, TOP - 0.05], DEPTH, k % 3 == 1, front, finish);
        if k as f64 != (units / 2.0).floor() {
            builder.piece(wall.span([a, b], [1.45, 2.15], [0.0, 0.33]), front);
            unit(builder, wall, [a, b], [1.46, 2.14], 0.36, false, front, finish);
        } else {
            // The hob and its hood.
            builder.piece(wall.span([a + 0.04, b - 0.04], [TOP, TOP + 0.008], [0.08, 0.54]), finish.iron);
            builder.piece(wall.span([a, b], [1.55, 1.62], [0.0, 0.48]), finish.metal);
            builder.piece(wall.span([a + 0.18, b - 0.18], [1.62, 2.3], [0.0, 0.26]), finish.metal);
            for (x, out) in [(0.17, 0.2), (0.43, 0.2), (0.17, 0.42), (0.43, 0.42)] {
                builder.cylinder(wall.at(a + x, TOP + 0.008, out), 0.075, 0.006, finish.metal);
            }
            let pot = wall.at(a + 0.17, TOP + 0.014, 0.2);
            builder.cylinder(pot, 0.09, 0.14, finish.metal);
        }
    }
    let sink = left + 0.3;
    builder.piece(wall.span([sink - 0.2, sink + 0.2], [TOP, TOP + 0.006], [0.12, 0.5]), finish.metal);
    builder.cylinder(wall.at(sink, TOP, 0.07), 0.014, 0.26, finish.metal);
    builder.piece(wall.span([sink - 0.012, sink + 0.012], [TOP + 0.25, TOP + 0.275], [0.06, 0.26]), finish.metal);
    let mut at = left + 0.62;
    while at < right - 0.15 {
        let (tall, radius) = (builder.dice.range(0.08, 0.28), builder.dice.range(0.03, 0.07));
        let material = [finish.ceramic, finish.timber, finish.shade, finish.spine][builder.dice.index(4)];
        let out = builder.dice.range(0.1, 0.3);
        builder.cylinder(wall.at(at, TOP, out), radius, tall, material);
        at += builder.dice.range(0.14, 0.34);
    }
}

/// One front of a kitchen unit: a door with a handle, or three drawers.
#[expect(clippy::too_many_arguments, reason = "where, how deep, what and of what")]
fn unit(
    builder: &mut Builder,
    wall: &Wall,
    [a, b]: [f64; 2],
    [foot, head]: [f64; 2],
    depth: f64,
    drawers: bool,
    front: MaterialId,
    finish: &RoomMaterials,
) {
    const GAP: f64 = 0.004;
    let rows = if drawers { 3 } else { 1 };
    for k in 0..rows {
        let at = |k: i32| foot + (head - foot) * f64::from(k) / f64::from(rows);
        let panel = Opening { left: a + GAP, right: b - GAP, foot: at(k) + GAP, head: at(k + 1) - GAP };
        let out = [depth - 0.02, depth];
        builder.piece(wall.span([panel.left, panel.right], [panel.foot, panel.head], out), front);
        if !drawers {
            frame(builder, wall, panel, 0.06, [depth, depth + 0.006], front);
        }
        let (middle, bar) = ((a + b) / 2.0, depth + 0.025);
        let up = if drawers || foot < 1.0 { panel.head - 0.06 } else { panel.foot + 0.05 };
        builder.piece(wall.span([middle - 0.07, middle + 0.07], [up, up + 0.012], [bar, bar + 0.012]), finish.metal);
    }
}

/// A refrigerator with notes on its door.
pub(in crate::scene) fn refrigerator(
    builder: &mut Builder,
    wall: &Wall,
    left: f64,
    width: f64,
    finish: &RoomMaterials,
) {
    const DEPTH: f64 = 0.64;
    let (right, height) = (left + width, builder.dice.range(1.75, 1.95));
    builder.piece(wall.span([left, right], [0.03, height], [0.03, DEPTH - 0.05]), finish.white_paint);
    for rows in [[0.05, 0.62], [0.635, height]] {
        builder.piece(wall.span([left, right], rows, [DEPTH - 0.05, DEPTH]), finish.white_paint);
        builder.piece(
            wall.span([right - 0.08, right - 0.05], [rows[1] - 0.4, rows[1] - 0.08], [DEPTH, DEPTH + 0.03]),
            finish.metal,
        );
    }
    for _ in 0..6 {
        let (x, up) = (left + builder.dice.range(0.05, width - 0.3), builder.dice.range(0.8, height - 0.3));
        let wide = builder.dice.range(0.08, 0.2);
        let face = if builder.dice.chance(0.5) { finish.page } else { finish.picture };
        builder.piece(wall.span([x, x + wide], [up, up + 1.3 * wide], [DEPTH, DEPTH + 0.003]), face);
    }
    builder.cylinder(wall.at(left + 0.5 * width, height, 0.3), 0.13, 0.2, finish.ceramic);
}

/// A white board with writing and notes, and a low shelf of papers below.
pub(in crate::scene) fn white_board(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    let right = left + width;
    let board = Opening { left, right, foot: 0.95, head: 2.05 };
    let ink =
        builder.material(SurfaceMaterial::new(Pattern::Writing, 0.05, [0xf0_f0ec, 0x20_3070, 0x90_2020]).glossy(0.02));
    builder.piece(wall.span([left, right], [board.foot, board.head], [0.0, 0.012]), ink);
    frame(builder, wall, board, 0.025, [0.0, 0.025], finish.metal);
    builder.piece(wall.span([left + 0.2, right - 0.2], [0.93, 0.95], [0.0, 0.08]), finish.metal);
    for _ in 0..7 {
        let (x, up) = (left + builder.dice.range(0.1, width - 0.3), builder.dice.range(1.05, 1.75));
        let wide = builder.dice.range(0.07, 0.2);
        let face = [finish.page, finish.cushion, finish.picture][builder.dice.index(3)];
        builder.piece(wall.span([x, x + wide], [up, up + 1.2 * wide], [0.012, 0.014]), face);
    }
    builder.piece(wall.span([left, right], [0.5, 0.53], [0.0, 0.3]), finish.timber);
    let mut at = left + 0.05;
    while at < right - 0.35 {
        let high = builder.dice.range(0.03, 0.25);
        builder.piece(wall.span([at, at + 0.22], [0.53, 0.53 + high], [0.03, 0.28]), finish.spine);
        at += builder.dice.range(0.24, 0.4);
    }
}

/// Steel cabinets with labelled doors, boxes on top.
pub(in crate::scene) fn lockers(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    const DEPTH: f64 = 0.45;
    let (height, columns) = (builder.dice.range(1.5, 1.95), 3);
    let tints = [0x7a_8890, 0x8a_8c80, 0x5c_6c60, 0xa0_8c74];
    let tint = tints[builder.dice.index(tints.len())];
    let steel = builder.material(SurfaceMaterial::new(Pattern::Paint, 1.0, [tint; 3]).glossy(0.03));
    builder.piece(wall.span([left, left + width], [0.06, height], [0.0, DEPTH - 0.02]), finish.iron);
    let rows = 2 + builder.dice.index(3);
    for column in 0..columns {
        let (a, b) = (
            left + width * f64::from(column) / f64::from(columns) + 0.005,
            left + width * f64::from(column + 1) / f64::from(columns) - 0.005,
        );
        for row in 0..rows {
            let at = |k: usize| 0.08 + (height - 0.1) * k as f64 / rows as f64;
            let [foot, head] = [at(row) + 0.004, at(row + 1) - 0.004];
            builder.piece(wall.span([a, b], [foot, head], [DEPTH - 0.02, DEPTH]), steel);
            let label = head - 0.12;
            builder.piece(wall.span([a + 0.08, a + 0.22], [label, label + 0.07], [DEPTH, DEPTH + 0.004]), finish.page);
            builder.piece(wall.span([b - 0.06, b - 0.035], [label - 0.1, label], [DEPTH, DEPTH + 0.018]), finish.metal);
        }
    }
    let mut at = left;
    while at < left + width - 0.3 {
        let (wide, tall) = (builder.dice.range(0.2, 0.42), builder.dice.range(0.12, 0.34));
        let carton = if builder.dice.chance(0.5) { finish.timber } else { finish.spine };
        builder.piece(wall.span([at, at + wide], [height, height + tall], [0.05, 0.4]), carton);
        at += wide + builder.dice.range(0.01, 0.1);
    }
}

/// One large painting, its label, and a lamp above it.
pub(in crate::scene) fn painting(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    let middle = left + width / 2.0;
    let size = [width * builder.dice.range(0.7, 1.0), builder.dice.range(0.8, 1.35)];
    picture(builder, wall, middle, 1.62, size, finish);
    let label = middle + size[0] / 2.0 + 0.06;
    builder.piece(wall.span([label, label + 0.12], [1.2, 1.36], [0.0, 0.006]), finish.page);
    let top = 1.62 + size[1] / 2.0;
    builder.piece(wall.span([middle - 0.01, middle + 0.01], [top, top + 0.1], [0.0, 0.16]), finish.metal);
    builder.piece(wall.span([middle - 0.2, middle + 0.2], [top + 0.08, top + 0.12], [0.14, 0.2]), finish.metal);
    builder.portals.push(Portal {
        corner: wall.at(middle - 0.2, top + 0.079, 0.14),
        side_s: wall.along * 0.4,
        side_t: wall.out * 0.06,
        normal: Vector3::y(),
        radiance: Some(srgb(0xff_f0d0) * 6.0),
    });
}

/// Benches to sit on and sculptures on stands.
pub(in crate::scene) fn sculptures(builder: &mut Builder, [x, z]: [f64; 2], finish: &RoomMaterials) {
    let marble = builder.material(SurfaceMaterial::new(Pattern::Rock, 0.4, [0xd8_d4cc, 0xb8_b0a8, 0]).glossy(0.03));
    let bronze = builder.material(SurfaceMaterial::new(Pattern::Rock, 0.15, [0x6a_5438, 0x4a_7060, 0]).glossy(0.05));
    let corner = |x: f64, up: f64, z: f64| Vector3::new(x, -up, z);
    for at in [-0.1 * z, 0.35 * z] {
        builder.piece([corner(-0.8, 0.4, at), corner(0.8, 0.46, at + 0.45)], finish.timber);
        for side in [-0.7, 0.62] {
            builder.piece([corner(side, 0.0, at + 0.05), corner(side + 0.08, 0.4, at + 0.4)], finish.iron);
        }
    }
    for (k, (at_x, at_z)) in
        [(-0.62, 0.1), (0.62, 0.3), (-0.55, 0.62), (0.55, -0.3), (0.1, 0.72), (-0.6, -0.6)].into_iter().enumerate()
    {
        let (at_x, at_z) = (at_x * x, at_z * z);
        let height = builder.dice.range(0.7, 1.1);
        builder
            .piece([corner(at_x - 0.2, 0.0, at_z - 0.2), corner(at_x + 0.2, height, at_z + 0.2)], finish.white_paint);
        builder.piece(
            [corner(at_x - 0.1, height - 0.25, at_z - 0.204), corner(at_x + 0.1, height - 0.12, at_z - 0.2)],
            finish.page,
        );
        let material = if k % 2 == 0 { marble } else { bronze };
        let mut up = height;
        for _ in 0..5 {
            let size = builder.dice.range(0.06, 0.13);
            let aside = Vector3::new(builder.dice.range(-0.06, 0.06), 0.0, builder.dice.range(-0.06, 0.06));
            let center = corner(at_x, up + size, at_z) + aside;
            builder.ellipsoid(center, Vector3::new(0.9 * size, 1.2 * size, 0.8 * size), material);
            up += 1.5 * size;
        }
    }
}

/// A bench with a vice, drawers and clutter, and a board of tools above.
pub(in crate::scene) fn workbench(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    const TOP: f64 = 0.88;
    const DEPTH: f64 = 0.65;
    let right = left + width;
    builder.piece(wall.span([left, right], [TOP - 0.07, TOP], [0.0, DEPTH]), finish.timber);
    for at in [left + 0.03, right - 0.13] {
        for out in [[0.05, 0.15], [DEPTH - 0.15, DEPTH - 0.05]] {
            builder.piece(wall.span([at, at + 0.1], [0.0, TOP - 0.07], out), finish.dark_timber);
        }
    }
    builder.piece(wall.span([left + 0.1, right - 0.1], [0.2, 0.23], [0.05, DEPTH - 0.08]), finish.timber);
    let board = Opening { left: left + 0.05, right: right - 0.05, foot: 1.15, head: 2.05 };
    builder.piece(wall.span([board.left, board.right], [board.foot, board.head], [0.0, 0.015]), finish.cushion);
    frame(builder, wall, board, 0.04, [0.0, 0.03], finish.dark_timber);
    // Tools on hooks: a handle and a blade or a head.
    let mut at = board.left + 0.1;
    while at < board.right - 0.12 {
        for row in [1.22, 1.64] {
            let (long, wide) = (builder.dice.range(0.14, 0.32), builder.dice.range(0.015, 0.04));
            let grip = if builder.dice.chance(0.5) { finish.timber } else { finish.shade };
            builder.piece(wall.span([at, at + 0.025], [row, row + 0.4 * long], [0.02, 0.045]), grip);
            let head = [at + 0.0125 - wide, at + 0.0125 + wide];
            let blade = if builder.dice.chance(0.5) {
                [row + 0.4 * long, row + long]
            } else {
                [row + 0.4 * long, row + 0.4 * long + 0.05]
            };
            builder.piece(wall.span(head, blade, [0.02, 0.03]), finish.metal);
        }
        at += builder.dice.range(0.08, 0.16);
    }
    for (floor, reach) in [(TOP, 0.5), (0.23, 0.45)] {
        let mut at = left + 0.15;
        while at < right - 0.3 {
            let (wide, tall) = (builder.dice.range(0.08, 0.3), builder.dice.range(0.05, 0.24));
            let material =
                [finish.timber, finish.metal, finish.spine, finish.ceramic, finish.page][builder.dice.index(5)];
            let from = builder.dice.range(0.05, 0.2);
            builder.piece(
                wall.span([at, at + wide], [floor, floor + tall], [from, from.max(reach - 0.2) + 0.12]),
                material,
            );
            at += wide + builder.dice.range(0.02, 0.22);
        }
    }
    chair(builder, wall.at(left + 0.6 * width, 0.0, DEPTH + 0.3), finish);
}
