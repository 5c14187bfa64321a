//! The two planes of a half-projective warp, and the way of every photograph to the panorama over them.

use nalgebra::{Matrix2, Matrix3, Vector2};
use trueup_core::geometry::Homography;
use trueup_core::mesh::GridMesh;

use super::input::WarpInput;
use super::limits::{MIN_DEPTH, depth_at, least_depth};

/// How a photograph comes to the panorama.
#[derive(Debug, Clone, Copy)]
pub(super) enum Route {
    /// By this homography to the plane of `ref`, whose center is the origin, and from there by the warp.
    ThroughRef(Homography),
    /// By this homography to the plane of `tar`. The photograph reaches behind the plane of `ref`.
    OnTar {
        onto_tar: Homography,
        /// To the plane of `ref`, for the part of the photograph that lies in front of it.
        onto_ref: Homography,
    },
}

/// Two photographs `ref` and `tar`, and all photographs on their planes. Homographies have the depth as their
/// denominator.
#[derive(Debug)]
pub(super) struct HalfPlanes {
    /// From the plane of `ref`, its center the origin, to that of `tar`; h33 = 1.
    pub tar_from_ref: Homography,
    /// The center of `tar` on the plane of `ref`.
    pub tar_center: Vector2<f64>,
    /// The longer side of `ref`, working pixels.
    pub ref_side_px: f64,
    /// Of every photograph.
    pub routes: Vec<Route>,
}

impl HalfPlanes {
    /// The planes of photographs `source` (`ref`) and `target` (`tar`); `onto_source` has every photograph's homography
    /// onto the plane of `source`. `None` if these two do not see each other's centers in front of them, or a
    /// photograph lies wholly in front of neither plane.
    pub(super) fn new(input: &WarpInput<'_>, onto_source: &[Homography], source: usize, target: usize) -> Option<Self> {
        let frame = &input.frames[source];
        let center = Vector2::new(frame.width / 2.0, frame.height / 2.0);
        let shifted = |by: Vector2<f64>| Homography(Matrix3::new(1.0, 0.0, by.x, 0.0, 1.0, by.y, 0.0, 0.0, 1.0));
        let onto_ref: Vec<Homography> = onto_source.iter().map(|plain| shifted(-center).after(plain)).collect();
        let tar_from_ref = onto_source[target].inverse()?.after(&shifted(center));
        let at_center = tar_from_ref.0[(2, 2)];
        let target_frame = &input.frames[target];
        let target_center = Vector2::new(target_frame.width / 2.0, target_frame.height / 2.0);
        let in_front = at_center > MIN_DEPTH && onto_ref[target].denominator(target_center) > MIN_DEPTH;
        if !in_front {
            return None;
        }
        let route = |photograph: usize| {
            let (onto_ref, onto_tar) = (onto_ref[photograph], tar_from_ref.after(&onto_ref[photograph]));
            if least_depth(&onto_ref, input, photograph) > MIN_DEPTH {
                Some(Route::ThroughRef(onto_ref))
            } else {
                let lies_on_tar = least_depth(&onto_tar, input, photograph) > MIN_DEPTH;
                lies_on_tar.then_some(Route::OnTar { onto_tar, onto_ref })
            }
        };
        Some(Self {
            tar_from_ref: Homography(tar_from_ref.0 / at_center),
            tar_center: onto_ref[target].apply(target_center),
            ref_side_px: frame.width.max(frame.height),
            routes: (0..onto_ref.len()).map(route).collect::<Option<_>>()?,
        })
    }

