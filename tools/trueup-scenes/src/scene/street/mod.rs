//! Streets of town houses.

mod house;
mod pavement;
mod square;

use nalgebra::Vector3;

use super::builder::Builder;
use super::wall::Wall;
use crate::color::srgb;
use crate::material::{Material, MaterialId, Pattern};
use crate::sky::Sun;
use house::house;
use pavement::pavement;
pub(super) use square::build as build_turned;
/// Half the width of the roadway and of the whole street, and how far it runs either way, metres.
const ROAD: f64 = 3.6;

const FRONT: f64 = 6.4;
const REACH: f64 = 75.0;
const KERB: f64 = 0.13;
/// Materials shared along the street.
#[derive(Debug, Clone, Copy)]
struct Finish {
    stone: MaterialId,
    trim: MaterialId,
    pane: MaterialId,
    window_paint: MaterialId,
    iron: MaterialId,
    door: MaterialId,
    timber: MaterialId,
    leaves: MaterialId,
    poster: MaterialId,
    rubber: MaterialId,
    windscreen: MaterialId,
}

/// Builds a street along z with the eye on its roadway.
pub(super) fn build(seed: u64) -> Builder {
    let mut builder = Builder::new(seed, 2);
    let finish = finish(&mut builder);
    ground(&mut builder, finish.stone);
    let right =
        Wall { corner: Vector3::new(FRONT, 0.0, REACH), along: -Vector3::z(), out: -Vector3::x(), length: 2.0 * REACH };
    let left =
        Wall { corner: Vector3::new(-FRONT, 0.0, -REACH), along: Vector3::z(), out: Vector3::x(), length: 2.0 * REACH };
    let far =
        Wall { corner: Vector3::new(-24.0, 0.0, REACH + 9.0), along: Vector3::x(), out: -Vector3::z(), length: 48.0 };
    let near =
        Wall { corner: Vector3::new(24.0, 0.0, -REACH - 9.0), along: -Vector3::x(), out: Vector3::z(), length: 48.0 };
    for front in [right, left, far, near] {
        row_of_houses(&mut builder, &front, &finish);
    }
    for side in [-1.0, 1.0] {
        pavement(&mut builder, side, &finish);
    }
    builder.eye = Vector3::new(-1.2, -1.6, 0.0);
    let towards = Vector3::new(0.55, -0.75, -0.37).normalize();
    builder.sun = Some(Sun { towards, irradiance: srgb(0xff_f0dc) * 4.2 });
    builder
}

fn finish(builder: &mut Builder) -> Finish {
    let mut add = |material: Material| builder.material(material);
    Finish {
        stone: add(Material::new(Pattern::Ashlar, 0.42, [0xb8_ac98; 3])),
        trim: add(Material::new(Pattern::Stucco, 1.0, [0xd8_d0c0; 3])),
        pane: add(Material::new(Pattern::Pane, 1.0, [0x1c_2228; 3]).glossy(0.12)),
        window_paint: add(Material::new(Pattern::Paint, 1.0, [0xe8_e6e0; 3])),
        iron: add(Material::new(Pattern::Paint, 1.0, [0x2c_302e; 3]).glossy(0.04)),
        door: add(Material::new(Pattern::Wood, 1.0, [0x6a_3c24; 3]).glossy(0.03)),
        timber: add(Material::new(Pattern::Wood, 1.0, [0x8a_6a48; 3])),
        leaves: add(Material::new(Pattern::Foliage, 1.0, [0x30_541e, 0x80_a044, 0])),
        poster: add(Material::new(Pattern::Page, 1.0, [0xee_e6d4, 0x22_2222, 0])),
        rubber: add(Material::new(Pattern::Paint, 1.0, [0x20_2022; 3])),
        windscreen: add(Material::new(Pattern::Paint, 1.0, [0x1a_2024; 3]).glossy(0.15)),
    }
}

fn ground(builder: &mut Builder, stone: MaterialId) {
    let asphalt = builder.material(Material::new(Pattern::Asphalt, 1.0, [0x6a_6866; 3]));
    let paving = builder.material(Material::new(Pattern::Paving, 0.5, [0xa8_a094; 3]));
    let white = builder.material(Material::new(Pattern::Stucco, 1.0, [0xdc_dcd6; 3]));
    let far = REACH + 40.0;
    let at = |x: f64, up: f64, z: f64| Vector3::new(x, -up, z);
    builder.block([at(-60.0, -1.0, -far), at(60.0, 0.0, far)], asphalt);
    for side in [-1.0, 1.0] {
        builder.block([at(side * ROAD, 0.0, -REACH), at(side * (FRONT + 1.0), KERB, REACH)], paving);
        builder.block([at(side * ROAD, 0.0, -REACH), at(side * (ROAD - 0.16), KERB + 0.01, REACH)], stone);
    }
    let mut z = -REACH;
    while z < REACH {
        builder.piece([at(-0.06, 0.0, z), at(0.06, 0.003, z + 2.0)], white);
        z += 5.0;
    }
    for k in 0..8 {
        let x = -3.0 + 0.8 * f64::from(k);
        builder.piece([at(x, 0.0, 9.0), at(x + 0.42, 0.003, 12.0)], white);
    }
}

/// Houses of different widths, heights and walls along a front.
fn row_of_houses(builder: &mut Builder, front: &Wall, finish: &Finish) {
    let mut from = 0.0;
    while from < front.length - 4.0 {
        let width = builder.dice.range(7.0, 12.5).min(front.length - from);
        let bays = (width / 2.6).floor().max(2.0);
        let floors = 3 + builder.dice.index(3);
        let house = Wall { corner: front.at(from, 0.0, 0.0), along: front.along, out: front.out, length: width };
        self::house(builder, &house, bays as usize, floors, finish);
        from += width;
    }
}
