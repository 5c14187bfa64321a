//! What stands between the houses and the road, and beside it.

use nalgebra::Vector3;
use trueup_core::geometry::exp_rotation;

use super::shared::{KERB, REACH, ROAD, StreetMaterials};
use crate::material::{Pattern, SurfaceMaterial};
use crate::scene::builder::Builder;

/// Lamps, trees, bollards, posts and parked cars along one side.
pub(super) fn pavement(builder: &mut Builder, side: f64, finish: &StreetMaterials) {
    let mut z = -REACH + 4.0;
    let mut k = 0;
    while z < REACH - 4.0 {
        let foot = Vector3::new(side * (ROAD + 0.45), -KERB, z);
        match k % 3 {
            0 => street_lamp(builder, foot, side, finish),
            1 => tree(builder, foot, finish),
            _ => traffic_sign(builder, foot, finish),
        }
        if builder.dice.chance(0.62) && z.abs() > 5.0 {
            car(builder, Vector3::new(side * (ROAD - 1.15), 0.0, z + 3.2), finish);
        }
        for offset in [1.6, 3.2, 4.8] {
            builder.cylinder(foot + Vector3::new(0.0, 0.0, offset), 0.05, 0.9, finish.iron);
        }
        z += 6.4;
        k += 1;
    }
}

pub(super) fn street_lamp(builder: &mut Builder, foot: Vector3<f64>, side: f64, finish: &StreetMaterials) {
    builder.cylinder(foot, 0.14, 0.5, finish.iron);
    builder.cylinder(foot, 0.06, 5.2, finish.iron);
    let top = foot - Vector3::new(0.0, 5.2, 0.0);
    builder.piece([top - Vector3::new(0.03, 0.0, 0.03), top + Vector3::new(-side * 1.2, 0.06, 0.03)], finish.iron);
    let head = top + Vector3::new(-side * 1.2, 0.05, 0.0);
    builder.piece([head - Vector3::new(0.3, 0.06, 0.12), head + Vector3::new(0.3, 0.06, 0.12)], finish.window_paint);
}

pub(super) fn tree(builder: &mut Builder, foot: Vector3<f64>, finish: &StreetMaterials) {
    let height = builder.dice.range(2.6, 3.4);
    builder.cylinder(foot, 0.11, height, finish.timber);
    let crown = foot - Vector3::new(0.0, height + 0.6, 0.0);
    for _ in 0..130 {
        let offset =
            Vector3::new(0.5 * builder.dice.normal(), 0.55 * builder.dice.normal(), 0.5 * builder.dice.normal());
        let size = builder.dice.range(0.06, 0.26);
        let tilt = Vector3::from_fn(|_, _| 0.5 * builder.dice.normal());
        let half = Vector3::new(size, builder.dice.range(0.3, 0.7) * size, size);
        builder.ellipsoid(crown + offset, half, finish.leaves).world_from_body = Some(exp_rotation(&tilt));
    }
}

pub(super) fn traffic_sign(builder: &mut Builder, foot: Vector3<f64>, finish: &StreetMaterials) {
    let colors = [[0x2a_4c9a, 0xf0_f0f0], [0xf0_eee8, 0xa0_2420], [0xe8_c840, 0x20_2020]];
    let [board, ink] = colors[builder.dice.index(colors.len())];
    let plate = builder.material(SurfaceMaterial::new(Pattern::Sign, 1.0, [board, ink, 0]).glossy(0.03));
    builder.cylinder(foot, 0.035, 2.7, finish.iron);
    let top = foot - Vector3::new(0.0, 2.6, 0.0);
    builder.piece([top + Vector3::new(-0.35, 0.0, -0.05), top + Vector3::new(0.35, 0.5, -0.04)], plate);
    builder.piece([top + Vector3::new(-0.3, 0.56, -0.05), top + Vector3::new(0.3, 0.75, -0.04)], plate);
}

/// A parked car: body, cabin, windows, lights, wheels.
pub(super) fn car(builder: &mut Builder, foot: Vector3<f64>, finish: &StreetMaterials) {
    let colors = [0x8a_1f1c, 0x24_3a5c, 0xc8_c8c4, 0x2a_2c2e, 0x4a_5c48, 0xd8_d0b8];
    let color = colors[builder.dice.index(colors.len())];
    let paint = builder.material(SurfaceMaterial::new(Pattern::Paint, 1.0, [color; 3]).glossy(0.08));
    let mut part = |low: [f64; 3], high: [f64; 3], material| {
        let corner = |[x, up, z]: [f64; 3]| foot + Vector3::new(x, -up, z);
        builder.piece([corner(low), corner(high)], material);
    };
    part([-0.86, 0.26, -2.05], [0.86, 0.82, 2.05], paint);
    part([-0.82, 0.82, -1.9], [0.82, 0.9, 1.95], paint);
    part([-0.72, 0.9, -1.45], [0.72, 1.4, 0.75], finish.windscreen);
    part([-0.74, 1.4, -1.4], [0.74, 1.46, 0.7], paint);
    for z in [-1.45, -0.4, 0.68] {
        part([-0.745, 0.9, z], [-0.72, 1.42, z + 0.08], paint);
        part([0.72, 0.9, z], [0.745, 1.42, z + 0.08], paint);
    }
    for end in [[-2.08, -2.05], [2.05, 2.08]] {
        part([-0.8, 0.3, end[0]], [0.8, 0.45, end[1]], finish.rubber);
        part([-0.76, 0.58, end[0]], [-0.5, 0.72, end[1]], finish.window_paint);
        part([0.5, 0.58, end[0]], [0.76, 0.72, end[1]], finish.window_paint);
        part([-0.26, 0.5, end[0]], [0.26, 0.62, end[1]], finish.poster);
    }
    let lying = trueup_core::geometry::rotation_about_z(std::f64::consts::FRAC_PI_2);
    for (x, z) in [(-0.78, -1.3), (0.78, -1.3), (-0.78, 1.3), (0.78, 1.3)] {
        for (radius, width, material) in [(0.32, 0.11, finish.rubber), (0.2, 0.12, finish.window_paint)] {
            let wheel = builder.cylinder(foot, radius, 2.0 * width, material);
            wheel.center = foot + Vector3::new(x, -0.32, z);
            wheel.world_from_body = Some(lying);
        }
    }
}
