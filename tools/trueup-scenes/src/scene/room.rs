//! Furnished rooms: with right angles, and with walls at free angles.

use nalgebra::Vector3;
use trueup_core::geometry::rotation_about_y;

use super::builder::Builder;
use super::furnish::furnish;
use super::furniture::{self, RoomMaterials};
use super::style::{Middle, RoomStyle};
use super::wall::Wall;
use crate::color::srgb;
use crate::material::{MaterialId, Pattern, SurfaceMaterial};
use crate::portal::Portal;
use crate::sky::Sun;

/// Builds a room with right angles around the eye.
pub(super) fn build(seed: u64, style: RoomStyle) -> Builder {
    let mut builder = Builder::new(seed, 1);
    let [widths, lengths, heights] = style.extents();
    let (width, length) = (builder.dice.range(widths[0], widths[1]), builder.dice.range(lengths[0], lengths[1]));
    let height = builder.dice.range(heights[0], heights[1]);
    let finish = RoomMaterials::new(&mut builder);
    let (x, z) = (width / 2.0, length / 2.0);
    let corner = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let walls = [
        Wall { corner: corner(-x, z), along: Vector3::x(), out: -Vector3::z(), length: width },
        Wall { corner: corner(x, z), along: -Vector3::z(), out: -Vector3::x(), length },
        Wall { corner: corner(x, -z), along: -Vector3::x(), out: Vector3::z(), length: width },
        Wall { corner: corner(-x, -z), along: Vector3::z(), out: Vector3::x(), length },
    ];
    shell(&mut builder, [x, z], height, style, &finish);
    let covering = style.wall_covering(&mut builder);
    let accent = style.wall_covering(&mut builder);
    for (index, wall) in walls.iter().enumerate() {
        let surface = if index % 2 == 0 { covering } else { accent };
        furnish(&mut builder, wall, style.walls()[index], height, surface, &finish);
    }
    middle(&mut builder, style, [x, z], height, &finish);
    if style.has_plants() {
        furniture::plant(&mut builder, Vector3::new(x - 0.4, 0.0, z - 0.4), &finish);
        furniture::plant(&mut builder, Vector3::new(-x + 0.4, 0.0, -z + 0.4), &finish);
    }
    builder.eye = Vector3::new(0.15 * x, -1.55, -0.4 * z);
    daylight(&mut builder);
    builder
}

/// Builds a room whose five or six walls, and all that stands along them, are turned about the vertical at random: one
/// vertical, horizontals at free angles.
pub(super) fn build_turned(seed: u64, style: RoomStyle) -> Builder {
    const NEAREST_M: f64 = 3.1;
    const FURTHEST_M: f64 = 3.9;
    /// How far a wall's direction may be from where a regular polygon has it, as a share of the step.
    const JITTER: f64 = 0.17;
    /// Walls run on into one another's thickness, so that no light comes through the corners.
    const OVERLAP_M: f64 = 0.1;
    const SLAB_THICK_M: f64 = 0.25;
    const SLAB_STEP_M: f64 = 2e-4;
    let mut builder = Builder::new(seed, 4);
    let height = builder.dice.range(style.extents()[2][0], style.extents()[2][1]);
    let finish = RoomMaterials::new(&mut builder);
    let [floor, ceiling] = [style.floor(&mut builder), style.ceiling(&mut builder)];
    let [floor, ceiling] = [floor, ceiling].map(|material| builder.material(material));
    let count = 5 + builder.dice.index(2);
    let step = std::f64::consts::TAU / count as f64;
    let start = builder.dice.range(0.0, step);
    let faces: Vec<(f64, f64)> = (0..count)
        .map(|k| {
            let turn = start + step * (k as f64 + builder.dice.range(-JITTER, JITTER));
            (turn, builder.dice.range(NEAREST_M, FURTHEST_M))
        })
        .collect();
    let coverings = [style.wall_covering(&mut builder), style.wall_covering(&mut builder)];
    for (k, &(turn, distance)) in faces.iter().enumerate() {
        let ((before, left_distance), (after, right_distance)) =
            (faces[(k + count - 1) % count], faces[(k + 1) % count]);
        // Where this wall's line meets its neighbors', in a frame that faces it.
        let (left, right) = ((turn - before).sin_cos(), (after - turn).sin_cos());
        let from = (distance * left.1 - left_distance) / left.0 - OVERLAP_M;
        let to = (right_distance - distance * right.1) / right.0 + OVERLAP_M;
        let corner = Vector3::new(from, 0.0, distance);
        let wall = Wall { corner, along: Vector3::x(), out: -Vector3::z(), length: to - from };
        let checkpoint = builder.checkpoint();
        furnish(&mut builder, &wall, style.walls()[k % 4], height, coverings[k % 2], &finish);
        // Floor and ceiling are laid from every wall to the middle, each a trace nearer than the last.
        let trace = SLAB_STEP_M * k as f64;
        let (near, far) = (-SLAB_THICK_M, distance + SLAB_THICK_M);
        builder.block([Vector3::new(from, -trace, near), Vector3::new(to, SLAB_THICK_M, far)], floor);
        let (under, over) = (trace - height, -height - SLAB_THICK_M);
        builder.block([Vector3::new(from, over, near), Vector3::new(to, under, far)], ceiling);
        builder.turn_since(checkpoint, Vector3::zeros(), turn);
    }
    let (checkpoint, turn) = (builder.checkpoint(), builder.dice.range(0.0, std::f64::consts::TAU));
    middle(&mut builder, style, [NEAREST_M, NEAREST_M], height, &finish);
    ceiling_lamps(
        &mut builder,
        [NEAREST_M, NEAREST_M].map(|reach| 0.7 * reach),
        height,
        style.ceiling_lamps(),
        &finish,
    );
    let pivot = Vector3::new(0.0, 0.0, 0.4);
    builder.turn_since(checkpoint, pivot, turn);
    let place = rotation_about_y(turn) * Vector3::new(0.0, 0.0, -0.45 * NEAREST_M);
    builder.eye = Vector3::new(place.x, -1.55, place.z);
    builder.yaw_deg = turn.to_degrees();
    daylight(&mut builder);
    builder
}

