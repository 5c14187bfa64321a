//! Printed and woven ornament: wallpaper, curtains, rugs. No two motifs are alike, as if painted by hand: a motif that
//! repeats exactly looks the same in many places, and no matcher could tell these apart.

use nalgebra::Vector3;

use super::interior::specks;
use super::surface::{Spot, SurfaceMaterial};
use crate::color::{Rgb, by_hue, mix};
use crate::noise::{band, edge, lattice, lerp, pulse, value_noise};

/// Height of a motif's cell as a multiple of its width.
const CELL_ASPECT: f64 = 1.6;

pub(super) fn wallpaper(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let width = material.scale_m;
    let stripe = pulse(spot.across, width, 2.0 * width, spot.footprint);
    let mut color = mix(material.colors[0], material.colors[1], stripe);
    for offset in [0.0, 0.004] {
        let line = pulse(spot.across + 0.01 + 2.0 * offset, 0.002 + offset / 4.0, width, spot.footprint);
        color = mix(color, material.colors[2], 0.6 * line);
    }
    // Petals that have drifted off, between the sprigs.
    let petals = specks(spot, 0.4 * width, 0.075 * width, 23).max(specks(spot, 0.23 * width, 0.035 * width, 24));
    color = mix(color, mix(material.colors[1], material.colors[2], 0.65), 0.85 * petals);
    color = sprig(spot, width, 25).over(color, material.colors[2], 0.95);
    let paper = spot.noise(0.004, 2, 0.7, 21);
    let age = spot.noise(0.9, 4, 0.5, 22);
    color * (1.0 + 0.07 * paper + 0.06 * age)
}

pub(super) fn curtain(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let fold = material.scale_m;
    let sway = 0.25 * fold * value_noise(Vector3::new(spot.across / fold, spot.down * 0.8, 0.0), 81);
    let phase = (spot.across + sway) / fold * std::f64::consts::TAU;
    let shade = 0.72 + 0.2 * phase.sin() + 0.08 * (2.3 * phase).sin();
    let color = sprig(spot, 0.22, 83).over(material.colors[0], material.colors[1], 0.85);
    color * shade * (1.0 + 0.12 * spot.noise(0.006, 3, 0.8, 82))
}

/// What a sprig covers of a spot.
#[derive(Debug, Clone, Copy)]
struct Sprig {
    green: f64,
    blossom: f64,
    eye: f64,
    hue: f64,
}

impl Sprig {
    /// Painted in an ink, with blossoms of another tint each, over a ground.
    fn over(self, ground: Rgb, ink: Rgb, opacity: f64) -> Rgb {
        let petal = mix(ink, by_hue(self.hue, 0.55, 0.75), 0.55);
        let color = mix(ground, ink, opacity * self.green);
        let color = mix(color, petal, opacity * self.blossom);
        mix(color, mix(ground, by_hue(0.12, 0.5, 0.95), 0.5), self.eye)
    }
}

/// One plant, drawn by seed, about a unit wide and 1.6 high about the origin, over a ground.
pub(super) fn plant(at: [f64; 2], soft: f64, seed: u32, ground: Rgb) -> Rgb {
    drawn(at, soft, &|k| lattice(k, 3, 3, seed)).over(ground, by_hue(0.28, 0.45, 0.45), 0.95)
}

/// A sprig in its cell, `width` metres wide.
fn sprig(spot: &Spot, width: f64, salt: u32) -> Sprig {
    let height = CELL_ASPECT * width;
    let column = (spot.across / width).floor();
    let shifted = spot.down + height * lattice(column as i64, 7, 0, salt);
    let row = (shifted / height).floor();
    let at = [spot.across / width - column - 0.5, CELL_ASPECT * (shifted / height - row - 0.5)];
    drawn(at, spot.footprint / width, &|k| lattice(column as i64, row as i64, k, salt))
}

/// A sprig of random numbers: stem, leaves, blossoms. The place is in cell widths from the cell's middle.
fn drawn([x, y]: [f64; 2], soft: f64, chance: &dyn Fn(i64) -> f64) -> Sprig {
    // Upright, unmirrored and of standard size.
    let (sine, cosine) = lerp(-0.3, 0.3, chance(1)).sin_cos();
    let size = lerp(0.85, 1.2, chance(2));
    let mirror = if chance(3) < 0.5 { -1.0 } else { 1.0 };
    let (x, y) = (mirror * (cosine * x + sine * y) / size, (cosine * y - sine * x) / size);
    let stem = |y: f64| lerp(0.03, 0.12, chance(4)) * (lerp(2.5, 5.0, chance(5)) * y + 6.0 * chance(6)).sin();
    let (head, foot) = (lerp(-0.5, -0.3, chance(7)), lerp(0.45, 0.65, chance(8)));
    let mut green = band(x - stem(y), -0.012, 0.012, soft) * band(y, head, foot, soft);
    for k in 0..7 {
        let own = |salt: i64| chance(20 + 8 * k + salt);
        if own(0) < 0.2 {
            continue;
        }
        let at = lerp(foot - 0.08, head + 0.2, (k as f64 + 0.6 * own(1)) / 7.0);
        let side = if (k % 2 == 0) == (own(2) < 0.8) { 1.0 } else { -1.0 };
        let (long, rise) = (lerp(0.08, 0.17, own(3)), lerp(-0.2, 1.1, own(4)));
        let (wide, (up, out)) = (long * lerp(0.35, 0.6, own(5)), rise.sin_cos());
        let (dx, dy) = (x - stem(at) - side * out * long, y - at + up * long);
        let (along, across) = (side * out * dx - up * dy, side * up * dx + out * dy);
        let radius = (along / long).hypot(across / wide);
        green = green.max(1.0 - edge((radius - 1.0) * wide, 0.0, soft));
    }
    let (mut blossom, mut eye) = (0.0_f64, 0.0_f64);
    for k in 0..3 {
        let own = |salt: i64| chance(80 + 8 * k + salt);
        let main = k == 0;
        if !main && own(0) < 0.45 {
            continue;
        }
        let radius = if main { lerp(0.1, 0.17, own(1)) } else { lerp(0.05, 0.09, own(1)) };
        let at = if main { head } else { lerp(head + 0.15, 0.3, own(2)) };
        let aside = if main { 0.0 } else { lerp(-0.3, 0.3, own(3)) };
        let (dx, dy) = (x - stem(at) - aside, y - at);
        let (distance, turn) = (dx.hypot(dy), dy.atan2(dx));
        let petals = 4.0 + (4.0 * own(4)).floor();
        let rim = radius * (0.76 + 0.24 * (petals * turn + 6.0 * own(5)).cos());
        blossom = blossom.max(1.0 - edge(distance, rim, soft));
        eye = eye.max(1.0 - edge(distance, lerp(0.2, 0.4, own(6)) * radius, soft));
    }
    Sprig { green, blossom, eye, hue: chance(9) }
}

