//! Whether lines that are straight in a photograph stay straight in the panorama.

use nalgebra::{Matrix2, Vector2};
use trueup_core::camera::Camera;
use trueup_core::lines::LineSegment;
use trueup_core::mesh::GridMesh;

/// Shortest line whose straightness is judged, as a share of the photograph's diagonal: shorter ones hardly show a
/// bend.
pub const LONG_LINE_DIAGONAL: f64 = 0.1;
/// Distance of the points of a line that are carried to the panorama, working pixels.
pub const LINE_STEP_PX: f64 = 3.0;
/// A line that strays from straight by more than this share of its length is bent: 3 px in 1000.
pub const BENT_SHARE: f64 = 0.003;
/// Most steps along a line.
const MAX_STEPS: usize = 10_000;

/// How straight a line is in the panorama. Panorama pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Straightness {
    /// Distance of its ends.
    pub length_px: f64,
    /// Root mean square distance of its points from their least-squares line.
    pub rms_px: f64,
    /// Largest such distance.
    pub largest_px: f64,
}

impl Straightness {
    /// Carries a straight line of the scene to the panorama point by point, `step_px` apart at most and at least three,
    /// and measures their distances from the straight line that fits them best (total least squares). `None` if that is
    /// no line: no length, or not finite anywhere, as where a projection has no place for a part of it.
    ///
    /// `line` has the ends of the line in the photograph, in the pixels of `camera`, over which `mesh` lies. Behind a
    /// lens that bends, what is straight between them in the scene is a curve in the photograph, and that is carried.
    pub fn of(line: &LineSegment, camera: &Camera, mesh: &GridMesh, step_px: f64) -> Option<Self> {
        // The cast saturates, and a length that is not finite or a step of 0 is refused below.
        let steps = ((line.length() / step_px).ceil() as usize).clamp(2, MAX_STEPS);
        let points: Option<Vec<Vector2<f64>>> =
            (0..=steps).map(|k| Some(mesh.warp(place_along(line, camera, k as f64 / steps as f64)?))).collect();
        let points = points?;
        let length_px = (points[steps] - points[0]).norm();
        let is_whole = points.iter().all(|point| point.x.is_finite() && point.y.is_finite());
        if !(is_whole && length_px.is_finite() && length_px > 0.0) {
            return None;
        }
        let count = points.len() as f64;
        let center = points.iter().sum::<Vector2<f64>>() / count;
        let moment: Matrix2<f64> = points.iter().map(|point| (point - center) * (point - center).transpose()).sum();
        let eigen = moment.symmetric_eigen();
        let across: Vector2<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let distances = points.iter().map(|point| (point - center).dot(&across).abs());
        let (squares, largest_px) =
            distances.fold((0.0, 0.0_f64), |(sum, largest), one| (sum + one * one, largest.max(one)));
        Some(Self { length_px, rms_px: (squares / count).sqrt(), largest_px })
    }

    /// The largest distance from straight as a share of the length.
    pub fn bend(&self) -> f64 {
        self.largest_px / self.length_px
    }

    /// Whether the line strays from straight by more than 0.003 of its length.
    pub fn is_bent(&self) -> bool {
        self.bend() > BENT_SHARE
    }
}

