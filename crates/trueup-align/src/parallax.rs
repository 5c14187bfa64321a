//! Parallax: how far photographs give way so that overlaps meet.
//!
//! Cameras that only turn leave a residual in every overlap where the photographer moved. The solved mesh has aligned
//! the overlaps as well as it could; which pixel of one photograph meets which pixel of another is read off it, and
//! both are drawn in the same direction. First photographs step aside as evenly as they can, also where they are alone,
//! so that lines stay straight (`smooth_steps`). What is left is drawn in a mean of the directions in which the
//! photographs then see the place. Each weighs as deep as the place lies in it, so that nothing jumps where another one
//! ends. The mesh's own shape, its plane and its drift over long rows are forgotten by this; only what it knows of
//! overlaps remains, so that any mesh will do, of whatever method.
//!
//! Near the poles of its sphere the mesh is off: photographs that look there cannot be unrolled, and pull at their
//! neighbors. They are drawn as their cameras see, unless these err by more: where parallax is what their gentler parts
//! tell.
//!
//! # Source
//! H.-Y. Shum and R. Szeliski, "Construction and refinement of panoramic mosaics with global and local alignment"
//! (2000), section 5: local alignment ("deghosting") towards the mean ray; here the correspondences are the mesh's, and
//! the weights make the field continuous.

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;
use trueup_core::statistics::median_of;

use crate::mesh::{LATTICE_CELLS, Meeting, coarsening_of_steps, smooth_steps, tilt_from_level};
use crate::projection::{ParallaxShift, PosedPhotograph, samples, smooth, steepest};

/// What the overlaps ask of every photograph.
///
/// * `period`: the turn of the mesh's plane, if it closes on itself.
/// * `max_parallax`: the largest angle in radians between where a camera sees a place and where it is drawn; from half
///   of it on, corrections fade, since a mesh that has to contradict its cameras more than that is torn itself.
pub fn shifts(photographs: &[PosedPhotograph], period: Option<f64>, max_parallax: f64) -> Vec<ParallaxShift> {
    let overlaps = Overlaps::new(photographs, period, max_parallax);
    let steps = overlaps.smooth_steps();
    (0..photographs.len())
        .into_par_iter()
        .map(|k| {
            let photograph = &photographs[k];
            let aside = (0..photograph.mesh.len()).map(|vertex| {
                let pixel = photograph.mesh.source(vertex);
                let sights = overlaps.sights(k, pixel);
                let drawn = common_direction(&sights, max_parallax, |sight| match &steps {
                    Some(steps) => {
                        let aside = steps[sight.photograph].warp(sight.pixel);
                        photographs[sight.photograph].camera.world_direction(sight.pixel + aside)
                    }
                    None => sight.direction,
                });
                let back = photograph.camera.project(photograph.camera.rotation() * drawn);
                back.map_or(Vector2::zeros(), |back| back - pixel)
            });
            ParallaxShift { aside: aside.collect() }
        })
        .collect()
}

/// How far apart sights may be, as a share of the room that they have to meet in, the sum of their distances from their
/// photographs' borders. Of photographs of 4:3 whose borders cross at a right angle, no place then moves by more than
/// half a step against its neighbor a step aside: cells keep half of their width. From 0.6 on they would fold.
const MOST_PER_ROOM: f64 = 0.3;

/// Photographs and what their mesh says of them.
struct Overlaps<'a> {
    photographs: &'a [PosedPhotograph],
    trusts: Vec<f64>,
    bounds: Vec<(Vector2<f64>, Vector2<f64>)>,
    /// The others whose bounds meet those of each photograph, in their order: no place of it lies in any but these.
    neighbors: Vec<Vec<usize>>,
    period: Option<f64>,
    max_parallax: f64,
}

