//! Straight lines of the scene as evidence for lenses: through the right lens, the rays along an edge lie in one plane.
//!
//! # Source
//! D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971 (the plumb line method). What
//! is minimized are distances in the photograph, as F. Devernay and O. Faugeras, "Straight lines have to be straight",
//! Machine Vision and Applications 13(1), 2001, advise.
//!
//! # Departures
//! Nobody chooses the lines. Whatever edge goes on smoothly takes part, and what is not straight in the scene loses its
//! influence by a loss that forgives (Cauchy).

use nalgebra::{DVector, Matrix2, Matrix2x3, Matrix3, Matrix3x2, RowSVector, SMatrix, SVector, Vector2, Vector3};
use trueup_core::camera::{Camera, INTRINSICS, ProjectionDerivatives};
use trueup_core::lines::EdgeCurve;
use trueup_core::source::WorkingFrame;

use super::observations::{cell_of, in_turns};

/// How many square pixels of a match's error a square pixel of the mean square distance of an edge from straight is
/// worth: such a mean scatters by a tenth of what a match does.
const WORTH: f64 = 100.0;
/// Root mean square distance of an edge from straight at which it begins to lose influence, in limits of Huber's loss
/// of the matches.
const LIMIT_SHARE: f64 = 0.1;
/// Cells along each side of a photograph whose edges may err together: those of one thing.
const CELLS: usize = 4;
/// Edges used in all, so that time stays bounded; photographs share them evenly when there are many: up to fifty
/// may use 160 and more each.
const EDGES_IN_ALL: usize = 8000;
/// Edges that every photograph may use, however many photographs there are.
const FEWEST_EDGES: usize = 24;
/// Fewest places along an edge that tell of its bend.
const FEWEST_PLACES: usize = 4;

/// The edges of one part of a photograph.
pub(super) struct CurveCluster {
    pub photograph: usize,
    pub curves: Vec<EdgeCurve>,
}

/// The edges of all photographs, in the order of the photographs.
#[derive(Default)]
pub(super) struct CurveObservations {
    pub clusters: Vec<CurveCluster>,
}

impl CurveObservations {
    /// Those of photographs with these frames, a bounded number: of every part of a photograph the longest.
    pub(super) fn new(frames: impl Iterator<Item = WorkingFrame>, curves: &[&[EdgeCurve]]) -> Self {
        let limit = FEWEST_EDGES.max(EDGES_IN_ALL / curves.len().max(1));
        let mut clusters = Vec::new();
        for ((photograph, frame), curves) in frames.enumerate().zip(curves) {
            let mut cells: Vec<Vec<EdgeCurve>> = vec![Vec::new(); CELLS * CELLS];
            for curve in curves.iter().filter(|curve| curve.places.len() >= FEWEST_PLACES) {
                let [x, y] = curve.places[curve.places.len() / 2];
                let cell = cell_of(y, frame.height, CELLS) * CELLS + cell_of(x, frame.width, CELLS);
                cells[cell].push(curve.clone());
            }
            keep_in_turns(&mut cells, limit);
            let filled = cells.into_iter().filter(|curves| !curves.is_empty());
            clusters.extend(filled.map(|curves| CurveCluster { photograph, curves }));
        }
        Self { clusters }
    }
}

/// Shortens lists to at most `limit` entries together: the first of each, then the second of each, and so on.
fn keep_in_turns<T>(lists: &mut [Vec<T>], limit: usize) {
    let lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
    let mut kept = vec![0; lists.len()];
    in_turns(&lengths).take(limit).for_each(|(list, _)| kept[list] += 1);
    for (list, kept) in lists.iter_mut().zip(kept) {
        list.truncate(kept);
    }
}

/// The quadratic model of a cluster's cost.
pub(super) struct CurveTerm {
    /// Weighted J^T J of the photograph's intrinsics.
    pub normal: SMatrix<f64, INTRINSICS, INTRINSICS>,
    /// Weighted J^T r.
    pub gradient: SVector<f64, INTRINSICS>,
}

/// The cost of a cluster; `huber_px` is the limit of the matches' loss.
pub(super) fn curve_cost(cameras: &[Camera], cluster: &CurveCluster, huber_px: f64) -> f64 {
    let camera = &cameras[cluster.photograph];
    let cost = |curve: &EdgeCurve| {
        let plane = || {
            let rays = rays(camera, curve);
            let by_bearing: Vec<_> =
                rays.iter().map(|ray| camera.projection_by_bearing(*ray)).collect::<Option<_>>()?;
            Plane::through(&rays, |k| &by_bearing[k])
        };
        let mean_square = plane().map_or(f64::INFINITY, |plane| plane.mean_square());
        cauchy(mean_square, huber_px).0
    };
    cluster.curves.iter().map(cost).sum()
}

/// Cauchy's loss of a mean square distance, and the weight of its squares. What is not finite costs as much as an edge
/// that is a photograph off.
fn cauchy(mean_square: f64, huber_px: f64) -> (f64, f64) {
    const FARTHEST: f64 = 1e6;
    let limit = (LIMIT_SHARE * huber_px).powi(2);
    let relative = mean_square.min(FARTHEST) / limit;
    (WORTH * limit * relative.ln_1p(), WORTH / (1.0 + relative))
}

