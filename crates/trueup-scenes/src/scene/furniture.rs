//! What stands along walls and in the middle of rooms. Heights and depths are metres.

use nalgebra::Vector3;

use super::builder::Builder;
use super::wall::{Opening, Wall};
use crate::colour::srgb;
use crate::light::Portal;
use crate::material::{Material, MaterialId, Pattern};

/// Materials that the pieces of one room share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Finish {
    pub(super) timber: MaterialId,
    pub(super) dark_timber: MaterialId,
    pub(super) white_paint: MaterialId,
    pub(super) metal: MaterialId,
    pub(super) fabric: MaterialId,
    pub(super) cushion: MaterialId,
    pub(super) curtain: MaterialId,
    pub(super) spine: MaterialId,
    pub(super) paper: MaterialId,
    pub(super) page: MaterialId,
    pub(super) picture: MaterialId,
    pub(super) ceramic: MaterialId,
    pub(super) leaves: MaterialId,
    pub(super) shade: MaterialId,
}

impl Finish {
    /// Chosen by the builder's dice.
    pub(super) fn new(builder: &mut Builder) -> Self {
        let timbers = [0x9a_6a3a, 0xb4_8650, 0x7a_4a28, 0xc8_a070];
        let fabrics = [[0x4a_6078, 0x7a_90a0], [0x8a_4a40, 0xb8_7a60], [0x5a_6a48, 0x8a_9870], [0x6a_6460, 0x9a_948c]];
        let timber = timbers[builder.dice.index(timbers.len())];
        let fabric = fabrics[builder.dice.index(fabrics.len())];
        let cushion = fabrics[builder.dice.index(fabrics.len())];
        let mut add = |material: Material| builder.material(material);
        Self {
            timber: add(Material::new(Pattern::Wood, 1.0, [timber; 3]).glossy(0.008)),
            dark_timber: add(Material::new(Pattern::Wood, 1.0, [0x5a_3820; 3]).glossy(0.01)),
            white_paint: add(Material::new(Pattern::Paint, 1.0, [0xe8_e4da; 3]).glossy(0.02)),
            metal: add(Material::new(Pattern::Paint, 1.0, [0x8a_8a88; 3]).glossy(0.25)),
            fabric: add(Material::new(Pattern::Fabric, 0.008, [fabric[0], fabric[1], 0])),
            cushion: add(Material::new(Pattern::Fabric, 0.006, [cushion[1], 0xe0_d0b0, 0])),
            curtain: add(Material::new(Pattern::Curtain, 0.11, [0xd8_ccb4, cushion[0], 0])),
            spine: add(Material::new(Pattern::Spine, 1.0, [0xff_ffff; 3])),
            paper: add(Material::new(Pattern::Paint, 1.0, [0xe0_d8c4; 3])),
            page: add(Material::new(Pattern::Page, 1.0, [0xee_eae0, 0x22_2222, 0])),
            picture: add(Material::new(Pattern::Picture, 1.0, [0xff_ffff; 3]).glossy(0.01)),
            ceramic: add(Material::new(Pattern::Tiles, 0.09, [0xc8_d4d0, 0x3a_6a84, 0xe0_dcd0]).glossy(0.06)),
            leaves: add(Material::new(Pattern::Foliage, 1.0, [0x2e_5a26, 0x78_a048, 0])),
            shade: add(Material::new(Pattern::Fabric, 0.01, [0xc8_9860, 0xa8_6a3c, 0]).emitting(0.25)),
        }
    }
}

/// Four bars round a rectangle of a wall.
fn frame(builder: &mut Builder, wall: &Wall, at: Opening, bar: f64, out: [f64; 2], material: MaterialId) {
    let Opening { left, right, foot, head } = at;
    builder.piece(wall.span([left, left + bar], [foot, head], out), material);
    builder.piece(wall.span([right - bar, right], [foot, head], out), material);
    builder.piece(wall.span([left + bar, right - bar], [foot, foot + bar], out), material);
    builder.piece(wall.span([left + bar, right - bar], [head - bar, head], out), material);
}

