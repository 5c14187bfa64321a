//! Synthetic sweeps of cameras in a Manhattan world, and the vanishing directions they would yield.

use nalgebra::{Matrix3, Vector3};
use rand::{Rng, RngExt};
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::geometry::{
    exp_rotation, random_rotation, rotation_about_x, rotation_about_y, rotation_about_z, rows_of,
};
use trueup_core::lines::LineSegment;
use trueup_core::matches::{PairMatches, PairVerdict, PointMatch, PointMatches};
use trueup_core::source::WorkingFrame;

use super::{PriorInput, PriorMethod, SimilarityOptions, SimilarityPrior, run};
use crate::vanishing::{Triad, TriadOutcome, VanishingOptions};

/// A normally distributed number (Box and Muller).
pub(crate) fn normal(generator: &mut impl Rng) -> f64 {
    let (first, second): (f64, f64) = (generator.random(), generator.random());
    (-2.0 * (1.0 - first).ln()).sqrt() * (std::f64::consts::TAU * second).cos()
}

/// A rotation by a normally distributed vector of `sd_deg` per component.
pub(crate) fn noise_rotation(sd_deg: f64, generator: &mut impl Rng) -> Matrix3<f64> {
    exp_rotation(&Vector3::from_fn(|_, _| normal(generator) * sd_deg.to_radians()))
}

/// How cameras are placed: `rows` sweeps of `count` photographs in all.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep {
    pub count: usize,
    pub rows: usize,
    pub yaw_step_deg: f64,
    pub pitch_base_deg: f64,
    pub roll_sd_deg: f64,
}

impl Default for Sweep {
    fn default() -> Self {
        Self { count: 8, rows: 1, yaw_step_deg: 25.0, pitch_base_deg: 0.0, roll_sd_deg: 8.0 }
    }
}

/// True cameras and what is measured of them.
#[derive(Debug, Clone)]
pub(crate) struct SyntheticScene {
    /// True rolls in radians.
    pub roll: Vec<f64>,
    /// True rotations from camera to world.
    pub world_from_camera: Vec<Matrix3<f64>>,
    pub cameras: Vec<Camera>,
    pub triads: Vec<TriadOutcome>,
    pub lines: Vec<Vec<LineSegment>>,
    pub frames: Vec<WorkingFrame>,
    pub edges: Vec<PairMatches>,
}

/// What the photographs' vanishing directions are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum World {
    /// One frame, but for a share of photographs with a random triad.
    Manhattan { noise_deg: f64, bad_share: f64 },
    /// A random triad in every photograph.
    Random,
}

pub(crate) const SIZE: (f64, f64) = (800.0, 600.0);
pub(crate) const FOCAL_PX: f64 = 700.0;

impl SyntheticScene {
    pub(crate) fn new(sweep: Sweep, world: World, camera_noise_deg: f64, seed: u64) -> Self {
        let mut generator = StageContext::default().generator("synthetic", seed);
        let (roll, world_from_camera, edges) = sweep.place(&mut generator);
        let gauge = random_rotation(&mut generator);
        let bad = match world {
            World::Manhattan { bad_share, .. } => (bad_share * sweep.count as f64).round() as usize,
            World::Random => sweep.count,
        };
        let mut order: Vec<usize> = (0..sweep.count).collect();
        for place in 0..sweep.count {
            order.swap(place, generator.random_range(place..sweep.count));
        }
        let (mut cameras, mut triads) = (Vec::new(), Vec::new());
        for (index, rotation) in world_from_camera.iter().enumerate() {
            let measured = noise_rotation(camera_noise_deg, &mut generator) * rotation.transpose() * gauge;
            cameras.push(Camera::new(FOCAL_PX, SIZE.0, SIZE.1, &measured));
            let noise_deg = if let World::Manhattan { noise_deg, .. } = world { noise_deg } else { 0.0 };
            let wrong = order[..bad].contains(&index);
            let exact = if wrong { random_rotation(&mut generator) } else { rotation.transpose() };
            triads.push(found(&shuffled(&(noise_rotation(noise_deg, &mut generator) * exact), &mut generator)));
        }
        let frames = vec![WorkingFrame { width: SIZE.0, height: SIZE.1, working_from_full: 1.0 }; sweep.count];
        Self { roll, world_from_camera, cameras, triads, lines: vec![Vec::new(); sweep.count], frames, edges }
    }

    /// What the prior is made from, without overlaps.
    pub(crate) fn input<'a>(&'a self, vanishing: &'a VanishingOptions) -> PriorInput<'a> {
        PriorInput {
            method: PriorMethod::VanishingPoints,
            cameras: &self.cameras,
            triads: &self.triads,
            lines: &self.lines,
            frames: &self.frames,
            gravity: &[],
            shown: &[],
            edges: &self.edges,
            overlaps: &[],
            cell_px: 40.0,
            vanishing,
            turn: 0.0,
            reference: 0,
        }
    }

    pub(crate) fn prior(&self, options: &SimilarityOptions) -> SimilarityPrior {
        run(&self.input(&VanishingOptions::default()), options, &StageContext::default()).expect("a well-formed scene")
    }

    /// The same with all level lines along a slope: of the 20 of each of three directions, of which the second is the
    /// vertical, those of the others.
    pub(crate) fn on_a_slope(&self, slope_deg: f64) -> Self {
        let mut sloping = self.clone();
        let mut generator = StageContext::default().generator("slope", 0);
        let slope = rotation_about_x(slope_deg.to_radians());
        for (lines, rotation) in sloping.lines.iter_mut().zip(&self.world_from_camera) {
            let along = photograph_lines(&(rotation.transpose() * slope), 20, 0, 0.5, &mut generator);
            lines[0..20].copy_from_slice(&along[0..20]);
            lines[40..60].copy_from_slice(&along[40..60]);
        }
        sloping
    }

