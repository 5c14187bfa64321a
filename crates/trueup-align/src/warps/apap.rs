//! As-projective-as-possible warps (APAP): a homography for every grid vertex, by moving DLT.

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::homography::undetermined;
use super::limits::{depth_at, refuse, with_depth};
use super::placement::one_after_another;
use super::{WarpInput, WarpModel, WarpOptions};
use crate::match_points::MovingDlt;

trueup_core::choice! {
    /// How the weight of a match falls with its distance from a vertex.
    pub enum Kernel {
        /// exp(-distance / decay), as in the authors' program.
        Code = "code",
        /// exp(-(distance / decay)^2), as in the paper.
        Paper = "paper",
    }
}

impl Kernel {
    /// The weight at a distance, both lengths in the same unit.
    pub(super) fn weight(self, distance: f64, decay: f64) -> f64 {
        match self {
            Self::Code => (-distance / decay).exp(),
            Self::Paper => (-(distance / decay).powi(2)).exp(),
        }
    }
}

/// Places the pictures one after the other: each vertex goes where the homography goes that fits the matches around it
/// best.
///
/// # Source
/// Zaragoza et al., "As-projective-as-possible image stitching with moving DLT" (2013), equations 9 to 13.
///
/// # Departures
/// The published method is for two pictures. Here each further one is fitted to the places that its matches have in the
/// panorama by then, as deformed as these are.
pub(super) fn place(input: &WarpInput<'_>, options: &WarpOptions, context: &StageContext<'_>) -> Result<Vec<GridMesh>> {
    one_after_another(input, context, |step, data, _| {
        let dlt = MovingDlt::new(&data.points, &data.places).ok_or_else(|| undetermined(input, step.picture))?;
        let grid = &input.grids[step.picture];
        let target: Vec<Option<[f64; 2]>> = (0..grid.len())
            .into_par_iter()
            .map(|vertex| at(&dlt, grid.source(vertex), input, step.picture, options).map(Into::into))
            .collect();
        let whole: Option<Vec<[f64; 2]>> = target.into_iter().collect();
        let target = whole.ok_or_else(|| {
            refuse(WarpModel::Apap, input, step.picture, "does not lie in front of the panorama's plane")
        })?;
        Ok(GridMesh { target, ..grid.clone() })
    })
}

/// Where a point goes; `None` behind the panorama's plane.
fn at(
    dlt: &MovingDlt,
    point: Vector2<f64>,
    input: &WarpInput<'_>,
    picture: usize,
    options: &WarpOptions,
) -> Option<Vector2<f64>> {
    let (kernel, decay) = (options.apap_kernel, options.apap_decay_px);
    let local = dlt
        .solve(|position| kernel.weight((position - point).norm(), decay).max(options.apap_weight_floor))
        .or_else(|| dlt.solve(|_| 1.0))?;
    let local = with_depth(&local, input.cameras[picture].focal_px, input.cameras[input.reference].focal_px)?;
    (depth_at(&local, &input.cameras[picture], point) > options.min_depth).then(|| local.apply(point))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Example, misalignment};
    use super::*;

    /// A floor of 1 makes all weights equal: the plain DLT homography, found by another route.
    #[test]
    fn equal_weights_are_one_homography() {
        let mut example = Example::panned(&[0.0, 25.0], 0);
        for (k, one) in example.pairs[0].inliers.iter_mut().enumerate() {
            one.in_b[0] += (k as f64 * 0.7).sin();
            one.in_b[1] += (k as f64 * 0.3).cos();
        }
        let options = WarpOptions { apap_weight_floor: 1.0, ..WarpOptions::default() };
        let placed = example.place_with(WarpModel::Apap, &options).expect("a pair");
        let points = |of: fn(&trueup_core::matches::PointMatch) -> [f64; 2]| -> Vec<Vector2<f64>> {
            example.pairs[0].inliers.iter().map(|one| Vector2::from(of(one))).collect()
        };
        let plain = trueup_core::geometry::Homography::fit(&points(|one| one.in_b), &points(|one| one.in_a), None);
        let plain = plain.expect("regular");
        for vertex in 0..example.grids[1].len() {
            let expected = plain.apply(example.grids[1].source(vertex));
            assert!((Vector2::from(placed.meshes[1].target[vertex]) - expected).norm() < 1e-4);
        }
    }

    #[test]
    fn both_kernels_follow_parallax_and_do_not_fold() {
        let mut example = Example::panned(&[0.0, 25.0], 0);
        // Below the middle the scene is nearer: its points are displaced by up to 8 px.
        for one in &mut example.pairs[0].inliers {
            one.in_b[0] += 8.0 / (1.0 + (-(one.in_b[1] - 300.0) / 60.0).exp());
        }
        let homography = example.place(WarpModel::Homography).expect("a pair");
        for kernel in [Kernel::Code, Kernel::Paper] {
            let options = WarpOptions { apap_kernel: kernel, ..WarpOptions::default() };
            let placed = example.place_with(WarpModel::Apap, &options).expect("a pair");
            assert_eq!(placed.folds, 0);
            let (moving, fixed) = (misalignment(&example, &placed.meshes), misalignment(&example, &homography.meshes));
            assert!(moving < 0.4 * fixed, "{kernel:?}: {moving} of {fixed} px");
        }
    }
}
