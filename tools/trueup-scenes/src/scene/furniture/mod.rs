//! What stands along walls and in the middle of rooms. Heights and depths are metres.

mod fittings;
mod openings;
mod shelves;
mod tables;

use nalgebra::Vector3;

use super::builder::Builder;
use super::wall::{Opening, Wall};
use crate::material::{Material, MaterialId, Pattern};
pub(super) use fittings::{lockers, painting, refrigerator, sculptures, white_board, workbench, worktop};
pub(super) use openings::{door, door_opening, window, window_opening};
pub(super) use shelves::{bookcase, cabinet};
use tables::chair;
pub(super) use tables::{desk, table};

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
    pub(super) iron: MaterialId,
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
            iron: add(Material::new(Pattern::Paint, 1.0, [0x2a_2c2e; 3]).glossy(0.03)),
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

/// A framed picture or a poster, centered `up` metres high.
pub(super) fn picture(builder: &mut Builder, wall: &Wall, center: f64, up: f64, size: [f64; 2], finish: &Finish) {
    let at = Opening {
        left: center - size[0] / 2.0,
        right: center + size[0] / 2.0,
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

fn table_lamp(builder: &mut Builder, foot: Vector3<f64>, finish: &Finish) {
    builder.cylinder(foot, 0.08, 0.02, finish.metal);
    builder.cylinder(foot, 0.015, 0.3, finish.metal);
    builder.cylinder(foot - Vector3::new(0.0, 0.28, 0.0), 0.13, 0.18, finish.shade);
}

/// Pictures hung in a loose grid.
pub(super) fn gallery(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &Finish) {
    let columns = (width / 0.62).floor().max(1.0);
    for k in 0..columns as usize {
        let center = left + width * (k as f64 + 0.5) / columns;
        let wide = builder.dice.range(0.36, 0.54);
        if builder.dice.chance(0.5) {
            let tall = builder.dice.range(0.6, 0.8);
            picture(builder, wall, center, 1.55, [wide, tall], finish);
        } else {
            for up in [1.32, 1.86] {
                let tall = builder.dice.range(0.32, 0.46);
                picture(builder, wall, center, up, [wide, tall], finish);
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

/// A plant in a pot.
pub(super) fn plant(builder: &mut Builder, foot: Vector3<f64>, finish: &Finish) {
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