/// Where the photograph shows what lies this share of the way from a line's start to its end.
fn place_along(line: &LineSegment, camera: &Camera, share: f64) -> Option<Vector2<f64>> {
    let (start, end) = (Vector2::from(line.start), Vector2::from(line.end));
    if camera.lens.is_pinhole() {
        return Some(start.lerp(&end, share));
    }
    camera.project(camera.bearing(start).lerp(&camera.bearing(end), share))
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::lens::{LensTerms, PlacedLens};

    use super::*;

    fn camera() -> Camera {
        Camera::new(300.0, 300.0, 100.0, &Matrix3::identity())
    }

    fn line(length: f64) -> LineSegment {
        LineSegment { start: [0.0, 50.0], end: [length, 50.0], width_px: 1.0, significance: 1.0 }
    }

    fn mapped(map: impl Fn(Vector2<f64>) -> Vector2<f64>) -> GridMesh {
        let mut mesh = GridMesh::regular(300.0, 100.0, 1.0);
        mesh.target = (0..mesh.len()).map(|vertex| map(mesh.source(vertex)).into()).collect();
        mesh
    }

    #[test]
    fn similarities_keep_lines_straight() {
        let mesh = mapped(|p| Vector2::new(2.0 * p.x - p.y, p.x + 2.0 * p.y));
        let straight = Straightness::of(&line(300.0), &camera(), &mesh, 3.0).expect("a line");
        assert!((straight.length_px - 300.0 * 5.0_f64.sqrt()).abs() < 1e-9);
        assert!(straight.largest_px < 1e-9 && straight.rms_px < 1e-9);
    }

    /// y = a x^2 over 0 to L about its best line: a (t^2 - L^2 / 12), t from the middle; largest a L^2 / 6 at the ends,
    /// RMS a L^2 / sqrt(180). a = 1e-4, L = 300: 1.5 and 0.67082 px, for points close together.
    #[test]
    fn a_parabola_has_its_known_bend() {
        let mesh = mapped(|p| Vector2::new(p.x, 1e-4 * p.x * p.x));
        let bent = Straightness::of(&line(300.0), &camera(), &mesh, 0.5).expect("a line");
        assert!((bent.largest_px - 1.5).abs() < 0.01, "{}", bent.largest_px);
        assert!((bent.rms_px - 0.67082).abs() < 0.01, "{}", bent.rms_px);
        assert!((bent.bend() - 1.5 / 300.0_f64.hypot(9.0)).abs() < 1e-4);
        assert!(bent.is_bent());
        let hardly = mapped(|p| Vector2::new(p.x, 5e-5 * p.x * p.x));
        assert!(!Straightness::of(&line(300.0), &camera(), &hardly, 0.5).expect("a line").is_bent());
    }

    /// A barrel of -3 % at the corners, drawn without its bend: what is straight in the scene is, however it curves in
    /// the photograph.
    #[test]
    fn behind_a_lens_a_straight_line_is_a_curve() {
        let lens = LensTerms { radial: [-0.1, 0.0, 0.0, 0.0], ..LensTerms::default() };
        let bent = camera().through(&PlacedLens { terms: lens, center_px: [0.0; 2] });
        let mesh = mapped(|p| {
            let bearing = bent.bearing(p);
            bearing.xy() / bearing.z * 300.0
        });
        let along_the_border = LineSegment { start: [0.0, 10.0], end: [300.0, 10.0], ..line(300.0) };
        let found = Straightness::of(&along_the_border, &bent, &mesh, 3.0).expect("a line");
        assert!(found.largest_px < 0.01 && found.length_px > 300.0, "{found:?}");
        // Its chord is another line.
        let chord = Straightness::of(&along_the_border, &camera(), &mesh, 3.0).expect("a line");
        assert!(chord.largest_px > 0.3, "{chord:?}");
    }

    #[test]
    fn a_point_is_no_line() {
        assert_eq!(Straightness::of(&line(0.0), &camera(), &mapped(|p| p), 3.0), None);
        assert_eq!(Straightness::of(&line(f64::NAN), &camera(), &mapped(|p| p), 3.0), None);
    }

    /// A line that is torn in its middle alone, as around a pole, is none.
    #[test]
    fn a_line_over_a_cell_that_is_not_there_has_no_straightness() {
        let mut mesh = GridMesh::regular(100.0, 100.0, 10.0);
        let line = LineSegment { start: [5.0, 50.0], end: [95.0, 50.0], width_px: 1.0, significance: 1.0 };
        assert!(Straightness::of(&line, &camera(), &mesh, LINE_STEP_PX).is_some());
        mesh.target[5 * 11 + 5] = [f64::NAN; 2];
        assert!(Straightness::of(&line, &camera(), &mesh, LINE_STEP_PX).is_none());
    }
}
