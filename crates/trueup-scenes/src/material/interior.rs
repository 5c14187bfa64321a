//! Surfaces of rooms.

use nalgebra::Vector3;

use super::{Material, Spot};
use crate::colour::{Rgb, mix, srgb};
use crate::noise::{band, edge, fractal_noise, lattice, lerp, pulse, value_noise};

pub(super) fn plaster(material: &Material, spot: &Spot) -> Rgb {
    let blotch = spot.noise(1.1, 4, 0.55, 11);
    let stipple = spot.noise(0.035, 5, 0.75, 12);
    let trowel = fractal_noise(
        Vector3::new(spot.across + 0.4 * spot.down, spot.down * 3.0, 0.0),
        0.5,
        4,
        0.6,
        spot.footprint,
        13,
    );
    // Small dents and specks, one per 12 cm cell or so: what a detector holds on to on a bare wall.
    let speck = specks(spot, 0.12, 0.006, 14);
    material.colours[0] * (1.0 + 0.05 * blotch + 0.11 * stipple + 0.05 * trowel) * (1.0 - 0.35 * speck)
}

/// Coverage by round specks, about one in two square cells of width `cell_m`, of radius up to `radius_m`.
pub(super) fn specks(spot: &Spot, cell_m: f64, radius_m: f64, salt: u32) -> f64 {
    let (x, y) = (spot.across / cell_m, spot.down / cell_m);
    let (column, row) = (x.floor() as i64, y.floor() as i64);
    let chance = |k| lattice(column, row, k, salt);
    if chance(0) < 0.5 {
        return 0.0;
    }
    let (dx, dy) = (x - column as f64 - lerp(0.2, 0.8, chance(1)), y - row as f64 - lerp(0.2, 0.8, chance(2)));
    let radius = radius_m * lerp(0.3, 1.0, chance(3));
    let distance = (dx * dx + dy * dy).sqrt() * cell_m;
    let visible = (radius / spot.footprint.max(1e-6)).min(1.0);
    visible * (1.0 - edge(distance, radius, spot.footprint))
}

pub(super) fn wallpaper(material: &Material, spot: &Spot) -> Rgb {
    let width = material.scale_m;
    let stripe = pulse(spot.across, width, 2.0 * width, spot.footprint);
    let mut colour = mix(material.colours[0], material.colours[1], stripe);
    for offset in [0.0, 0.004] {
        let line = pulse(spot.across + 0.01 + 2.0 * offset, 0.002 + offset / 4.0, width, spot.footprint);
        colour = mix(colour, material.colours[2], 0.6 * line);
    }
    colour = mix(colour, material.colours[2], 0.8 * leaf(spot, width));
    let paper = spot.noise(0.004, 2, 0.7, 21);
    let age = spot.noise(0.9, 4, 0.5, 22);
    colour * (1.0 + 0.07 * paper + 0.05 * age)
}

/// A stem with leaves and a blossom in every other stripe, mirrored from row to row.
fn leaf(spot: &Spot, width: f64) -> f64 {
    let height = 1.6 * width;
    let column = (spot.across / width).floor();
    let shifted = spot.down + if column.rem_euclid(2.0) < 1.0 { 0.0 } else { 0.5 * height };
    let row = (shifted / height).floor();
    let x = (spot.across / width - column - 0.5) * if row.rem_euclid(2.0) < 1.0 { 1.0 } else { -1.0 };
    let y = shifted / height - row - 0.5;
    let soft = spot.footprint / width;
    let ellipse = |cx: f64, cy: f64, a: f64, b: f64, slope: f64| {
        let (dx, dy) = (x - cx, (y - cy) * 1.6);
        let (u, v) = ((dx + slope * dy) / a, (dy - slope * dx) / b);
        1.0 - edge(((u * u + v * v).sqrt() - 1.0) * a.min(b), 0.0, soft)
    };
    let stem = band(x - 0.06 * (9.0 * y).sin(), -0.012, 0.012, soft) * band(y, -0.4, 0.3, soft);
    let petals = [(0.0, -0.26), (0.1, -0.2), (-0.1, -0.2), (0.06, -0.13), (-0.06, -0.13)];
    let blossom = petals.iter().map(|&(cx, cy)| ellipse(cx, cy, 0.06, 0.06, 0.0)).fold(0.0, f64::max);
    let leaves = [(0.16, 0.02, 0.6), (-0.15, 0.12, -0.6), (0.14, 0.24, 0.5), (-0.12, -0.05, -0.5)]
        .iter()
        .map(|&(cx, cy, slope)| ellipse(cx, cy, 0.12, 0.045, slope))
        .fold(0.0, f64::max);
    let eye = ellipse(0.0, -0.19, 0.035, 0.035, 0.0);
    (stem.max(blossom).max(leaves) - 0.8 * eye).max(0.0)
}

