//! SPHP for any number of photographs: which pair the warp is made of, and where its lines lie.

use nalgebra::{Matrix2, Matrix3, Vector2};
use rayon::prelude::*;
use trueup_core::geometry::Homography;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::WarpModel;
use super::deformed::deformed;
use super::homography::onto;
use super::input::WarpInput;
use super::limits::{MIN_DEPTH, farthest_angle, least_depth, refuse};
use super::options::WarpOptions;
use super::sphp::SphpWarp;
use crate::stitch_graph::StitchGraph;

/// Offsets of the first line that are tried, in working pixels of a photograph whose longer side is
/// [`PUBLISHED_SIDE_PX`].
const FIRST_OFFSETS: [f64; 2] = [-300.0, 600.0];
/// Offsets of the second line.
const SECOND_OFFSETS: [f64; 2] = [-300.0, 200.0];
/// Step of both.
const OFFSET_STEP: f64 = 10.0;
/// Least distance of the lines.
const LEAST_GAP: f64 = 120.0;
/// The longer side of photographs that these lengths belong to.
const PUBLISHED_SIDE_PX: f64 = 800.0;
/// Distance of the points at which the distortion is sampled, working pixels.
const SAMPLE_STEP_PX: f64 = 40.0;

/// Places all photographs by one half-projective warp.
///
/// The panorama lies on the plane of a photograph `tar` where the warp is a homography, and follows the photograph
/// `ref` where it is a similarity; tried are the two photographs farthest apart in the graph and the reference with the
/// one farthest from it, in both roles, and all pairs of lines on a raster. The least distorted one is taken: that with
/// the smallest sum of squared distances of the Jacobians from each photograph's best similarity.
///
/// # Source
/// Chang, Sato and Chuang, "Shape-preserving half-projective warps for image stitching" (2014), sections 3 and 4;
/// ranges and step of the lines as in the authors' program.
///
/// # Departures
/// Jacobians are sampled every 40 px instead of at every pixel. For more than two photographs the paper leaves the
/// choice of the pair to the user.
pub(super) fn place(
    model: WarpModel,
    input: &WarpInput<'_>,
    options: &WarpOptions,
    context: &StageContext<'_>,
) -> Result<Vec<GridMesh>> {
    let zero_rotation = model == WarpModel::Sphp;
    let mut best: Option<(f64, Plan)> = None;
    for (source, target) in roles(input) {
        context.check_cancelled()?;
        let Some(found) = Plan::search(input, source, target, zero_rotation, options)? else { continue };
        if best.as_ref().is_none_or(|(cost, _)| found.0 < *cost) {
            best = Some(found);
        }
    }
    let Some((_, plan)) = best else {
        let widest = (0..input.grids.len())
            .max_by(|&a, &b| farthest_angle(input, a).total_cmp(&farthest_angle(input, b)))
            .unwrap_or(input.reference);
        return Err(refuse(model, input, widest, "cannot be laid on one plane with the others"));
    };
    Ok((0..input.grids.len()).map(|photograph| plan.mesh(input, photograph)).collect())
}

/// The pairs (ref, tar) to be tried.
fn roles(input: &WarpInput<'_>) -> Vec<(usize, usize)> {
    let distances = hop_distances(input);
    let count = input.grids.len();
    let far = |from: usize| (0..count).rev().max_by_key(|&to| distances[from][to]).unwrap_or(from);
    let one_end = (0..count).rev().max_by_key(|&from| distances[from][far(from)]).unwrap_or(0);
    let mut roles = Vec::new();
    for (a, b) in [(one_end, far(one_end)), (input.reference, far(input.reference))] {
        for role in [(a, b), (b, a)] {
            if a != b && !roles.contains(&role) {
                roles.push(role);
            }
        }
    }
    roles
}

/// Steps between all photographs along overlaps.
fn hop_distances(input: &WarpInput<'_>) -> Vec<Vec<usize>> {
    let count = input.grids.len();
    let graph = StitchGraph::new(count, input.pairs);
    (0..count)
        .map(|start| {
            let mut distance = vec![usize::MAX; count];
            distance[start] = 0;
            let mut queue = std::collections::VecDeque::from([start]);
            while let Some(here) = queue.pop_front() {
                for edge in graph.edges.iter().filter(|edge| edge.a == here || edge.b == here) {
                    let other = if edge.a == here { edge.b } else { edge.a };
                    if distance[other] == usize::MAX {
                        distance[other] = distance[here] + 1;
                        queue.push_back(other);
                    }
                }
            }
            // Photographs that are not connected are never the farthest.
            distance.into_iter().map(|steps| if steps == usize::MAX { 0 } else { steps }).collect()
        })
        .collect()
}

