//! Printed and painted matter: lettering, book spines, posters, pictures.

use nalgebra::Vector3;

use super::ornament;
use super::surface::{Spot, SurfaceMaterial};
use crate::color::{Rgb, by_hue, luminance, mix, srgb};
use crate::noise::{band, edge, fractal_noise, lattice, lerp, pulse};

/// Capital letters on a grid of 3 x 5, rows from the top, the left column in the highest bit of three.
const LETTERS: [u16; 26] = [
    0b010_101_111_101_101,
    0b110_101_110_101_110,
    0b011_100_100_100_011,
    0b110_101_101_101_110,
    0b111_100_110_100_111,
    0b111_100_110_100_100,
    0b011_100_101_101_011,
    0b101_101_111_101_101,
    0b111_010_010_010_111,
    0b001_001_001_101_010,
    0b101_101_110_101_101,
    0b100_100_100_100_111,
    0b101_111_111_101_101,
    0b110_101_101_101_101,
    0b111_101_101_101_111,
    0b110_101_110_100_100,
    0b111_101_101_110_011,
    0b110_101_110_101_101,
    0b011_100_010_001_110,
    0b111_010_010_010_010,
    0b101_101_101_101_111,
    0b101_101_101_101_010,
    0b101_101_111_111_101,
    0b101_101_010_101_101,
    0b101_101_010_010_010,
    0b111_001_010_100_111,
];

/// Words for signs.
const WORDS: [&str; 16] = [
    "BAKERY", "BOOKS", "CAFE", "HOTEL", "FLOWERS", "BANK", "OPTICS", "MUSIC", "TAILOR", "WINE", "THEATRE", "SHOES",
    "PHARMACY", "CLOCKS", "MUSEUM", "BICYCLES",
];

/// What bookbinders like.
const CLOTHS: [u32; 18] = [
    0x7a_2a26, 0x22_3450, 0x2c_4c38, 0x9a_7848, 0xdc_d0b4, 0x2a_2624, 0x5c_4030, 0x8a_8880, 0xb0_4a30, 0xe4_e0d8,
    0x3c_5c78, 0xc8_a050, 0x50_2834, 0x6a_7c5c, 0xc0_b498, 0x1c_2c30, 0xa8_3840, 0xf0_e8d0,
];

/// Coverage of a letter at (x, y) in [0, 1] of its cell of 4 x 6 grid units (one unit of margin right and below).
fn letter(index: usize, x: f64, y: f64) -> f64 {
    let (column, row) = ((x * 4.0).floor(), (y * 6.0).floor());
    if !(0.0..3.0).contains(&column) || !(0.0..5.0).contains(&row) {
        return 0.0;
    }
    let bit = 14 - (row as usize * 3 + column as usize);
    f64::from((LETTERS[index % 26] >> bit) & 1)
}

/// Coverage of lines of random words, `length` metres long, in cells of `height` metres at (x, y) metres.
fn text(x: f64, y: f64, length: f64, height: f64, footprint: f64, seed: u32) -> f64 {
    let width = 0.7 * height;
    let (column, row) = ((x / width).floor(), (y / height).floor());
    if x < 0.0 || (column + 1.0) * width > length {
        return 0.0;
    }
    let chance = |k| lattice(column as i64, row as i64, k, seed);
    if chance(0) < 0.16 {
        return 0.0;
    }
    let drawn = letter((chance(1) * 26.0) as usize, x / width - column, 1.3 * (y / height - row));
    // Too small to read: the gray that print has from afar.
    lerp(drawn, 0.3, (3.0 * footprint / height).min(1.0))
}

/// Coverage of one word, drawn by seed, in the middle of a field of this size at (x, y) from its corner, metres.
fn word([x, y]: [f64; 2], [width, height]: [f64; 2], spot: &Spot) -> f64 {
    let word = WORDS[((spot.chance(1) * WORDS.len() as f64) as usize).min(WORDS.len() - 1)];
    let size = (0.62 * height).min(0.9 * width / (0.66 * word.len() as f64));
    let (left, top) = (0.5 * (width - 0.66 * size * word.len() as f64), 0.5 * (height - 0.83 * size));
    let cell = (x - left) / (0.66 * size);
    word.as_bytes()
        .get(cell.floor().max(0.0) as usize)
        .filter(|_| cell >= 0.0)
        .map_or(0.0, |&byte| letter(usize::from(byte - b'A'), cell.fract(), (y - top) / size))
}