/// Timber sawn along `axis`: rings stretched along the grain, pores, and tone from board to board by the body's seed.
pub(super) fn wood(colour: Rgb, point: Vector3<f64>, axis: usize, spot: &Spot) -> Rgb {
    const STRETCH: f64 = 14.0;
    let mut squeezed = point + Vector3::new(1.7, 0.9, 2.3) * (10.0 * spot.chance(1));
    squeezed[axis] /= STRETCH;
    let footprint = spot.footprint;
    let warp = fractal_noise(squeezed, 0.12, 3, 0.5, footprint, 31);
    let across = squeezed[(axis + 1) % 3] + 0.6 * squeezed[(axis + 2) % 3];
    let visible = (0.01 / footprint.max(1e-6) - 0.5).clamp(0.0, 1.0);
    let rings = ((across / 0.012 + 4.0 * warp) * std::f64::consts::TAU).sin() * visible;
    let fibre = fractal_noise(squeezed, 0.008, 3, 0.8, footprint, 32);
    let tone = fractal_noise(squeezed, 0.05, 3, 0.6, footprint, 33);
    let dark = Vector3::new(0.62, 0.52, 0.45);
    let shade = (0.35 + 0.13 * rings + 0.35 * tone + 0.28 * fibre).clamp(0.0, 1.0);
    mix(colour * 1.1, colour.component_mul(&dark), shade) * (0.92 + 0.16 * spot.chance(2))
}

pub(super) fn planks(material: &Material, spot: &Spot) -> Rgb {
    let (width, length) = (material.scale_m, 9.0 * material.scale_m);
    let column = (spot.point.x / width).floor();
    let shift = length * lattice(column as i64, 0, 0, 41);
    let row = ((spot.point.z + shift) / length).floor();
    let board = Spot { seed: (lattice(column as i64, row as i64, 1, 42) * 4e9) as u32, ..*spot };
    let tone = 0.75 + 0.5 * board.chance(3);
    let colour = wood(material.colours[0], spot.point, 2, &board) * tone;
    let gap = 0.003;
    let joint =
        pulse(spot.point.x, gap, width, spot.footprint).max(pulse(spot.point.z + shift, gap, length, spot.footprint));
    let knot = specks(&Spot { across: spot.point.x, down: spot.point.z, ..*spot }, 0.4, 0.015, 43);
    colour * (1.0 - 0.75 * joint) * (1.0 - 0.5 * knot)
}

