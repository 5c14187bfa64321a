//! SPHP for any number of photographs: which pair the warp is made of, and where its lines lie.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use trueup_core::geometry::Homography;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::deformed::deformed;
use super::half_planes::{HalfPlanes, Route, Samples, distortion};
use super::homography::onto;
use super::input::WarpInput;
use super::limits::{farthest_angle, refuse};
use super::options::WarpModel;
use super::options::WarpOptions;
use super::sphp::SphpWarp;

/// Offsets of the first line that are tried, in working pixels of a photograph whose longer side is
/// [`PUBLISHED_SIDE_PX`].
const FIRST_OFFSETS: [f64; 2] = [-300.0, 600.0];
/// Offsets of the second line.
const SECOND_OFFSETS: [f64; 2] = [-300.0, 200.0];
/// Least distance of the lines.
const LEAST_GAP: f64 = 120.0;
/// The longer side of photographs that these lengths belong to.
const PUBLISHED_SIDE_PX: f64 = 800.0;

/// How closely the lines are searched.
#[derive(Debug, Clone, Copy)]
struct Raster {
    /// Step of both offsets, in the unit of [`FIRST_OFFSETS`].
    offset_step: f64,
    /// Distance of the points at which the distortion is sampled, working pixels.
    sample_step_px: f64,
}

/// The raster that compares pairs: both ranges of offsets have several steps, a photograph a few tens of samples.
const COARSE: Raster = Raster { offset_step: 100.0, sample_step_px: 120.0 };
/// The raster that finds the lines of a pair; the step of the authors' program.
const FINE: Raster = Raster { offset_step: 10.0, sample_step_px: 40.0 };
/// Pairs whose lines are searched on the fine raster: the best of the coarse one, and those that may be better after
/// all.
const FINE_PAIRS: usize = 3;

/// Places all photographs by one half-projective warp.
///
/// The panorama lies on the plane of a photograph `tar` where the warp is a homography, and follows the plane of a
/// photograph `ref` where it is a similarity. Tried are all pairs of photographs in both roles, and for each all pairs
/// of lines on a raster. The least distorted one is taken: that with the smallest sum of squared distances of the
/// Jacobians from each photograph's best similarity. A photograph beyond either is as distorted as it is on that plane;
/// so in a row the two lie inside its ends, which are both as near to them as can be.
///
/// # Source
/// Chang, Sato and Chuang, "Shape-preserving half-projective warps for image stitching" (2014), sections 3 and 4;
/// ranges and step of the lines as in the authors' program.
///
/// # Departures
/// Jacobians are sampled every 40 px instead of at every pixel. For more than two photographs the paper leaves the
/// choice of the pair to the user; the same cost chooses it here, on a coarse raster first. The ranges of the lines
/// start at the centers of the pair, not of the outermost photographs. A photograph that reaches behind the plane of
/// `ref`, where the published map does not exist, is where it lies on the plane of `tar` if it lies there wholly.
pub(super) fn place(
    model: WarpModel,
    input: &WarpInput<'_>,
    options: &WarpOptions,
    context: &StageContext<'_>,
) -> Result<Vec<GridMesh>> {
    let zero_rotation = model == WarpModel::Sphp;
    let mut compared: Vec<(f64, HalfPlanes)> = Vec::new();
    for source in 0..input.grids.len() {
        context.check_cancelled()?;
        let onto_source = onto(input, source, options.pair_homographies)?;
        for target in (0..input.grids.len()).filter(|&target| target != source) {
            let planes = HalfPlanes::new(input, &onto_source, source, target);
            let found =
                planes.and_then(|planes| Some((least_distorted(&planes, input, zero_rotation, COARSE)?.0, planes)));
            compared.extend(found);
        }
        // The sort is stable: between equals the order of the photographs decides.
        compared.sort_by(|one, other| one.0.total_cmp(&other.0));
        compared.truncate(FINE_PAIRS);
    }
    let mut best: Option<(f64, Warp, &HalfPlanes)> = None;
    for (_, planes) in &compared {
        context.check_cancelled()?;
        let Some((cost, warp)) = least_distorted(planes, input, zero_rotation, FINE) else { continue };
        if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
            best = Some((cost, warp, planes));
        }
    }
    let Some((_, warp, planes)) = best else {
        let widest = (0..input.grids.len())
            .max_by(|&a, &b| farthest_angle(input, a).total_cmp(&farthest_angle(input, b)))
            .unwrap_or(input.reference);
        return Err(refuse(model, input, widest, "cannot be laid on one plane with the others"));
    };
    let mesh = |photograph: usize| {
        let place = |point| warp.place(&planes.routes[photograph], input.straight(photograph, point));
        deformed(&input.grids[photograph], place)
    };
    Ok((0..input.grids.len()).map(mesh).collect())
}

