//! Streets of town houses.

mod house;
mod pavement;
mod shared;
mod square;

use nalgebra::Vector3;

use super::builder::Builder;
use super::wall::Wall;
use crate::color::srgb;
use crate::material::{MaterialId, Pattern, SurfaceMaterial};
use crate::sky::Sun;
use house::house;
use pavement::pavement;
use shared::{FRONT, KERB, REACH, ROAD, StreetMaterials};
pub(super) use square::build as build_turned;

/// Builds a street along z with the eye on its roadway.
pub(super) fn build(seed: u64) -> Builder {
    let mut builder = Builder::new(seed, 2);
    let finish = StreetMaterials::new(&mut builder);
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

fn ground(builder: &mut Builder, stone: MaterialId) {
    let asphalt = builder.material(SurfaceMaterial::new(Pattern::Asphalt, 1.0, [0x6a_6866; 3]));
    let paving = builder.material(SurfaceMaterial::new(Pattern::Paving, 0.5, [0xa8_a094; 3]));
    let white = builder.material(SurfaceMaterial::new(Pattern::Stucco, 1.0, [0xdc_dcd6; 3]));
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
fn row_of_houses(builder: &mut Builder, front: &Wall, finish: &StreetMaterials) {
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