pub(super) fn tiles(material: &Material, spot: &Spot) -> Rgb {
    let size = material.scale_m;
    let (column, row) = ((spot.across / size).floor(), (spot.down / size).floor());
    let own = lattice(column as i64, row as i64, 0, 51);
    let odd = (column + row).rem_euclid(2.0);
    let base = mix(material.colours[0], material.colours[1], odd) * (0.88 + 0.24 * own);
    // Every tile shows another piece of stone.
    let offset = Vector3::new(own * 37.0, own * 91.0, own * 53.0);
    let vein = fractal_noise(spot.point + offset, 0.12, 5, 0.6, spot.footprint, 52);
    let visible = (0.01 / spot.footprint.max(1e-6)).min(1.0);
    let line = (1.0 - 9.0 * vein.abs()).max(0.0) * visible;
    let grain = spot.noise(0.006, 2, 0.7, 53);
    let stone = base * (1.0 + 0.12 * vein + 0.06 * grain - 0.18 * line);
    let joint = (0.012 * size).max(0.003);
    let grout = pulse(spot.across, joint, size, spot.footprint).max(pulse(spot.down, joint, size, spot.footprint));
    mix(stone, material.colours[2] * (1.0 + 0.2 * grain), grout)
}

pub(super) fn rug(material: &Material, spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let (x, y) = (spot.unit[0] * width, spot.unit[1] * height);
    let rim = x.min(width - x).min(y).min(height - y);
    let soft = spot.footprint;
    let (u, v) = ((x - width / 2.0) / 0.24, (y - height / 2.0) / 0.32);
    let cell = ((u + 0.5).floor(), (v + 0.5).floor());
    let diamond = (u - cell.0).abs() + (v - cell.1).abs();
    let mut colour = mix(material.colours[0], material.colours[1], band(diamond, 0.25, 0.38, soft / 0.24));
    let heart = lattice(cell.0 as i64, cell.1 as i64, 0, 61);
    colour = mix(colour, mix(material.colours[2], material.colours[1], heart), 1.0 - edge(diamond, 0.17, soft / 0.24));
    colour = mix(colour, material.colours[2], 1.0 - edge(rim, 0.18, soft));
    let teeth = pulse(x + y, 0.03, 0.06, soft) * band(rim, 0.07, 0.11, soft);
    colour = mix(colour, material.colours[1], teeth.max(band(rim, 0.16, 0.175, soft)).max(1.0 - edge(rim, 0.02, soft)));
    let pile = spot.noise(0.008, 2, 0.8, 62);
    let wear = spot.noise(0.5, 4, 0.6, 63);
    colour * (1.0 + 0.3 * pile + 0.12 * wear)
}

pub(super) fn fabric(material: &Material, spot: &Spot) -> Rgb {
    let thread = material.scale_m;
    let warp = pulse(spot.across, 0.5 * thread, thread, spot.footprint);
    let weft = pulse(spot.down, 0.5 * thread, thread, spot.footprint);
    let check = pulse(spot.across, 0.12, 0.24, spot.footprint) + pulse(spot.down, 0.12, 0.24, spot.footprint);
    let noise = spot.noise(0.02, 3, 0.8, 71);
    let colour = mix(material.colours[0], material.colours[1], 0.35 * check);
    colour * (0.86 + 0.2 * (warp + weft - 2.0 * warp * weft) + 0.14 * noise + 0.08 * spot.noise(0.4, 3, 0.5, 72))
}

pub(super) fn curtain(material: &Material, spot: &Spot) -> Rgb {
    let fold = material.scale_m;
    let sway = 0.25 * fold * value_noise(Vector3::new(spot.across / fold, spot.down * 0.8, 0.0), 81);
    let phase = (spot.across + sway) / fold * std::f64::consts::TAU;
    let shade = 0.72 + 0.2 * phase.sin() + 0.08 * (2.3 * phase).sin();
    let motif = leaf(spot, 0.14);
    let colour = mix(material.colours[0], material.colours[1], 0.7 * motif);
    colour * shade * (1.0 + 0.12 * spot.noise(0.006, 3, 0.8, 82))
}

pub(super) fn paint(material: &Material, spot: &Spot) -> Rgb {
    let dirt = spot.noise(0.3, 5, 0.6, 91);
    let fine = spot.noise(0.006, 2, 0.8, 92);
    let scratch = specks(spot, 0.15, 0.004, 93);
    mix(material.colours[0], srgb(0x30_2c28), 0.25 * scratch) * (1.0 + 0.05 * dirt + 0.05 * fine)
}
