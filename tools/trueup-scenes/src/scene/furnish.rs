//! Setting furniture along a wall.

use super::builder::Builder;
use super::furniture::{self, RoomMaterials};
use super::style::Feature;
use super::wall::{Opening, Wall};
use crate::material::MaterialId;

/// Builds a wall with as many features as it has room for, in random order, evenly spaced.
pub(super) fn furnish(
    builder: &mut Builder,
    wall: &Wall,
    features: &[Feature],
    height: f64,
    surface: MaterialId,
    finish: &RoomMaterials,
) {
    const CORNER: f64 = 0.75;
    const GAP: f64 = 0.45;
    let room = wall.length - 2.0 * CORNER;
    let mut chosen: Vec<Feature> = Vec::new();
    for &feature in features {
        let used: f64 = chosen.iter().map(|feature| feature.width() + GAP).sum();
        if used + feature.width() <= room {
            chosen.push(feature);
        }
    }
    for k in (1..chosen.len()).rev() {
        let other = builder.dice.index(k + 1);
        chosen.swap(k, other);
    }
    let used: f64 = chosen.iter().map(|feature| feature.width()).sum();
    let gap = (room - used) / (chosen.len() as f64 - 1.0).max(1.0);
    let mut left = if chosen.len() > 1 { CORNER } else { CORNER + (room - used) / 2.0 };
    let (mut openings, mut doors) = (Vec::new(), Vec::new());
    let mut before = None;
    for feature in chosen {
        let width = feature.width();
        match feature {
            Feature::Window => {
                let opening = furniture::window_opening(left, width);
                furniture::window(builder, wall, opening, finish);
                openings.push(opening);
            }
            Feature::Door => {
                let opening = furniture::door_opening(left);
                furniture::door(builder, wall, opening, finish);
                openings.push(opening);
                doors.push(opening);
            }
            Feature::Bookcase => furniture::bookcase(builder, wall, left, width, finish),
            Feature::Cabinet => furniture::cabinet(builder, wall, left, width, finish),
            Feature::Gallery => furniture::gallery(builder, wall, left, width, finish),
            Feature::Sofa => furniture::sofa(builder, wall, left, width, finish),
            Feature::Desk => furniture::desk(builder, wall, left, width, finish),
            Feature::Worktop => furniture::worktop(builder, wall, left, width, finish),
            Feature::Refrigerator => furniture::refrigerator(builder, wall, left, width, finish),
            Feature::WhiteBoard => furniture::white_board(builder, wall, left, width, finish),
            Feature::Lockers => furniture::lockers(builder, wall, left, width, finish),
            Feature::Painting => furniture::painting(builder, wall, left, width, finish),
            Feature::Workbench => furniture::workbench(builder, wall, left, width, finish),
        }
        if let Some((from, beside)) = before {
            fill_gap(builder, wall, [from, left], [beside, feature], finish);
        }
        before = Some((left + width, feature));
        left += width + gap;
    }
    wall.build(builder, &openings, [0.0, height], 0.25, surface);
    skirting(builder, wall, &doors, height, finish);
}

/// Hangs a picture between two features if they leave room for one.
fn fill_gap(builder: &mut Builder, wall: &Wall, [from, to]: [f64; 2], beside: [Feature; 2], finish: &RoomMaterials) {
    const CLEARANCE: f64 = 0.15;
    const CURTAIN: f64 = 0.5;
    let reach = beside.map(|feature| if feature == Feature::Window { CURTAIN } else { CLEARANCE });
    let (from, to) = (from + reach[0], to - reach[1]);
    if to - from > 0.3 {
        let width = (to - from).min(builder.dice.range(0.5, 0.8));
        let height = width * builder.dice.range(1.0, 1.4);
        furniture::picture(builder, wall, (from + to) / 2.0, 1.6, [width, height], finish);
    }
}

/// Skirting board, broken at doors, and a cornice.
fn skirting(builder: &mut Builder, wall: &Wall, doors: &[Opening], height: f64, finish: &RoomMaterials) {
    let mut from = 0.0;
    for door in doors {
        builder.piece(wall.span([from, door.left - 0.09], [0.0, 0.11], [0.0, 0.018]), finish.white_paint);
        from = door.right + 0.09;
    }
    builder.piece(wall.span([from, wall.length], [0.0, 0.11], [0.0, 0.018]), finish.white_paint);
    builder.piece(wall.span([0.0, wall.length], [height - 0.07, height], [0.0, 0.05]), finish.white_paint);
    builder.piece(wall.span([0.0, wall.length], [height - 0.12, height - 0.07], [0.0, 0.02]), finish.white_paint);
}