pub(super) fn sign(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let (x, y) = (spot.unit[0] * width, spot.unit[1] * height);
    let rim = x.min(width - x).min(y).min(height - y);
    let border = band(rim, 0.03, 0.045, spot.footprint);
    let base = material.colors[0] * (1.0 + 0.08 * spot.noise(0.2, 5, 0.6, 201));
    mix(base, material.colors[1], word([x, y], spot.size, spot).max(border))
}

pub(super) fn page(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let (x, y) = (spot.unit[0] * width, spot.unit[1] * height);
    let margin = 0.08 * width;
    let measure = width - 2.0 * margin;
    // From the top: a heading, a picture, lines of text.
    let (heading, top, bottom) = (0.24 * height, 0.26 * height, 0.66 * height);
    let inside = band(x, margin, width - margin, spot.footprint);
    let head = word([x - margin, y - 0.5 * margin], [measure, heading], spot);
    let line = 0.03 * height;
    let body = text(x - margin, y - 0.7 * height, measure, line, spot.footprint, spot.seed ^ 2)
        * band(y, 0.7 * height, 0.7 * height + 8.0 * line, 1e-4);
    let paper = material.colors[0] * (1.0 + 0.04 * spot.noise(0.05, 4, 0.6, 211));
    let field =
        Spot { unit: [(x - margin) / measure, (y - top) / (bottom - top)], size: [measure, bottom - top], ..*spot };
    let color = mix(paper, picture(&field), inside * band(y, top, bottom, spot.footprint));
    let ink = mix(material.colors[1], by_hue(spot.chance(4), 0.8, 0.5), 0.5);
    mix(color, ink, head.max(body) * inside)
}

/// A board somebody wrote and drew on.
pub(super) fn writing(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let (x, y) = (spot.unit[0] * width, spot.unit[1] * height);
    let soft = spot.footprint;
    let line = material.scale_m;
    let mut color = material.colors[0] * (1.0 + 0.06 * spot.noise(0.3, 5, 0.6, 321));
    let left = text(x - 0.08 * width, y - 0.12 * height, 0.45 * width, line, soft, spot.seed)
        * band(y, 0.12 * height, 0.8 * height, 1e-4);
    color = mix(color, material.colors[1], left);
    // Boxes and circles on the right, joined by nothing.
    for k in 0..6 {
        let chance = |salt| lattice(k, 50, salt, spot.seed);
        let (at_x, at_y) = (width * lerp(0.6, 0.92, chance(0)), height * lerp(0.15, 0.85, chance(1)));
        let radius = height * lerp(0.05, 0.14, chance(2));
        let (dx, dy) = ((x - at_x).abs(), (y - at_y).abs());
        let distance = if chance(3) < 0.5 { dx.hypot(dy) } else { dx.max(1.6 * dy) };
        let stroke = band(distance, radius - 0.006, radius + 0.006, soft);
        color = mix(color, material.colors[if chance(4) < 0.5 { 1 } else { 2 }], 0.9 * stroke);
    }
    color
}

pub(super) fn spine(material: &SurfaceMaterial, spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let (x, y) = (spot.unit[0] * width, spot.unit[1] * height);
    let chance = |k| spot.chance(k);
    let cloth =
        srgb(CLOTHS[((chance(1) * CLOTHS.len() as f64) as usize).min(CLOTHS.len() - 1)]) * lerp(0.7, 1.3, chance(2));
    let ink = if luminance(cloth) > 0.25 { srgb(0x24_2220) } else { srgb(0xe8_d9a0) };
    let soft = spot.footprint;
    let lines =
        [0.08, 0.11, 0.86, 0.9].iter().map(|&at| band(y, at * height, at * height + 0.004, soft)).fold(0.0, f64::max);
    let label =
        band(y, 0.16 * height, lerp(0.3, 0.45, chance(4)) * height, soft) * f64::from(u8::from(chance(5) < 0.5));
    let label_color = by_hue(chance(6), 0.6, lerp(0.2, 0.8, chance(7)));
    // Lettering runs down the spine.
    let size = (0.55 * width).min(0.03);
    let inside = band(y, 0.2 * height, 0.8 * height, 1e-4) * band(x, 0.5 * (width - size), 0.5 * (width + size), 1e-4);
    let title = text(y, width - x - 0.5 * (width - size), 0.8 * height, size, soft, spot.seed) * inside;
    let rounding = 1.0 - 0.45 * (2.0 * spot.unit[0] - 1.0).powi(4);
    let mut color = mix(cloth, label_color, label);
    color = mix(color, ink, lines.max(0.9 * title));
    color.component_mul(&material.colors[0]) * rounding * (1.0 + 0.14 * spot.noise(0.01, 3, 0.8, 221))
}

