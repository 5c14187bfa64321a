//! Blocks at random turns, near and far, above and below: plenty of straight edges, no direction preferred.

use nalgebra::Vector3;
use trueup_core::geometry::exp_rotation;

use super::builder::Builder;
use crate::color::srgb;
use crate::material::{MaterialId, Pattern, SurfaceMaterial};
use crate::sky::Sun;

/// Blocks of many materials hanging in the air round the eye, over rolling ground.
pub(super) fn build(seed: u64) -> Builder {
    const BLOCKS: usize = 520;
    const NEAREST_M: f64 = 4.5;
    const FURTHEST_M: f64 = 34.0;
    /// Sines of the elevations between which blocks hang.
    const ELEVATIONS: [f64; 2] = [-0.12, 0.95];
    /// Half the diameter of a block as a share of its distance.
    const SIZES: [f64; 2] = [0.035, 0.13];
    let mut builder = Builder::new(seed, 5);
    let turf = builder.material(SurfaceMaterial::new(Pattern::Grass, 2.5, [0x4c_5c2c, 0x8c_8450, 0xd8_d0b0]));
    builder.block([Vector3::new(-150.0, 0.0, -150.0), Vector3::new(150.0, 1.0, 150.0)], turf);
    for _ in 0..30 {
        let (distance, turn) = (builder.dice.range(14.0, 60.0), builder.dice.range(0.0, std::f64::consts::TAU));
        let half =
            Vector3::new(builder.dice.range(4.0, 12.0), builder.dice.range(0.6, 3.0), builder.dice.range(4.0, 12.0));
        let tilt = random_axis(&mut builder) * 0.2;
        let hill = builder.ellipsoid(Vector3::new(distance * turn.sin(), 0.0, distance * turn.cos()), half, turf);
        hill.world_from_body = Some(exp_rotation(&tilt));
    }
    let materials = materials(&mut builder);
    let eye = builder.eye;
    for _ in 0..BLOCKS {
        let distance = NEAREST_M * (FURTHEST_M / NEAREST_M).powf(builder.dice.unit());
        let (sine, turn) =
            (builder.dice.range(ELEVATIONS[0], ELEVATIONS[1]), builder.dice.range(0.0, std::f64::consts::TAU));
        let level = (1.0 - sine * sine).sqrt();
        let direction = Vector3::new(level * turn.sin(), -sine, level * turn.cos());
        let half = Vector3::from_fn(|_, _| distance * builder.dice.range(SIZES[0], SIZES[1]));
        let axis = random_axis(&mut builder);
        let material = materials[builder.dice.index(materials.len())];
        let offset = Vector3::from_fn(|_, _| builder.dice.range(-9.0, 9.0));
        let block = builder.turned(eye + direction * distance, half, 0.0, material);
        block.world_from_body = Some(exp_rotation(&axis));
        block.texture_center = offset;
    }
    builder.sun = Some(Sun { towards: Vector3::new(0.5, -0.7, 0.45).normalize(), irradiance: srgb(0xff_f0dc) * 1.1 });
    builder
}

/// An axis of random direction whose length is an angle of 0 to 180 degrees.
fn random_axis(builder: &mut Builder) -> Vector3<f64> {
    let axis = Vector3::from_fn(|_, _| builder.dice.normal());
    let angle = std::f64::consts::PI * builder.dice.unit().cbrt();
    axis * (angle / axis.norm().max(1e-9))
}

fn materials(builder: &mut Builder) -> Vec<MaterialId> {
    [
        SurfaceMaterial::new(Pattern::Rock, 0.8, [0x8a_8072, 0x9a_9a5c, 0]),
        SurfaceMaterial::new(Pattern::Rock, 0.5, [0xa0_6848, 0x70_5040, 0]),
        SurfaceMaterial::new(Pattern::Rock, 0.6, [0x5a_6a78, 0x88_94a0, 0]),
        SurfaceMaterial::new(Pattern::Rock, 0.3, [0xb8_a468, 0x8a_6a30, 0]),
        SurfaceMaterial::new(Pattern::Plaster, 1.0, [0xd8_c0a4; 3]),
        SurfaceMaterial::new(Pattern::Plaster, 1.0, [0x90_a8a0; 3]),
        SurfaceMaterial::new(Pattern::Stucco, 1.0, [0xb8_7a60; 3]),
        SurfaceMaterial::new(Pattern::Foliage, 1.0, [0x2a_4a1e, 0x7a_9a40, 0]),
        SurfaceMaterial::new(Pattern::Foliage, 1.0, [0x6a_4a1e, 0xc0_9a40, 0]),
        SurfaceMaterial::new(Pattern::Asphalt, 1.0, [0x8a_8884; 3]),
        SurfaceMaterial::new(Pattern::Wood, 1.0, [0xa8_7848; 3]),
        SurfaceMaterial::new(Pattern::Picture, 1.0, [0xff_ffff; 3]),
    ]
    .map(|material| builder.material(material))
    .to_vec()
}