/// A warp of all photographs.
#[derive(Debug)]
struct Plan {
    /// For each photograph the homography into the plane of `ref`, its center the origin.
    onto_ref: Vec<Homography>,
    warp: Warp,
}

#[derive(Debug)]
enum Warp {
    Halves(Box<SphpWarp>),
    /// An affine map needs no second half.
    Affine(Homography),
}

/// A place of a photograph in the plane of `ref`, and the derivative there.
struct Sample {
    place: Vector2<f64>,
    derivative: Matrix2<f64>,
}

impl Plan {
    /// The least distorted warp for these roles with its cost; `None` if the homographies do not allow one.
    fn search(
        input: &WarpInput<'_>,
        source: usize,
        target: usize,
        zero_rotation: bool,
        options: &WarpOptions,
    ) -> Result<Option<(f64, Self)>> {
        let onto_source = onto(input, source, options.pair_homographies)?;
        let in_front = (0..onto_source.len())
            .all(|photograph| least_depth(&onto_source[photograph], input, photograph) > MIN_DEPTH);
        if !in_front {
            return Ok(None);
        }
        let frame = &input.frames[source];
        let (x, y) = (frame.width / 2.0, frame.height / 2.0);
        let to_center = Homography(Matrix3::new(1.0, 0.0, -x, 0.0, 1.0, -y, 0.0, 0.0, 1.0));
        let from_center = Homography(Matrix3::new(1.0, 0.0, x, 0.0, 1.0, y, 0.0, 0.0, 1.0));
        let onto_ref: Vec<Homography> = onto_source.iter().map(|homography| to_center.after(homography)).collect();
        let target_from_ref = onto(input, target, options.pair_homographies)?[source].after(&from_center);
        let scale = target_from_ref.0[(2, 2)];
        if scale <= MIN_DEPTH {
            return Ok(None);
        }
        let target_from_ref = Homography(target_from_ref.0 / scale);
        let samples: Vec<Vec<Sample>> =
            (0..onto_ref.len()).map(|photograph| sampled(input, photograph, &onto_ref[photograph])).collect();
        let centers = input
            .frames
            .iter()
            .zip(&onto_ref)
            .map(|(frame, homography)| homography.apply(Vector2::new(frame.width / 2.0, frame.height / 2.0)));
        let unit = frame.width.max(frame.height) / PUBLISHED_SIDE_PX;
        let found = match SphpWarp::growth(&target_from_ref) {
            None => {
                let cost = distortion(&samples, |place| Some(target_from_ref.jacobian(place)));
                cost.map(|cost| (cost, Warp::Affine(target_from_ref)))
            }
            Some(direction) => {
                let along: Vec<f64> = centers.map(|center| direction.dot(&center)).collect();
                let start = [
                    along.iter().copied().fold(f64::INFINITY, f64::min),
                    along.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                ];
                least_distorted(&target_from_ref, start, unit, zero_rotation, &samples)
            }
        };
        Ok(found.map(|(cost, warp)| (cost, Self { onto_ref, warp })))
    }

    fn mesh(&self, input: &WarpInput<'_>, photograph: usize) -> GridMesh {
        deformed(&input.grids[photograph], |point| {
            let place = self.onto_ref[photograph].apply(point);
            match &self.warp {
                Warp::Halves(warp) => warp.apply(place),
                Warp::Affine(homography) => homography.apply(place),
            }
        })
    }
}

fn sampled(input: &WarpInput<'_>, photograph: usize, onto_ref: &Homography) -> Vec<Sample> {
    let frame = &input.frames[photograph];
    let grid = GridMesh::regular(frame.width, frame.height, SAMPLE_STEP_PX);
    let sample = |point| Sample { place: onto_ref.apply(point), derivative: onto_ref.jacobian(point) };
    (0..grid.len()).map(|vertex| sample(grid.source(vertex))).collect()
}

/// Tries all pairs of lines around `start`; `unit` is the scale of the published lengths.
fn least_distorted(
    homography: &Homography,
    start: [f64; 2],
    unit: f64,
    zero_rotation: bool,
    samples: &[Vec<Sample>],
) -> Option<(f64, Warp)> {
    let offsets = |[low, high]: [f64; 2]| {
        let steps = ((high - low) / OFFSET_STEP).round() as usize;
        (0..=steps).map(move |step| (low + OFFSET_STEP * step as f64) * unit)
    };
    let firsts: Vec<f64> = offsets(FIRST_OFFSETS).map(|offset| start[0] + offset).collect();
    let candidates: Vec<Option<(f64, SphpWarp)>> = firsts
        .into_par_iter()
        .map(|first| {
            let mut best: Option<(f64, SphpWarp)> = None;
            for second in offsets(SECOND_OFFSETS).map(|offset| start[1] + offset) {
                if second - first < LEAST_GAP * unit {
                    continue;
                }
                let Some(warp) = SphpWarp::new(homography, first, second, zero_rotation) else { continue };
                let cost = distortion(samples, |place| {
                    let derivative = warp.jacobian(place);
                    (derivative.determinant() > 0.0).then_some(derivative)
                });
                if let Some(cost) = cost
                    && best.as_ref().is_none_or(|(least, _)| cost < *least)
                {
                    best = Some((cost, warp));
                }
            }
            best
        })
        .collect();
    // The order of the candidates, not of the threads, decides between equals.
    let least = candidates.into_iter().flatten().reduce(|best, next| if next.0 < best.0 { next } else { best });
    least.map(|(cost, warp)| (cost, Warp::Halves(Box::new(warp))))
}

