//! Surfaces of rooms.

use nalgebra::Vector3;

use super::surface::{Spot, SurfaceMaterial};
use crate::color::{Rgb, mix, srgb};
use crate::noise::{band, edge, fractal_noise, lattice, lerp, pulse};

pub(super) fn plaster(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let blotch = spot.noise(0.7, 2, 0.7, 11);
    // Brushed on by hand: clouds as wide as the brush.
    let limewash = spot.noise(0.2, 3, 0.75, 18);
    let stipple = spot.noise(0.035, 5, 0.75, 12);
    let trowel = fractal_noise(
        Vector3::new(spot.across + 0.4 * spot.down, spot.down * 3.0, 0.0),
        0.5,
        4,
        0.6,
        spot.footprint,
        13,
    );
    // Dents, specks and knocked-off chips of several sizes: what a detector holds on to on a bare wall.
    let speck = specks(spot, 0.12, 0.006, 14).max(0.5 * specks(spot, 0.27, 0.013, 15));
    let stain = stain(spot, 1.3, 16);
    let brown = Vector3::new(0.78, 0.68, 0.5);
    let wall = material.colors[0] * (1.0 + 0.1 * blotch + 0.2 * limewash + 0.12 * stipple + 0.06 * trowel);
    let wall = mix(wall, wall.component_mul(&brown), 0.3 * stain);
    wall * (1.0 - 0.4 * speck) * (1.0 - 0.3 * crack(spot, 1.1, 17))
}

/// Hairline cracks, 0 to 1: where slow noise crosses zero, in the places where a second noise lets it show.
fn crack(spot: &Spot, wavelength: f64, salt: u32) -> f64 {
    const STEEPNESS: f64 = 60.0;
    let visible = (0.008 / spot.footprint.max(1e-6)).min(1.0);
    let path = spot.noise(wavelength, 6, 0.6, salt);
    let open = edge(spot.noise(0.8 * wavelength, 2, 0.5, salt ^ 1), 0.15, 0.2);
    (1.0 - STEEPNESS * path.abs()).max(0.0) * visible * open
}

