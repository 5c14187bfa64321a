//! What hangs on walls, and the bars that frame it.

use super::materials::RoomMaterials;
use crate::material::MaterialId;
use crate::scene::builder::Builder;
use crate::scene::wall::{Opening, Wall};

/// Four bars round a rectangle of a wall.
pub(super) fn frame(builder: &mut Builder, wall: &Wall, at: Opening, bar: f64, out: [f64; 2], material: MaterialId) {
    let Opening { left, right, foot, head } = at;
    builder.piece(wall.span([left, left + bar], [foot, head], out), material);
    builder.piece(wall.span([right - bar, right], [foot, head], out), material);
    builder.piece(wall.span([left + bar, right - bar], [foot, foot + bar], out), material);
    builder.piece(wall.span([left + bar, right - bar], [head - bar, head], out), material);
}

/// A framed picture or a poster, centered `up` metres high.
pub(in crate::scene) fn picture(
    builder: &mut Builder,
    wall: &Wall,
    center: f64,
    up: f64,
    size: [f64; 2],
    finish: &RoomMaterials,
) {
    let at = Opening {
        left: center - size[0] / 2.0,
        right: center + size[0] / 2.0,
        foot: up - size[1] / 2.0,
        head: up + size[1] / 2.0,
    };
    let poster = builder.dice.chance(0.3);
    let face = if poster { finish.page } else { finish.picture };
    let border = if poster { 0.02 } else { 0.035 };
    let timber = if builder.dice.chance(0.5) { finish.dark_timber } else { finish.timber };
    frame(builder, wall, at, border, [0.0, 0.03], timber);
    let mat = if poster { border } else { border + 0.05 };
    builder.piece(
        wall.span([at.left + border, at.right - border], [at.foot + border, at.head - border], [0.0, 0.012]),
        finish.paper,
    );
    builder.piece(wall.span([at.left + mat, at.right - mat], [at.foot + mat, at.head - mat], [0.0, 0.014]), face);
}

/// Pictures hung in a loose grid.
pub(in crate::scene) fn gallery(builder: &mut Builder, wall: &Wall, left: f64, width: f64, finish: &RoomMaterials) {
    let columns = (width / 0.62).floor().max(1.0);
    for k in 0..columns as usize {
        let center = left + width * (k as f64 + 0.5) / columns;
        let wide = builder.dice.range(0.36, 0.54);
        if builder.dice.chance(0.5) {
            let tall = builder.dice.range(0.6, 0.8);
            picture(builder, wall, center, 1.55, [wide, tall], finish);
        } else {
            for up in [1.32, 1.86] {
                let tall = builder.dice.range(0.32, 0.46);
                picture(builder, wall, center, up, [wide, tall], finish);
            }
        }
    }
}
