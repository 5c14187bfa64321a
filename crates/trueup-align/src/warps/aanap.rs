//! Adaptive as-natural-as-possible warps (AANAP): a local homography in the overlap that turns into a similarity away
//! from it.

use nalgebra::{Matrix3, Vector2};
use rand::Rng;
use rand::seq::index::sample;
use rayon::prelude::*;
use trueup_core::geometry::{Homography, Normalization};
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::deformed::deformed;
use super::distance_kernel::DistanceKernel;
use super::homography::undetermined;
use super::input::{STAGE, WarpInput};
use super::limits::corners;
use super::options::WarpOptions;
use super::placement::{Anchored, Step, one_after_another};
use crate::match_points::MovingDlt;

/// Places the photographs one after the other, each between its local homography and a similarity.
///
/// # Source
/// Lin et al., "Adaptive as-natural-as-possible image stitching" (2015), sections 3.1 to 3.3: linearized homography
/// with Student-t weights, the similarity of least rotation among the planes of the matches, and the smooth change from
/// one to the other, in which the reference takes part.
///
/// # Departures
/// The published method is for two photographs. Here each further one is fitted to the places that its matches have in
/// the panorama by then, and moves what is placed already in the same way; `warps.adapt_reference` turns that off.
pub(super) fn place(input: &WarpInput<'_>, options: &WarpOptions, context: &StageContext<'_>) -> Result<Vec<GridMesh>> {
    one_after_another(input, context, |step, data, placed| {
        let mut generator = context.generator(STAGE, input.seeds[step.photograph]);
        let join =
            Join::new(input, step, data, placed, &mut generator).ok_or_else(|| undetermined(input, step.photograph))?;
        if options.adapt_reference {
            for mesh in placed.iter_mut() {
                *mesh = mesh.take().map(|mesh| join.adapted(mesh));
            }
        }
        Ok(deformed(&input.grids[step.photograph], |point| join.place(point)))
    })
}

/// How one photograph joins those placed.
#[derive(Debug)]
struct Join {
    /// The photograph under its local homographies, linearized away from the overlap.
    local: GridMesh,
    global: Homography,
    photograph_from_global: Homography,
    similarity: Matrix3<f64>,
    /// Where in the panorama the similarity starts, and the way to where it is reached.
    start: Vector2<f64>,
    way: Vector2<f64>,
}

impl Join {
    fn new(
        input: &WarpInput<'_>,
        step: Step,
        data: &Anchored,
        placed: &[Option<GridMesh>],
        generator: &mut impl Rng,
    ) -> Option<Self> {
        let grid = &input.grids[step.photograph];
        let dlt = MovingDlt::new(&data.points, &data.places)?;
        let global = dlt.solve(|_| 1.0)?;
        let fields = LocalHomographies::new(&dlt, &data.points, grid)?;
        let target: Vec<[f64; 2]> =
            (0..grid.len()).into_par_iter().map(|vertex| fields.place(grid.source(vertex)).into()).collect();
        let local = GridMesh { target, ..grid.clone() };
        let similarity = global_similarity(data, generator)?;
        let parent = placed[step.parent].as_ref()?;
        let center = |mesh: &GridMesh| mesh.warp(Vector2::new(mesh.width / 2.0, mesh.height / 2.0));
        let from = center(parent);
        let axis = (center(&local) - from).try_normalize(f64::MIN_POSITIVE)?;
        let along = corners(grid.width, grid.height).map(|corner| axis.dot(&(local.warp(corner) - from)));
        let low = along.iter().copied().fold(f64::INFINITY, f64::min);
        let high = along.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let photograph_from_global = global.inverse()?;
        let way = axis * (high - low);
        Some(Self { local, global, photograph_from_global, similarity, start: from + axis * low, way })
    }

    /// Share of the similarity at a place that the local homographies mean.
    fn share(&self, place: Vector2<f64>) -> f64 {
        ((place - self.start).dot(&self.way) / self.way.norm_squared()).clamp(0.0, 1.0)
    }

    /// Where a point of the photograph goes.
    fn place(&self, point: Vector2<f64>) -> Vector2<f64> {
        let place = self.local.warp(point);
        let share = self.share(place);
        Homography(self.similarity).apply(point) * share + place * (1.0 - share)
    }

    /// A placed photograph, moved as the new one is.
    fn adapted(&self, mesh: GridMesh) -> GridMesh {
        let target = mesh.target.iter().map(|&place| self.moved(place.into()).into()).collect();
        GridMesh { target, ..mesh }
    }

