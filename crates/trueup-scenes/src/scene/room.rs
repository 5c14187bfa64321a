//! Furnished rooms.

use nalgebra::Vector3;

use super::builder::Builder;
use super::furniture::{self, Finish};
use super::wall::Wall;
use crate::colour::srgb;
use crate::material::{Material, MaterialId, Pattern};
use crate::sky::Sun;

/// What may stand along a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Feature {
    Window,
    Door,
    Bookcase,
    Cabinet,
    Gallery,
    Sofa,
    Desk,
}

impl Feature {
    /// Metres of wall it wants.
    fn width(self) -> f64 {
        match self {
            Self::Window => 1.35,
            Self::Door => 0.95,
            Self::Bookcase => 1.3,
            Self::Cabinet => 1.45,
            Self::Gallery => 1.3,
            Self::Sofa => 1.95,
            Self::Desk => 1.4,
        }
    }
}

/// What each wall carries at most, in order of importance.
const WALLS: [&[Feature]; 4] = [
    &[Feature::Window, Feature::Bookcase, Feature::Cabinet, Feature::Gallery],
    &[Feature::Door, Feature::Desk, Feature::Gallery, Feature::Bookcase],
    &[Feature::Sofa, Feature::Bookcase, Feature::Gallery, Feature::Cabinet],
    &[Feature::Window, Feature::Cabinet, Feature::Window, Feature::Gallery],
];

/// Builds a room of 5 to 7 m by 6 to 8 m around the eye.
pub(super) fn build(seed: u64) -> Builder {
    let mut builder = Builder::new(seed, 1);
    let (width, length) = (builder.dice.range(5.2, 6.8), builder.dice.range(5.8, 7.6));
    let height = builder.dice.range(2.65, 2.95);
    let finish = Finish::new(&mut builder);
    let (x, z) = (width / 2.0, length / 2.0);
    let corner = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let walls = [
        Wall { corner: corner(-x, z), along: Vector3::x(), out: -Vector3::z(), length: width },
        Wall { corner: corner(x, z), along: -Vector3::z(), out: -Vector3::x(), length },
        Wall { corner: corner(x, -z), along: -Vector3::x(), out: Vector3::z(), length: width },
        Wall { corner: corner(-x, -z), along: Vector3::z(), out: Vector3::x(), length },
    ];
    shell(&mut builder, [x, z], height, &finish);
    let covering = wall_covering(&mut builder);
    let accent = wall_covering(&mut builder);
    for (index, wall) in walls.iter().enumerate() {
        let surface = if index % 2 == 0 { covering } else { accent };
        furnish(&mut builder, wall, WALLS[index], height, surface, &finish);
    }
    let rug_at = Vector3::new(builder.dice.range(-0.3, 0.3), 0.0, 0.2 * z);
    let rug = rug_material(&mut builder);
    builder.piece([rug_at + Vector3::new(-1.5, -0.012, -1.1), rug_at + Vector3::new(1.5, 0.0, 1.1)], rug);
    furniture::table(&mut builder, rug_at + Vector3::new(0.2, 0.0, 0.25), height, &finish);
    furniture::plant(&mut builder, Vector3::new(x - 0.4, 0.0, z - 0.4), &finish);
    furniture::plant(&mut builder, Vector3::new(-x + 0.4, 0.0, -z + 0.4), &finish);
    builder.eye = Vector3::new(0.15 * x, -1.55, -0.4 * z);
    let towards = Vector3::new(-0.62, -0.62, 0.55).normalize();
    builder.sun = Some(Sun { towards, irradiance: srgb(0xff_ead0) * 4.0 });
    builder.sky.brightness = 1.3;
    builder
}

