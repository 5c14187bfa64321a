//! Whether a profile that can be read says something that photographs can be in.
//!
//! A profile may be well formed and absurd: damaged on the way, or made by a broken program. One such among the
//! photographs would turn all of them into something that neither people nor matching recognize, were its space chosen
//! for all.

use moxcms::{ColorProfile, Layout, WHITE_POINT_D50, Xyzd};
use trueup_core::color::TransferCurve;

use super::convert::transform;

/// Light at half of the encoded range: from below that of the curve of highlights up to 10,000 cd/m2 (SMPTE ST 2084:
/// 0.0092) to beyond that of linear light (0.5). Cameras and screens are at 0.17 to 0.29.
const MIDDLE_LIGHT: std::ops::RangeInclusive<f64> = 0.004..=0.65;

/// Least factor by which light grows over a tenth of the encoded range, from a tenth on: linear light, the slowest in
/// use, grows by 1.11 over the last. Less is a stretch of levels that all mean the same.
const LEAST_RISE: f64 = 1.03;

/// Grays that are tried.
const GRAYS: u32 = 8;

/// Most that the sum of the primaries may differ from the white of profiles, as CIE XYZ: rounding and coarse adaptation
/// make a tenth of this.
const WHITE_TOLERANCE: f64 = 0.1;

/// Where primaries may lie, as CIE XYZ relative to a white of 1. The widest space in use, ACES 2065-1, goes from -0.08
/// to 0.95.
const PRIMARIES: std::ops::RangeInclusive<f64> = -0.15..=1.1;

/// Least determinant of the primaries; sRGB's is 0.2, and that of the narrowest screens half of it.
const LEAST_DETERMINANT: f64 = 0.02;

/// Most that a neutral color may be colored in sRGB, and by how much a brighter one may be darker, as shares of the
/// full level.
const MOST_CAST: f64 = 0.25;
const MOST_FALL: f64 = 0.02;

/// Levels of sRGB within which black, and from which on white, is one.
const BLACK: f64 = 0.3;
const WHITE: f64 = 0.7;

/// What is wrong with a tone curve that never falls, if anything.
pub(super) fn flaw_of_curve(curve: &TransferCurve) -> Option<&'static str> {
    if !MIDDLE_LIGHT.contains(&curve.linear(0.5)) {
        return Some("its tone curve is too steep or too flat");
    }
    let light = |tenth: u32| curve.linear(f64::from(tenth) / 10.0);
    let stands_still = (1..10).any(|tenth| light(tenth + 1) < LEAST_RISE * light(tenth));
    stands_still.then_some("its tone curve makes one level of many")
}

/// What is wrong with the primaries of a space, if anything.
pub(super) fn flaw_of_primaries([red, green, blue]: [Xyzd; 3]) -> Option<&'static str> {
    let [r, g, b] = [red, green, blue].map(|primary| [primary.x, primary.y, primary.z]);
    let white = WHITE_POINT_D50.to_xyzd();
    let is_white = [white.x, white.y, white.z]
        .into_iter()
        .enumerate()
        .all(|(axis, white)| (r[axis] + g[axis] + b[axis] - white).abs() <= WHITE_TOLERANCE);
    let are_possible = [r, g, b].iter().flatten().all(|value| PRIMARIES.contains(value));
    let determinant =
        r[0] * (g[1] * b[2] - g[2] * b[1]) - g[0] * (r[1] * b[2] - r[2] * b[1]) + b[0] * (r[1] * g[2] - r[2] * g[1]);
    // A comparison that is false for NaN.
    let is_sane = is_white && are_possible && determinant.abs() >= LEAST_DETERMINANT;
    (!is_sane).then_some("its primaries are none that a picture has")
}

/// What is wrong with the way from RGB in `profile` to sRGB, if anything: grays have to stay about gray and in their
/// order.
pub(super) fn flaw_of_conversion(profile: &ColorProfile) -> Option<String> {
    let full = f64::from(u16::MAX);
    let grays: Vec<u16> = (0..=GRAYS).flat_map(|step| [(u32::from(u16::MAX) * step / GRAYS) as u16; 3]).collect();
    let mut converted = vec![0; grays.len()];
    let done = transform(profile, &ColorProfile::new_srgb(), Layout::Rgb)
        .and_then(|transform| transform.transform(&grays, &mut converted).map_err(|error| error.to_string()));
    if let Err(reason) = done {
        return Some(format!("it cannot be followed: {reason}"));
    }
    let levels: Vec<[f64; 3]> =
        converted.as_chunks::<3>().0.iter().map(|gray| gray.map(|level| f64::from(level) / full)).collect();
    let means: Vec<f64> = levels.iter().map(|gray| gray.iter().sum::<f64>() / 3.0).collect();
    let cast = |gray: &[f64; 3]| {
        gray.iter().fold(0.0, |most: f64, &level| most.max(level))
            - gray.iter().fold(1.0, |least: f64, &level| least.min(level))
    };
    if levels.iter().any(|gray| cast(gray) > MOST_CAST) {
        return Some("its grays are colored".to_owned());
    }
    let [black, .., white] = means[..] else { return None };
    let falls = means.windows(2).any(|pair| pair[1] < pair[0] - MOST_FALL);
    (falls || black > BLACK || white < WHITE).then(|| "its grays do not go from black to white".to_owned())
}