pub(super) fn rug(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let (x, y) = (spot.unit[0] * width, spot.unit[1] * height);
    let rim = x.min(width - x).min(y).min(height - y);
    let soft = spot.footprint;
    let (u, v) = ((x - width / 2.0) / 0.24, (y - height / 2.0) / 0.32);
    let cell = ((u + 0.5).floor(), (v + 0.5).floor());
    let chance = |k: i64| lattice(cell.0 as i64, cell.1 as i64, k, spot.seed);
    let (u, v) = (u - cell.0, v - cell.1);
    let diamond = u.abs() + v.abs();
    let outline = band(diamond, lerp(0.3, 0.36, chance(1)), lerp(0.4, 0.45, chance(2)), soft / 0.24);
    let mut color = mix(material.colors[0], material.colors[1], outline);
    // What each weaver put into a diamond, and between four of them.
    let heart = match (chance(3) * 4.0) as u32 {
        0 => 1.0 - edge(diamond, 0.24, soft / 0.24),
        1 => band(u.hypot(v), 0.09, 0.2, soft / 0.24),
        2 => (1.0 - edge(u.abs(), 0.05, soft / 0.24)).max(1.0 - edge(v.abs(), 0.05, soft / 0.24)),
        _ => 1.0 - edge((u.abs() - 0.1).abs().max((v.abs() - 0.1).abs()), 0.06, soft / 0.24),
    };
    let inside = 1.0 - edge(diamond, 0.28, soft / 0.24);
    let wool = mix(material.colors[2], by_hue(chance(4), 0.5, lerp(0.3, 0.8, chance(5))), 0.6);
    color = mix(color, wool, heart * inside);
    let scattered = Spot { across: x, down: y, ..*spot };
    let tufts = specks(&scattered, 0.09, 0.016, spot.seed) * edge(diamond, 0.48, soft / 0.24);
    color = mix(color, material.colors[1], tufts);
    color = mix(color, material.colors[2], 1.0 - edge(rim, 0.18, soft));
    let teeth = pulse(x + y, 0.03, 0.06, soft) * band(rim, 0.07, 0.11, soft);
    let stars = specks(&scattered, 0.05, 0.012, spot.seed ^ 1) * band(rim, 0.03, 0.15, soft);
    color = mix(color, material.colors[1], teeth.max(band(rim, 0.16, 0.175, soft)).max(1.0 - edge(rim, 0.02, soft)));
    color = mix(color, material.colors[0], stars);
    let pile = spot.noise(0.008, 2, 0.8, 62);
    let wear = spot.noise(0.5, 4, 0.6, 63);
    color * (1.0 + 0.3 * pile + 0.15 * wear)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::surface::Pattern;

    /// Gray levels of one cell of wallpaper, `column` and `row` cells away.
    fn cell(column: f64, row: f64) -> Vec<f64> {
        const WIDTH: f64 = 0.25;
        let material = SurfaceMaterial::new(Pattern::Wallpaper, WIDTH, [0xf0_f0f0, 0xf0_f0f0, 0x20_2020]);
        let spot = |k: u32| {
            let (x, y) = (f64::from(k % 24) / 24.0, f64::from(k / 24) / 36.0);
            let (across, down) = (WIDTH * (column + x), WIDTH * CELL_ASPECT * (row + y));
            let point = Vector3::new(across, down, 0.0);
            Spot { point, across, down, unit: [x, y], size: [4.0, 3.0], grain: 0, footprint: 0.005, seed: 5 }
        };
        (0..24 * 36).map(|k| wallpaper(&material, &spot(k)).y).collect()
    }

    #[test]
    fn no_two_cells_of_wallpaper_look_alike() {
        let places = [(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (0.0, 1.0), (2.0, 2.0), (-6.0, -3.0)];
        let cells: Vec<Vec<f64>> = places.iter().map(|&(column, row)| cell(column, row)).collect();
        for (k, first) in cells.iter().enumerate() {
            for second in &cells[k + 1..] {
                let apart = first.iter().zip(second).filter(|(a, b)| (*a - *b).abs() > 0.2).count();
                assert!(apart * 10 > first.len(), "{apart} of {}", first.len());
            }
        }
    }
}
