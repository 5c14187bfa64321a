//! A square between houses that stand at free angles: one vertical, no shared horizontals.

use nalgebra::Vector3;
use trueup_core::geometry::rotation_about_y;

use super::house::house;
use super::pavement::{car, street_lamp, traffic_sign, tree};
use super::shared::{KERB, StreetMaterials};
use crate::color::srgb;
use crate::material::{Pattern, SurfaceMaterial};
use crate::scene::builder::Builder;
use crate::scene::wall::Wall;
use crate::sky::Sun;

/// Builds a square with two rings of houses, the outer one in the gaps of the inner.
pub(in crate::scene) fn build(seed: u64) -> Builder {
    use std::f64::consts::TAU;
    /// How many houses, and how far their fronts are, metres.
    const RINGS: [(usize, [f64; 2]); 2] = [(7, [10.0, 13.5]), (9, [25.0, 32.0])];
    /// Houses are turned against the ring by up to this, radians.
    const TURN: f64 = 0.7;
    let mut builder = Builder::new(seed, 6);
    let finish = StreetMaterials::new(&mut builder);
    let cobbles = builder.material(SurfaceMaterial::new(Pattern::Paving, 0.22, [0x98_9088; 3]));
    let far = 90.0;
    builder.block([Vector3::new(-far, 0.0, -far), Vector3::new(far, 1.0, far)], cobbles);
    for (count, distances) in RINGS {
        for k in 0..count {
            let turn = TAU * (k as f64 + builder.dice.range(-0.12, 0.12)) / count as f64;
            let distance = builder.dice.range(distances[0], distances[1]);
            // Lower than street houses, so that looking up still shows roofs before the sky.
            let (width, floors) = (builder.dice.range(7.5, 10.5), 2 + builder.dice.index(3));
            let wall = Wall {
                corner: Vector3::new(-width / 2.0, 0.0, distance),
                along: Vector3::x(),
                out: -Vector3::z(),
                length: width,
            };
            let checkpoint = builder.checkpoint();
            house(&mut builder, &wall, (width / 2.6).floor().max(2.0) as usize, floors, &finish);
            let own = builder.dice.range(-TURN, TURN);
            builder.turn_since(checkpoint, Vector3::new(0.0, 0.0, distance), own);
            builder.turn_since(checkpoint, Vector3::zeros(), turn);
        }
    }
    for k in 0..16 {
        let turn = TAU * (f64::from(k) + builder.dice.range(-0.3, 0.3)) / 16.0;
        let distance = builder.dice.range(4.5, 8.0);
        let foot = rotation_about_y(turn) * Vector3::new(0.0, 0.0, distance);
        let (checkpoint, own) = (builder.checkpoint(), builder.dice.range(0.0, TAU));
        thing(&mut builder, k, foot, &finish);
        builder.turn_since(checkpoint, foot, own);
    }
    builder.eye = Vector3::new(0.0, -1.6, 0.0);
    let towards = Vector3::new(0.5, -0.75, -0.43).normalize();
    builder.sun = Some(Sun { towards, irradiance: srgb(0xff_f0dc) * 4.0 });
    builder
}

fn thing(builder: &mut Builder, k: i32, foot: Vector3<f64>, finish: &StreetMaterials) {
    match k % 8 {
        0 | 4 => street_lamp(builder, foot, 1.0, finish),
        1 | 5 => tree(builder, foot, finish),
        2 | 6 => car(builder, foot, finish),
        3 => traffic_sign(builder, foot, finish),
        _ => {
            for offset in [-1.0, 0.0, 1.0] {
                builder.cylinder(foot + Vector3::new(offset, KERB, 0.0), 0.06, 1.0, finish.iron);
            }
        }
    }
}