impl<'a> Overlaps<'a> {
    fn new(photographs: &'a [PosedPhotograph], period: Option<f64>, max_parallax: f64) -> Self {
        let sized = photographs.iter().map(|one| (&one.camera, [one.mesh.width, one.mesh.height]));
        let frame = tilt_from_level(sized, &Matrix3::identity()).unwrap_or_else(Matrix3::identity);
        let trusts = photographs.iter().map(|photograph| trust(steepest(photograph, &frame))).collect();
        let down = frame.row(1).transpose();
        let bounds: Vec<_> = photographs.iter().map(|photograph| photograph.mesh.bounds()).collect();
        let of_each =
            |k: usize| (0..bounds.len()).filter(|&o| o != k && meet(&bounds[k], &bounds[o], period)).collect();
        let neighbors = (0..bounds.len()).map(of_each).collect();
        let mut overlaps = Self { photographs, trusts, bounds, neighbors, period, max_parallax };
        let believed = |k: usize| match overlaps.trusts[k] {
            trust if trust < 1.0 => trust.max(evidence(overlaps.parallax(k, &down))),
            trust => trust,
        };
        overlaps.trusts = (0..photographs.len()).into_par_iter().map(believed).collect();
        overlaps
    }

    /// The median angle in radians by which others see otherwise what photograph `k` shows where the mesh can be
    /// unrolled; 0 if there is nothing. `down` is that of the mesh's sphere.
    fn parallax(&self, k: usize, down: &Vector3<f64>) -> f64 {
        /// Pixels looked at along each side.
        const SAMPLES: usize = 17;
        let gentle = WHOLE_DEG.to_radians().sin();
        let angles = samples(&self.photographs[k], SAMPLES)
            .map(|pixel| self.sights(k, pixel))
            .filter(|sights| sights[0].direction.dot(down).abs() < gentle)
            .flat_map(|sights| {
                let own = sights[0].direction;
                sights.into_iter().skip(1).map(move |sight| sight.direction.angle(&own))
            });
        median_of(angles).unwrap_or(0.0)
    }

    /// Who sees what photograph `k` has at `pixel`: itself first.
    fn sights(&self, k: usize, pixel: Vector2<f64>) -> Vec<Sight> {
        let photograph = &self.photographs[k];
        let direction = photograph.camera.world_direction(pixel);
        let weight = depth(photograph, pixel);
        let own =
            Sight { photograph: k, pixel, direction, weight, room: room(photograph, weight), trust: self.trusts[k] };
        let place = photograph.mesh.warp(pixel);
        let others = self.neighbors[k].iter();
        std::iter::once(own).chain(others.filter_map(|&other| self.sight(other, place, &direction))).collect()
    }

    /// How far photographs give way as evenly as they can, see [`smooth_steps`]; `None` if nothing asks for it.
    fn smooth_steps(&self) -> Option<Vec<GridMesh>> {
        let lattices = |coarsening: f64| -> Vec<GridMesh> {
            let lattice = |photograph: &PosedPhotograph| {
                let GridMesh { width, height, .. } = photograph.mesh;
                GridMesh::regular(width, height, coarsening * width.max(height) / LATTICE_CELLS)
            };
            self.photographs.iter().map(lattice).collect()
        };
        let usual = lattices(1.0);
        let lattices = lattices(coarsening_of_steps(usual.iter().map(GridMesh::len).sum()));
        let meetings: Vec<Vec<Meeting>> = lattices
            .par_iter()
            .enumerate()
            .map(|(k, lattice)| {
                let of_vertex = |vertex: usize| {
                    let sights = self.sights(k, lattice.source(vertex));
                    let share = mean_direction(&sights, |sight| sight.direction)
                        .map_or(0.0, |mean| kept(&sights, &mean, self.max_parallax) * trust_of(&sights));
                    let met = sights.into_iter().skip(1).filter(move |_| share > 0.0);
                    met.map(move |sight| Meeting { from: [k, vertex], to: sight.photograph, place: sight.pixel, share })
                };
                (0..lattice.len()).flat_map(of_vertex).collect()
            })
            .collect();
        let cameras: Vec<Camera> = self.photographs.iter().map(|photograph| photograph.camera).collect();
        let meetings: Vec<Meeting> = meetings.into_iter().flatten().collect();
        smooth_steps(&cameras, &lattices, &meetings)
    }