/// The opening a window of this width needs.
pub(super) fn window_opening(left: f64, width: f64) -> Opening {
    Opening { left, right: left + width, foot: 0.85, head: 2.3 }
}

/// Window with bars, sill, curtains and radiator; the sky's light comes in through it.
pub(super) fn window(builder: &mut Builder, wall: &Wall, at: Opening, finish: &Finish) {
    let Opening { left, right, foot, head } = at;
    frame(builder, wall, at, 0.06, [-0.16, -0.09], finish.white_paint);
    let middle = (left + right) / 2.0;
    builder.piece(
        wall.span([middle - 0.03, middle + 0.03], [foot + 0.06, head - 0.06], [-0.16, -0.09]),
        finish.white_paint,
    );
    let transom = foot + 0.68 * (head - foot);
    for side in [[left + 0.06, middle - 0.03], [middle + 0.03, right - 0.06]] {
        builder.piece(wall.span(side, [transom - 0.02, transom + 0.02], [-0.15, -0.1]), finish.white_paint);
    }
    let surround = Opening { left: left - 0.08, right: right + 0.08, foot: foot - 0.02, head: head + 0.08 };
    frame(builder, wall, surround, 0.08, [0.0, 0.02], finish.white_paint);
    builder.piece(wall.span([left - 0.12, right + 0.12], [foot - 0.05, foot], [-0.09, 0.16]), finish.white_paint);
    for side in [[left - 0.42, left - 0.06], [right + 0.06, right + 0.42]] {
        builder.piece(wall.span(side, [0.06, 2.48], [0.05, 0.1]), finish.curtain);
    }
    builder.piece(wall.span([left - 0.5, right + 0.5], [2.48, 2.51], [0.06, 0.09]), finish.metal);
    let mut rib = left + 0.1;
    while rib < right - 0.1 {
        builder.piece(wall.span([rib, rib + 0.045], [0.14, 0.7], [0.04, 0.12]), finish.white_paint);
        rib += 0.06;
    }
    builder.portals.push(Portal {
        corner: wall.at(left, head, -0.24),
        side_s: wall.along * (right - left),
        side_t: Vector3::new(0.0, head - foot, 0.0),
        normal: wall.out,
        radiance: None,
    });
}

/// The opening a door needs.
pub(super) fn door_opening(left: f64) -> Opening {
    Opening { left, right: left + 0.95, foot: 0.0, head: 2.08 }
}

/// A closed door with panels, architrave and handle, and a light switch beside it.
pub(super) fn door(builder: &mut Builder, wall: &Wall, at: Opening, finish: &Finish) {
    let Opening { left, right, head, .. } = at;
    let around = Opening { left: left - 0.09, right: right + 0.09, foot: 0.0, head: head + 0.09 };
    frame(builder, wall, around, 0.09, [0.0, 0.025], finish.white_paint);
    builder.piece(wall.span([left, right], [0.005, head], [-0.12, -0.07]), finish.timber);
    let middle = (left + right) / 2.0;
    for side in [[left + 0.12, middle - 0.05], [middle + 0.05, right - 0.12]] {
        for rows in [[0.18, 0.85], [1.0, 1.9]] {
            let panel = Opening { left: side[0], right: side[1], foot: rows[0], head: rows[1] };
            frame(builder, wall, panel, 0.03, [-0.07, -0.055], finish.dark_timber);
        }
    }
    builder.piece(wall.span([right - 0.09, right - 0.05], [0.95, 1.15], [-0.07, -0.055]), finish.metal);
    builder.piece(wall.span([right - 0.2, right - 0.06], [1.05, 1.075], [-0.03, -0.01]), finish.metal);
    builder.piece(wall.span([right + 0.2, right + 0.28], [1.1, 1.18], [0.0, 0.012]), finish.white_paint);
}