/// The map from the plane of `ref` to the panorama.
#[derive(Debug)]
enum Warp {
    Halves(Box<SphpWarp>),
    /// An affine map needs no second half.
    Affine(Homography),
}

impl Warp {
    /// Where a point of a photograph goes.
    fn place(&self, route: &Route, point: Vector2<f64>) -> Vector2<f64> {
        match (route, self) {
            (Route::ThroughRef(onto_ref), Self::Halves(warp)) => warp.apply(onto_ref.apply(point)),
            (Route::ThroughRef(onto_ref), Self::Affine(tar_from_ref)) => tar_from_ref.apply(onto_ref.apply(point)),
            (Route::OnTar { onto_tar, .. }, _) => onto_tar.apply(point),
        }
    }
}

/// The least distorted warp over these planes, and its distortion; `None` if no lines yield one.
fn least_distorted(
    planes: &HalfPlanes,
    input: &WarpInput<'_>,
    zero_rotation: bool,
    raster: Raster,
) -> Option<(f64, Warp)> {
    let samples = planes.sampled(input, raster.sample_step_px);
    let Some(direction) = SphpWarp::growth(&planes.tar_from_ref) else {
        let cost = distortion(&samples, |place| Some(planes.tar_from_ref.jacobian(place)));
        return cost.map(|cost| (cost, Warp::Affine(planes.tar_from_ref)));
    };
    let ranges = LineRanges::new(planes, direction, &samples);
    let candidates: Vec<Option<(f64, SphpWarp)>> = ranges
        .firsts(raster)
        .into_par_iter()
        .map(|first| {
            let seconds = ranges.seconds(raster, first);
            let tried = seconds.filter_map(|second| {
                let warp = SphpWarp::new(&planes.tar_from_ref, first, second, zero_rotation)?;
                let upright = |derivative: Matrix2<f64>| (derivative.determinant() > 0.0).then_some(derivative);
                Some((distortion(&samples, |place| upright(warp.jacobian(place)))?, warp))
            });
            tried.reduce(less)
        })
        .collect();
    // The order of the candidates, not of the threads, decides between equals.
    candidates.into_iter().flatten().reduce(less).map(|(cost, warp)| (cost, Warp::Halves(Box::new(warp))))
}

/// The one of less cost; the earlier one between equals.
fn less(best: (f64, SphpWarp), next: (f64, SphpWarp)) -> (f64, SphpWarp) {
    if next.0 < best.0 { next } else { best }
}

/// Where the lines are searched.
struct LineRanges {
    /// Along u, the centers of `tar` and `ref`: the lesser, the greater.
    start: f64,
    end: f64,
    /// The scale of the published lengths.
    unit: f64,
    /// The first line lies no earlier: what follows the homography wholly does not reach beyond.
    least_first: f64,
}

impl LineRanges {
    fn new(planes: &HalfPlanes, direction: Vector2<f64>, samples: &[Samples]) -> Self {
        let [of_tar, of_ref] = [planes.tar_center, Vector2::zeros()].map(|center| direction.dot(&center));
        let beside = samples.iter().filter_map(|photograph| match photograph {
            Samples::ThroughRef(_) => None,
            Samples::OnTar { in_front, .. } => Some(in_front),
        });
        Self {
            start: of_tar.min(of_ref),
            end: of_tar.max(of_ref),
            unit: planes.ref_side_px / PUBLISHED_SIDE_PX,
            least_first: beside.flatten().map(|place| direction.dot(place)).fold(f64::NEG_INFINITY, f64::max),
        }
    }

    fn firsts(&self, raster: Raster) -> Vec<f64> {
        let lines = offsets(FIRST_OFFSETS, raster).map(|offset| self.start + offset * self.unit);
        lines.filter(|first| *first >= self.least_first).collect()
    }

    fn seconds(&self, raster: Raster, first: f64) -> impl Iterator<Item = f64> {
        let lines = offsets(SECOND_OFFSETS, raster).map(|offset| self.end + offset * self.unit);
        lines.filter(move |second| second - first >= LEAST_GAP * self.unit)
    }
}