    /// How another photograph sees the `place` that is expected in `direction`; `None` if it does not show it.
    fn sight(&self, number: usize, place: Vector2<f64>, direction: &Vector3<f64>) -> Option<Sight> {
        /// How far outside of the other photograph the camera may expect the place for a look at the mesh, as a share
        /// of its size.
        const ASIDE: f64 = 0.25;
        let other = &self.photographs[number];
        let expected = other.camera.project(other.camera.rotation() * direction)?;
        let size = Vector2::new(other.mesh.width, other.mesh.height);
        let near = |axis: usize| expected[axis] > -ASIDE * size[axis] && expected[axis] < (1.0 + ASIDE) * size[axis];
        if !(near(0) && near(1)) {
            return None;
        }
        let mut place = place;
        if let Some(period) = self.period {
            place.x += period * ((other.mesh.warp(expected).x - place.x) / period).round();
        }
        let (low, high) = &self.bounds[number];
        if (0..2).any(|axis| place[axis] < low[axis] || place[axis] > high[axis]) {
            return None;
        }
        let pixel = other.mesh.source_of(place, expected)?;
        let inside = (0..2).all(|axis| (0.0..=size[axis]).contains(&pixel[axis]));
        let direction = other.camera.world_direction(pixel);
        let weight = depth(other, pixel);
        let (room, trust) = (room(other, weight), self.trusts[number]);
        inside.then_some(Sight { photograph: number, pixel, direction, weight, room, trust })
    }
}

/// Whether two boxes (lowest and highest coordinates) have a place in common, wherever on a plane that repeats after
/// `period` in x.
fn meet(a: &(Vector2<f64>, Vector2<f64>), b: &(Vector2<f64>, Vector2<f64>), period: Option<f64>) -> bool {
    /// Pixels of the panorama that rounding cannot move a place by.
    const ROUNDING: f64 = 1e-3;
    let mut apart = (b.0 + b.1 - a.0 - a.1) * 0.5;
    if let Some(period) = period {
        apart.x -= period * (apart.x / period).round();
    }
    let reach = (b.1 - b.0 + a.1 - a.0) * 0.5;
    (0..2).all(|axis| apart[axis].abs() <= reach[axis] + ROUNDING)
}

/// The direction in which a photograph sees a place, and how much it counts.
#[derive(Debug, Clone, Copy)]
struct Sight {
    photograph: usize,
    /// Where the photograph shows it.
    pixel: Vector2<f64>,
    /// By its camera.
    direction: Vector3<f64>,
    weight: f64,
    /// About how far the photograph's border is, radians.
    room: f64,
    /// How far its mesh is believed, 0 to 1.
    trust: f64,
}

/// Up to so far from the horizon the mesh's sphere can be unrolled.
const WHOLE_DEG: f64 = 65.0;

/// How far the mesh of a photograph is believed that reaches this far from the horizon of the mesh's sphere (radians),
/// which is unrolled up to 70 degrees: what lies beyond pulls at its neighbors.
fn trust(steepest: f64) -> f64 {
    const NONE_DEG: f64 = 75.0;
    ((NONE_DEG - steepest.to_degrees()) / (NONE_DEG - WHOLE_DEG)).clamp(0.0, 1.0)
}

/// How surely it is `parallax` by which others see otherwise what a steep photograph shows, not what its mesh errs by,
/// so that the mesh is believed.
///
/// Of cut photographs from one point, that look up by 45 to 55 degrees and meet by their cameras alone, the mesh says
/// 0.6 to 2e-4 radians; of steep photographs of churches and rooms, between which photographers moved, 14 to 100e-4.
fn evidence(parallax: f64) -> f64 {
    /// Radians: no more than what meshes err by.
    const NONE: f64 = 3e-4;
    /// Radians: certain.
    const WHOLE: f64 = 12e-4;
    smooth(parallax, [NONE, WHOLE])
}

/// 1 in the middle of a photograph, 0 on its border.
fn depth(photograph: &PosedPhotograph, pixel: Vector2<f64>) -> f64 {
    let along = |position: f64, length: f64| (2.0 * position.min(length - position) / length).max(0.0);
    along(pixel.x, photograph.mesh.width) * along(pixel.y, photograph.mesh.height)
}

/// About how far from its border, radians, a place of a photograph lies that is so deep in it.
fn room(photograph: &PosedPhotograph, depth: f64) -> f64 {
    0.5 * depth * photograph.mesh.width.min(photograph.mesh.height) / photograph.camera.focal_px
}

