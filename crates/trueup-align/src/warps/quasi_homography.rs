//! The quasi-homography warp: a homography in the overlap, of the same slopes but linear scale beyond it.

use nalgebra::{Vector2, Vector3};
use trueup_core::geometry::Homography;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::deformed::deformed;
use super::homography::{of_pair_or_cameras, undetermined};
use super::input::WarpInput;
use super::limits::check_depth_in_overlap;
use super::options::WarpModel;
use super::options::WarpOptions;
use crate::stitch_graph::StitchGraph;

/// A homography up to a line, and beyond it the map that keeps the homography's lines but not its growing scale.
///
/// Let u be the direction in the photograph in which the homography's denominator falls, and v the direction across.
/// Lines of constant u become parallel lines, lines of constant v a pencil: a point's place is where its two lines
/// meet. Along every line of the pencil the parallels stand at the same coordinate xi(u) = (a u + b) / (d - c u). Up to
/// the line u = `partition` the map is the homography; beyond, xi continues by its tangent, and the parallels of u are
/// drawn where xi says while the pencil stays: the point moves to H(u', v) with xi(u') = xi(partition) + xi'(partition)
/// (u - partition). Straight lines of constant v stay straight, scale across grows linearly instead of hyperbolically,
/// and no point reaches the horizon. The map and its derivative are continuous across the line.
///
/// # Source
/// Li, Xu and Wang, "Quasi-homography warps in image stitching" (2018): slope preservation and scale linearization.
///
/// # Departures
/// The published system of equations is in the photograph's own axes, where both families of lines converge; along the
/// direction in which the denominator falls it has the closed form above. The partition line ends the overlap in that
/// direction instead of being a column.
#[derive(Debug, Clone)]
struct QuasiHomography {
    homography: Homography,
    /// `None` for affine maps, which grow nowhere.
    beyond: Option<Beyond>,
}

/// What holds beyond the partition line.
#[derive(Debug, Clone, Copy)]
struct Beyond {
    direction: Vector2<f64>,
    partition: f64,
    /// a, b, c, d of xi(u) = (a u + b) / (d - c u).
    xi: [f64; 4],
}

impl QuasiHomography {
    /// The warp of a homography that is left as it is up to the farthest of `kept` in the direction of its growth.
    ///
    /// `None` if one of these points is behind the homography's plane, or if it is singular.
    fn new(homography: &Homography, kept: &[Vector2<f64>]) -> Option<Self> {
        /// Change of the denominator per pixel, relative to the denominator, below which a map is affine.
        const AFFINE: f64 = 1e-9;
        if kept.iter().any(|&point| homography.denominator(point) <= 0.0) {
            return None;
        }
        let h = &homography.0;
        let slope = h[(2, 0)].hypot(h[(2, 1)]);
        let origin = kept.first().copied().unwrap_or_else(Vector2::zeros);
        if slope <= AFFINE * homography.denominator(origin).abs() {
            return Some(Self { homography: *homography, beyond: None });
        }
        let direction = Vector2::new(-h[(2, 0)], -h[(2, 1)]) / slope;
        let partition = kept.iter().map(|point| direction.dot(point)).fold(f64::NEG_INFINITY, f64::max);
        let along = Vector2::new(h[(0, 0)], h[(1, 0)]) * direction.x + Vector2::new(h[(0, 1)], h[(1, 1)]) * direction.y;
        let across =
            Vector2::new(h[(0, 1)], h[(1, 1)]) * direction.x - Vector2::new(h[(0, 0)], h[(1, 0)]) * direction.y;
        let normal = Vector2::new(across.y, -across.x).try_normalize(f64::MIN_POSITIVE)?;
        let xi = [normal.dot(&along), normal.dot(&Vector2::new(h[(0, 2)], h[(1, 2)])), slope, h[(2, 2)]];
        let regular = (xi[0] * xi[3] + xi[1] * xi[2]).abs() > f64::MIN_POSITIVE;
        regular.then_some(Self { homography: *homography, beyond: Some(Beyond { direction, partition, xi }) })
    }

