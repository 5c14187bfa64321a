//! Town houses with shops.

use nalgebra::Vector3;

use super::shared::{KERB, StreetMaterials};
use crate::material::{MaterialId, Pattern, SurfaceMaterial};
use crate::scene::builder::Builder;
use crate::scene::wall::{Opening, Wall};

fn house_surface(builder: &mut Builder) -> MaterialId {
    let bricks =
        [[0x9a_5238, 0xb8_ac9c, 0x7a_4030], [0xb0_8458, 0xc4_b8a4, 0x96_6c48], [0x84_4434, 0xa0_9488, 0x5c_3428]];
    let stuccos = [0xdc_c8a0, 0xd0_a888, 0xb8_c0b0, 0xe4_dccc, 0xc8_9c80, 0xa8_b4bc];
    let material = match builder.dice.index(5) {
        0 | 1 => SurfaceMaterial::new(Pattern::Brick, 0.075, bricks[builder.dice.index(bricks.len())]),
        2 => SurfaceMaterial::new(Pattern::Ashlar, 0.36, [0xc0_b49c; 3]),
        _ => SurfaceMaterial::new(Pattern::Stucco, 1.0, [stuccos[builder.dice.index(stuccos.len())]; 3]),
    };
    builder.material(material)
}

/// One house: shops or a door below, rows of windows above, string courses, a cornice, chimneys.
pub(super) fn house(builder: &mut Builder, wall: &Wall, bays: usize, floors: usize, finish: &StreetMaterials) {
    const GROUND: f64 = 3.7;
    let storey = builder.dice.range(2.9, 3.4);
    let (surface, height) = (house_surface(builder), GROUND + storey * floors as f64 + 0.5);
    let bay = wall.length / bays as f64;
    let (window_width, window_height) = (builder.dice.range(0.95, 1.25), storey * builder.dice.range(0.5, 0.64));
    let balconies = builder.dice.chance(0.6);
    let louvres = builder.dice.chance(0.45).then(|| {
        let colors = [0x3a_5a48, 0x4a_5c70, 0x7a_3c30, 0x8a_8478];
        let color = colors[builder.dice.index(colors.len())];
        builder.material(SurfaceMaterial::new(Pattern::Louvres, 0.05, [color; 3]))
    });
    let (mut upper, mut lower) = (Vec::new(), Vec::new());
    for column in 0..bays {
        let middle = bay * (column as f64 + 0.5);
        let shop = Opening { left: middle - 0.4 * bay, right: middle + 0.4 * bay, foot: 0.55, head: 2.7 };
        let entrance = Opening { left: middle - 0.55, right: middle + 0.55, foot: KERB, head: 2.7 };
        let opening = if column == bays / 2 { entrance } else { shop };
        ground_floor(builder, wall, opening, column == bays / 2, finish);
        lower.push(opening);
        for floor in 0..floors {
            let foot = GROUND + storey * floor as f64 + 0.75;
            let opening = Opening {
                left: middle - window_width / 2.0,
                right: middle + window_width / 2.0,
                foot,
                head: foot + window_height,
            };
            window(builder, wall, opening, louvres, finish);
            if balconies && floor % 2 == 1 {
                balcony(builder, wall, opening, finish);
            }
            upper.push(opening);
        }
    }
    wall.build(builder, &lower, [0.0, GROUND - 0.35], 0.4, finish.stone);
    wall.build(builder, &upper, [GROUND, height], 0.4, surface);
    shop_sign(builder, wall, GROUND, finish);
    builder.block(wall.span([0.0, wall.length], [GROUND - 0.35, GROUND], [-0.4, 0.06]), finish.trim);
    builder.piece(wall.span([0.0, wall.length], [height, height + 0.22], [-0.4, 0.3]), finish.trim);
    builder.piece(wall.span([0.0, wall.length], [height - 0.16, height], [-0.1, 0.14]), finish.trim);
    let mut at = 0.3;
    while at < wall.length - 0.3 {
        builder.piece(wall.span([at, at + 0.14], [height - 0.3, height], [0.0, 0.24]), finish.trim);
        at += 0.62;
    }
    // The body behind keeps the sky out of the windows and carries the roof.
    builder.block(wall.span([0.02, wall.length - 0.02], [0.0, height - 0.05], [-9.0, -0.4]), surface);
    for at in [0.25, 0.7] {
        let (x, up) = (at * wall.length, height + builder.dice.range(1.0, 2.0));
        builder.piece(wall.span([x, x + 0.9], [height - 0.1, up], [-4.0, -3.2]), surface);
    }
    // A downpipe at the party wall.
    builder.cylinder(wall.at(0.12, KERB, 0.08), 0.05, height - 0.3, finish.iron);
}

