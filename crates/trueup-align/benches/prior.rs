//! Speed of the search for vanishing directions and of the similarity prior.

use std::f64::consts::TAU;

use nalgebra::Matrix3;
use rand::{Rng, RngExt};
use trueup_align::similarity::{PriorInput, SimilarityOptions, run};
use trueup_align::vanishing::{TriadOutcome, VanishingOptions, detect_triad};
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};
use trueup_core::lines::LineSegment;
use trueup_core::matches::{PairMatches, PairVerdict, PointMatches};
use trueup_core::source::WorkingFrame;

const FRAME: WorkingFrame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 0.5 };
const FOCAL_PX: f64 = 700.0;

fn main() {
    divan::main();
}

/// 400 segments: 100 along each axis of the world, 100 in any direction.
fn lines(camera_from_world: &Matrix3<f64>, generator: &mut impl Rng) -> Vec<LineSegment> {
    let segment = |index: usize, generator: &mut dyn Rng| {
        let start = [(generator.random::<f64>() - 0.5) * 800.0, (generator.random::<f64>() - 0.5) * 600.0];
        let length = 25.0 + 135.0 * generator.random::<f64>();
        let angle = match index % 4 {
            3 => TAU * generator.random::<f64>(),
            axis => {
                let v = camera_from_world.column(axis);
                (FOCAL_PX * v.y - start[1] * v.z).atan2(FOCAL_PX * v.x - start[0] * v.z)
            }
        };
        let start = [start[0] + 400.0, start[1] + 300.0];
        let end = [start[0] + length * angle.cos(), start[1] + length * angle.sin()];
        LineSegment { start, end, width_px: 2.0, significance: 10.0 }
    };
    (0..400).map(|index| segment(index, generator)).collect()
}

/// Cameras of three rows of a full circle.
fn rotations(count: usize) -> Vec<Matrix3<f64>> {
    let columns = count.div_ceil(3);
    let place = |index: usize| {
        let yaw = TAU * (index % columns) as f64 / columns as f64;
        let pitch = 0.4 * ((index / columns) as f64 - 1.0);
        (rotation_about_y(yaw) * rotation_about_x(pitch) * rotation_about_z(0.1 * (index as f64).sin())).transpose()
    };
    (0..count).map(place).collect()
}

#[divan::bench]
fn triad_of_400_segments(bencher: divan::Bencher<'_, '_>) {
    let context = StageContext::default();
    let rotation = rotations(3)[1] * rotation_about_y(0.5);
    let lines = lines(&rotation, &mut context.generator("lines", 0));
    let camera = Camera::new(FOCAL_PX, FRAME.width, FRAME.height, &rotation);
    let options = VanishingOptions::default();
    bencher.bench(|| detect_triad(&lines, &camera, &FRAME, &options, &mut context.generator("vanishing", 0)));
}

#[divan::bench(args = [12, 40, 72])]
fn prior(bencher: divan::Bencher<'_, '_>, count: usize) {
    let context = StageContext::default();
    let vanishing = VanishingOptions::default();
    let rotations = rotations(count);
    let cameras: Vec<Camera> =
        rotations.iter().map(|rotation| Camera::new(FOCAL_PX, FRAME.width, FRAME.height, rotation)).collect();
    let subjects = || (0_u64..).zip(&rotations);
    let lines: Vec<Vec<LineSegment>> =
        subjects().map(|(subject, rotation)| lines(rotation, &mut context.generator("lines", subject))).collect();
    let triads: Vec<TriadOutcome> = subjects()
        .zip(&lines)
        .zip(&cameras)
        .map(|(((subject, _), lines), camera)| {
            detect_triad(lines, camera, &FRAME, &vanishing, &mut context.generator("vanishing", subject))
        })
        .collect();
    let columns = count.div_ceil(3);
    let edges: Vec<PairMatches> = (0..count)
        .flat_map(|index| [(index, index + 1), (index, index + columns)])
        .filter(|&(_, other)| other < count)
        .map(|(a, b)| joined(a, b))
        .collect();
    let frames = vec![FRAME; count];
    let input = PriorInput {
        method: trueup_align::similarity::PriorMethod::VanishingPoints,
        cameras: &cameras,
        triads: &triads,
        lines: &lines,
        frames: &frames,
        gravity: &[],
        shown: &[],
        edges: &edges,
        overlaps: &[],
        cell_px: 40.0,
        vanishing: &vanishing,
        turn: 0.0,
        reference: 0,
    };
    bencher.bench(|| run(&input, &SimilarityOptions::default(), &context));
}

fn joined(a: usize, b: usize) -> PairMatches {
    PairMatches {
        a,
        b,
        putative: 0,
        in_overlap: 0,
        agreeing: 0,
        needed: 15,
        verdict: PairVerdict::Joined,
        b_from_a: None,
        inliers: PointMatches::default(),
        elsewhere: PointMatches::default(),
    }
}
