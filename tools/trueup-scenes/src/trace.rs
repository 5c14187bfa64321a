//! What a ray sees in a scene.

use nalgebra::Vector3;

use crate::bvh::{Ray, SURFACE_OFFSET_M};
use crate::color::Rgb;
use crate::light::tangents;
use crate::scene::lit::LitScene;
use crate::sky::SUN_RADIUS;

/// Radiance that arrives at `origin` from `direction`. `angle` is the sample's, in radians; `sun_at` a place on the
/// sun's unit disc; `mirrors` how often the ray may still be mirrored.
pub(crate) fn trace(
    scene: &LitScene,
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    angle: f64,
    sun_at: [f64; 2],
    mirrors: u32,
) -> Rgb {
    trace_surface(scene, origin, direction, angle, sun_at, mirrors).0
}

/// As [`trace`], with the body and face that was met as one number; 0 for the sky.
pub(crate) fn trace_surface(
    scene: &LitScene,
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    angle: f64,
    sun_at: [f64; 2],
    mirrors: u32,
) -> (Rgb, u64) {
    const FACES: u64 = 6;
    const MIN_COSINE: f64 = 0.08;
    const GRAZING_GAIN: f64 = 8.0;
    let ray = Ray::new(origin, direction);
    let Some((index, entry)) = scene.unlit.hierarchy.nearest(&ray, f64::INFINITY) else {
        return (scene.unlit.sky.radiance(direction, angle), 0);
    };
    let solid = &scene.unlit.solids[index];
    let point = origin + direction * entry.distance;
    let in_body = solid.to_body(point - solid.center);
    let (chart, normal) = solid.chart(entry.face, in_body);
    let normal = solid.to_world(normal);
    let cosine = (-direction.dot(&normal)).max(MIN_COSINE);
    // The pixel's footprint is an ellipse, longer by 1 / cosine one way: take the geometric mean.
    let footprint = entry.distance * angle / cosine.sqrt();
    let material = &scene.unlit.materials[solid.faces[entry.face]];
    let albedo = material.albedo(&solid.spot(entry.face, in_body, chart, footprint));
    let surface = point + normal * SURFACE_OFFSET_M;
    let irradiance = scene.light.at(index, entry.face, chart) + sunlight(scene, surface, normal, sun_at);
    let mut light = albedo.component_mul(&irradiance) / std::f64::consts::PI + material.colors[0] * material.emission;
    if material.gloss > 0.0 && mirrors > 0 {
        // Schlick's approximation; what is rough shines less at grazing angles than a mirror would.
        let grazing = (GRAZING_GAIN * material.gloss).min(1.0);
        let reflectance = material.gloss + (grazing - material.gloss) * (1.0 - cosine).powi(5);
        let mirrored = direction - normal * (2.0 * direction.dot(&normal));
        let seen = trace(scene, surface, mirrored, angle * 2.0, sun_at, mirrors - 1);
        light = light * (1.0 - reflectance) + seen * reflectance;
    }
    (light, 1 + FACES * index as u64 + entry.face as u64)
}

/// Irradiance by the sun, looking at one place of its disc.
fn sunlight(scene: &LitScene, surface: Vector3<f64>, normal: Vector3<f64>, [s, t]: [f64; 2]) -> Rgb {
    let Some(sun) = scene.unlit.sun else { return Rgb::zeros() };
    let cosine = normal.dot(&sun.towards);
    if cosine <= 0.0 {
        return Rgb::zeros();
    }
    let (right, up) = tangents(sun.towards);
    let towards = sun.towards + (right * s + up * t) * SUN_RADIUS;
    if scene.unlit.hierarchy.blocked(&Ray::new(surface, towards), f64::INFINITY) {
        return Rgb::zeros();
    }
    sun.irradiance * cosine
}
