//! Bookcases and cabinets.

use nalgebra::Vector3;

use super::living::table_lamp;
use super::materials::RoomMaterials;
use super::pictures::picture;
use crate::scene::builder::Builder;
use crate::scene::wall::Wall;

/// A bookcase full of books, a vase here and there.
pub(in crate::scene) fn bookcase(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    const SIDE: f64 = 0.025;
    let (height, depth, right) = (builder.dice.range(1.9, 2.25), 0.3, left + width);
    builder.piece(wall.span([left, left + SIDE], [0.0, height], [0.0, depth]), finish.timber);
    builder.piece(wall.span([right - SIDE, right], [0.0, height], [0.0, depth]), finish.timber);
    builder.piece(wall.span([left + SIDE, right - SIDE], [0.0, height], [0.0, 0.015]), finish.dark_timber);
    let shelves = 6;
    let pitch = (height - 0.08 - SIDE) / f64::from(shelves);
    for shelf in 0..=shelves {
        let up = 0.08 + pitch * f64::from(shelf);
        builder.piece(wall.span([left + SIDE, right - SIDE], [up, up + SIDE], [0.015, depth]), finish.timber);
        if shelf < shelves {
            let floor = up + SIDE;
            shelf_row(builder, wall, [left + SIDE, right - SIDE], [floor, floor + pitch - SIDE], finish);
        }
    }
}

/// One row of books between `sides`, from the board at `room[0]` to the one at `room[1]`.
fn shelf_row(builder: &mut Builder, wall: &Wall, sides: [f64; 2], room: [f64; 2], finish: &RoomMaterials) {
    let (mut at, clear) = (sides[0] + 0.005, room[1] - room[0]);
    while at < sides[1] - 0.06 {
        if builder.dice.chance(0.06) {
            let radius = 0.06_f64.min((sides[1] - at) / 2.0);
            builder.cylinder(wall.at(at + radius, room[0], 0.16), radius, 0.6 * clear, finish.ceramic);
            at += 2.0 * radius + 0.03;
            continue;
        }
        // Books come in series of one size.
        let (height, thickness) = (clear * builder.dice.range(0.62, 0.92), builder.dice.range(0.018, 0.05));
        let depth = builder.dice.range(0.16, 0.25);
        for _ in 0..=builder.dice.index(4) {
            let thick = thickness * builder.dice.range(0.85, 1.2);
            let tall = (height * builder.dice.range(0.97, 1.03)).min(clear - 0.01);
            if at + thick > sides[1] {
                return;
            }
            let book = builder
                .piece(wall.span([at, at + thick - 0.001], [room[0], room[0] + tall], [0.03, depth]), finish.spine);
            (book.faces[2], book.faces[3]) = (finish.paper, finish.paper);
            at += thick;
        }
        if builder.dice.chance(0.1) {
            at += builder.dice.range(0.03, 0.15);
        }
    }
}

/// A low cabinet with doors, things on top, and a picture above.
pub(in crate::scene) fn cabinet(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    let (height, depth) = (0.8, 0.42);
    builder.piece(wall.span([left, left + width], [0.1, height - 0.03], [0.0, depth - 0.02]), finish.dark_timber);
    builder.piece(
        wall.span([left - 0.02, left + width + 0.02], [height - 0.03, height], [0.0, depth + 0.01]),
        finish.timber,
    );
    let doors = (width / 0.42).round().max(1.0);
    for k in 0..doors as usize {
        let (a, b) = (left + width * k as f64 / doors + 0.008, left + width * (k + 1) as f64 / doors - 0.008);
        let split = if k % 2 == 0 { 0.55 } else { 0.33 };
        for rows in [[0.12, split - 0.005], [split + 0.005, height - 0.045]] {
            builder.piece(wall.span([a, b], rows, [depth - 0.02, depth]), finish.timber);
            let knob = [(a + b) / 2.0 - 0.02, (a + b) / 2.0 + 0.02];
            builder.piece(wall.span(knob, [rows[1] - 0.06, rows[1] - 0.045], [depth, depth + 0.02]), finish.metal);
        }
    }
    for foot in [left + 0.05, left + width - 0.1] {
        builder.piece(wall.span([foot, foot + 0.05], [0.0, 0.1], [0.04, depth - 0.04]), finish.dark_timber);
    }
    table_lamp(builder, wall.at(left + 0.22, height, 0.2), finish);
    let vase = wall.at(left + width - 0.25, height, 0.2);
    builder.cylinder(vase, 0.06, 0.2, finish.ceramic);
    for _ in 0..7 {
        let offset = Vector3::new(
            builder.dice.range(-0.1, 0.1),
            builder.dice.range(-0.42, -0.22),
            builder.dice.range(-0.1, 0.1),
        );
        let size = builder.dice.range(0.04, 0.08);
        builder.ellipsoid(vase + offset, Vector3::new(size, 0.7 * size, size), finish.leaves);
    }
    let stack = wall.at(left + 0.5 * width, height, 0.2);
    for k in 0..4 {
        let (up, turn) = (0.02 + 0.036 * f64::from(k), builder.dice.range(-0.3, 0.3));
        let half = Vector3::new(0.14, 0.017, 0.1);
        builder.turned(stack - Vector3::new(0.0, up, 0.0), half, turn, finish.spine);
    }
    let size = [builder.dice.range(0.6, 0.95), builder.dice.range(0.5, 0.75)];
    picture(builder, wall, left + width / 2.0, 1.65, size, finish);
}