    fn moved(&self, place: Vector2<f64>) -> Vector2<f64> {
        let share = self.share(place);
        if share == 0.0 {
            return place;
        }
        Homography(self.similarity).apply(self.point_at(place)) * share + place * (1.0 - share)
    }

    /// The point of the photograph, or of its plane beyond its border, that the local homographies carry to a place.
    fn point_at(&self, place: Vector2<f64>) -> Vector2<f64> {
        /// The local deviation from the global homography changes slowly: a few rounds reach rounding.
        const ROUNDS: usize = 6;
        let mut point = self.photograph_from_global.apply(place);
        for _ in 0..ROUNDS {
            let inside = Vector2::new(point.x.clamp(0.0, self.local.width), point.y.clamp(0.0, self.local.height));
            let deviation = self.local.warp(inside) - self.global.apply(inside);
            point = self.photograph_from_global.apply(place - deviation);
        }
        point
    }
}

/// Local homographies inside the rectangle around the matches, their linearization outside.
struct LocalHomographies<'a> {
    dlt: &'a MovingDlt,
    low: Vector2<f64>,
    high: Vector2<f64>,
    anchors: Vec<(Vector2<f64>, Homography)>,
    /// Unit of the distances from anchors.
    unit: f64,
}

impl<'a> LocalHomographies<'a> {
    fn new(dlt: &'a MovingDlt, points: &[Vector2<f64>], grid: &GridMesh) -> Option<Self> {
        /// Anchors on each side of the rectangle.
        const ANCHORS_PER_SIDE: usize = 20;
        /// Unit of the distances from anchors, in diagonals of the photograph.
        const UNIT: f64 = 0.1;
        let low = points.iter().copied().reduce(|a, b| a.inf(&b))?;
        let high = points.iter().copied().reduce(|a, b| a.sup(&b))?;
        let mut local = Self { dlt, low, high, anchors: Vec::new(), unit: UNIT * grid.width.hypot(grid.height) };
        let corners = [low, Vector2::new(high.x, low.y), high, Vector2::new(low.x, high.y)];
        let places: Vec<Vector2<f64>> = (0..4 * ANCHORS_PER_SIDE)
            .map(|k| {
                let (side, part) = (k / ANCHORS_PER_SIDE, (k % ANCHORS_PER_SIDE) as f64 / ANCHORS_PER_SIDE as f64);
                corners[side].lerp(&corners[(side + 1) % 4], part)
            })
            .collect();
        local.anchors =
            places.into_par_iter().map(|place| Some((place, local.homography(place)?))).collect::<Option<_>>()?;
        Some(local)
    }

    fn homography(&self, point: Vector2<f64>) -> Option<Homography> {
        /// Distance over which the weight of a match falls to 1/e, working px: the published 12.5 squared.
        const DECAY_PX: f64 = 156.25;
        let weight = |position: Vector2<f64>| DistanceKernel::Code.weight((position - point).norm(), DECAY_PX);
        // Far from all matches the weights only differ by a factor; the nearest match's is the scale.
        self.dlt.solve(weight).or_else(|| self.dlt.solve(|_| 1.0))
    }

    /// Where a point goes.
    fn place(&self, point: Vector2<f64>) -> Vector2<f64> {
        let nearest = point.sup(&self.low).inf(&self.high);
        let outside = ((point - nearest).norm() / self.unit).min(1.0);
        let inner = || self.homography(point).map_or_else(|| self.linearized(point), |local| local.apply(point));
        if outside == 0.0 {
            return inner();
        }
        let linearized = self.linearized(point);
        if outside >= 1.0 {
            return linearized;
        }
        // A smooth step over one unit of distance, so that nothing jumps at the rectangle's border.
        let share = outside * outside * (3.0 - 2.0 * outside);
        linearized * share + inner() * (1.0 - share)
    }

    /// Mean of the local homographies' tangents at the anchors, by Student's t of the distance.
    fn linearized(&self, point: Vector2<f64>) -> Vector2<f64> {
        /// Degrees of freedom of Student's t, as published.
        const FREEDOM: f64 = 5.0;
        let (mut sum, mut total) = (Vector2::zeros(), 0.0);
        for (anchor, homography) in &self.anchors {
            let offset = point - anchor;
            let squared = offset.norm_squared() / (self.unit * self.unit);
            let weight = (1.0 + squared / FREEDOM).powf(-0.5 * (FREEDOM + 1.0));
            sum += (homography.apply(*anchor) + homography.jacobian(*anchor) * offset) * weight;
            total += weight;
        }
        sum / total
    }
}

