//! Procedural texture: value noise and periodic patterns, band-limited to what a pixel can show.

use nalgebra::Vector3;

// Three odd multipliers spread neighboring lattice points.
const SPREAD: [u32; 3] = [0x8da6_b343, 0xd816_3841, 0xcb1a_b31f];
const SEED_SPREAD: u32 = 0x9e37_79b1;

/// A random number in [0, 1) for a lattice point.
pub(crate) fn lattice(x: i64, y: i64, z: i64, seed: u32) -> f64 {
    let spread = (x as u32).wrapping_mul(SPREAD[0])
        ^ (y as u32).wrapping_mul(SPREAD[1])
        ^ (z as u32).wrapping_mul(SPREAD[2])
        ^ seed.wrapping_mul(SEED_SPREAD);
    mixed(spread)
}

/// Two xor-shift rounds mix a word; the result as a number in [0, 1).
fn mixed(mut hash: u32) -> f64 {
    hash = (hash ^ (hash >> 15)).wrapping_mul(0x2c1b_3c6d);
    hash = (hash ^ (hash >> 12)).wrapping_mul(0x297a_2d39);
    hash ^= hash >> 15;
    f64::from(hash) * (1.0 / 4_294_967_296.0)
}

fn fade(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// Linear interpolation from `a` to `b`.
pub(crate) fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// The largest integer not above a number of moderate size: `f64::floor` is a call on processors assumed by default.
pub(crate) fn floor(x: f64) -> f64 {
    let whole = x as i64 as f64;
    if whole > x { whole - 1.0 } else { whole }
}

/// Smooth noise in [-1, 1] with features about one unit wide.
pub(crate) fn value_noise(point: Vector3<f64>, seed: u32) -> f64 {
    let cell = point.map(floor);
    let [u, v, w] = [0, 1, 2].map(|axis| fade(point[axis] - cell[axis]));
    // The words of `lattice` for both corners along each axis.
    let [x, y, z]: [[u32; 2]; 3] = [0, 1, 2].map(|axis| {
        let low = (cell[axis] as i64 as u32).wrapping_mul(SPREAD[axis]);
        [low, low.wrapping_add(SPREAD[axis])]
    });
    let seed = seed.wrapping_mul(SEED_SPREAD);
    let edge = |word: u32| lerp(mixed(x[0] ^ word), mixed(x[1] ^ word), u);
    let face = |word: u32| lerp(edge(y[0] ^ word), edge(y[1] ^ word), v);
    2.0 * lerp(face(z[0] ^ seed), face(z[1] ^ seed), w) - 1.0
}

/// Sum of octaves of [`value_noise`], each half as wide and `gain` times as strong as the one before, in about
/// [-1, 1]. Octaves finer than twice `footprint` (the width of a pixel on the surface) are left out, so that the
/// texture does not alias.
pub(crate) fn fractal_noise(
    point: Vector3<f64>,
    wavelength: f64,
    octaves: u32,
    gain: f64,
    footprint: f64,
    seed: u32,
) -> f64 {
    let (mut sum, mut total, mut strength, mut width) = (0.0, 0.0, 1.0, wavelength);
    for octave in 0..octaves {
        total += strength;
        let visible = (width / (2.0 * footprint) - 1.0).clamp(0.0, 1.0);
        if visible > 0.0 {
            sum += strength * visible * value_noise(point / width, seed.wrapping_add(octave.wrapping_mul(0x51ed_270b)));
        }
        strength *= gain;
        width *= 0.5;
    }
    sum / total
}

/// How much of a pixel of width `footprint` at `x` lies within `[0, width)` of a pattern repeating every `period`:
/// exact box filtering, in [0, 1].
pub(crate) fn pulse(x: f64, width: f64, period: f64, footprint: f64) -> f64 {
    let integral = |x: f64| {
        let cell = floor(x / period);
        cell * width + (x - cell * period).min(width)
    };
    let half = 0.5 * footprint.max(1e-6);
    (integral(x + half) - integral(x - half)) / (2.0 * half)
}

/// 0 below `edge`, 1 above, with a ramp of `footprint` between.
pub(crate) fn edge(x: f64, edge: f64, footprint: f64) -> f64 {
    ((x - edge) / footprint.max(1e-6) + 0.5).clamp(0.0, 1.0)
}

/// 1 where `low <= x < high`, with ramps of `footprint`.
pub(crate) fn band(x: f64, low: f64, high: f64, footprint: f64) -> f64 {
    edge(x, low, footprint) * (1.0 - edge(x, high, footprint))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_pixel_sees_the_mean_of_a_pulse_train() {
        assert!((pulse(0.37, 0.25, 1.0, 10.0) - 0.25).abs() < 1e-9);
        assert!((pulse(0.1, 0.25, 1.0, 0.01) - 1.0).abs() < 1e-9);
        assert!(pulse(-0.1, 0.25, 1.0, 0.01).abs() < 1e-9);
    }

    #[test]
    fn noise_is_continuous_bounded_and_repeatable() {
        for k in 0..500 {
            let point = Vector3::new(f64::from(k) * 0.37 - 50.0, f64::from(k) * -0.11, 3.3);
            let here = value_noise(point, 7);
            assert!(here.abs() <= 1.0);
            assert!((value_noise(point + Vector3::repeat(1e-6), 7) - here).abs() < 1e-4);
        }
    }

    #[test]
    fn noise_at_a_lattice_point_is_the_points_number() {
        for [x, y, z] in [[0, 0, 0], [3, -7, 12], [-1, -1, 100_000]] {
            let point = Vector3::new(x as f64, y as f64, z as f64);
            assert!((value_noise(point, 9) - (2.0 * lattice(x, y, z, 9) - 1.0)).abs() < 1e-12);
        }
        assert_eq!([floor(-0.5), floor(-2.0), floor(1.7), floor(0.0)], [-1.0, -2.0, 1.0, 0.0]);
    }

    #[test]
    fn octaves_below_the_pixel_vanish() {
        assert!(fractal_noise(Vector3::new(0.3, 0.2, 0.9), 0.01, 4, 0.5, 1.0, 5).abs() < 1e-12);
    }
}