impl CurveTerm {
    /// Linearized at these cameras.
    pub(super) fn new(cameras: &[Camera], cluster: &CurveCluster, huber_px: f64) -> Self {
        let camera = &cameras[cluster.photograph];
        let mut term = Self { normal: SMatrix::zeros(), gradient: SVector::zeros() };
        for curve in &cluster.curves {
            let Some((plane, jacobian)) = linearized(camera, curve) else { continue };
            let weight = cauchy(plane.mean_square(), huber_px).1 / curve.places.len() as f64;
            for (row, distance) in jacobian.iter().zip(plane.distances_px.iter()) {
                let weighted = row.transpose() * weight;
                term.normal += weighted * row;
                term.gradient += weighted * *distance;
            }
        }
        term
    }
}

/// The plane of an edge, and how the distances from it change with the intrinsics, a row for each; `None` where a ray
/// has no place.
fn linearized(camera: &Camera, curve: &EdgeCurve) -> Option<(Plane, Vec<RowSVector<f64, INTRINSICS>>)> {
    let rays = rays(camera, curve);
    let derivatives: Vec<ProjectionDerivatives> =
        rays.iter().map(|ray| camera.projection_derivatives(*ray)).collect::<Option<_>>()?;
    let plane = Plane::through(&rays, |k| &derivatives[k].by_bearing)?;
    let jacobian = plane.jacobian(&rays, &derivatives)?;
    Some((plane, jacobian))
}

/// The rays along an edge, unit length.
fn rays(camera: &Camera, curve: &EdgeCurve) -> Vec<Vector3<f64>> {
    curve.places.iter().map(|place| camera.bearing(Vector2::from(*place)).normalize()).collect()
}

/// The plane through the camera nearest to the rays along an edge.
struct Plane {
    /// Unit normal.
    normal: Vector3<f64>,
    /// How many pixels a ray's picture moves as the ray moves along the normal.
    scales_px: Vec<f64>,
    /// How far each place is from the plane's picture, pixels.
    distances_px: DVector<f64>,
}

impl Plane {
    /// Through rays whose pictures move with them as `by_bearing` says of each.
    fn through<'a>(rays: &[Vector3<f64>], by_bearing: impl Fn(usize) -> &'a Matrix2x3<f64>) -> Option<Self> {
        let spread = |weight: &dyn Fn(usize) -> f64| {
            let scatter = |k: usize| rays[k] * rays[k].transpose() * weight(k);
            (0..rays.len()).map(scatter).fold(Matrix3::zeros(), |sum, one| sum + one)
        };
        // Distances in the photograph are those of rays, times a scale that hardly changes along the edge.
        let roughly = flattest(&spread(&|_| 1.0))?;
        let scales_px: Vec<f64> = (0..rays.len()).map(|k| (by_bearing(k) * roughly).norm()).collect();
        let normal = flattest(&spread(&|k| scales_px[k] * scales_px[k]))?;
        let distances_px = DVector::from_fn(rays.len(), |k, _| scales_px[k] * normal.dot(&rays[k]));
        Some(Self { normal, scales_px, distances_px })
    }

    fn mean_square(&self) -> f64 {
        self.distances_px.norm_squared() / self.distances_px.len() as f64
    }

    /// How the distances of its rays change with the intrinsics while the places stay, and the plane turns after them:
    /// a row for each.
    fn jacobian(
        &self,
        rays: &[Vector3<f64>],
        derivatives: &[ProjectionDerivatives],
    ) -> Option<Vec<RowSVector<f64, INTRINSICS>>> {
        let across = self.normal.cross(&rays[rays.len() / 2]).normalize();
        let tangents = Matrix3x2::from_columns(&[across, self.normal.cross(&across)]);
        let mut jacobian = Vec::with_capacity(rays.len());
        let turning = |(ray, scale): (&Vector3<f64>, &f64)| tangents.tr_mul(ray) * *scale;
        let (mut turns, mut coupling) = (Matrix2::zeros(), SMatrix::<f64, 2, INTRINSICS>::zeros());
        for ((ray, scale), derivatives) in rays.iter().zip(&self.scales_px).zip(derivatives) {
            let row = (self.normal.transpose() * derivatives.bearing_by_pixel()?) * derivatives.by_intrinsics * -scale;
            let turning = turning((ray, scale));
            turns += turning * turning.transpose();
            coupling += turning * row;
            jacobian.push(row);
        }
        let followed = turns.try_inverse()? * coupling;
        for (row, one) in jacobian.iter_mut().zip(rays.iter().zip(&self.scales_px)) {
            *row -= turning(one).transpose() * followed;
        }
        Some(jacobian)
    }
}

/// The unit direction in which a scatter is least, by inverse iteration; `None` where it is not finite.
///
/// Rays along an edge scatter a thousand times less across its plane than in it, so that every step gains three digits
/// or more.
fn flattest(scatter: &Matrix3<f64>) -> Option<Vector3<f64>> {
    /// Steps; where two directions are nearly alike, either does.
    const STEPS: usize = 8;
    /// Change of a unit direction in a step that is due to rounding.
    const SETTLED: f64 = 1e-14;
    let [x, y, z] = [0, 1, 2].map(|column| scatter.column(column).into_owned());
    // A multiple of the inverse, which exists also where the scatter is flat.
    let inverse = Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)]);
    let longest =
        (0..3).max_by(|&a, &b| inverse.column(a).norm_squared().total_cmp(&inverse.column(b).norm_squared()))?;
    let mut direction = inverse.column(longest).try_normalize(0.0)?;
    for _ in 0..STEPS {
        let next = (inverse * direction).try_normalize(0.0)?;
        let change = (next - direction).norm_squared();
        direction = next;
        if change <= SETTLED * SETTLED {
            break;
        }
    }
    direction.iter().all(|part| part.is_finite()).then_some(direction)
}

#[cfg(test)]
#[path = "straightness_tests.rs"]
mod tests;