/// Where a place is drawn that is seen in the directions `seen`: their mean, faded towards the first as the cameras
/// contradict each other. All photographs that see the place come to the same mean and the same fading.
fn common_direction(sights: &[Sight], max_parallax: f64, seen: impl Fn(&Sight) -> Vector3<f64>) -> Vector3<f64> {
    let own = seen(&sights[0]);
    if sights.len() == 1 {
        return own;
    }
    let (Some(mean), Some(by_cameras)) =
        (mean_direction(sights, &seen), mean_direction(sights, |sight| sight.direction))
    else {
        return own;
    };
    let share = kept(sights, &by_cameras, max_parallax) * trust_of(sights) * room_to_meet(sights, &seen);
    own.lerp(&mean, share).normalize()
}

/// Which share of the way sights go to their mean where photographs end beside each other; their directions are those
/// `seen`.
///
/// Where the border of one photograph crosses that of another, what is drawn goes from what the one sees to what the
/// other sees within any distance, however small: cells fold. So sights meet only where they have room for it, and are
/// left apart nearer to the crossing.
fn room_to_meet(sights: &[Sight], seen: impl Fn(&Sight) -> Vector3<f64>) -> f64 {
    let room: f64 = sights.iter().map(|sight| sight.room).sum();
    let directions: Vec<Vector3<f64>> = sights.iter().map(seen).collect();
    let pairs = directions.iter().enumerate().flat_map(|(k, one)| directions[..k].iter().map(|other| one.angle(other)));
    let apart = pairs.fold(f64::MIN_POSITIVE, f64::max);
    smooth(MOST_PER_ROOM * room / apart, [0.0, 1.0])
}

/// The mean of the directions `seen`; `None` if none of the sights counts.
fn mean_direction(sights: &[Sight], seen: impl Fn(&Sight) -> Vector3<f64>) -> Option<Vector3<f64>> {
    sights.iter().map(|sight| seen(sight) * sight.weight).sum::<Vector3<f64>>().try_normalize(f64::MIN_POSITIVE)
}

/// Which share of the way to their `mean` sights go, as far as they lie from it: 1 up to half of `max_parallax`,
/// falling to 0 at all of it.
fn kept(sights: &[Sight], mean: &Vector3<f64>, max_parallax: f64) -> f64 {
    let counted = sights.iter().filter(|sight| sight.weight > 0.0);
    let farthest = counted.map(|sight| sight.direction.angle(mean)).fold(sights[0].direction.angle(mean), f64::max);
    smooth(2.0 - 2.0 * farthest / max_parallax.max(f64::MIN_POSITIVE), [0.0, 1.0])
}

/// How far sights are believed, together.
fn trust_of(sights: &[Sight]) -> f64 {
    let weights: f64 = sights.iter().map(|sight| sight.weight).sum();
    sights.iter().map(|sight| sight.weight * sight.trust).sum::<f64>() / weights
}

#[cfg(test)]
mod tests {
    use trueup_core::geometry::{rotation_about_x, rotation_about_y};

    use super::*;

    /// Two photographs 30 degrees apart on an unrolled sphere of 700 pixels a radian. What the second one's mesh says
    /// is moved by `moved` panorama pixels against its camera.
    fn pair(moved: [f64; 2]) -> Vec<PosedPhotograph> {
        pair_looking_up(0.0, moved)
    }

    /// The same, looking up by `pitch` degrees.
    fn pair_looking_up(pitch: f64, moved: [f64; 2]) -> Vec<PosedPhotograph> {
        let pitch = rotation_about_x(pitch.to_radians());
        let photograph = |yaw: f64, moved: [f64; 2]| {
            let level_from_camera = rotation_about_y(yaw) * pitch;
            let camera = Camera::new(700.0, 800.0, 600.0, &level_from_camera.transpose());
            let mut mesh = GridMesh::regular(800.0, 600.0, 20.0);
            let own = Camera::new(700.0, 800.0, 600.0, &pitch.transpose());
            for vertex in 0..mesh.len() {
                let ray = own.world_direction(mesh.source(vertex));
                let place = Vector2::new(yaw + ray.x.atan2(ray.z), ray.y.asin()) * 700.0;
                mesh.target[vertex] = (place + Vector2::from(moved)).into();
            }
            PosedPhotograph { camera, mesh }
        };
        vec![photograph(0.0, [0.0; 2]), photograph(30_f64.to_radians(), moved)]
    }