/// Frame, cross bars and pane set back in an opening.
fn glazing(builder: &mut Builder, wall: &Wall, at: Opening, bars: usize, finish: &StreetMaterials) {
    let Opening { left, right, foot, head } = at;
    let paint = finish.window_paint;
    builder.piece(wall.span([left, right], [foot, head], [-0.3, -0.22]), finish.pane);
    let out = [-0.22, -0.16];
    builder.piece(wall.span([left, left + 0.07], [foot, head], out), paint);
    builder.piece(wall.span([right - 0.07, right], [foot, head], out), paint);
    builder.piece(wall.span([left, right], [foot, foot + 0.07], out), paint);
    builder.piece(wall.span([left, right], [head - 0.07, head], out), paint);
    for k in 1..=bars {
        let x = left + (right - left) * k as f64 / (bars + 1) as f64;
        builder.piece(wall.span([x - 0.03, x + 0.03], [foot, head], out), paint);
    }
    let transom = foot + 0.68 * (head - foot);
    builder.piece(wall.span([left, right], [transom - 0.025, transom + 0.025], out), paint);
}

fn window(builder: &mut Builder, wall: &Wall, at: Opening, louvres: Option<MaterialId>, finish: &StreetMaterials) {
    glazing(builder, wall, at, 1, finish);
    let Opening { left, right, foot, head } = at;
    builder.piece(wall.span([left - 0.12, right + 0.12], [foot - 0.1, foot], [-0.1, 0.12]), finish.trim);
    builder.piece(wall.span([left - 0.1, right + 0.1], [head, head + 0.22], [0.0, 0.05]), finish.trim);
    builder.piece(wall.span([left - 0.16, right + 0.16], [head + 0.22, head + 0.3], [0.0, 0.14]), finish.trim);
    if let Some(louvres) = louvres {
        let leaf = (right - left) / 2.0;
        builder.piece(wall.span([left - leaf - 0.02, left - 0.02], [foot, head], [0.0, 0.04]), louvres);
        builder.piece(wall.span([right + 0.02, right + leaf + 0.02], [foot, head], [0.0, 0.04]), louvres);
    }
}

fn balcony(builder: &mut Builder, wall: &Wall, at: Opening, finish: &StreetMaterials) {
    const DEPTH: f64 = 0.75;
    let (left, right, floor) = (at.left - 0.35, at.right + 0.35, at.foot - 0.35);
    builder.piece(wall.span([left, right], [floor - 0.14, floor], [0.0, DEPTH]), finish.trim);
    let rail = floor + 0.95;
    builder.piece(wall.span([left, right], [rail, rail + 0.04], [DEPTH - 0.05, DEPTH]), finish.iron);
    builder.piece(wall.span([left, right], [floor + 0.08, floor + 0.1], [DEPTH - 0.04, DEPTH - 0.01]), finish.iron);
    for side in [left, right - 0.04] {
        builder.piece(wall.span([side, side + 0.04], [rail, rail + 0.04], [0.0, DEPTH]), finish.iron);
    }
    let bars = ((right - left) / 0.14) as usize;
    for k in 0..=bars {
        let x = left + (right - left - 0.02) * k as f64 / bars.max(1) as f64;
        builder.piece(wall.span([x, x + 0.02], [floor, rail], [DEPTH - 0.035, DEPTH - 0.015]), finish.iron);
    }
    if builder.dice.chance(0.5) {
        builder.piece(
            wall.span([left + 0.1, right - 0.1], [floor + 0.7, floor + 0.88], [DEPTH, DEPTH + 0.16]),
            finish.timber,
        );
        for k in 0..7 {
            let x = left + 0.2 + (right - left - 0.4) * f64::from(k) / 6.0;
            let half = Vector3::new(0.13, builder.dice.range(0.08, 0.18), 0.1);
            builder.ellipsoid(wall.at(x, floor + 0.92, DEPTH + 0.08), half, finish.leaves);
        }
    }
}