/// A bookcase full of books, a vase here and there.
pub(super) fn bookcase(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &Finish) {
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
fn shelf_row(builder: &mut Builder, wall: &Wall, sides: [f64; 2], room: [f64; 2], finish: &Finish) {
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

/// A framed picture or a poster, centred `up` metres high.
pub(super) fn picture(builder: &mut Builder, wall: &Wall, centre: f64, up: f64, size: [f64; 2], finish: &Finish) {
    let at = Opening {
        left: centre - size[0] / 2.0,
        right: centre + size[0] / 2.0,
        foot: up - size[1] / 2.0,
        head: up + size[1] / 2.0,
    };
    let poster = builder.dice.chance(0.3);
    let face = if poster { finish.page } else { finish.picture };
    let border = if poster { 0.02 } else { 0.035 };
    let timber = if builder.dice.chance(0.5) { finish.dark_timber } else { finish.timber };
    frame(builder, wall, at, border, [0.0, 0.03], timber);
    let mat = if poster { border } else { border + 0.05 };
    builder.piece(
        wall.span([at.left + border, at.right - border], [at.foot + border, at.head - border], [0.0, 0.012]),
        finish.paper,
    );
    builder.piece(wall.span([at.left + mat, at.right - mat], [at.foot + mat, at.head - mat], [0.0, 0.014]), face);
}

/// A low cabinet with doors, things on top, and a picture above.
pub(super) fn cabinet(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &Finish) {
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

fn table_lamp(builder: &mut Builder, foot: Vector3<f64>, finish: &Finish) {
    builder.cylinder(foot, 0.08, 0.02, finish.metal);
    builder.cylinder(foot, 0.015, 0.3, finish.metal);
    builder.cylinder(foot - Vector3::new(0.0, 0.28, 0.0), 0.13, 0.18, finish.shade);
}

/// Pictures hung in a loose grid.
pub(super) fn gallery(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &Finish) {
    let columns = (width / 0.62).floor().max(1.0);
    for k in 0..columns as usize {
        let centre = left + width * (k as f64 + 0.5) / columns;
        let wide = builder.dice.range(0.36, 0.54);
        if builder.dice.chance(0.5) {
            let tall = builder.dice.range(0.6, 0.8);
            picture(builder, wall, centre, 1.55, [wide, tall], finish);
        } else {
            for up in [1.32, 1.86] {
                let tall = builder.dice.range(0.32, 0.46);
                picture(builder, wall, centre, up, [wide, tall], finish);
            }
        }
    }
}

/// A sofa with cushions, and a picture above.
pub(super) fn sofa(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &Finish) {
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

/// A desk with drawers, a screen, papers, a chair, and a notice board above.
pub(super) fn desk(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &Finish) {
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
pub(super) fn chair(builder: &mut Builder, foot: Vector3<f64>, finish: &Finish) {
    let yaw = builder.dice.range(-0.5, 0.5);
    let rotation = trueup_core::geometry::rotation_about_y(yaw);
    let mut part = |x: f64, up: f64, z: f64, half: [f64; 3], material| {
        let centre = foot + rotation * Vector3::new(x, -up, z);
        builder.turned(centre, Vector3::from(half), yaw, material);
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
pub(super) fn table(builder: &mut Builder, foot: Vector3<f64>, ceiling: f64, finish: &Finish) {
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

/// A plant in a pot.
pub(super) fn plant(builder: &mut Builder, foot: Vector3<f64>, finish: &Finish) {
    builder.cylinder(foot, 0.16, 0.32, finish.ceramic);
    builder.cylinder(foot, 0.02, 0.9, finish.dark_timber);
    for _ in 0..26 {
        let (turn, up) = (builder.dice.range(0.0, std::f64::consts::TAU), builder.dice.range(0.5, 1.35));
        let reach = builder.dice.range(0.03, 0.28);
        let size = builder.dice.range(0.05, 0.13);
        let centre = foot + Vector3::new(reach * turn.cos(), -up, reach * turn.sin());
        let half = Vector3::new(size, 0.35 * size, 0.6 * size);
        let leaf = builder.ellipsoid(centre, half, finish.leaves);
        leaf.world_from_body =
            Some(trueup_core::geometry::rotation_about_y(-turn) * trueup_core::geometry::rotation_about_z(0.5));
    }
}