    /// The direction a photograph draws a pixel in.
    fn drawn(photographs: &[PosedPhotograph], shifts: &[ParallaxShift], k: usize, pixel: Vector2<f64>) -> Vector3<f64> {
        photographs[k].camera.world_direction(shifts[k].looked_through(&photographs[k].mesh, pixel))
    }

    #[test]
    fn what_agrees_stays() {
        let photographs = pair([0.0; 2]);
        let shifts = shifts(&photographs, None, 0.03);
        assert_eq!(shifts.len(), 2);
        for (shift, photograph) in shifts.iter().zip(&photographs) {
            assert_eq!(shift.aside.len(), photograph.mesh.len());
            let largest = shift.aside.iter().map(Vector2::norm).fold(0.0, f64::max);
            assert!(largest < 0.15, "the grid's own sag, not {largest}");
        }
    }

    /// Pixels that the mesh puts at the same place are drawn in the same direction; where a photograph is alone it
    /// goes on evenly, and all but stays far from the overlap.
    #[test]
    fn overlaps_meet_and_the_rest_goes_on() {
        let photographs = pair([4.0, -3.0]);
        let shifts = shifts(&photographs, None, 0.03);
        for pixel in [[450.0, 300.0], [600.0, 200.0], [700.0, 450.0]].map(Vector2::from) {
            let start = photographs[0].camera.transfer(&photographs[1].camera, pixel).expect("in front");
            let same = photographs[1].mesh.source_of(photographs[0].mesh.warp(pixel), start).expect("overlapping");
            let before =
                photographs[0].camera.world_direction(pixel).angle(&photographs[1].camera.world_direction(same))
                    * 700.0;
            assert!((before - 5.0).abs() < 0.3, "{before}");
            let apart = drawn(&photographs, &shifts, 0, pixel).angle(&drawn(&photographs, &shifts, 1, same)) * 700.0;
            assert!(apart < 0.1, "{apart} px at {pixel}");
        }
        let moved = |pixel: [f64; 2]| {
            let pixel = Vector2::from(pixel);
            drawn(&photographs, &shifts, 0, pixel).angle(&photographs[0].camera.world_direction(pixel)) * 700.0
        };
        let (beside, far) = (moved([300.0, 300.0]), moved([20.0, 300.0]));
        assert!(beside > 0.2 && beside < 5.0 && far < beside, "{beside} and {far} px");
    }

    /// A mesh that contradicts its cameras by 50 pixels (4 degrees) is not believed.
    #[test]
    fn contradictions_are_left_to_the_cameras() {
        let photographs = pair([50.0, 0.0]);
        let shifts = shifts(&photographs, None, 0.03);
        assert_eq!(shifts.len(), 2);
        for (shift, photograph) in shifts.iter().zip(&photographs) {
            assert_eq!(shift.aside.len(), photograph.mesh.len());
            assert!(shift.aside.iter().all(|aside| aside.norm() < 1e-6));
        }
    }

    /// Of photographs that reach up beyond 75 degrees, what the mesh says is followed where it is more than it errs by.
    #[test]
    fn steep_photographs_meet_where_parallax_is_evident() {
        let largest = |moved: [f64; 2]| {
            let photographs = pair_looking_up(54.0, moved);
            let down = Vector3::y();
            let overlaps = Overlaps::new(&photographs, None, 0.1);
            let reach = photographs.iter().map(|one| steepest(one, &Matrix3::identity()).to_degrees());
            assert!(reach.clone().all(|reach| (75.0..85.0).contains(&reach)), "{:?}", reach.collect::<Vec<_>>());
            let shifts = shifts(&photographs, None, 0.1);
            let aside = shifts.iter().flat_map(|shift| &shift.aside).map(Vector2::norm).fold(0.0, f64::max);
            ([0, 1].map(|k| overlaps.parallax(k, &down)), overlaps.trusts, aside)
        };
        let (parallax, trusts, aside) = largest([0.0, 0.1]);
        assert!(parallax.iter().all(|&parallax| parallax < 3e-4), "{parallax:?}");
        assert!(trusts == [0.0; 2] && aside < 1e-6, "{trusts:?}: {aside} px");
        let (parallax, trusts, aside) = largest([0.0, 5.0]);
        assert!(parallax.iter().all(|&parallax| (parallax * 700.0 - 5.0).abs() < 0.3), "{parallax:?}");
        assert!(trusts == [1.0; 2] && aside > 1.0, "{trusts:?}: {aside} px");
    }