    /// Where a point goes.
    fn apply(&self, point: Vector2<f64>) -> Vector2<f64> {
        let Some(beyond) = &self.beyond else { return self.homography.apply(point) };
        let u = beyond.direction.dot(&point);
        if u <= beyond.partition {
            return self.homography.apply(point);
        }
        self.homography.apply(point + beyond.direction * (beyond.drawn_back(u) - u))
    }
}

impl Beyond {
    /// The u' whose parallel the homography puts where the parallel of u belongs.
    fn drawn_back(&self, u: f64) -> f64 {
        let [a, b, c, d] = self.xi;
        let w = d - c * self.partition;
        let linear = (a * self.partition + b) / w + (a * d + b * c) / (w * w) * (u - self.partition);
        (d * linear - b) / (a + c * linear)
    }
}

/// Places every photograph relative to its neighbor in the tree of the strongest overlaps that leads to the reference.
///
/// # Departures
/// The published warp is for two photographs. Here the warp of a photograph onto its neighbor's plane is followed by
/// the neighbor's own warp, which is defined beyond its border too; overlaps that are not in the tree meet only nearly.
pub(super) fn place(input: &WarpInput<'_>, options: &WarpOptions, context: &StageContext<'_>) -> Result<Vec<GridMesh>> {
    context.check_cancelled()?;
    let model = WarpModel::QuasiHomography;
    let count = input.grids.len();
    let all: Vec<usize> = (0..count).collect();
    // For each photograph the warps to the reference, its own first.
    let mut chains: Vec<Option<Vec<QuasiHomography>>> = vec![None; count];
    chains[input.reference] = Some(Vec::new());
    for step in StitchGraph::new(count, input.pairs).spanning_tree(&all, input.reference) {
        let (photograph, parent) = (step.child, step.parent);
        let Some(onward) = chains[parent].clone() else { continue };
        let homography = of_pair_or_cameras(input, photograph, parent, options.pair_homographies)?;
        let overlap = overlap(input, photograph, parent, &homography);
        check_depth_in_overlap(model, input, photograph, &homography, &overlap)?;
        let own = QuasiHomography::new(&homography, &overlap).ok_or_else(|| undetermined(input, photograph))?;
        chains[photograph] = Some(std::iter::once(own).chain(onward).collect());
    }
    (0..count)
        .map(|photograph| {
            let chain = chains[photograph].as_ref().ok_or_else(|| undetermined(input, photograph))?;
            let straight = |point| input.straight(photograph, point);
            let place = |point| chain.iter().fold(straight(point), |place, warp| warp.apply(place));
            Ok(deformed(&input.grids[photograph], place))
        })
        .collect()
}

