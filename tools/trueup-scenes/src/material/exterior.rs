//! Surfaces of streets and of the open country.

use nalgebra::Vector3;

use super::interior::specks;
use super::surface::{Spot, SurfaceMaterial};
use crate::color::{Rgb, mix, srgb};
use crate::noise::{band, edge, fractal_noise, lattice, lerp, pulse};

/// Dark streaks that rain leaves, 0 to 1: noise drawn out downwards.
fn streaks(spot: &Spot, salt: u32) -> f64 {
    let drawn = Vector3::new(spot.across, spot.down * 0.12, 0.0);
    fractal_noise(drawn, 0.5, 5, 0.65, spot.footprint, salt).max(0.0)
}

pub(super) fn brick(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let height = material.scale_m;
    let (length, joint) = (3.2 * height, 0.16 * height);
    let row = (spot.down / height).floor();
    let shifted = spot.across + if row.rem_euclid(2.0) < 1.0 { 0.0 } else { 0.5 * length };
    let column = (shifted / length).floor();
    let own = lattice(column as i64, row as i64, 0, 101);
    let other = lattice(column as i64, row as i64, 1, 101);
    let faded = (1.0 - 0.5 * spot.footprint / height).clamp(0.0, 1.0);
    let tone = 1.0 + faded * (lerp(0.55, 1.35, own) - 1.0);
    let fired = mix(material.colors[0], material.colors[2], faded * other * other) * tone;
    let rough = spot.noise(0.03, 4, 0.7, 102);
    let mortar = pulse(spot.down, joint, height, spot.footprint).max(pulse(shifted, joint, length, spot.footprint));
    let wall = mix(fired * (1.0 + 0.25 * rough), material.colors[1] * (1.0 + 0.2 * rough), mortar);
    wall * (1.0 + 0.1 * spot.noise(2.5, 4, 0.5, 103) - 0.25 * streaks(spot, 104))
}

pub(super) fn stucco(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let blotch = spot.noise(1.8, 6, 0.6, 111);
    let grit = spot.noise(0.05, 4, 0.8, 112);
    let crack = fractal_noise(spot.point, 0.9, 5, 0.6, spot.footprint, 113);
    let visible = (0.02 / spot.footprint.max(1e-6)).min(1.0);
    let line = (1.0 - 40.0 * crack.abs()).max(0.0) * visible;
    let speck = specks(spot, 0.3, 0.02, 114);
    let shade = 1.0 + 0.12 * blotch + 0.14 * grit - 0.3 * streaks(spot, 115) - 0.2 * line - 0.25 * speck;
    material.colors[0] * shade
}

pub(super) fn ashlar(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let height = material.scale_m;
    let length = 2.1 * height;
    let row = (spot.down / height).floor();
    let shifted = spot.across + length * lattice(row as i64, 3, 0, 121);
    let column = (shifted / length).floor();
    let own = lattice(column as i64, row as i64, 0, 122);
    let joint = 0.02;
    let groove = pulse(spot.down, joint, height, spot.footprint).max(pulse(shifted, joint, length, spot.footprint));
    // A bevel: light from above catches the lower edge of a groove.
    let bevel = pulse(spot.down - joint, joint, height, spot.footprint);
    let grain = spot.noise(0.3, 6, 0.7, 123);
    let pits = specks(spot, 0.06, 0.006, 124);
    let stone = material.colors[0] * (0.85 + 0.3 * own) * (1.0 + 0.25 * grain - 0.3 * pits);
    stone * (1.0 - 0.6 * groove + 0.12 * bevel - 0.2 * streaks(spot, 125))
}

pub(super) fn asphalt(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let aggregate = spot.noise(0.016, 3, 0.9, 131);
    let patches = spot.noise(3.0, 5, 0.55, 132);
    let crack = fractal_noise(spot.point, 1.5, 6, 0.6, spot.footprint, 133);
    let visible = (0.03 / spot.footprint.max(1e-6)).min(1.0);
    let line = (1.0 - 40.0 * crack.abs()).max(0.0) * visible;
    let stones = specks(spot, 0.05, 0.008, 134);
    let surface = material.colors[0] * (1.0 + 0.45 * aggregate + 0.25 * patches - 0.5 * line + 0.9 * stones);
    // Later repairs are darker and have straight edges.
    let (x, z) = ((spot.point.x / 2.3).floor(), (spot.point.z / 5.1).floor());
    let repaired = lattice(x as i64, z as i64, 0, 135) > 0.8;
    surface * if repaired { 0.72 } else { 1.0 }
}