/// The similarity of least rotation among those of the planes that the matches lie on.
fn global_similarity(data: &Anchored, generator: &mut impl Rng) -> Option<Matrix3<f64>> {
    /// Matches that make a plane, as published.
    const PLANE_MATCHES: usize = 50;
    let normalized = Normalized::of(data)?;
    let mut left: Vec<usize> = (0..data.points.len()).collect();
    let mut candidates: Vec<Matrix3<f64>> = Vec::new();
    loop {
        let plane = largest_plane(&normalized, &left, generator);
        let large = plane.len() >= PLANE_MATCHES;
        // Without any large plane the largest one has to do.
        if large || (candidates.is_empty() && plane.len() >= 4) {
            candidates.extend(fitted_similarity(data, &plane));
        }
        if !large {
            break;
        }
        left.retain(|index| plane.binary_search(index).is_err());
    }
    if candidates.is_empty() {
        candidates.extend(fitted_similarity(data, &(0..data.points.len()).collect::<Vec<_>>()));
    }
    let turn = |similarity: &Matrix3<f64>| similarity[(1, 0)].atan2(similarity[(0, 0)]).abs();
    candidates.into_iter().reduce(|best, next| if turn(&next) < turn(&best) { next } else { best })
}

/// Matches whose points and places are centered, and 1.4 from their center on average.
struct Normalized {
    points: Vec<Vector2<f64>>,
    places: Vec<Vector2<f64>>,
}

impl Normalized {
    /// `None` if all points or all places coincide.
    fn of(data: &Anchored) -> Option<Self> {
        let applied = |points: &[Vector2<f64>]| -> Option<Vec<Vector2<f64>>> {
            let normalization = Normalization::of(points)?;
            Some(points.iter().map(|&point| normalization.apply(point)).collect())
        };
        Some(Self { points: applied(&data.points)?, places: applied(&data.places)? })
    }
}

/// The largest set of the matches `left` that one homography explains, ascending; by RANSAC.
fn largest_plane(data: &Normalized, left: &[usize], generator: &mut impl Rng) -> Vec<usize> {
    /// Largest distance of a match from a plane's homography, in units in which matches are 1.4 from their center on
    /// average; as published.
    const TOLERANCE: f64 = 0.01;
    /// Most samples of four matches: one of them is all on a plane of 1 in 4 matches with 86 %, of 1 in 3 with 99.8 %.
    const MOST_SAMPLES: f64 = 500.0;
    const SAMPLE_SIZE: usize = 4;
    /// How sure it must be that no larger plane was missed for the search to end early.
    const CONFIDENCE: f64 = 0.999;
    let mut best = Vec::new();
    if left.len() < SAMPLE_SIZE {
        return best;
    }
    let mut needed = MOST_SAMPLES;
    let mut taken = 0.0;
    while taken < needed {
        taken += 1.0;
        let chosen = sample(generator, left.len(), SAMPLE_SIZE);
        let of = |points: &[Vector2<f64>]| -> [Vector2<f64>; SAMPLE_SIZE] {
            std::array::from_fn(|k| points[left[chosen.index(k)]])
        };
        let Some(plane) = Homography::from_four_points(&of(&data.points), &of(&data.places)) else {
            continue;
        };
        let agrees = |&index: &usize| (plane.apply(data.points[index]) - data.places[index]).norm() <= TOLERANCE;
        let agreeing: Vec<usize> = left.iter().copied().filter(agrees).collect();
        if agreeing.len() > best.len() {
            best = agreeing;
            let all_on_it = (best.len() as f64 / left.len() as f64).powi(SAMPLE_SIZE as i32);
            // Never negative nor NaN: a share of 1 gives ln(0) = -infinity, and 0 samples more.
            needed = ((1.0 - CONFIDENCE).ln() / (1.0 - all_on_it).ln()).clamp(0.0, MOST_SAMPLES);
        }
    }
    best
}

/// The least-squares similarity of some matches; `None` if they coincide.
fn fitted_similarity(data: &Anchored, chosen: &[usize]) -> Option<Matrix3<f64>> {
    let mean =
        |points: &[Vector2<f64>]| chosen.iter().map(|&index| points[index]).sum::<Vector2<f64>>() / chosen.len() as f64;
    let (from, to) = (mean(&data.points), mean(&data.places));
    let (mut turn, mut spread) = (Vector2::zeros(), 0.0);
    for &index in chosen {
        let (p, q) = (data.points[index] - from, data.places[index] - to);
        turn += Vector2::new(p.dot(&q), p.perp(&q));
        spread += p.norm_squared();
    }
    let (a, b) = (turn.x / spread, turn.y / spread);
    let shift = to - Vector2::new(a * from.x - b * from.y, b * from.x + a * from.y);
    let similarity = Matrix3::new(a, -b, shift.x, b, a, shift.y, 0.0, 0.0, 1.0);
    similarity.iter().all(|entry| entry.is_finite()).then_some(similarity)
}

