//! Light straight from the portals and the sun.

use super::grid_point::GridPoint;
use crate::bvh::{Ray, SURFACE_OFFSET_M};
use crate::color::Rgb;
use crate::portal::Portal;
use crate::scene::unlit::UnlitScene;

/// Irradiance from the portals, and from the sun.
pub(super) fn direct_light(scene: &UnlitScene, place: &GridPoint, samples: usize) -> (Rgb, Rgb) {
    if place.buried {
        return (Rgb::zeros(), Rgb::zeros());
    }
    let portals = scene.portals.iter().map(|portal| portal_light(scene, place, portal, samples)).sum();
    let sun = scene.sun.map_or(Rgb::zeros(), |sun| {
        let cosine = place.normal.dot(&sun.towards);
        let lit = cosine > 0.0 && !scene.hierarchy.blocked(&Ray::new(place.point, sun.towards), f64::INFINITY);
        if lit { sun.irradiance * cosine } else { Rgb::zeros() }
    });
    (portals, sun)
}

fn portal_light(scene: &UnlitScene, place: &GridPoint, portal: &Portal, samples: usize) -> Rgb {
    const SKY_BLUR: f64 = 0.1;
    /// Windows give more light than they show, so that room and view fit into one exposure.
    const WINDOW_GAIN: f64 = 3.5;
    let patch = portal.side_s.cross(&portal.side_t).norm() / (samples * samples) as f64;
    let mut sum = Rgb::zeros();
    for k in 0..samples * samples {
        let (s, t) = ((k % samples) as f64 + 0.5, (k / samples) as f64 + 0.5);
        let target = portal.corner + (portal.side_s * s + portal.side_t * t) / samples as f64;
        let path = target - place.point;
        let distance_squared = path.norm_squared().max(1e-6);
        let direction = path / distance_squared.sqrt();
        let (here, there) = (place.normal.dot(&direction), -portal.normal.dot(&direction));
        if here <= 0.0 || there <= 0.0 {
            continue;
        }
        let limit = distance_squared.sqrt() - 2.0 * SURFACE_OFFSET_M;
        if scene.hierarchy.blocked(&Ray::new(place.point, direction), limit) {
            continue;
        }
        let radiance = portal.radiance.unwrap_or_else(|| scene.sky.radiance(direction, SKY_BLUR) * WINDOW_GAIN);
        // A patch nearer than its own size would count as a point source too close: bound it.
        sum += radiance * (here * there * patch / distance_squared.max(patch));
    }
    sum
}