/// The vertices of a photograph that a homography carries into another, and its matches with that one, as of
/// [`WarpInput::straight`].
fn overlap(input: &WarpInput<'_>, photograph: usize, parent: usize, homography: &Homography) -> Vec<Vector2<f64>> {
    let (grid, frame) = (&input.grids[photograph], &input.frames[parent]);
    let inside = |point: &Vector2<f64>| {
        let place = homography.0 * Vector3::new(point.x, point.y, 1.0);
        place.z > 0.0 && frame.contains(place.x / place.z, place.y / place.z)
    };
    let pair = input.pairs.iter().find(|pair| (pair.a, pair.b) == (photograph.min(parent), photograph.max(parent)));
    let matches = pair.into_iter().flat_map(|pair| &pair.inliers);
    let matched = matches.map(|one| Vector2::from(if photograph < parent { one.in_a } else { one.in_b }));
    let straight = |point: Vector2<f64>| input.straight(photograph, point);
    let vertices = (0..grid.len()).map(|vertex| straight(grid.source(vertex))).filter(inside);
    vertices.chain(matched.map(straight)).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    use super::super::limits::{LIMITS, Limits};
    use super::super::tests::{Example, misalignment};
    use super::*;

    fn homography() -> Homography {
        Homography(Matrix3::new(1.05, 0.08, 200.0, -0.06, 1.02, 30.0, -4e-4, 6e-5, 1.0))
    }

    fn example() -> QuasiHomography {
        QuasiHomography::new(&homography(), &[Vector2::new(0.0, 0.0), Vector2::new(300.0, 600.0)]).expect("regular")
    }

    proptest! {
        /// Inside it is the homography; beyond, a line of constant v keeps its image and is walked at even steps
        /// across.
        #[test]
        fn inside_it_is_the_homography_and_beyond_its_lines_at_linear_scale(v in -300.0..300.0_f64, far in 1.0..2000.0_f64) {
            let (warp, homography) = (example(), homography());
            let Beyond { direction, partition, .. } = warp.beyond.expect("projective");
            let across = Vector2::new(-direction.y, direction.x);
            let at = |u: f64| direction * u + across * v;
            prop_assert!((warp.apply(at(partition - far)) - homography.apply(at(partition - far))).norm() < 1e-9);
            let (one, two, three) =
                (warp.apply(at(partition)), warp.apply(at(partition + far)), warp.apply(at(partition + 2.0 * far)));
            // Collinear and equally spaced: steps along a straight line whose slope does not change.
            prop_assert!(((two - one) - (three - two)).norm() < 1e-6 * (three - one).norm());
            let near = homography.apply(at(partition)) - homography.apply(at(partition - 50.0));
            prop_assert!(near.normalize().perp(&(two - one).normalize()).abs() < 1e-9);
        }

        #[test]
        fn value_and_derivative_are_continuous_across_the_line(v in -300.0..300.0_f64) {
            let warp = example();
            let Beyond { direction, partition, .. } = warp.beyond.expect("projective");
            let across = Vector2::new(-direction.y, direction.x);
            let at = |u: f64| warp.apply(direction * u + across * v);
            let (near, step) = (1e-9, 1e-3);
            prop_assert!((at(partition + near) - at(partition - near)).norm() < 1e-6);
            let before = (at(partition - near) - at(partition - near - step)) / step;
            let after = (at(partition + near + step) - at(partition + near)) / step;
            prop_assert!((after - before).norm() < 1e-5);
        }
    }

    #[test]
    fn affine_maps_are_reproduced_and_points_behind_the_plane_refused() {
        let affine = Homography(Matrix3::new(1.2, 0.1, 5.0, -0.2, 0.9, 2.0, 0.0, 0.0, 1.0));
        let warp = QuasiHomography::new(&affine, &[Vector2::zeros()]).expect("affine");
        let point = Vector2::new(700.0, -300.0);
        assert!((warp.apply(point) - affine.apply(point)).norm() < 1e-9);
        assert!(QuasiHomography::new(&homography(), &[Vector2::new(3000.0, 0.0)]).is_none());
    }

    #[test]
    fn photographs_in_a_row_meet_and_stay_smaller_than_by_homographies() {
        let example = Example::panned(&[-56.0, -28.0, 0.0, 28.0, 56.0], 2);
        let quasi = example.place(WarpModel::QuasiHomography).expect("a row");
        let wide = Limits { max_area_ratio: 1e6, max_reach: 1e6, ..LIMITS };
        let plain = example.place_within(WarpModel::Homography, &wide).expect("below 90 degrees");
        assert_eq!(quasi.folds, 0);
        assert!(misalignment(&example, &quasi.meshes) < 1.5, "{}", misalignment(&example, &quasi.meshes));
        let width = |mesh: &GridMesh| mesh.bounds().1.x - mesh.bounds().0.x;
        assert!(width(&quasi.meshes[4]) < 0.5 * width(&plain.meshes[4]));
    }
}
