//! Where a photographer stands: clear of furniture, and how far all round is.

use nalgebra::Vector3;

use super::unlit::UnlitScene;
use crate::bvh::Ray;

impl UnlitScene {
    /// Distance from a point to the nearest surface, metres, over directions spread evenly; 0 inside a body.
    pub(crate) fn clearance(&self, point: [f64; 3]) -> f64 {
        const DIRECTIONS: usize = 400;
        let point = Vector3::from(point);
        if self.hierarchy.covers(&self.solids, point) {
            return 0.0;
        }
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..DIRECTIONS)
            .filter_map(|k| {
                let height = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
                let (level, (sine, cosine)) = ((1.0 - height * height).sqrt(), (golden * k as f64).sin_cos());
                let ray = Ray::new(point, Vector3::new(level * sine, height, level * cosine));
                self.hierarchy.nearest(&ray, f64::INFINITY).map(|(_, entry)| entry.distance)
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Moves the eye to the nearest place of a spiral where it is clear of everything: a hand-held camera wanders about
    /// it, and what is too near cannot be stitched. If nowhere is clear, to the clearest place.
    pub(super) fn step_clear(&mut self) {
        const CLEAR_INDOORS_M: f64 = 0.8;
        const CLEAR_OUTDOORS_M: f64 = 1.3;
        const STEP_M: f64 = 0.2;
        const RINGS: usize = 12;
        const TURNS: usize = 8;
        let wanted = if self.is_outdoors() { CLEAR_OUTDOORS_M } else { CLEAR_INDOORS_M };
        let [x, y, z] = self.viewpoint.eye;
        let mut best = (self.clearance([x, y, z]), [x, y, z]);
        for place in 0..RINGS * TURNS {
            if best.0 >= wanted {
                break;
            }
            let radius = STEP_M * (place / TURNS + 1) as f64;
            let (sine, cosine) = (std::f64::consts::TAU * (place % TURNS) as f64 / TURNS as f64).sin_cos();
            let eye = [x + radius * sine, y, z + radius * cosine];
            let clearance = self.clearance(eye);
            if clearance > best.0 {
                best = (clearance, eye);
            }
        }
        self.viewpoint.eye = best.1;
    }

    /// Measures the depth round the eye.
    pub(super) fn measure_depth(&mut self) {
        /// What is as far as this need not be told from infinity, metres.
        const ENDLESS_M: f64 = 100.0;
        let eye = Vector3::from(self.viewpoint.eye);
        let mut depths: Vec<f64> = round_about(0.0)
            .filter_map(|direction| self.hierarchy.nearest(&Ray::new(eye, direction), f64::INFINITY))
            .map(|(_, entry)| entry.distance)
            .collect();
        depths.sort_by(f64::total_cmp);
        self.viewpoint.depth_m = depths.get(depths.len() / 2).copied().unwrap_or(ENDLESS_M);
    }
}

/// Unit vectors all round at one elevation (its tangent; negative is up).
pub(super) fn round_about(elevation: f64) -> impl Iterator<Item = Vector3<f64>> {
    const TURNS: usize = 96;
    (0..TURNS).map(move |turn| {
        let (sine, cosine) = (turn as f64 / TURNS as f64 * std::f64::consts::TAU).sin_cos();
        Vector3::new(sine, elevation, cosine).normalize()
    })
}
