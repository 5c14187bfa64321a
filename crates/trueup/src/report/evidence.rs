//! What the photographs of a panorama show that tells how well it is drawn, whatever it is drawn on.

use rayon::prelude::*;
use trueup_align::metrics::{self, VerticalLinesInput};
use trueup_align::similarity::{EstimatedRoll, RollsInput, estimated_rolls};
use trueup_core::camera::Camera;
use trueup_core::lines::LineSegment;
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::source::WorkingFrame;

use crate::pipeline::align::Geometry;
use crate::pipeline::align::component::Component;

/// Lines and matches of the photographs that make a panorama, from its stitching: what another view of it is measured
/// by, too.
#[derive(Debug)]
pub(crate) struct Evidence {
    /// In the order of the panorama's grids.
    pub photographs: Vec<EvidencePhotograph>,
    /// The overlaps that were to coincide.
    pub pairs: Vec<EvidencePair>,
    /// Which of the photographs sets the pixel scale.
    pub reference: usize,
}

/// A photograph, and what its own lines tell.
#[derive(Debug)]
pub(crate) struct EvidencePhotograph {
    /// Its position among all photographs of the project.
    pub position: usize,
    pub frame: WorkingFrame,
    /// Its camera, in working pixels.
    pub camera: Camera,
    /// Its vertical lines, in working pixels: those that carry the vertical that the lines of all photographs tell, or
    /// where these tell none, that it has by itself.
    pub vertical_lines: Vec<LineSegment>,
    /// The roll that the lines of all photographs tell.
    pub roll: Option<EstimatedRoll>,
    pub long_lines: Vec<EvidenceLine>,
}

/// A long line, and which of the photograph's three vanishing directions it points to.
#[derive(Debug)]
pub(crate) struct EvidenceLine {
    /// In working pixels.
    pub segment: LineSegment,
    pub direction: Option<usize>,
}

/// What two photographs have in common, by their numbers in [`Evidence::photographs`].
#[derive(Debug)]
pub(crate) struct EvidencePair {
    pub a: usize,
    pub b: usize,
    /// In the photographs' own pixels.
    pub matches: Vec<PointMatch>,
}

impl Evidence {
    /// That of a group of photographs whose geometry was found.
    pub(crate) fn of(component: &Component, geometry: &Geometry) -> Self {
        let rolls = rolls(component, geometry);
        let mut vertical_lines = vertical_lines(component, geometry, &rolls);
        let photograph = |k: usize| EvidencePhotograph {
            position: component.members[k],
            frame: component.frames[k],
            camera: geometry.cameras.cameras[k],
            vertical_lines: std::mem::take(&mut vertical_lines[k]),
            roll: rolls[k],
            long_lines: long_lines(component, geometry, k),
        };
        Self {
            photographs: (0..component.members.len()).map(photograph).collect(),
            pairs: geometry.coinciding.iter().map(|pair| in_full(component, pair)).collect(),
            reference: component.reference,
        }
    }
}

/// The vertical lines of each photograph.
fn vertical_lines(
    component: &Component,
    geometry: &Geometry,
    rolls: &[Option<EstimatedRoll>],
) -> Vec<Vec<LineSegment>> {
    let down = geometry.prior.level_from_world().row(1).transpose();
    let of_photograph = |k: usize| -> Vec<LineSegment> {
        let (lines, camera) = (&geometry.lines(component)[k], &geometry.cameras.cameras[k]);
        let expected_down = rolls[k].map_or_else(|| camera.rotation() * down, |known| known.down);
        let photograph = VerticalLinesInput { lines, frame: &component.frames[k], camera, expected_down };
        let vertical = match rolls[k] {
            Some(_) => metrics::carrying_segments(&photograph),
            None => metrics::vertical_segments(&photograph),
        };
        vertical.into_iter().map(|line| lines[line]).collect()
    };
    (0..component.members.len()).into_par_iter().map(of_photograph).collect()
}

/// The roll of every photograph that the lines of all of them tell.
fn rolls(component: &Component, geometry: &Geometry) -> Vec<Option<EstimatedRoll>> {
    let input = RollsInput {
        cameras: &geometry.cameras.cameras,
        edges: &geometry.coinciding,
        lines: geometry.lines(component),
        frames: &component.frames,
        prior: &geometry.prior,
    };
    // Rolls are of rotating cameras.
    let rolls = if geometry.cameras.flat_scene.is_some() { None } else { estimated_rolls(&input) };
    rolls.unwrap_or_else(|| vec![None; component.members.len()])
}

/// The long lines of photograph `k`.
fn long_lines(component: &Component, geometry: &Geometry, k: usize) -> Vec<EvidenceLine> {
    let shortest = metrics::LONG_LINE_DIAGONAL * component.frames[k].diagonal();
    let long: Vec<LineSegment> =
        geometry.lines(component)[k].iter().filter(|line| line.length() >= shortest).copied().collect();
    let directions = match geometry.triads[k].triad() {
        Some(triad) => {
            let matrix = triad.matrix();
            let columns = std::array::from_fn(|column| matrix.column(column).into_owned());
            metrics::directions_of_segments(&long, &geometry.cameras.cameras[k], &columns)
        }
        None => vec![None; long.len()],
    };
    long.into_iter().zip(directions).map(|(segment, direction)| EvidenceLine { segment, direction }).collect()
}

/// A pair's matches in the photographs' own pixels.
fn in_full(component: &Component, pair: &PairMatches) -> EvidencePair {
    let full = |point: [f64; 2], photograph: usize| {
        point.map(|coordinate| coordinate / component.frames[photograph].working_from_full)
    };
    let in_full = |one: &PointMatch| PointMatch { in_a: full(one.in_a, pair.a), in_b: full(one.in_b, pair.b) };
    EvidencePair { a: pair.a, b: pair.b, matches: pair.inliers.iter().map(in_full).collect() }
}