pub(super) fn picture(spot: &Spot) -> Rgb {
    let painted = match (spot.chance(11) * 5.0) as u32 {
        0 => blocks(spot),
        1 => discs(spot),
        2 => houses(spot),
        3 => herbarium(spot),
        _ => landscape(spot),
    };
    painted * (1.0 + 0.1 * spot.noise(0.01, 3, 0.8, 231))
}

/// Hills behind hills under an evening sky.
fn landscape(spot: &Spot) -> Rgb {
    let aspect = spot.size[0] / spot.size[1].max(1e-3);
    let [x, y] = [spot.unit[0] * aspect, spot.unit[1]];
    let (soft, seed) = (spot.footprint / spot.size[1].max(1e-3), spot.seed);
    let noise = |scale: f64, octaves, salt: u32, squash: f64| {
        fractal_noise(Vector3::new(x, y * squash, 0.0), scale, octaves, 0.55, soft, seed ^ salt)
    };
    let hue = spot.chance(2);
    let mut color = mix(by_hue(0.58, 0.5, 0.8), by_hue(0.08 + 0.1 * hue, 0.45, 1.0), (1.6 * y).min(1.0));
    color = mix(color, srgb(0xff_f4e0), (0.9 * noise(0.5, 5, 1, 2.5)).clamp(0.0, 0.8));
    let (sun_x, sun_y) = (aspect * lerp(0.15, 0.85, spot.chance(3)), lerp(0.15, 0.35, spot.chance(4)));
    color = mix(color, srgb(0xff_f0b0), 1.0 - edge((x - sun_x).hypot(y - sun_y), 0.06, soft));
    for layer in 0..5_u32 {
        let depth = f64::from(layer) / 4.0;
        let ridge =
            |salt| fractal_noise(Vector3::new(x, 7.0 * depth, 0.0), 0.9 - 0.5 * depth, 6, 0.5, soft, seed ^ salt);
        let height = 0.42 + 0.13 * f64::from(layer) - 0.12 * ridge(10 + layer);
        let tint = by_hue(lerp(0.6, 0.25 + 0.15 * hue, depth), lerp(0.25, 0.65, depth), lerp(0.75, 0.35, depth));
        let relief = 1.0 + 0.6 * noise(0.12, 5, 20 + layer, 1.0 + 2.0 * depth);
        color = mix(color, tint * relief, edge(y, height, soft));
    }
    color
}

/// Colored fields between black bars: a rectangle split again and again.
fn blocks(spot: &Spot) -> Rgb {
    let (mut low, mut high) = ([0.0, 0.0], [spot.size[0], spot.size[1]]);
    let at = [spot.unit[0] * spot.size[0], spot.unit[1] * spot.size[1]];
    let (mut path, mut bar) = (1_i64, 0.0_f64);
    for level in 0..6 {
        let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
        let cut = lerp(low[axis], high[axis], lerp(0.3, 0.7, lattice(path, level, 0, spot.seed)));
        bar = bar.max(band(at[axis], cut - 0.006, cut + 0.006, spot.footprint));
        let right = at[axis] > cut;
        if right {
            low[axis] = cut
        } else {
            high[axis] = cut
        }
        path = 2 * path + i64::from(right);
    }
    let chance = |k| lattice(path, 9, k, spot.seed);
    let pale = srgb(0xee_e8da);
    let field =
        if chance(0) < 0.35 { pale } else { by_hue(chance(1), lerp(0.4, 0.9, chance(2)), lerp(0.4, 0.95, chance(3))) };
    mix(field * (1.0 + 0.12 * spot.noise(0.06, 4, 0.6, 241)), srgb(0x1c_1a1a), bar)
}

