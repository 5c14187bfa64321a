//! Adaptive as-natural-as-possible warps (AANAP): a local homography in the overlap that turns into a similarity away
//! from it.

use nalgebra::{Matrix3, Vector2};
use rand::Rng;
use rayon::prelude::*;
use trueup_core::geometry::Homography;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::deformed::deformed;
use super::distance_kernel::DistanceKernel;
use super::homography::undetermined;
use super::input::{STAGE, WarpInput};
use super::limits::corners;
use super::options::WarpOptions;
use super::placement::{Anchored, Step, one_after_another};
use crate::moving_dlt::MovingDlt;
use crate::plane_similarity::{MatchedPoints, similarity_of_least_turn};

/// Places the photographs one after the other, each between its local homography and a similarity.
///
/// # Source
/// Lin et al., "Adaptive as-natural-as-possible image stitching" (2015), sections 3.1 to 3.3: linearized homography
/// with Student-t weights, the similarity of least rotation among the planes of the matches, and the smooth change from
/// one to the other, in which the reference takes part.
///
/// # Departures
/// The published method is for two photographs. Here each further one is fitted to the places that its matches have in
/// the panorama by then, and moves what is placed already in the same way. With `warps.adapt_reference` off what is
/// placed stays: a photograph that joins follows its local homographies as far as its matches reach, so that it meets
/// what stays, and becomes the similarity from there to its far corner.
pub(super) fn place(input: &WarpInput<'_>, options: &WarpOptions, context: &StageContext<'_>) -> Result<Vec<GridMesh>> {
    one_after_another(input, context, |step, data, placed| {
        let mut generator = context.generator(STAGE, input.seeds[step.photograph]);
        let join = Join::new(input, step, data, placed, options.adapt_reference, &mut generator)
            .ok_or_else(|| undetermined(input, step.photograph))?;
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
    change: Change,
}

impl Join {
    /// `None` if the matches determine no map. With `adapts` the change to the similarity is the published one, in
    /// which what is placed takes part; without, it begins where the matches end.
    fn new(
        input: &WarpInput<'_>,
        step: Step,
        data: &Anchored,
        placed: &[Option<GridMesh>],
        adapts: bool,
        generator: &mut impl Rng,
    ) -> Option<Self> {
        let grid = &input.grids[step.photograph];
        let dlt = MovingDlt::new(&data.points, &data.places)?;
        let global = dlt.solve(|_| 1.0)?;
        let fields = LocalHomographies::new(&dlt, &data.points, grid)?;
        let target: Vec<[f64; 2]> =
            (0..grid.len()).into_par_iter().map(|vertex| fields.place(grid.source(vertex)).into()).collect();
        let local = GridMesh { target, ..grid.clone() };
        let matched = MatchedPoints { points: &data.points, places: &data.places };
        let similarity = similarity_of_least_turn(matched, generator)?;
        let photograph_from_global = global.inverse()?;
        let change = match adapts {
            true => Change::across(&local, center(placed[step.parent].as_ref()?))?,
            false => Change::beyond(&local, &data.places),
        };
        Some(Self { local, global, photograph_from_global, similarity, change })
    }

    /// Share of the similarity at a place that the local homographies mean.
    fn share(&self, place: Vector2<f64>) -> f64 {
        self.change.share(place)
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

/// Where the middle of a photograph lies.
fn center(mesh: &GridMesh) -> Vector2<f64> {
    mesh.warp(Vector2::new(mesh.width / 2.0, mesh.height / 2.0))
}

/// Where in the panorama the similarity takes over: evenly along a way.
#[derive(Debug, Clone, Copy)]
struct Change {
    start: Vector2<f64>,
    /// To where the similarity is reached; zero where it is not.
    way: Vector2<f64>,
}

impl Change {
    /// From the first corner of the photograph, as its local homographies place it, to the last one, along the line
    /// from the center of its neighbor to its own. `None` if these coincide.
    ///
    /// # Source
    /// Lin et al. (2015), equations 15 and 16.
    fn across(local: &GridMesh, from: Vector2<f64>) -> Option<Self> {
        let axis = (center(local) - from).try_normalize(f64::MIN_POSITIVE)?;
        let [low, high] = extent(corner_places(local), from, axis)?;
        Some(Self { start: from + axis * low, way: axis * (high - low) })
    }

    /// From the last of the matches to the last corner, along the line from the middle of the matches to that of the
    /// photograph. The similarity is nowhere reached if the matches surround the middle, or reach to the far corner.
    fn beyond(local: &GridMesh, places: &[Vector2<f64>]) -> Self {
        /// Least way, in diagonals of the photograph: a change within less would be a crease.
        const LEAST_WAY: f64 = 0.05;
        let from = places.iter().sum::<Vector2<f64>>() / places.len() as f64;
        let found = || {
            let axis = (center(local) - from).try_normalize(f64::MIN_POSITIVE)?;
            let [_, low] = extent(places.iter().copied(), from, axis)?;
            let [_, high] = extent(corner_places(local), from, axis)?;
            let long = high - low > LEAST_WAY * local.width.hypot(local.height);
            long.then_some(Self { start: from + axis * low, way: axis * (high - low) })
        };
        found().unwrap_or(Self { start: from, way: Vector2::zeros() })
    }

    /// Share of the similarity at a place: 0 before the way, 1 behind it.
    fn share(&self, place: Vector2<f64>) -> f64 {
        let squared = self.way.norm_squared();
        if squared > 0.0 { ((place - self.start).dot(&self.way) / squared).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Where a photograph's corners lie.
fn corner_places(mesh: &GridMesh) -> impl Iterator<Item = Vector2<f64>> {
    corners(mesh.width, mesh.height).into_iter().map(|corner| mesh.warp(corner))
}

/// The least and the greatest distance of places from a point along an axis; `None` without places.
fn extent(places: impl Iterator<Item = Vector2<f64>>, from: Vector2<f64>, axis: Vector2<f64>) -> Option<[f64; 2]> {
    let distances = places.map(|place| axis.dot(&(place - from)));
    distances.map(|distance| [distance; 2]).reduce(|[low, high], [next, _]| [low.min(next), high.max(next)])
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

#[cfg(test)]
mod tests {
    use super::super::options::WarpModel;
    use super::super::tests::{Example, HEIGHT, WIDTH, matched, misalignment};
    use super::*;
    use crate::warps::placement::anchored;

    fn joined(example: &Example) -> Join {
        let input = example.input();
        let placed = vec![Some(example.grids[0].clone()), None];
        let data = anchored(&input, 1, &placed);
        let mut generator = StageContext::default().generator(STAGE, 0);
        let step = Step { photograph: 1, parent: 0 };
        Join::new(&input, step, &data, &placed, true, &mut generator).expect("regular")
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
        let adapted = example.place(WarpModel::Aanap).expect("a pair");
        assert_eq!(adapted.folds, 0);
        assert_ne!(adapted.meshes[0], example.grids[0]);
        assert!(misalignment(&example, &adapted.meshes) < 1.5, "{}", misalignment(&example, &adapted.meshes));
    }

    /// Without moving the reference the photograph follows its local homographies wherever it has matches.
    #[test]
    fn a_fixed_reference_stays_and_the_overlap_meets() {
        let example = Example::panned(&[0.0, 28.0], 0);
        let options = WarpOptions { adapt_reference: false, ..WarpOptions::default() };
        let fixed = example.place_with(WarpModel::Aanap, &options).expect("a pair");
        assert_eq!((fixed.folds, &fixed.meshes[0]), (0, &example.grids[0]));
        assert!(misalignment(&example, &fixed.meshes) < 1.0, "{}", misalignment(&example, &fixed.meshes));
        // Panned by 28 degrees, the far border would be (cos 1.7 / cos 57.7)^2 = 3.5 times as high; the similarity,
        // which the overlap decides, is nearly as large as the photograph.
        let border = |y: f64| fixed.meshes[1].warp(Vector2::new(WIDTH, y));
        let height = (border(HEIGHT) - border(0.0)).norm() / HEIGHT;
        assert!(height < 1.5, "{height}");
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

    /// Where what is placed stays, each photograph is as large as the reference, give or take what its overlap
    /// stretches.
    #[test]
    fn photographs_of_a_wide_row_meet_a_reference_that_stays() {
        let yaws: Vec<f64> = (-4..=4).map(|k| 26.0 * f64::from(k)).collect();
        let example = Example::panned(&yaws, 4);
        let options = WarpOptions { adapt_reference: false, ..WarpOptions::default() };
        let placed = example.place_with(WarpModel::Aanap, &options).expect("a row of 208 degrees");
        assert_eq!((placed.folds, &placed.meshes[4]), (0, &example.grids[4]));
        // Local homographies follow a neighbor that turns from a homography into a similarity only nearly.
        assert!(misalignment(&example, &placed.meshes) < 20.0, "{}", misalignment(&example, &placed.meshes));
        for mesh in &placed.meshes {
            let (low, high) = mesh.bounds();
            let (width, height) = ((high.x - low.x) / WIDTH, (high.y - low.y) / HEIGHT);
            assert!((0.7..1.6).contains(&width) && (0.7..1.6).contains(&height), "{width} x {height}");
        }
    }
}
