//! The similarity prior of a flat scene: what its cameras say.

use nalgebra::Matrix3;
use trueup_core::geometry::rows_of;

use super::prior::{Guidance, SimilarityPrior};
use crate::cameras::{FlatScene, PlaneCamera};

/// How photographs of a flat scene lie on its plane, which is the level world: as `scene` has it.
pub fn of_flat_scene(scene: &FlatScene) -> SimilarityPrior {
    let count = scene.cameras.len();
    let per_pixel: Vec<f64> = scene.cameras.iter().map(|camera| 1.0 / camera.pixels_per_unit()).collect();
    let mean = per_pixel.iter().sum::<f64>() / count.max(1) as f64;
    let roll: Vec<f64> = scene.cameras.iter().map(PlaneCamera::roll).collect();
    let mut guidance = Guidance::none(count, 0.0, Vec::new());
    guidance.failed_clause = Some(FLAT.to_owned());
    SimilarityPrior {
        theta: roll.clone(),
        scale: per_pixel.iter().map(|one| one / mean).collect(),
        guidance,
        level_from_world: rows_of(&Matrix3::identity()),
        camera_from_world: scene.cameras.iter().map(|one| one.camera.camera_from_world).collect(),
        roll,
    }
}

/// Why lines are not asked for vanishing points.
const FLAT: &str = "a flat scene has no depth that lines could lead into";