    /// Where the photographs lie and how they are deformed there, at points `step_px` apart.
    pub(super) fn sampled(&self, input: &WarpInput<'_>, step_px: f64) -> Vec<Samples> {
        let of_photograph = |(photograph, route): (usize, &Route)| {
            let points = straightened(input, photograph, step_px);
            match route {
                Route::ThroughRef(onto_ref) => {
                    let sample = |point: &Sample| Sample {
                        place: onto_ref.apply(point.place),
                        derivative: onto_ref.jacobian(point.place) * point.derivative,
                    };
                    Samples::ThroughRef(points.iter().map(sample).collect())
                }
                Route::OnTar { onto_tar, onto_ref } => {
                    let camera = &input.cameras[photograph];
                    let in_front = |point: &&Sample| depth_at(onto_ref, camera, point.place) > 0.0;
                    let derivative = |point: &Sample| onto_tar.jacobian(point.place) * point.derivative;
                    Samples::OnTar {
                        derivatives: points.iter().map(derivative).collect(),
                        in_front: points.iter().filter(in_front).map(|point| onto_ref.apply(point.place)).collect(),
                    }
                }
            }
        };
        self.routes.iter().enumerate().map(of_photograph).collect()
    }
}

/// Where a pinhole would show points of a photograph, `step_px` apart, and how these places move with the photograph's
/// own: homographies are of what pinholes show. Without those that no pinhole sees.
fn straightened(input: &WarpInput<'_>, photograph: usize, step_px: f64) -> Vec<Sample> {
    let frame = &input.frames[photograph];
    let grid = GridMesh::regular(frame.width, frame.height, step_px);
    let sample = |vertex| {
        let pixel = grid.source(vertex);
        let (place, derivative) = (input.straight(photograph, pixel), input.straight_jacobian(photograph, pixel)?);
        place.iter().chain(&derivative).all(|value| value.is_finite()).then_some(Sample { place, derivative })
    };
    (0..grid.len()).filter_map(sample).collect()
}

/// Points of a photograph, in order.
#[derive(Debug)]
pub(super) enum Samples {
    /// Of one that the warp deforms.
    ThroughRef(Vec<Sample>),
    /// Of one on the plane of `tar`.
    OnTar {
        /// Derivatives of the whole map to the panorama.
        derivatives: Vec<Matrix2<f64>>,
        /// Places on the plane of `ref` of the points in front of it.
        in_front: Vec<Vector2<f64>>,
    },
}

/// A place of a photograph on a plane, and the derivative there by the photograph's own.
#[derive(Debug)]
pub(super) struct Sample {
    pub place: Vector2<f64>,
    pub derivative: Matrix2<f64>,
}

/// Sum over the photographs of the squared distances of the derivatives from the photograph's best similarity.
/// `jacobian` is the derivative of the map from the plane of `ref` to the panorama; `None` where it has none.
///
/// # Source
/// Chang, Sato and Chuang, "Shape-preserving half-projective warps for image stitching" (2014), equation 12.
pub(super) fn distortion(samples: &[Samples], jacobian: impl Fn(Vector2<f64>) -> Option<Matrix2<f64>>) -> Option<f64> {
    let mut cost = 0.0;
    for photograph in samples {
        let mut sums = SimilaritySums::default();
        match photograph {
            Samples::ThroughRef(samples) => {
                for sample in samples {
                    sums.add(&(jacobian(sample.place)? * sample.derivative));
                }
            }
            Samples::OnTar { derivatives, .. } => derivatives.iter().for_each(|derivative| sums.add(derivative)),
        }
        cost += sums.distance();
    }
    cost.is_finite().then_some(cost)
}

/// What the distance of derivatives from their best similarity is made of.
#[derive(Debug, Default)]
struct SimilaritySums {
    squares: f64,
    turn: Vector2<f64>,
    count: usize,
}

impl SimilaritySums {
    fn add(&mut self, derivative: &Matrix2<f64>) {
        self.squares += derivative.norm_squared();
        let (diagonal, across) = (derivative[(0, 0)] + derivative[(1, 1)], derivative[(1, 0)] - derivative[(0, 1)]);
        self.turn += Vector2::new(diagonal, across);
        self.count += 1;
    }

    /// The best similarity is (alpha, beta) = turn / 2n; what it explains is 2 n (alpha^2 + beta^2).
    fn distance(&self) -> f64 {
        self.squares - self.turn.norm_squared() / (2.0 * self.count as f64)
    }
}
