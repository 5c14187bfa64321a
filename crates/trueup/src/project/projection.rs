//! How a panorama is drawn from directions, as its project records it.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};
use trueup_align::projection::{Fit, FlatKind, ProjectionView};
use trueup_compose::crop::Rectangle;
use trueup_compose::layout::CanvasLayout;
use trueup_core::spherical::{SphericalFrame, SphericalProjection};

/// Share of the half turn from pole to pole that a whole sphere shows at least: what lies at a pole is often not
/// photographed, where the tripod stands.
pub(crate) const WHOLE_SPHERE: f64 = 0.75;

/// What lies farther away than this, in panorama pixels, has no place any more: no file format is as wide.
pub(crate) const FARTHEST_PX: f64 = 4_294_967_296.0;

/// Least scale that is recorded, canvas pixels per radian: a whole turn on less than a pixel is no panorama.
const LEAST_PX_PER_RADIAN: f64 = 1e-3;

/// How the panorama is drawn from directions. A direction of the level world (x right, y down, z forward) that the
/// rotations `yaw`, `pitch` and `roll` turn into the viewer's lies at `(plane - origin) * px_per_radian` on the canvas,
/// where `plane` is its place in the projection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProjectionRecord {
    /// The projection's name.
    pub kind: FlatKind,
    /// Where the viewer looks: to the right of straight ahead in the level world.
    pub yaw_deg: f64,
    /// Where the viewer looks: up.
    pub pitch_deg: f64,
    /// How the viewer's head is turned, clockwise.
    pub roll_deg: f64,
    /// Distance of Panini's viewpoint behind the axis; the others do not ask.
    pub panini_distance: f64,
    /// Which of its family a fitted projection is; nothing recorded of the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
    /// Canvas pixels per radian at the projection's middle.
    pub px_per_radian: f64,
    /// The plane's coordinates (radians at the middle) at the canvas's corner.
    pub origin: [f64; 2],
    /// Where the panorama lies on the whole sphere, for viewers of spherical panoramas; `None` for other projections.
    pub sphere: Option<SphericalFrame>,
}

impl ProjectionRecord {
    /// How `view` is drawn on the canvas `drawn`.
    pub(crate) fn new(view: &ProjectionView, drawn: &CanvasLayout) -> Self {
        let record = Self {
            kind: view.flat.kind,
            yaw_deg: view.yaw.to_degrees(),
            pitch_deg: view.pitch.to_degrees(),
            roll_deg: view.roll.to_degrees(),
            panini_distance: view.flat.panini_distance,
            fit: (view.flat.kind == FlatKind::Fitted).then_some(view.flat.fit),
            px_per_radian: drawn.canvas_from_target,
            origin: drawn.origin,
            sphere: None,
        };
        let (size, turn) = ([drawn.width, drawn.height], drawn.period);
        Self { sphere: record.sphere_of(size, turn), ..record }
    }

    /// How it is drawn on a part of its canvas; `turn` is the width of the canvas if it goes all the way round.
    pub(crate) fn of_part(&self, part: &Rectangle, turn: Option<usize>) -> Self {
        let corner = part.corner();
        let origin = [0, 1].map(|axis| self.origin[axis] + corner[axis] / self.px_per_radian);
        let moved = Self { origin, ..*self };
        Self { sphere: moved.sphere_of(part.size(), turn), ..moved }
    }

    /// Whether a canvas of this height shows a turn from pole to pole, or all but: a whole sphere.
    pub(crate) fn is_whole_sphere(&self, height: usize, turn: Option<usize>) -> bool {
        let half_turn = PI * self.px_per_radian;
        turn.is_some() && self.kind == FlatKind::Equirectangular && height as f64 >= WHOLE_SPHERE * half_turn
    }

    /// Where a canvas of `size` pixels lies on the whole sphere, in whole pixels.
    fn sphere_of(&self, [width, height]: [usize; 2], turn: Option<usize>) -> Option<SphericalFrame> {
        let scale = self.px_per_radian;
        let [x, y] = self.origin;
        // Rounding may put the last column a pixel beyond the whole.
        let whole = |length: f64, start: usize, own: usize| (length.round() as usize).max(start + own);
        let start = |at: f64| (at * scale).round().max(0.0) as usize;
        let left = start(x + PI);
        let full_width = turn.unwrap_or_else(|| whole(TAU * scale, left, width));
        let (projection, top, full_height) = match self.kind {
            FlatKind::Equirectangular => {
                let top = start(y + PI / 2.0);
                (SphericalProjection::Equirectangular, top, whole(PI * scale, top, height))
            }
            FlatKind::Cylindrical => {
                // As high above the horizon as below it.
                let half = (-y).max(y + height as f64 / scale).max(0.0);
                let top = start(y + half);
                (SphericalProjection::Cylindrical, top, whole(2.0 * half * scale, top, height))
            }
            _ => return None,
        };
        Some(SphericalFrame { projection, full_width, full_height, left, top, middle_yaw: self.yaw_deg.to_radians() })
    }