/// Sum over the photographs of the squared distances of the derivatives from the photograph's best similarity; `None`
/// where the warp has no derivative.
fn distortion(samples: &[Vec<Sample>], jacobian: impl Fn(Vector2<f64>) -> Option<Matrix2<f64>>) -> Option<f64> {
    let mut cost = 0.0;
    for of_photograph in samples {
        let (mut squares, mut turn) = (0.0, Vector2::zeros());
        for sample in of_photograph {
            let whole = jacobian(sample.place)? * sample.derivative;
            squares += whole.norm_squared();
            turn += Vector2::new(whole[(0, 0)] + whole[(1, 1)], whole[(1, 0)] - whole[(0, 1)]);
        }
        // The best similarity is (alpha, beta) = turn / 2n; what it explains is 2 n (alpha^2 + beta^2).
        cost += squares - turn.norm_squared() / (2.0 * of_photograph.len() as f64);
    }
    cost.is_finite().then_some(cost)
}

#[cfg(test)]
mod tests {
    use super::super::limits::{LIMITS, Limits};
    use super::super::tests::{Example, HEIGHT, WIDTH, misalignment};
    use super::*;

    const MODELS: [WarpModel; 2] = [WarpModel::Sphp, WarpModel::SphpFree];

    #[test]
    fn rows_meet_without_a_fold_and_are_less_distorted_than_by_homographies() {
        let example = Example::panned(&[-25.0, 0.0, 25.0], 1);
        let wide = Limits { max_area_ratio: 1e6, ..LIMITS };
        for model in MODELS {
            let placed = example.place(model).expect("a narrow set");
            assert_eq!(placed.folds, 0);
            assert!(misalignment(&example, &placed.meshes) < 1.0, "{}", misalignment(&example, &placed.meshes));
            // On the plane of an end photograph the other end would be huge.
            let plain = Example::panned(&[-25.0, 0.0, 25.0], 0).place_within(WarpModel::Homography, &wide);
            let width = |mesh: &GridMesh| mesh.bounds().1.x - mesh.bounds().0.x;
            let plain = plain.expect("below 90 degrees");
            let widest = |meshes: &[GridMesh]| meshes.iter().map(width).fold(0.0, f64::max);
            assert!(widest(&placed.meshes) < 0.7 * widest(&plain.meshes));
        }
    }

    /// Value and derivative of the whole map of a photograph have no jump anywhere.
    #[test]
    fn the_whole_map_of_a_photograph_is_smooth() {
        let example = Example::panned(&[-25.0, 0.0, 25.0], 1);
        let input = example.input();
        for zero_rotation in [true, false] {
            let (_, plan) = Plan::search(&input, 2, 0, zero_rotation, &WarpOptions::default())
                .expect("connected")
                .expect("a narrow set");
            let Warp::Halves(warp) = &plan.warp else { panic!("a pan is projective") };
            let whole = |photograph: usize, point: Vector2<f64>| warp.apply(plan.onto_ref[photograph].apply(point));
            for photograph in 0..3 {
                let step = 0.5;
                let mut earlier: Option<Vector2<f64>> = None;
                for k in 0..(WIDTH / step) as usize {
                    let at = |k: usize| whole(photograph, Vector2::new(k as f64 * step, HEIGHT / 3.0));
                    let slope = (at(k + 1) - at(k)) / step;
                    let change = earlier.map_or(0.0, |earlier| (slope - earlier).norm());
                    assert!(change < 0.02, "photograph {photograph} at {k}: {change}");
                    earlier = Some(slope);
                }
            }
        }
    }

    #[test]
    fn zero_rotation_leaves_a_photograph_upright() {
        let example = Example::panned(&[0.0, 20.0], 0);
        let input = example.input();
        let (_, plan) =
            Plan::search(&input, 1, 0, true, &WarpOptions::default()).expect("connected").expect("a narrow pair");
        let Warp::Halves(warp) = &plan.warp else { panic!("a pan is projective") };
        assert!(warp.similarity_rotation().abs() < 1e-9);
    }
}