/// Floor, ceiling with beams, and what runs round both.
fn shell(builder: &mut Builder, [x, z]: [f64; 2], height: f64, finish: &Finish) {
    const THICK: f64 = 0.25;
    let timbers = [0xa8_7848, 0xc0_9464, 0x8a_5a34];
    let timber = timbers[builder.dice.index(timbers.len())];
    let floor = if builder.dice.chance(0.7) {
        Material::new(Pattern::Planks, builder.dice.range(0.1, 0.18), [timber; 3]).glossy(0.04)
    } else {
        Material::new(Pattern::Tiles, 0.4, [0xc8_bca8, 0x9a_8878, 0x6a_645c]).glossy(0.04)
    };
    let floor = builder.material(floor);
    let ceiling = if builder.dice.chance(0.5) {
        Material::new(Pattern::Planks, 0.14, [0xe6_d8bc; 3])
    } else {
        Material::new(Pattern::Plaster, 1.0, [0xf2_efe8; 3])
    };
    let ceiling = builder.material(ceiling);
    let (x, z) = (x + THICK, z + THICK);
    builder.block([Vector3::new(-x, 0.0, -z), Vector3::new(x, THICK, z)], floor);
    builder.block([Vector3::new(-x, -height - THICK, -z), Vector3::new(x, -height, z)], ceiling);
    if builder.dice.chance(0.6) {
        let beams = 4;
        for k in 0..beams {
            let at = -z + 2.0 * z * (f64::from(k) + 0.5) / f64::from(beams);
            builder.piece(
                [Vector3::new(-x, -height, at - 0.07), Vector3::new(x, -height + 0.16, at + 0.07)],
                finish.dark_timber,
            );
        }
    }
}

fn wall_covering(builder: &mut Builder) -> MaterialId {
    let papers =
        [[0xe8_e0c8, 0xdc_d0b0, 0x6a_6034], [0xd0_dcd8, 0xc0_d0cc, 0x2e_5654], [0xe6_d2ca, 0xd8_beb4, 0x7a_3c38]];
    let plasters = [0xe6_dcc8, 0xc4_ccc4, 0xd8_c0a4, 0xb8_c4d0];
    let kind = builder.dice.unit();
    let material = if kind < 0.5 {
        Material::new(Pattern::Wallpaper, builder.dice.range(0.22, 0.28), papers[builder.dice.index(papers.len())])
    } else if kind < 0.7 {
        Material::new(Pattern::Brick, 0.075, [0xa8_6248, 0xc4_b8a6, 0xc8_906c])
    } else {
        Material::new(Pattern::Plaster, 1.0, [plasters[builder.dice.index(plasters.len())]; 3])
    };
    builder.material(material)
}

fn rug_material(builder: &mut Builder) -> MaterialId {
    let rugs =
        [[0x8a_2e28, 0xe0_cc9c, 0x2a_3a58], [0x2e_4a66, 0xdc_d0b0, 0x8a_4a30], [0x5a_5a3c, 0xe4_d8b8, 0x7a_2c28]];
    let colours = rugs[builder.dice.index(rugs.len())];
    builder.material(Material::new(Pattern::Rug, 1.0, colours))
}

/// Builds a wall with as many features as it has room for, in random order, evenly spaced.
fn furnish(
    builder: &mut Builder,
    wall: &Wall,
    features: &[Feature],
    height: f64,
    surface: MaterialId,
    finish: &Finish,
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
fn fill_gap(builder: &mut Builder, wall: &Wall, [from, to]: [f64; 2], beside: [Feature; 2], finish: &Finish) {
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
fn skirting(builder: &mut Builder, wall: &Wall, doors: &[super::wall::Opening], height: f64, finish: &Finish) {
    let mut from = 0.0;
    for door in doors {
        builder.piece(wall.span([from, door.left - 0.09], [0.0, 0.11], [0.0, 0.018]), finish.white_paint);
        from = door.right + 0.09;
    }
    builder.piece(wall.span([from, wall.length], [0.0, 0.11], [0.0, 0.018]), finish.white_paint);
    builder.piece(wall.span([0.0, wall.length], [height - 0.07, height], [0.0, 0.05]), finish.white_paint);
    builder.piece(wall.span([0.0, wall.length], [height - 0.12, height - 0.07], [0.0, 0.02]), finish.white_paint);
}