fn ground_floor(builder: &mut Builder, wall: &Wall, at: Opening, entrance: bool, finish: &StreetMaterials) {
    let Opening { left, right, foot, head } = at;
    if !entrance {
        glazing(builder, wall, at, 2, finish);
        builder.piece(wall.span([left - 0.05, right + 0.05], [foot - 0.12, foot], [-0.1, 0.1]), finish.trim);
        if builder.dice.chance(0.4) {
            awning(builder, wall, at);
        }
        return;
    }
    builder.piece(wall.span([left, right], [foot, head - 0.5], [-0.3, -0.22]), finish.door);
    builder.piece(wall.span([left, right], [head - 0.5, head], [-0.3, -0.24]), finish.pane);
    builder.piece(wall.span([left, right], [head - 0.54, head - 0.46], [-0.24, -0.16]), finish.window_paint);
    let middle = (left + right) / 2.0;
    for side in [[left + 0.1, middle - 0.05], [middle + 0.05, right - 0.1]] {
        for rows in [[foot + 0.15, foot + 0.75], [foot + 0.9, head - 0.65]] {
            builder.piece(wall.span(side, rows, [-0.22, -0.2]), finish.door);
        }
    }
    builder.piece(wall.span([left - 0.2, right + 0.2], [0.0, KERB + 0.04], [-0.3, 0.3]), finish.stone);
    builder.piece(wall.span([right + 0.2, right + 0.6], [1.4, 1.95], [0.0, 0.03]), finish.poster);
}

/// A striped awning sloping down to the pavement.
fn awning(builder: &mut Builder, wall: &Wall, at: Opening) {
    let cloths = [[0xb8_3830, 0xe8_e0d0], [0x2e_6a50, 0xe8_e0d0], [0x34_5890, 0xe8_e0d0]];
    let [stripe, ground] = cloths[builder.dice.index(cloths.len())];
    let cloth = builder.material(SurfaceMaterial::new(Pattern::Curtain, 0.24, [stripe, ground, 0]));
    let out = Vector3::new(0.0, 0.35, 0.0) + wall.out;
    let rise = out.normalize();
    let normal = wall.along.cross(&rise);
    let rotation = nalgebra::Matrix3::from_columns(&[wall.along, rise, normal]);
    let half = Vector3::new((at.right - at.left) / 2.0 + 0.1, 0.55, 0.01);
    let center = wall.at((at.left + at.right) / 2.0, at.head + 0.1, 0.02) + rise * 0.55;
    builder.turned(center, half, 0.0, cloth).world_from_body = Some(rotation);
}

fn shop_sign(builder: &mut Builder, wall: &Wall, ground: f64, finish: &StreetMaterials) {
    let boards = [[0x2a_4a3a, 0xe8_d8a0], [0x7a_2420, 0xf0_e4c8], [0x24_3450, 0xe8_e4d8], [0xe4_dcc4, 0x30_2c28]];
    let [board, ink] = boards[builder.dice.index(boards.len())];
    let sign = builder.material(SurfaceMaterial::new(Pattern::Sign, 1.0, [board, ink, 0]));
    let (left, width) = (0.08 * wall.length, builder.dice.range(0.35, 0.6) * wall.length);
    builder.piece(wall.span([left, left + width], [ground - 0.85, ground - 0.1], [0.0, 0.1]), sign);
    // A sign that hangs across the pavement.
    let x = 0.9 * wall.length;
    builder.piece(wall.span([x - 0.03, x + 0.03], [ground - 0.9, ground - 0.35], [0.25, 1.25]), sign);
    builder.piece(wall.span([x - 0.02, x + 0.02], [ground - 0.32, ground - 0.28], [0.0, 1.3]), finish.iron);
}