fn offsets([low, high]: [f64; 2], raster: Raster) -> impl Iterator<Item = f64> {
    let steps = ((high - low) / raster.offset_step).round() as usize;
    (0..=steps).map(move |step| low + raster.offset_step * step as f64)
}

#[cfg(test)]
mod tests {
    use super::super::limits::{LIMITS, Limits};
    use super::super::options::HomographySource;
    use super::super::tests::{Example, HEIGHT, WIDTH, misalignment};
    use super::*;
    use trueup_core::camera::Camera;
    use trueup_core::geometry::{rotation_about_y, rotation_about_z};
    use trueup_core::lens::{LensTerms, PlacedLens};

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

    /// The warp of these roles.
    fn searched(example: &Example, source: usize, target: usize, zero_rotation: bool) -> (HalfPlanes, Warp) {
        let input = example.input();
        let onto_source = onto(&input, source, HomographySource::Pairs).expect("connected");
        let planes = HalfPlanes::new(&input, &onto_source, source, target).expect("two planes");
        let (_, warp) = least_distorted(&planes, &input, zero_rotation, FINE).expect("a narrow set");
        (planes, warp)
    }

    /// Warps are judged by where pinholes would show the photographs, as they are placed: behind a lens they come out
    /// as those of pinholes, but for the points that the photographs have.
    #[test]
    fn samples_of_a_photograph_behind_a_lens_lie_where_it_is_placed() {
        let terms = LensTerms { radial: [-0.1, 0.0, 0.0, 0.0], ..LensTerms::default() };
        let lens = PlacedLens { terms, center_px: [0.0; 2] };
        let pinholes = Example::panned(&[-20.0, 0.0, 20.0], 1).cameras;
        let bent = Example::new(pinholes.into_iter().map(|camera| camera.through(&lens)).collect(), 1);
        let (planes, warp) = searched(&bent, 2, 0, true);
        let input = bent.input();
        let step_px = 100.0;
        let grid = GridMesh::regular(WIDTH, HEIGHT, step_px);
        for (photograph, samples) in planes.sampled(&input, step_px).iter().enumerate() {
            let (Route::ThroughRef(onto_ref), Samples::ThroughRef(samples)) = (&planes.routes[photograph], samples)
            else {
                panic!("all lie in front of both planes")
            };
            let place = |pixel: Vector2<f64>| onto_ref.apply(input.straight(photograph, pixel));
            for (vertex, sample) in samples.iter().enumerate() {
                let pixel = grid.source(vertex);
                let along = (place(pixel + Vector2::x() * 0.01) - place(pixel - Vector2::x() * 0.01)) / 0.02;
                assert!((sample.place - place(pixel)).norm() < 1e-9);
                assert!((sample.derivative.column(0) - along).norm() < 1e-4, "{photograph} {pixel}");
            }
        }
        assert!(matches!(warp, Warp::Halves(_)));
    }

    /// Value and derivative of the whole map of a photograph have no jump anywhere.
    #[test]
    fn the_whole_map_of_a_photograph_is_smooth() {
        let example = Example::panned(&[-25.0, 0.0, 25.0], 1);
        for zero_rotation in [true, false] {
            let (planes, warp) = searched(&example, 2, 0, zero_rotation);
            for route in &planes.routes {
                let step = 0.5;
                let mut earlier: Option<Vector2<f64>> = None;
                for k in 0..(WIDTH / step) as usize {
                    let at = |k: usize| warp.place(route, Vector2::new(k as f64 * step, HEIGHT / 3.0));
                    let slope = (at(k + 1) - at(k)) / step;
                    let change = earlier.map_or(0.0, |earlier| (slope - earlier).norm());
                    assert!(change < 0.02, "at {k}: {change}");
                    earlier = Some(slope);
                }
            }
        }
    }

    #[test]
    fn zero_rotation_leaves_a_photograph_upright() {
        let example = Example::panned(&[0.0, 20.0], 0);
        let (_, warp) = searched(&example, 1, 0, true);
        let Warp::Halves(warp) = &warp else { panic!("a pan is projective") };
        assert!(warp.similarity_rotation().abs() < 1e-9);
    }