    /// Whether it can have been recorded: a scale above 0, and a middle within the reach of any canvas.
    pub(crate) fn is_sound(&self) -> bool {
        let turns = [self.yaw_deg, self.pitch_deg, self.roll_deg, self.panini_distance];
        let is_near = |at: &f64| (at * self.px_per_radian).abs() <= FARTHEST_PX;
        (LEAST_PX_PER_RADIAN..=FARTHEST_PX).contains(&self.px_per_radian)
            && self.origin.iter().all(is_near)
            && turns.iter().all(|turn| turn.is_finite())
    }

    /// Pixels of the canvas after which directions repeat; `None` on a plane, on which they do not.
    pub(crate) fn turn_px(&self) -> Option<f64> {
        self.kind.turns().then_some(TAU * self.px_per_radian)
    }
}

#[cfg(test)]
mod tests {
    use trueup_align::projection::Flat;

    use super::*;

    fn view(kind: FlatKind) -> ProjectionView {
        let (flat, half) = (Flat::named(kind, 1.0), kind.comfortable());
        ProjectionView { flat, yaw: 0.25, pitch: 0.0, roll: 0.0, half, shown: None, closed: false }
    }

    fn sphere(view: &ProjectionView, canvas: &CanvasLayout) -> Option<SphericalFrame> {
        ProjectionRecord::new(view, canvas).sphere
    }

    fn canvas(width: usize, height: usize, origin: [f64; 2]) -> CanvasLayout {
        CanvasLayout { width, height, canvas_from_target: 1000.0, origin, placed: Vec::new(), period: None }
    }

    /// 1000 pixels a radian: the whole is 6283 x 3142 pixels, its middle at (3141.6, 1570.8); the canvas begins half a
    /// radian left of it and 0.2 radians above the horizon.
    #[test]
    fn a_cropped_panorama_knows_its_place_on_the_sphere() {
        let frame = sphere(&view(FlatKind::Equirectangular), &canvas(1200, 700, [-0.5, -0.2])).expect("a sphere");
        assert_eq!((frame.full_width, frame.full_height, frame.left, frame.top), (6283, 3142, 2642, 1371));
        assert!(frame.holds(1200, 700) && (frame.middle_yaw - 0.25).abs() < 1e-12);
        // The cylinder reaches 0.5 below the horizon, and as much above it in the whole.
        let frame = sphere(&view(FlatKind::Cylindrical), &canvas(1200, 700, [-0.5, -0.2])).expect("a cylinder");
        assert_eq!((frame.full_height, frame.top), (1000, 300));
        assert!(sphere(&view(FlatKind::Panini), &canvas(10, 10, [0.0; 2])).is_none());
        // What rounding adds at the end is part of the whole.
        let corner = [-PI, -PI / 2.0];
        let ending = sphere(&view(FlatKind::Equirectangular), &canvas(6284, 3143, corner));
        assert!(ending.expect("a sphere").holds(6284, 3143));
    }

    /// What is cut off of a panorama is as if it had never been drawn.
    #[test]
    fn a_part_of_a_panorama_lies_where_it_lay() {
        let whole = ProjectionRecord::new(&view(FlatKind::Equirectangular), &canvas(1200, 700, [-0.5, -0.2]));
        let part = whole.of_part(&Rectangle { columns: 100..1000, rows: 50..650 }, None);
        let alone = ProjectionRecord::new(&view(FlatKind::Equirectangular), &canvas(900, 600, [-0.4, -0.15]));
        assert!((0..2).all(|axis| (part.origin[axis] - alone.origin[axis]).abs() < 1e-12));
        assert_eq!(ProjectionRecord { origin: alone.origin, ..part }, alone);
        assert!(!whole.is_whole_sphere(3142, None) && whole.is_whole_sphere(3142, Some(6283)));
        assert!(!whole.is_whole_sphere(1000, Some(6283)));
    }
}