    /// Around the place where the upper border of one photograph crosses the right border of another, 10 pixels apart
    /// in what they see there: no place moves by more than half a step against its neighbor, in any direction, and
    /// cells do not fold; away from there both are drawn at the same place.
    #[test]
    fn cells_do_not_fold_where_borders_cross() {
        const FOCAL_PX: f64 = 700.0;
        const APART: f64 = 10.0 / FOCAL_PX;
        let sights = |below: f64, aside: f64, first: usize| {
            let sight = |photograph: usize| {
                let (distance, length) = if photograph == 0 { (below, 600.0) } else { (aside, 800.0) };
                let (weight, room) = (2.0 * distance / length, distance / FOCAL_PX);
                let direction = rotation_about_y(APART * photograph as f64) * Vector3::z();
                Sight { photograph, pixel: Vector2::zeros(), direction, weight, room, trust: 1.0 }
            };
            [sight(first), sight(1 - first)]
        };
        let drawn = |below: f64, aside: f64, first: usize| {
            let direction = common_direction(&sights(below, aside, first), 1.0, |sight| sight.direction);
            FOCAL_PX * direction.x.atan2(direction.z)
        };
        let mut steepest = 0.0_f64;
        for below in (1..160).map(|k| f64::from(k) * 0.25) {
            for aside in (1..160).map(|k| f64::from(k) * 0.25) {
                let here = drawn(below, aside, 0);
                let by = [drawn(below + 0.01, aside, 0) - here, drawn(below, aside + 0.01, 0) - here];
                steepest = steepest.max(by[0].hypot(by[1]) / 0.01);
            }
        }
        assert!((0.4..0.55).contains(&steepest), "{steepest}");
        let together = drawn(20.0, 15.0, 0) - drawn(20.0, 15.0, 1);
        assert!(together.abs() < 1e-9, "{together}");
        let apart = drawn(1e-6, 1e-6, 1) - drawn(1e-6, 1e-6, 0);
        assert!((apart - 10.0).abs() < 1e-3, "{apart}");
    }

    #[test]
    fn boxes_meet_across_the_turn() {
        let at = |x: f64, y: f64| (Vector2::new(x, y), Vector2::new(x + 10.0, y + 10.0));
        assert!(meet(&at(0.0, 0.0), &at(9.0, -9.0), None));
        assert!(!meet(&at(0.0, 0.0), &at(11.0, 0.0), None) && !meet(&at(0.0, 0.0), &at(0.0, 11.0), None));
        // Of a turn of 100, 295 is 5 to the left of 300.
        assert!(
            meet(&at(0.0, 0.0), &at(295.0, 0.0), Some(100.0)) && !meet(&at(0.0, 0.0), &at(250.0, 0.0), Some(100.0))
        );
        // A box as wide as the turn is everywhere.
        let wide = (Vector2::new(0.0, 0.0), Vector2::new(101.0, 10.0));
        assert!((0..10).all(|step| meet(&wide, &at(f64::from(step) * 37.0, 0.0), Some(100.0))));
    }

    /// The same pair with the second mesh a turn farther.
    #[test]
    fn overlaps_meet_across_the_turn() {
        let near = shifts(&pair([4.0, -3.0]), None, 0.03);
        let period = std::f64::consts::TAU * 700.0;
        let far = shifts(&pair([4.0 + period, -3.0]), Some(period), 0.03);
        assert_eq!((near.len(), far.len()), (2, 2));
        let moved = near.iter().flat_map(|shift| &shift.aside).map(Vector2::norm).fold(0.0, f64::max);
        assert!(moved > 1.0, "the overlap asks for {moved} px only");
        for (near, far) in near.iter().zip(&far) {
            assert_eq!(near.aside.len(), far.aside.len());
            let largest = near.aside.iter().zip(&far.aside).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(largest < 1e-2, "{largest}");
        }
    }
}