/// Gabled houses in a row, with windows, in front of others.
fn houses(spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let soft = spot.footprint / height.max(1e-3);
    let (x, y) = (spot.unit[0] * width / height.max(1e-3), spot.unit[1]);
    let cloud = fractal_noise(Vector3::new(x, 2.0 * y, 0.0), 0.3, 4, 0.6, soft, spot.seed);
    let mut color = mix(by_hue(0.55, 0.35, 0.95), srgb(0xff_f6e8), (0.5 * y + 0.6 * cloud).clamp(0.0, 1.0));
    for row in 0..3_i64 {
        let size = 0.13 + 0.035 * row as f64;
        let place = x / size + 0.37 * row as f64;
        let column = place.floor();
        let chance = |k: i64| lattice(column as i64, row, k, spot.seed ^ 7);
        let across = place - column - 0.5;
        let eaves = 0.36 + 0.17 * row as f64 - 0.16 * chance(0);
        let gable = eaves - lerp(0.3, 0.9, chance(1)) * size * (0.5 - across.abs()).max(0.0);
        let plaster = by_hue(lerp(0.02, 0.16, chance(2)), lerp(0.2, 0.6, chance(3)), lerp(0.6, 1.0, chance(4)));
        let (column_at, row_at) = (3.0 * (across + 0.5), (y - eaves) / (0.5 * size));
        let pane = band(column_at.fract(), 0.28, 0.72, 3.0 * soft / size)
            * band(row_at.rem_euclid(1.0), 0.3, 0.75, 2.0 * soft / size)
            * edge(y, eaves, soft);
        let lit = lattice((3.0 * place).floor() as i64, row_at.floor() as i64, row, spot.seed ^ 8);
        let glass = if lit < 0.3 { srgb(0xff_e090) } else { by_hue(0.6, 0.4, 0.35) };
        let roof = by_hue(lerp(0.0, 0.07, chance(5)), 0.6, lerp(0.35, 0.65, chance(6)));
        let wall = mix(mix(roof, plaster, edge(y, eaves, soft)), glass, pane);
        let seam = 1.0 - 0.5 * edge(across.abs(), 0.48, soft / size);
        color = mix(color, wall * seam, edge(y, gable, soft));
    }
    let quay = srgb(0x8a_7c6c) * (1.0 + 0.3 * spot.noise(0.04, 3, 0.7, 261));
    mix(color, quay, edge(y, 0.93, soft))
}

/// A pressed plant on laid paper.
fn herbarium(spot: &Spot) -> Rgb {
    let [width, height] = spot.size;
    let side = width.min(height / 1.6);
    let ground = mix(srgb(0xf0_e8d0), srgb(0xdc_dccc), spot.chance(2)) * (1.0 + 0.1 * spot.noise(0.1, 4, 0.6, 271));
    ornament::plant(
        [(spot.unit[0] - 0.5) * width / side, (spot.unit[1] - 0.5) * height / side],
        spot.footprint / side,
        spot.seed,
        ground,
    )
}

/// Overlapping rings on a pale ground.
fn discs(spot: &Spot) -> Rgb {
    let [x, y] = [spot.unit[0] * spot.size[0], spot.unit[1] * spot.size[1]];
    let mut color = mix(srgb(0xf0_e6d2), srgb(0xc8_d4d8), spot.chance(2));
    for k in 0..14 {
        let chance = |salt| lattice(k, 40, salt, spot.seed);
        let radius = spot.size[1] * lerp(0.05, 0.28, chance(0) * chance(0));
        let distance = (x - chance(1) * spot.size[0]).hypot(y - chance(2) * spot.size[1]);
        let tint = by_hue(chance(3), 0.7, lerp(0.35, 0.95, chance(4)));
        let disc = 1.0 - edge(distance, radius, spot.footprint);
        let rings = pulse(distance, 0.12 * radius, 0.3 * radius, spot.footprint);
        color = mix(color, tint * (1.0 - 0.5 * rings), 0.85 * disc);
    }
    color * (1.0 + 0.1 * spot.noise(0.08, 5, 0.6, 251))
}