    /// Per photograph |theta - roll| in degrees.
    pub(crate) fn errors_deg(&self, prior: &SimilarityPrior) -> Vec<f64> {
        let error = |(theta, roll): (&f64, &f64)| trueup_core::geometry::wrap_angle(theta - roll).abs().to_degrees();
        assert_eq!(prior.theta.len(), self.roll.len());
        prior.theta.iter().zip(&self.roll).map(error).collect()
    }
}

impl Sweep {
    /// Rolls, camera-to-world rotations, and an edge to the right and the lower neighbor.
    fn place(&self, generator: &mut impl Rng) -> (Vec<f64>, Vec<Matrix3<f64>>, Vec<PairMatches>) {
        const ROW_STEP_DEG: f64 = 25.0;
        const PITCH_SD_DEG: f64 = 4.0;
        const YAW_SD_DEG: f64 = 2.0;
        let columns = self.count.div_ceil(self.rows);
        let (mut rolls, mut rotations, mut edges) = (Vec::new(), Vec::new(), Vec::new());
        for index in 0..self.count {
            let (row, column) = (index / columns, index % columns);
            let yaw = (column as f64 - columns as f64 / 2.0) * self.yaw_step_deg + YAW_SD_DEG * normal(generator);
            let offset = (row as f64 - (self.rows as f64 - 1.0) / 2.0) * ROW_STEP_DEG;
            let pitch = self.pitch_base_deg + offset + PITCH_SD_DEG * normal(generator);
            let roll = (self.roll_sd_deg * normal(generator)).to_radians();
            let (pan, tilt) = (rotation_about_y(yaw.to_radians()), rotation_about_x(pitch.to_radians()));
            rotations.push(pan * tilt * rotation_about_z(roll));
            rolls.push(roll);
            if column + 1 < columns && index + 1 < self.count {
                edges.push(joined(index, index + 1, Vec::new()));
            }
            if index + columns < self.count {
                edges.push(joined(index, index + columns, Vec::new()));
            }
        }
        (rolls, rotations, edges)
    }
}

/// A joined pair with these matches.
pub(crate) fn joined(a: usize, b: usize, inliers: Vec<PointMatch>) -> PairMatches {
    let count = inliers.len();
    PairMatches {
        a,
        b,
        putative: count,
        in_overlap: count,
        agreeing: count,
        needed: 15,
        verdict: PairVerdict::Joined,
        b_from_a: None,
        inliers: inliers.into(),
        elsewhere: PointMatches::default(),
    }
}

/// A triad of exactly these directions.
pub(crate) fn found(matrix: &Matrix3<f64>) -> TriadOutcome {
    TriadOutcome::Found(Triad {
        camera_from_triad: rows_of(matrix),
        quality: 1.0,
        line_counts: [20; 3],
        clusters: Vec::new(),
        covariance: [[0.0; 3]; 3],
        roll_sd: None,
    })
}

/// The columns in random order and with random signs.
fn shuffled(matrix: &Matrix3<f64>, generator: &mut impl Rng) -> Matrix3<f64> {
    let mut columns: [Vector3<f64>; 3] = std::array::from_fn(|k| matrix.column(k).into_owned());
    for place in 0..3 {
        columns.swap(place, generator.random_range(place..3));
        columns[place] *= if generator.random_bool(0.5) { 1.0 } else { -1.0 };
    }
    Matrix3::from_columns(&columns)
}

/// Segments of a camera's photograph: `per_direction` along each axis of the world, `clutter` in any direction, ends
/// moved by normal noise.
pub(crate) fn photograph_lines(
    camera_from_world: &Matrix3<f64>,
    per_direction: usize,
    clutter: usize,
    noise_px: f64,
    generator: &mut impl Rng,
) -> Vec<LineSegment> {
    let mut segments = Vec::new();
    let point = |generator: &mut dyn Rng| {
        [(generator.random::<f64>() - 0.5) * SIZE.0, (generator.random::<f64>() - 0.5) * SIZE.1]
    };
    for axis in 0..3 {
        let v = camera_from_world.column(axis);
        let mut made = 0;
        while made < per_direction {
            let start = point(generator);
            let toward = [FOCAL_PX * v.x - start[0] * v.z, FOCAL_PX * v.y - start[1] * v.z];
            let length = (25.0 + 135.0 * generator.random::<f64>()) / toward[0].hypot(toward[1]);
            let end = [start[0] + length * toward[0], start[1] + length * toward[1]];
            if end[0].abs() <= SIZE.0 / 2.0 && end[1].abs() <= SIZE.1 / 2.0 {
                let mut noisy = |value: f64| value + noise_px * normal(generator);
                let ends = [[noisy(start[0]), noisy(start[1])], [noisy(end[0]), noisy(end[1])]];
                segments.push(segment(ends[0], ends[1]));
                made += 1;
            }
        }
    }
    for _ in 0..clutter {
        let start = point(generator);
        let angle = std::f64::consts::PI * generator.random::<f64>();
        let length = 25.0 + 75.0 * generator.random::<f64>();
        segments.push(segment(start, [start[0] + length * angle.cos(), start[1] + length * angle.sin()]));
    }
    segments
}

/// A segment between points given from the photograph's center.
fn segment(start: [f64; 2], end: [f64; 2]) -> LineSegment {
    let place = |point: [f64; 2]| [point[0] + SIZE.0 / 2.0, point[1] + SIZE.1 / 2.0];
    LineSegment { start: place(start), end: place(end), width_px: 2.0, significance: 10.0 }
}