pub(super) fn paving(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let size = material.scale_m;
    let row = (spot.point.z / size).floor();
    let shifted = spot.point.x + 0.5 * size * row.rem_euclid(2.0);
    let column = (shifted / size).floor();
    let own = lattice(column as i64, row as i64, 0, 141);
    let joint = 0.014;
    let gap = pulse(shifted, joint, size, spot.footprint).max(pulse(spot.point.z, joint, size, spot.footprint));
    let grain = spot.noise(0.2, 6, 0.75, 142);
    let gum = specks(&Spot { across: spot.point.x, down: spot.point.z, ..*spot }, 0.35, 0.025, 143);
    material.colors[0] * (0.8 + 0.4 * own) * (1.0 + 0.3 * grain) * (1.0 - 0.6 * gap) * (1.0 - 0.4 * gum)
}

/// What a window shows by day: mostly dark, here a curtain, there a blind; the sky in it comes by reflection.
pub(super) fn pane(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let [x, y] = spot.unit;
    let soft = spot.footprint / spot.size[0].max(0.1);
    let depth = 0.6 + 0.4 * spot.noise(0.7, 3, 0.5, 151);
    let room = mix(material.colors[0], srgb(0x5a_4c3c), 0.5 * edge(y, 0.55, 0.3)) * depth;
    let dressing = spot.chance(5);
    let cloth = mix(srgb(0xe6_dfd0), srgb(0xb9_a88c), spot.chance(6));
    if dressing < 0.45 {
        let opening = lerp(0.1, 0.42, spot.chance(7));
        let fold = 0.8 + 0.2 * ((x * spot.size[0] / 0.07) * std::f64::consts::TAU).sin();
        let drawn = 1.0 - band(x, opening, 1.0 - opening, soft);
        mix(room, cloth * fold, drawn)
    } else if dressing < 0.7 {
        let lowered = lerp(0.2, 0.8, spot.chance(8));
        let slat = 0.75 + 0.25 * pulse(spot.down, 0.02, 0.05, spot.footprint);
        mix(cloth * slat, room, edge(y, lowered, soft))
    } else {
        room
    }
}

pub(super) fn louvres(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let (x, y) = (spot.unit[0] * width, spot.unit[1] * height);
    let rim = x.min(width - x).min(y).min(height - y);
    let inside = edge(rim, 0.06, spot.footprint);
    let slat = pulse(spot.down, 0.45 * material.scale_m, material.scale_m, spot.footprint);
    let paint = material.colors[0] * (1.0 + 0.12 * spot.noise(0.1, 4, 0.7, 161) - 0.2 * streaks(spot, 162));
    paint * (1.0 - 0.55 * inside * slat)
}

pub(super) fn foliage(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let leaves = spot.noise(0.09, 3, 0.8, 171);
    let clumps = spot.noise(0.7, 3, 0.6, 172);
    let shade = (0.55 + 0.55 * leaves + 0.35 * clumps).clamp(0.08, 1.4);
    mix(material.colors[0], material.colors[1], (0.5 + leaves).clamp(0.0, 1.0)) * shade
}

pub(super) fn grass(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let patches = spot.noise(material.scale_m, 4, 0.6, 191);
    let tufts = spot.noise(0.45, 4, 0.75, 192);
    let blades = spot.noise(0.06, 4, 0.85, 193);
    let green = mix(material.colors[0], material.colors[1], (0.5 + 0.9 * patches).clamp(0.0, 1.0));
    let meadow = green * (0.85 + 0.55 * tufts + 0.75 * blades).clamp(0.15, 1.8);
    let bloom = edge(spot.noise(2.2, 3, 0.6, 194), -0.1, 0.5);
    let flowers = specks(spot, 0.16, 0.022, 195).max(specks(spot, 0.4, 0.05, 196));
    mix(meadow, material.colors[2], 0.8 * bloom * flowers)
}

pub(super) fn rock(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let scale = material.scale_m;
    let layers =
        fractal_noise(spot.point.component_mul(&Vector3::new(0.3, 1.6, 0.3)), scale, 5, 0.6, spot.footprint, 181);
    let lumps = spot.noise(scale, 8, 0.65, 182);
    let lichen = edge(spot.noise(0.6 * scale, 5, 0.6, 183), 0.25, 0.2);
    let stone = material.colors[0] * (0.75 + 0.5 * layers + 0.9 * lumps).clamp(0.12, 1.6);
    mix(stone, material.colors[1] * (0.8 + 0.5 * lumps), 0.7 * lichen)
}
