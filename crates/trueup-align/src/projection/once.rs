//! Every photograph's grid once, whole and even: what is measured and recorded of a view.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector2};
use rayon::prelude::*;
use trueup_core::geometry::wrap_angle;
use trueup_core::mesh::GridMesh;

use super::grid::Placement;
use super::parallax_shift::ParallaxShift;
use super::photograph::PosedPhotograph;

/// Largest distance of the middle of a cell's side from the true map, in canvas pixels, that even division is to reach.
/// A tenth of a pixel is what matches are good for.
const LARGEST_SAG_PX: f64 = 0.1;
/// The finest division of a cell of the solved mesh.
const FINEST: usize = 4;

/// Places every photograph of the view as one even grid on the plane, in the order given.
///
/// Other than the grids of [`super::place`], which are drawn, each is whole: a photograph across the cut of a turn goes
/// on beyond the end of the plane, one that shows a pole is torn behind its middle (cells wider than a quarter turn),
/// and what lies beyond the view's end has its place as far as the projection goes. Vertices that have none are NaN.
/// Cells are those of the solved mesh, divided evenly until they are within a tenth of a pixel of the true map, but
/// into 4 x 4 at most.
pub fn place_once(
    photographs: &[PosedPhotograph],
    shifts: &[ParallaxShift],
    placement: &Placement<'_>,
) -> Vec<GridMesh> {
    photographs
        .par_iter()
        .zip(shifts)
        .map(|(photograph, shift)| {
            let view_from_camera = placement.view.view_from_level() * photograph.camera.rotation().transpose();
            Once { photograph, shift, placement, view_from_camera }.grid()
        })
        .collect()
}

struct Once<'a> {
    photograph: &'a PosedPhotograph,
    shift: &'a ParallaxShift,
    placement: &'a Placement<'a>,
    view_from_camera: Matrix3<f64>,
}

impl Once<'_> {
    /// The place of a pixel, on a turn at most half of one away from the photograph's middle; NaN where it has none.
    fn place(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        let flat = &self.placement.view.flat;
        let looked_through = self.shift.looked_through(&self.photograph.mesh, pixel);
        let direction = self.view_from_camera * self.photograph.camera.bearing(looked_through);
        let Some(mut place) = flat.place(direction) else { return Vector2::repeat(f64::NAN) };
        if flat.kind.turns() {
            let ahead = self.view_from_camera.column(2);
            let center = ahead.x.atan2(ahead.z);
            place.x = center + wrap_angle(place.x - center);
        }
        place
    }

    fn even(&self, division: usize) -> GridMesh {
        let solved = &self.photograph.mesh;
        let [rows, columns] = [solved.rows, solved.columns].map(|lines| (lines - 1) * division + 1);
        let mut mesh =
            GridMesh { rows, columns, width: solved.width, height: solved.height, target: Vec::new(), lines: None };
        mesh.target = (0..mesh.len()).map(|vertex| self.place(mesh.source(vertex)).into()).collect();
        mesh
    }

    fn grid(&self) -> GridMesh {
        let coarse = self.even(1);
        let sag = self.sag(&coarse) * self.placement.canvas_from_plane;
        // The sag falls with the square of the length; the cast saturates.
        let division = ((sag / LARGEST_SAG_PX).sqrt().ceil() as usize).clamp(1, FINEST);
        if division == 1 { coarse } else { self.even(division) }
    }

    /// The largest distance of the middle of a cell's diagonal from the true map, on the plane; cells that are torn or
    /// not whole aside.
    fn sag(&self, mesh: &GridMesh) -> f64 {
        mesh.whole_cells()
            .filter_map(|[first, _, last, _]| {
                let [from, to] = [first, last].map(|vertex| Vector2::from(mesh.target[vertex]));
                let middle = self.place((mesh.source(first) + mesh.source(last)) / 2.0);
                let is_torn = self.placement.view.flat.kind.turns() && (from.x - to.x).abs() > FRAC_PI_2;
                let sag = ((from + to) / 2.0 - middle).norm();
                (sag.is_finite() && !is_torn).then_some(sag)
            })
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::coverage::tests::photograph;
    use super::super::flat::{Flat, FlatKind};
    use super::super::view::ProjectionView;
    use super::*;

    fn placed(photograph: &PosedPhotograph, kind: FlatKind) -> GridMesh {
        let view = ProjectionView {
            flat: Flat::named(kind, 1.0),
            yaw: 0.0,
            pitch: 0.0,
            roll: 0.0,
            half: kind.comfortable(),
            shown: None,
            closed: false,
        };
        let shift = ParallaxShift { aside: vec![Vector2::zeros(); photograph.mesh.len()] };
        let placement = Placement { view: &view, canvas_from_plane: 700.0, closed: false };
        place_once(std::slice::from_ref(photograph), &[shift], &placement).remove(0)
    }

    /// The corner of a photograph that looks 25 degrees to the right is (400, 300, 700) for its camera, and on the
    /// plane where the tangents of the two turns say.
    #[test]
    fn vertices_lie_where_the_projection_has_them() {
        let mesh = placed(&photograph(25.0, 0.0), FlatKind::Perspective);
        let (sine, cosine) = 25_f64.to_radians().sin_cos();
        let depth = 700.0 * cosine - 400.0 * sine;
        let expected = Vector2::new(700.0 * sine + 400.0 * cosine, 300.0) / depth;
        assert!((Vector2::from(mesh.target[mesh.len() - 1]) - expected).norm() < 1e-9);
        assert!(mesh.rows > 31 && mesh.lines.is_none(), "cells of 20 pixels sag by more than a tenth");
    }

    #[test]
    fn a_photograph_across_the_cut_goes_on_beyond_it() {
        let (low, high) = placed(&photograph(170.0, 0.0), FlatKind::Equirectangular).bounds();
        assert!(low.x < 170_f64.to_radians() && high.x > PI && high.x - low.x < FRAC_PI_2, "{low} {high}");
    }

    #[test]
    fn what_lies_behind_a_plane_is_not_a_number() {
        let mesh = placed(&photograph(75.0, 0.0), FlatKind::Perspective);
        assert!(mesh.is_defined(0) && !mesh.is_defined(mesh.len() - 1));
    }
}