/// Marks that water left as it dried: ragged patches with a dark rim, in one of three cells of width `cell_m`.
fn stain(spot: &Spot, cell_m: f64, salt: u32) -> f64 {
    let (x, y) = (spot.across / cell_m, spot.down / cell_m);
    let (column, row) = (x.floor(), y.floor());
    let chance = |k| lattice(column as i64, row as i64, k, salt);
    if chance(0) > 0.34 {
        return 0.0;
    }
    let (dx, dy) = (x - column - lerp(0.4, 0.6, chance(1)), y - row - lerp(0.4, 0.6, chance(2)));
    let ragged = dx.hypot(dy) + 0.1 * spot.noise(0.3 * cell_m, 5, 0.55, salt);
    let radius = lerp(0.08, 0.26, chance(3));
    let soft = 0.008 + spot.footprint / cell_m;
    let inside = 1.0 - edge(ragged, radius, 2.0 * soft);
    let rim = band(ragged, 0.9 * radius, radius, soft);
    (0.35 * inside + 0.65 * rim).min(1.0)
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

/// Timber sawn along `axis`: rings stretched along the grain and bent round knots, pores, and tone from board to board
/// by the body's seed.
pub(super) fn wood(color: Rgb, point: Vector3<f64>, axis: usize, spot: &Spot) -> Rgb {
    const STRETCH: f64 = 10.0;
    let own = point + Vector3::new(1.7, 0.9, 2.3) * (10.0 * spot.chance(1));
    let (heart, swell) = knot(own[axis], own[(axis + 1) % 3] + 0.6 * own[(axis + 2) % 3], spot.footprint, spot.seed);
    let mut squeezed = own;
    squeezed[axis] /= STRETCH;
    let footprint = spot.footprint;
    let warp = fractal_noise(squeezed, 0.12, 3, 0.5, footprint, 31);
    let across = squeezed[(axis + 1) % 3] + 0.6 * squeezed[(axis + 2) % 3];
    let visible = (0.01 / footprint.max(1e-6) - 0.5).clamp(0.0, 1.0);
    let rings = ((across / 0.014 + 5.0 * warp + 3.0 * swell) * std::f64::consts::TAU).sin() * visible;
    let fibre = fractal_noise(squeezed, 0.008, 3, 0.8, footprint, 32);
    let tone = fractal_noise(squeezed, 0.05, 4, 0.7, footprint, 33);
    let dark = Vector3::new(0.55, 0.44, 0.36);
    let shade = (0.38 + 0.17 * rings + 0.5 * tone + 0.3 * fibre + 0.25 * swell).clamp(0.0, 1.0);
    let sawn = mix(color * 1.12, color.component_mul(&dark), shade) * (0.92 + 0.16 * spot.chance(2));
    mix(sawn, color.component_mul(&Vector3::new(0.22, 0.15, 0.1)), 0.85 * heart)
}

/// A knot in about every other cell of a board, from the way `along` and `across` the grain: how much of its dark
/// heart there is, and how far it bends the rings round it, both 0 to 1.
fn knot(along: f64, across: f64, footprint: f64, seed: u32) -> (f64, f64) {
    const CELL_M: [f64; 2] = [0.24, 0.12];
    let (column, row) = ((along / CELL_M[0]).floor(), (across / CELL_M[1]).floor());
    let chance = |k| lattice(column as i64, row as i64, k, seed ^ 34);
    if chance(0) < 0.55 {
        return (0.0, 0.0);
    }
    let radius = lerp(0.005, 0.017, chance(1) * chance(1));
    let (u, v) = (
        along - (column + lerp(0.35, 0.65, chance(2))) * CELL_M[0],
        across - (row + lerp(0.4, 0.6, chance(3))) * CELL_M[1],
    );
    let distance = (u * lerp(0.5, 0.9, chance(4))).hypot(v);
    // No further than the cell's border.
    let reach = (2.6 * radius).min(0.35 * CELL_M[1]);
    let swell = (1.0 - distance / reach).max(0.0);
    let visible = (radius / footprint.max(1e-6)).min(1.0);
    (visible * (1.0 - edge(distance, radius, footprint.max(0.3 * radius))), visible * swell)
}

pub(super) fn planks(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let (width, length) = (material.scale_m, 9.0 * material.scale_m);
    let column = (spot.point.x / width).floor();
    let shift = length * lattice(column as i64, 0, 0, 41);
    let row = ((spot.point.z + shift) / length).floor();
    let board = Spot { seed: (lattice(column as i64, row as i64, 1, 42) * 4e9) as u32, ..*spot };
    let tone = 0.62 + 0.6 * board.chance(3);
    let color = wood(material.colors[0], spot.point, 2, &board) * tone;
    let gap = 0.003;
    let joint =
        pulse(spot.point.x, gap, width, spot.footprint).max(pulse(spot.point.z + shift, gap, length, spot.footprint));
    // Nails beside the joints, and the scratches and stains of many years.
    let flat = Spot { across: spot.point.x, down: spot.point.z, ..*spot };
    let worn = specks(&flat, 0.3, 0.018, 43).max(0.6 * stain(&flat, 0.9, 44));
    let wear = spot.noise(0.4, 5, 0.65, 45);
    color * (1.0 - 0.75 * joint) * (1.0 - 0.45 * worn) * (1.0 + 0.15 * wear)
}

pub(super) fn tiles(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let size = material.scale_m;
    let (column, row) = ((spot.across / size).floor(), (spot.down / size).floor());
    let own = lattice(column as i64, row as i64, 0, 51);
    let odd = (column + row).rem_euclid(2.0);
    let base = mix(material.colors[0], material.colors[1], odd) * (0.88 + 0.24 * own);
    // Every tile shows another piece of stone.
    let offset = Vector3::new(own * 37.0, own * 91.0, own * 53.0);
    let vein = fractal_noise(spot.point + offset, 0.12, 5, 0.6, spot.footprint, 52);
    let visible = (0.01 / spot.footprint.max(1e-6)).min(1.0);
    let line = (1.0 - 9.0 * vein.abs()).max(0.0) * visible;
    let grain = spot.noise(0.006, 2, 0.7, 53);
    let stone = base * (1.0 + 0.12 * vein + 0.06 * grain - 0.18 * line);
    let joint = (0.012 * size).max(0.003);
    let grout = pulse(spot.across, joint, size, spot.footprint).max(pulse(spot.down, joint, size, spot.footprint));
    mix(stone, material.colors[2] * (1.0 + 0.2 * grain), grout)
}

pub(super) fn fabric(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let thread = material.scale_m;
    let warp = pulse(spot.across, 0.5 * thread, thread, spot.footprint);
    let weft = pulse(spot.down, 0.5 * thread, thread, spot.footprint);
    let check = pulse(spot.across, 0.12, 0.24, spot.footprint) + pulse(spot.down, 0.12, 0.24, spot.footprint);
    let noise = spot.noise(0.02, 3, 0.8, 71);
    let color = mix(material.colors[0], material.colors[1], 0.35 * check);
    color * (0.86 + 0.2 * (warp + weft - 2.0 * warp * weft) + 0.14 * noise + 0.08 * spot.noise(0.4, 3, 0.5, 72))
}

pub(super) fn paint(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let dirt = spot.noise(0.3, 5, 0.6, 91);
    let fine = spot.noise(0.006, 2, 0.8, 92);
    let scratch = specks(spot, 0.15, 0.004, 93);
    mix(material.colors[0], srgb(0x30_2c28), 0.25 * scratch) * (1.0 + 0.05 * dirt + 0.05 * fine)
}

/// Carpet tiles, every other one turned.
pub(super) fn carpet(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let size = material.scale_m;
    let (x, z) = (spot.point.x, spot.point.z);
    let (column, row) = ((x / size).floor(), (z / size).floor());
    let own = lattice(column as i64, row as i64, 0, 301);
    let (along, across) = if (column + row).rem_euclid(2.0) < 1.0 { (x, z) } else { (z, x) };
    let drawn = Vector3::new(across, 0.08 * along, 7.0 * own);
    let stripes = fractal_noise(drawn, 0.09, 5, 0.75, spot.footprint, 302);
    let loops = spot.noise(0.012, 3, 0.85, 303);
    let flat = Spot { across: x, down: z, ..*spot };
    let spots = specks(&flat, 0.35, 0.03, 304).max(0.6 * stain(&flat, 1.1, 305));
    let seam = pulse(x, 0.006, size, spot.footprint).max(pulse(z, 0.006, size, spot.footprint));
    let wool = mix(material.colors[0], material.colors[1], (0.5 + 1.1 * stripes).clamp(0.0, 1.0)) * (0.85 + 0.3 * own);
    mix(wool * (1.0 + 0.35 * loops), material.colors[2], (0.5 * spots).max(0.5 * seam))
}

/// Mineral panels in a metal grid, each with its own stains.
pub(super) fn ceiling_panels(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let size = material.scale_m;
    let (x, z) = (spot.point.x, spot.point.z);
    let own = lattice((x / size).floor() as i64, (z / size).floor() as i64, 0, 311);
    let bar = pulse(x, 0.024, size, spot.footprint).max(pulse(z, 0.024, size, spot.footprint));
    let flat = Spot { across: x, down: z, ..*spot };
    let holes = specks(&flat, 0.035, 0.006, 312).max(specks(&flat, 0.06, 0.011, 313));
    let water = stain(&flat, 1.7, 314);
    let panel = material.colors[0] * (0.93 + 0.1 * own) * (1.0 - 0.55 * holes);
    let panel = mix(panel, panel.component_mul(&Vector3::new(0.75, 0.62, 0.42)), 0.5 * water);
    mix(panel * (1.0 + 0.05 * spot.noise(0.2, 4, 0.6, 315)), material.colors[1], bar)
}
