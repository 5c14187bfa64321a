//! As-projective-as-possible warps (APAP): a homography for every grid vertex, by moving DLT.

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::distance_kernel::DistanceKernel;
use super::homography::undetermined;
use super::input::WarpInput;
use super::limits::{MIN_DEPTH, depth_at, refuse, with_depth};
use super::options::WarpModel;
use super::options::WarpOptions;
use super::placement::one_after_another;
use crate::moving_dlt::{MovingDlt, WEIGHT_FLOOR};

/// Places the photographs one after the other: each vertex goes where the homography goes that fits the matches around
/// it best.
///
/// # Source
/// Zaragoza et al., "As-projective-as-possible image stitching with moving DLT" (2013), equations 9 to 13.
///
/// # Departures
/// The published method is for two photographs. Here each further one is fitted to the places that its matches have in
/// the panorama by then, as deformed as these are.
pub(super) fn place(input: &WarpInput<'_>, options: &WarpOptions, context: &StageContext<'_>) -> Result<Vec<GridMesh>> {
    let weighting = Weighting { kernel: options.apap_kernel, decay_px: options.apap_decay_px, floor: WEIGHT_FLOOR };
    place_weighted(input, weighting, context)
}

/// How the weight of a match falls with its distance from a vertex.
#[derive(Debug, Clone, Copy)]
struct Weighting {
    kernel: DistanceKernel,
    /// Where it has fallen to 1/e, working pixels.
    decay_px: f64,
    /// Smallest weight; 1 makes all weights equal, which is one homography.
    floor: f64,
}

/// As [`place`], with any weights.
fn place_weighted(input: &WarpInput<'_>, weighting: Weighting, context: &StageContext<'_>) -> Result<Vec<GridMesh>> {
    one_after_another(input, context, |step, data, _| {
        let dlt = MovingDlt::new(&data.points, &data.places).ok_or_else(|| undetermined(input, step.photograph))?;
        let grid = &input.grids[step.photograph];
        let target: Vec<Option<[f64; 2]>> = (0..grid.len())
            .into_par_iter()
            .map(|vertex| at(&dlt, grid.source(vertex), input, step.photograph, weighting).map(Into::into))
            .collect();
        let whole: Option<Vec<[f64; 2]>> = target.into_iter().collect();
        let target = whole.ok_or_else(|| {
            refuse(WarpModel::Apap, input, step.photograph, "does not lie in front of the panorama's plane")
        })?;
        Ok(GridMesh { target, ..grid.clone() })
    })
}

/// Where a point goes; `None` behind the panorama's plane.
fn at(
    dlt: &MovingDlt,
    point: Vector2<f64>,
    input: &WarpInput<'_>,
    photograph: usize,
    weighting: Weighting,
) -> Option<Vector2<f64>> {
    let Weighting { kernel, decay_px, floor } = weighting;
    let local = dlt
        .solve(|position| kernel.weight((position - point).norm(), decay_px).max(floor))
        .or_else(|| dlt.solve(|_| 1.0))?;
    let local = with_depth(&local, input.cameras[photograph].focal_px, input.cameras[input.reference].focal_px)?;
    (depth_at(&local, &input.cameras[photograph], point) > MIN_DEPTH).then(|| local.apply(point))
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
        let weighting = Weighting { kernel: DistanceKernel::Code, decay_px: 72.25, floor: 1.0 };
        let placed = place_weighted(&example.input(), weighting, &StageContext::default()).expect("a pair");
        let points = |of: fn(&trueup_core::matches::PointMatch) -> [f64; 2]| -> Vec<Vector2<f64>> {
            example.pairs[0].inliers.iter().map(|one| Vector2::from(of(one))).collect()
        };
        let plain = trueup_core::geometry::Homography::fit(&points(|one| one.in_b), &points(|one| one.in_a), None);
        let plain = plain.expect("regular");
        for vertex in 0..example.grids[1].len() {
            let expected = plain.apply(example.grids[1].source(vertex));
            assert!((Vector2::from(placed[1].target[vertex]) - expected).norm() < 1e-4);
        }
    }

    #[test]
    fn both_kernels_follow_parallax_and_do_not_fold() {
        let mut example = Example::panned(&[0.0, 25.0], 0);
        // Below the middle the scene is nearer: its points are displaced by up to 8 px.
        for one in example.pairs[0].inliers.iter_mut() {
            one.in_b[0] += 8.0 / (1.0 + (-(one.in_b[1] - 300.0) / 60.0).exp());
        }
        let homography = example.place(WarpModel::Homography).expect("a pair");
        for kernel in [DistanceKernel::Code, DistanceKernel::Paper] {
            let options = WarpOptions { apap_kernel: kernel, ..WarpOptions::default() };
            let placed = example.place_with(WarpModel::Apap, &options).expect("a pair");
            assert_eq!(placed.folds, 0);
            let (moving, fixed) = (misalignment(&example, &placed.meshes), misalignment(&example, &homography.meshes));
            assert!(moving < 0.4 * fixed, "{kernel:?}: {moving} of {fixed} px");
        }
    }
}
