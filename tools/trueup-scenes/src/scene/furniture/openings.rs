//! Windows and doors.

use nalgebra::Vector3;

use super::materials::RoomMaterials;
use super::pictures::frame;
use crate::portal::Portal;
use crate::scene::builder::Builder;
use crate::scene::wall::{Opening, Wall};

/// The opening a window of this width needs.
pub(in crate::scene) fn window_opening(left: f64, width: f64) -> Opening {
    Opening { left, right: left + width, foot: 0.85, head: 2.3 }
}

/// Window with bars, sill, curtains and radiator; the sky's light comes in through it.
pub(in crate::scene) fn window(builder: &mut Builder, wall: &Wall, at: Opening, finish: &RoomMaterials) {
    let Opening { left, right, foot, head } = at;
    frame(builder, wall, at, 0.06, [-0.16, -0.09], finish.white_paint);
    let middle = (left + right) / 2.0;
    builder.piece(
        wall.span([middle - 0.03, middle + 0.03], [foot + 0.06, head - 0.06], [-0.16, -0.09]),
        finish.white_paint,
    );
    let transom = foot + 0.68 * (head - foot);
    for side in [[left + 0.06, middle - 0.03], [middle + 0.03, right - 0.06]] {
        builder.piece(wall.span(side, [transom - 0.02, transom + 0.02], [-0.15, -0.1]), finish.white_paint);
    }
    let surround = Opening { left: left - 0.08, right: right + 0.08, foot: foot - 0.02, head: head + 0.08 };
    frame(builder, wall, surround, 0.08, [0.0, 0.02], finish.white_paint);
    builder.piece(wall.span([left - 0.12, right + 0.12], [foot - 0.05, foot], [-0.09, 0.16]), finish.white_paint);
    for side in [[left - 0.42, left - 0.06], [right + 0.06, right + 0.42]] {
        builder.piece(wall.span(side, [0.06, 2.48], [0.05, 0.1]), finish.curtain);
    }
    builder.piece(wall.span([left - 0.5, right + 0.5], [2.48, 2.51], [0.06, 0.09]), finish.metal);
    let mut rib = left + 0.1;
    while rib < right - 0.1 {
        builder.piece(wall.span([rib, rib + 0.045], [0.14, 0.7], [0.04, 0.12]), finish.white_paint);
        rib += 0.06;
    }
    builder.portals.push(Portal {
        corner: wall.at(left, head, -0.24),
        side_s: wall.along * (right - left),
        side_t: Vector3::new(0.0, head - foot, 0.0),
        normal: wall.out,
        radiance: None,
    });
}

/// The opening a door needs.
pub(in crate::scene) fn door_opening(left: f64) -> Opening {
    Opening { left, right: left + 0.95, foot: 0.0, head: 2.08 }
}

/// A closed door with panels, architrave and handle, and a light switch beside it.
pub(in crate::scene) fn door(builder: &mut Builder, wall: &Wall, at: Opening, finish: &RoomMaterials) {
    let Opening { left, right, head, .. } = at;
    let around = Opening { left: left - 0.09, right: right + 0.09, foot: 0.0, head: head + 0.09 };
    frame(builder, wall, around, 0.09, [0.0, 0.025], finish.white_paint);
    builder.piece(wall.span([left, right], [0.005, head], [-0.12, -0.07]), finish.timber);
    let middle = (left + right) / 2.0;
    for side in [[left + 0.12, middle - 0.05], [middle + 0.05, right - 0.12]] {
        for rows in [[0.18, 0.85], [1.0, 1.9]] {
            let panel = Opening { left: side[0], right: side[1], foot: rows[0], head: rows[1] };
            frame(builder, wall, panel, 0.03, [-0.07, -0.055], finish.dark_timber);
        }
    }
    builder.piece(wall.span([right - 0.09, right - 0.05], [0.95, 1.15], [-0.07, -0.055]), finish.metal);
    builder.piece(wall.span([right - 0.2, right - 0.06], [1.05, 1.075], [-0.03, -0.01]), finish.metal);
    builder.piece(wall.span([right + 0.2, right + 0.28], [1.1, 1.18], [0.0, 0.012]), finish.white_paint);
}