fn daylight(builder: &mut Builder) {
    let towards = Vector3::new(-0.62, -0.62, 0.55).normalize();
    builder.sun = Some(Sun { towards, irradiance: srgb(0xff_ead0) * 4.0 });
    builder.sky.brightness = 1.3;
}

/// What stands in the middle of a room.
fn middle(builder: &mut Builder, style: RoomStyle, [x, z]: [f64; 2], height: f64, finish: &RoomMaterials) {
    let at = Vector3::new(builder.dice.range(-0.3, 0.3), 0.0, 0.2 * z);
    match style.middle() {
        Middle::Sculptures => furniture::sculptures(builder, [x, z], finish),
        Middle::Table => {
            let rug = rug_material(builder);
            builder.piece([at + Vector3::new(-1.5, -0.012, -1.1), at + Vector3::new(1.5, 0.0, 1.1)], rug);
            furniture::table(builder, at + Vector3::new(0.2, 0.0, 0.25), height, finish);
        }
        Middle::BareTable => furniture::table(builder, at + Vector3::new(0.2, 0.0, 0.25), height, finish),
    }
}

/// Floor, ceiling with beams or lamps.
fn shell(builder: &mut Builder, [x, z]: [f64; 2], height: f64, style: RoomStyle, finish: &RoomMaterials) {
    const THICK: f64 = 0.25;
    let floor = style.floor(builder);
    let floor = builder.material(floor);
    let ceiling = style.ceiling(builder);
    let ceiling = builder.material(ceiling);
    let (outer_x, outer_z) = (x + THICK, z + THICK);
    builder.block([Vector3::new(-outer_x, 0.0, -outer_z), Vector3::new(outer_x, THICK, outer_z)], floor);
    builder
        .block([Vector3::new(-outer_x, -height - THICK, -outer_z), Vector3::new(outer_x, -height, outer_z)], ceiling);
    if builder.dice.chance(style.beams()) {
        let beams = 4;
        for k in 0..beams {
            let at = -outer_z + 2.0 * outer_z * (f64::from(k) + 0.5) / f64::from(beams);
            builder.piece(
                [Vector3::new(-outer_x, -height, at - 0.07), Vector3::new(outer_x, -height + 0.16, at + 0.07)],
                finish.dark_timber,
            );
        }
    }
    ceiling_lamps(builder, [x, z], height, style.ceiling_lamps(), finish);
}

/// A grid of flat lamps under the ceiling.
fn ceiling_lamps(
    builder: &mut Builder,
    [x, z]: [f64; 2],
    height: f64,
    [rows, columns]: [usize; 2],
    finish: &RoomMaterials,
) {
    const HALF_M: [f64; 2] = [0.16, 0.6];
    const RADIANCE: f64 = 4.0;
    if rows * columns == 0 {
        return;
    }
    let glowing = builder.material(SurfaceMaterial::new(Pattern::Paint, 1.0, [0xff_f4e0; 3]).emitting(2.0));
    for row in 0..rows {
        for column in 0..columns {
            let at = |k: usize, count: usize, reach: f64| reach * ((2 * k + 1) as f64 / count as f64 - 1.0);
            let (at_x, at_z) = (at(column, columns, x), at(row, rows, z));
            let corner = |side: f64, margin: f64, drop: f64| {
                Vector3::new(at_x + side * (HALF_M[0] + margin), -height + drop, at_z + side * (HALF_M[1] + margin))
            };
            builder.piece([corner(-1.0, 0.03, 0.0), corner(1.0, 0.03, 0.07)], finish.white_paint);
            builder.piece([corner(-1.0, 0.0, 0.06), corner(1.0, 0.0, 0.08)], glowing);
            builder.portals.push(Portal {
                corner: corner(-1.0, 0.0, 0.081),
                side_s: Vector3::new(2.0 * HALF_M[0], 0.0, 0.0),
                side_t: Vector3::new(0.0, 0.0, 2.0 * HALF_M[1]),
                normal: Vector3::y(),
                radiance: Some(srgb(0xff_f0d8) * RADIANCE),
            });
        }
    }
}

fn rug_material(builder: &mut Builder) -> MaterialId {
    let rugs =
        [[0x8a_2e28, 0xe0_cc9c, 0x2a_3a58], [0x2e_4a66, 0xdc_d0b0, 0x8a_4a30], [0x5a_5a3c, 0xe4_d8b8, 0x7a_2c28]];
    let colors = rugs[builder.dice.index(rugs.len())];
    builder.material(SurfaceMaterial::new(Pattern::Rug, 1.0, colors))
}
