//! The open country: rocks and trees at random turns, no line straight and no direction preferred.

use nalgebra::Vector3;
use trueup_core::geometry::exp_rotation;

use super::builder::Builder;
use crate::color::srgb;
use crate::material::{Pattern, SurfaceMaterial};
use crate::sky::Sun;

/// Boulders, scree and trees around a clearing.
pub(super) fn build(seed: u64) -> Builder {
    let mut builder = Builder::new(seed, 3);
    let rocks = [[0x8a_8072, 0x9a_9a5c, 0], [0x6e_6a68, 0x8a_7a50, 0], [0xa0_8468, 0x70_7848, 0]]
        .map(|colors| builder.material(SurfaceMaterial::new(Pattern::Rock, 1.2, colors)));
    let bark = builder.material(SurfaceMaterial::new(Pattern::Rock, 0.3, [0x5a_4a3a, 0x5a_6040, 0]));
    let leaves = [[0x2a_4a1e, 0x7a_9a40, 0], [0x3a_5228, 0x9a_a04a, 0]]
        .map(|colors| builder.material(SurfaceMaterial::new(Pattern::Foliage, 1.0, colors)));
    let turf = builder.material(SurfaceMaterial::new(Pattern::Grass, 2.5, [0x4c_5c2c, 0x8c_8450, 0xd8_d0b0]));
    builder.block([Vector3::new(-150.0, 0.0, -150.0), Vector3::new(150.0, 1.0, 150.0)], turf);
    // Humps hide the plane's own horizon.
    for _ in 0..40 {
        let place = ring(&mut builder, 14.0, 80.0);
        let half =
            Vector3::new(builder.dice.range(4.0, 14.0), builder.dice.range(0.6, 4.0), builder.dice.range(4.0, 14.0));
        builder.ellipsoid(place, half, turf);
    }
    for _ in 0..260 {
        let place = ring(&mut builder, 3.5, 40.0);
        let distance = place.norm();
        let size = builder.dice.range(0.2, 1.0) * (0.4 + 0.06 * distance);
        let half = Vector3::new(size, size * builder.dice.range(0.4, 0.9), size * builder.dice.range(0.5, 1.0));
        let axis = Vector3::new(builder.dice.normal(), builder.dice.normal(), builder.dice.normal());
        let rock = rocks[builder.dice.index(rocks.len())];
        let center = place - Vector3::new(0.0, 0.3 * half.y, 0.0);
        if builder.dice.chance(0.6) {
            builder.turned(center, half, 0.0, rock).world_from_body = Some(exp_rotation(&axis));
        } else {
            builder.ellipsoid(center, half, rock).world_from_body = Some(exp_rotation(&axis));
        }
    }
    for _ in 0..70 {
        let foot = ring(&mut builder, 6.0, 55.0);
        tree(&mut builder, foot, bark, leaves[usize::from(foot.x > 0.0)]);
    }
    builder.sun = Some(Sun { towards: Vector3::new(0.5, -0.7, 0.45).normalize(), irradiance: srgb(0xff_f0dc) * 4.5 });
    builder
}

/// A place on the ground between two distances from the eye.
fn ring(builder: &mut Builder, near: f64, far: f64) -> Vector3<f64> {
    let (distance, turn) = (builder.dice.range(near, far), builder.dice.range(0.0, std::f64::consts::TAU));
    Vector3::new(distance * turn.sin(), 0.0, distance * turn.cos())
}

/// A leaning trunk with clumps of leaves.
fn tree(builder: &mut Builder, foot: Vector3<f64>, bark: usize, leaves: usize) {
    let height = builder.dice.range(2.5, 5.5);
    let lean = Vector3::new(builder.dice.range(-0.25, 0.25), 0.0, builder.dice.range(-0.25, 0.25));
    let rotation = exp_rotation(&lean);
    let trunk = builder.cylinder(foot, 0.05 * height, height, bark);
    trunk.center = foot + rotation * Vector3::new(0.0, -height / 2.0, 0.0);
    trunk.world_from_body = Some(rotation);
    let top = foot + rotation * Vector3::new(0.0, -height, 0.0);
    for _ in 0..60 {
        let offset =
            Vector3::new(builder.dice.normal(), 0.7 * builder.dice.normal(), builder.dice.normal()) * (0.22 * height);
        let size = height * builder.dice.range(0.03, 0.15);
        let tilt = Vector3::from_fn(|_, _| 0.5 * builder.dice.normal());
        let half = Vector3::new(size, builder.dice.range(0.35, 0.8) * size, size);
        builder.ellipsoid(top + offset, half, leaves).world_from_body = Some(exp_rotation(&tilt));
    }
}
