//! Linear light and its sRGB encoding.

use nalgebra::Vector3;

/// Linear-light red, green, blue; 1 is a perfect white under unit illumination.
pub(crate) type Rgb = Vector3<f64>;

/// A color as designers write it, `0xRRGGBB` in sRGB, in linear light.
pub(crate) fn srgb(hex: u32) -> Rgb {
    let channel = |shift: u32| {
        let encoded = f64::from((hex >> shift) & 0xff) / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    };
    Rgb::new(channel(16), channel(8), channel(0))
}

/// The sRGB encoding of a linear value in [0, 1] (IEC 61966-2-1).
pub(crate) fn encode(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// From `a` (t = 0) to `b` (t = 1).
pub(crate) fn mix(a: Rgb, b: Rgb, t: f64) -> Rgb {
    a + (b - a) * t
}

/// Perceived brightness of a linear color (Rec. 709 weights).
pub(crate) fn luminance(color: Rgb) -> f64 {
    0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z
}

/// A saturated or muted color by hue (turns), chroma and lightness in [0, 1], all three cyclic or clamped; enough for
/// book spines and posters.
pub(crate) fn by_hue(hue: f64, chroma: f64, lightness: f64) -> Rgb {
    let channel = |offset: f64| {
        let wave = (((hue + offset).rem_euclid(1.0) * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        lightness * (1.0 - chroma + chroma * wave)
    };
    Rgb::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)).map(|encoded| encoded * encoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_inverts_decoding() {
        for value in [0_u32, 5, 100, 200, 255] {
            assert!((encode(srgb(value << 16).x) * 255.0 - f64::from(value)).abs() < 1e-6);
        }
    }

    #[test]
    fn hues_are_where_painters_put_them() {
        let red = by_hue(0.0, 1.0, 1.0);
        assert!(red.x > 0.9 && red.y < 0.1 && red.z < 0.1);
        let green = by_hue(1.0 / 3.0, 1.0, 1.0);
        assert!(green.y > 0.9 && green.x < 0.1);
    }
}