#[cfg(test)]
mod tests {
    use super::super::WarpModel;
    use super::super::tests::{Example, HEIGHT, WIDTH, matched, misalignment};
    use super::*;
    use crate::warps::placement::anchored;

    fn joined(example: &Example) -> Join {
        let input = example.input();
        let placed = vec![Some(example.grids[0].clone()), None];
        let data = anchored(&input, 1, &placed);
        let mut generator = StageContext::default().generator(STAGE, 0);
        Join::new(&input, Step { photograph: 1, parent: 0 }, &data, &placed, &mut generator).expect("regular")
    }

    #[test]
    fn it_is_the_homography_at_the_overlap_and_the_similarity_far_from_it() {
        let example = Example::panned(&[0.0, 28.0], 0);
        let join = joined(&example);
        let truth = |point| example.cameras[1].transfer(&example.cameras[0], point).expect("in front");
        for y in [150.0, 300.0, 450.0] {
            // Inside the matches the local map is the homography, up to the bilinear cells.
            let point = Vector2::new(200.0, y);
            assert!((join.local.warp(point) - truth(point)).norm() < 0.3);
        }
        // At the farthest corner the similarity has taken over.
        let farthest = [0.0, HEIGHT]
            .map(|y| Vector2::new(WIDTH, y))
            .into_iter()
            .max_by(|one, other| join.share(join.local.warp(*one)).total_cmp(&join.share(join.local.warp(*other))));
        let farthest = farthest.expect("two corners");
        assert!((join.share(join.local.warp(farthest)) - 1.0).abs() < 1e-12);
        assert!((join.place(farthest) - Homography(join.similarity).apply(farthest)).norm() < 1e-9);
        let far = Vector2::new(WIDTH, 0.0);
        assert!(join.share(join.local.warp(far)) > 0.99, "a corner ends the change");
        // The nearest corner is where the change begins.
        let near =
            [Vector2::new(0.0, 0.0), Vector2::new(0.0, HEIGHT)].map(|corner| join.share(join.local.warp(corner)));
        assert!(near.iter().any(|share| *share < 1e-9), "{near:?}");
    }

    #[test]
    fn the_reference_is_adapted_so_that_the_overlap_still_meets() {
        let example = Example::panned(&[0.0, 28.0], 0);
        let fixed = WarpOptions { adapt_reference: false, ..WarpOptions::default() };
        let adapted = example.place(WarpModel::Aanap).expect("a pair");
        assert_eq!(adapted.folds, 0);
        assert!(misalignment(&example, &adapted.meshes) < 1.5, "{}", misalignment(&example, &adapted.meshes));
        let fixed = example.place_with(WarpModel::Aanap, &fixed).expect("a pair");
        assert_eq!(fixed.meshes[0], example.grids[0]);
        assert!(misalignment(&example, &fixed.meshes) > 5.0);
    }

    #[test]
    fn an_affine_pair_stays_affine_in_the_overlap_and_similar_where_it_is_one() {
        let (sine, cosine) = 0.1_f64.sin_cos();
        let turned = |point: Vector2<f64>| {
            Some(Vector2::new(cosine * point.x - sine * point.y - 350.0, sine * point.x + cosine * point.y + 10.0))
        };
        let cameras = Example::panned(&[0.0, 28.0], 0).cameras;
        let example = Example::with_pairs(cameras, vec![matched(0, 1, turned)], 0);
        let placed = example.place(WarpModel::Aanap).expect("a pair");
        // Homography and similarity are the same map, so the whole photograph follows it and the reference stays.
        for vertex in 0..example.grids[1].len() {
            let back = turned(Vector2::from(placed.meshes[1].target[vertex])).expect("total");
            assert!((back - example.grids[1].source(vertex)).norm() < 1e-3);
            let stays = Vector2::from(placed.meshes[0].target[vertex]) - example.grids[0].source(vertex);
            assert!(stays.norm() < 1e-3);
        }
    }

    #[test]
    fn photographs_in_a_row_are_all_placed() {
        let example = Example::panned(&[-56.0, -28.0, 0.0, 28.0, 56.0], 2);
        let placed = example.place(WarpModel::Aanap).expect("a row");
        assert!(misalignment(&example, &placed.meshes) < 12.0, "{}", misalignment(&example, &placed.meshes));
    }
}