    /// Cameras panned by 26 degrees each, turned about their axes by these angles in degrees.
    fn rolled(rolls_deg: &[f64]) -> Example {
        let middle = (rolls_deg.len() as f64 - 1.0) / 2.0;
        let camera = |(k, roll): (usize, &f64)| {
            let yaw = (26.0 * (k as f64 - middle)).to_radians();
            let world_from_camera = rotation_about_y(yaw) * rotation_about_z(roll.to_radians());
            Camera::new(700.0, WIDTH, HEIGHT, &world_from_camera.transpose())
        };
        Example::new(rolls_deg.iter().enumerate().map(camera).collect(), rolls_deg.len() / 2)
    }

    /// How many times as large a photograph is at its largest cell as at its smallest.
    fn unevenness(mesh: &GridMesh) -> f64 {
        let across = |vertex: usize| Vector2::from(mesh.target[vertex + 1]) - Vector2::from(mesh.target[vertex]);
        let down =
            |vertex: usize| Vector2::from(mesh.target[vertex + mesh.columns]) - Vector2::from(mesh.target[vertex]);
        let areas: Vec<f64> = (0..mesh.len() - mesh.columns)
            .filter(|vertex| (vertex + 1) % mesh.columns != 0)
            .map(|vertex| across(vertex).perp(&down(vertex)))
            .collect();
        areas.iter().copied().fold(0.0, f64::max) / areas.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Five photographs span 104 degrees between their outer axes: no plane through an end shows them all. On the plane
    /// of the middle one a photograph at 52 degrees is uneven by (cos 22 / cos 82)^3 = 296 from side to side; beside a
    /// neighbor of its own, at 26 degrees, by (cos 4 / cos 56)^3 = 6.
    #[test]
    fn both_ends_of_a_wide_row_keep_their_shape() {
        let example = rolled(&[3.0, -4.0, 1.0, 2.0, -3.0]);
        for model in MODELS {
            let placed = example.place(model).expect("five photographs");
            assert_eq!(placed.folds, 0);
            assert!(misalignment(&example, &placed.meshes) < 1.5, "{}", misalignment(&example, &placed.meshes));
            let uneven: Vec<f64> = placed.meshes.iter().map(unevenness).collect();
            assert!(uneven.iter().all(|uneven| *uneven < 12.0), "{model:?}: {uneven:?}");
        }
    }

    /// The turn of a photograph: that of its lower border against its upper one, which a change of scale leaves alone.
    fn turn(mesh: &GridMesh) -> f64 {
        let middle = |row: usize| Vector2::from(mesh.target[row * mesh.columns + mesh.columns / 2]);
        let down = middle(mesh.rows - 1) - middle(0);
        (-down.x).atan2(down.y).to_degrees()
    }

    /// The photographs differ by a roll of 12 degrees, which the panorama shows unless the switch takes it away.
    #[test]
    fn the_switch_keeps_a_rolled_photograph_unturned() {
        let example = rolled(&[0.0, 12.0]);
        let turned = |model| {
            let meshes = example.place(model).expect("a pair").meshes;
            (turn(&meshes[1]) - turn(&meshes[0])).abs()
        };
        let (upright, free) = (turned(WarpModel::Sphp), turned(WarpModel::SphpFree));
        assert!((free - 12.0).abs() < 3.0, "{free}");
        assert!(upright < 0.5 * free, "{upright}");
    }

    /// A photograph that reaches behind the plane of `ref` lies where it lies on the plane of `tar`.
    #[test]
    fn a_photograph_behind_one_plane_lies_on_the_other() {
        let example = Example::panned(&[-52.0, -26.0, 0.0, 26.0, 52.0], 2);
        let (planes, warp) = searched(&example, 1, 3, true);
        // 52 + 26 degrees from the axis of 1, and half a photograph more: its far border is behind that plane.
        assert!(matches!(planes.routes[4], Route::OnTar { .. }) && matches!(planes.routes[3], Route::ThroughRef(_)));
        let center = warp.place(&planes.routes[4], Vector2::new(WIDTH / 2.0, HEIGHT / 2.0));
        let expected = WIDTH / 2.0 + 700.0 * 26_f64.to_radians().tan();
        assert!((center - Vector2::new(expected, HEIGHT / 2.0)).norm() < 1e-3, "{center}");
        // The other way round no plane is left for it: it lies behind that of 0 and of 1.
        let input = example.input();
        let onto_source = onto(&input, 0, HomographySource::Pairs).expect("connected");
        assert!(HalfPlanes::new(&input, &onto_source, 0, 1).is_none());
    }
}
