//! Profiles of color spaces that files name in numbers.

use moxcms::{
    Chromaticity, CicpColorPrimaries, CicpProfile, ColorPrimaries, ColorProfile, MatrixCoefficients, ToneReprCurve,
    TransferCharacteristics, XyY,
};

use super::icc::{RgbSpace, Understood, compact, description, understand};

/// Code points of what screens show as sRGB: its primaries, unspecified ones, and its curve (ITU-T H.273, tables 2 and
/// 3).
const PRIMARIES_OF_SRGB: u16 = 1;
const UNSPECIFIED: u16 = 2;
const CURVE_OF_SRGB: u16 = 13;

/// Code points of the curves of video cameras, by which no photograph is shown: sRGB's is meant (Rec. BT.709, 601, 2020
/// at both depths, and unspecified).
const CURVES_OF_VIDEO: [u16; 5] = [1, UNSPECIFIED, 6, 14, 15];

/// Most that chromaticities may differ from sRGB's and be the same: half of their last decimal.
const SAME_CHROMATICITY: f32 = 5e-4;

/// The chromaticities x, y of primaries and white that floating point samples are in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chromaticities {
    pub(crate) red: [f32; 2],
    pub(crate) green: [f32; 2],
    pub(crate) blue: [f32; 2],
    pub(crate) white: [f32; 2],
}

impl Chromaticities {
    /// Of sRGB (IEC 61966-2-1, table 1).
    pub(crate) const SRGB: Self =
        Self { red: [0.64, 0.33], green: [0.30, 0.60], blue: [0.15, 0.06], white: [0.3127, 0.3290] };

    fn values(self) -> [f32; 8] {
        let Self { red, green, blue, white } = self;
        [red[0], red[1], green[0], green[1], blue[0], blue[1], white[0], white[1]]
    }

    fn is_srgb(self) -> bool {
        self.values().iter().zip(Self::SRGB.values()).all(|(own, srgb)| (own - srgb).abs() <= SAME_CHROMATICITY)
    }
}

/// What code points say of colors.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum NamedSpace {
    Srgb,
    /// A space of this profile.
    Other(Vec<u8>),
    /// None that is known.
    Unknown,
}

/// What code points of ITU-T H.273 say where they are all that is said, or more than other things that are.
pub(crate) fn space_of_code_points(primaries: u16, transfer: u16) -> NamedSpace {
    match profile_of_code_points(primaries, transfer) {
        Some(icc) => NamedSpace::Other(icc),
        None if names_primaries(primaries) && is_srgb(primaries, transfer) => NamedSpace::Srgb,
        None => NamedSpace::Unknown,
    }
}

/// Whether a code point of primaries says anything.
pub(crate) fn names_primaries(primaries: u16) -> bool {
    primaries != UNSPECIFIED
}

/// The profile of the color space that code points name; `None` for sRGB, and for what names none.
///
/// # Source
/// ITU-T H.273, tables 2 (primaries) and 3 (transfer characteristics).
pub(crate) fn profile_of_code_points(primaries: u16, transfer: u16) -> Option<Vec<u8>> {
    let [primaries, transfer] = meant(primaries, transfer);
    if is_srgb(primaries, transfer) {
        return None;
    }
    let cicp = CicpProfile {
        color_primaries: CicpColorPrimaries::try_from(u8::try_from(primaries).ok()?).ok()?,
        transfer_characteristics: TransferCharacteristics::try_from(u8::try_from(transfer).ok()?).ok()?,
        matrix_coefficients: MatrixCoefficients::Identity,
        full_range: true,
    };
    ToneReprCurve::try_from(cicp.transfer_characteristics).ok()?;
    let mut profile = ColorProfile::new_srgb();
    profile.cicp = None;
    // What this returns is false whatever it does (moxcms 0.8); the numbers are there when it has taken the primaries.
    profile.update_rgb_colorimetry_from_cicp(cicp);
    profile.cicp.as_ref()?;
    let name = format!("primaries {primaries}, transfer {transfer} of H.273");
    Some(compact(profile, &name).to_vec())
}

/// The code points of the space in which screens show what is said to be in these.
fn meant(primaries: u16, transfer: u16) -> [u16; 2] {
    let primaries = if primaries == UNSPECIFIED { PRIMARIES_OF_SRGB } else { primaries };
    [primaries, if CURVES_OF_VIDEO.contains(&transfer) { CURVE_OF_SRGB } else { transfer }]
}

fn is_srgb(primaries: u16, transfer: u16) -> bool {
    meant(primaries, transfer) == [PRIMARIES_OF_SRGB, CURVE_OF_SRGB]
}

/// The profile of samples with sRGB's curve and these primaries; `None` if they are sRGB's.
pub(crate) fn profile_of_chromaticities(chromaticities: Chromaticities) -> Option<Vec<u8>> {
    if chromaticities.is_srgb() {
        return None;
    }
    let Chromaticities { red, green, blue, white } = chromaticities;
    let place = |[x, y]: [f32; 2]| Chromaticity { x, y };
    let primaries = ColorPrimaries { red: place(red), green: place(green), blue: place(blue) };
    let [x, y] = white.map(f64::from);
    let mut profile = ColorProfile::new_srgb();
    profile.update_rgb_colorimetry(XyY { x, y, yb: 1.0 }, primaries);
    Some(compact(profile, "the primaries of the photograph").to_vec())
}

/// The profile of samples with sRGB's curve and the primaries of another profile: of light, which no curve of that
/// profile is applied to any more. `None` where the primaries are sRGB's, and where there are none, as in profiles of
/// gray or of tables alone. What cannot be used stays as it is, to be told of.
pub(crate) fn profile_of_light(icc: Vec<u8>) -> Option<Vec<u8>> {
    let own = match understand(&icc) {
        Understood::Space(space) => space.profile,
        Understood::Tables(profile) => profile,
        Understood::Gray(_) => return None,
        Understood::Foreign(_) | Understood::Damaged(_) => return Some(icc),
    };
    let mut profile = ColorProfile::new_srgb();
    profile.red_colorant = own.red_colorant;
    profile.green_colorant = own.green_colorant;
    profile.blue_colorant = own.blue_colorant;
    let icc = compact(profile, &format!("the primaries of {}", description(&own)));
    let is_needed = matches!(understand(&icc), Understood::Space(space) if !space.is_same(&RgbSpace::srgb()));
    is_needed.then(|| icc.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(icc: Option<Vec<u8>>) -> Option<String> {
        match understand(&icc?) {
            Understood::Space(space) => Some(description(&space.profile)),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_screens_show_as_srgb_needs_no_profile() {
        for (primaries, transfer) in [(1, 13), (2, 2), (1, 1), (1, 6), (2, 13), (200, 13), (1, 255), (1000, 1000)] {
            assert_eq!(profile_of_code_points(primaries, transfer), None, "{primaries} {transfer}");
        }
        assert_eq!(profile_of_chromaticities(Chromaticities::SRGB), None);
    }

    #[test]
    fn other_spaces_have_one_that_is_understood() {
        assert_eq!(name(profile_of_code_points(12, 13)).as_deref(), Some("primaries 12, transfer 13 of H.273"));
        assert!(name(profile_of_code_points(9, 16)).is_some(), "highlights up to 10,000 cd/m2");
        // Display P3 (SMPTE RP 431-2 with D65) is code point 12.
        let p3 = Chromaticities { red: [0.68, 0.32], green: [0.265, 0.69], blue: [0.15, 0.06], white: [0.3127, 0.329] };
        let [Some(by_places), Some(by_code)] = [profile_of_chromaticities(p3), profile_of_code_points(12, 13)] else {
            panic!("profiles")
        };
        let [Understood::Space(by_places), Understood::Space(by_code)] = [understand(&by_places), understand(&by_code)]
        else {
            panic!("spaces")
        };
        assert!(by_places.is_same(&by_code));
        // ACEScg (Academy S-2014-004).
        let aces = Chromaticities {
            red: [0.713, 0.293],
            green: [0.165, 0.83],
            blue: [0.128, 0.044],
            white: [0.32168, 0.33767],
        };
        assert!(name(profile_of_chromaticities(aces)).is_some());
    }

    #[test]
    fn light_keeps_the_primaries_of_its_profile_and_not_its_curve() {
        let with_curve = |mut profile: ColorProfile, gamma: u16| {
            let curve = Some(ToneReprCurve::Lut(vec![gamma]));
            (profile.red_trc, profile.green_trc, profile.blue_trc) = (curve.clone(), curve.clone(), curve);
            profile.encode().expect("a profile")
        };
        // 256 stands for a gamma of 1.
        assert_eq!(profile_of_light(with_curve(ColorProfile::new_srgb(), 256)), None);
        let of_p3 = profile_of_light(with_curve(ColorProfile::new_display_p3(), 256));
        let expected = ColorProfile::new_display_p3().encode().expect("a profile");
        let [Understood::Space(found), Understood::Space(expected)] =
            [understand(&of_p3.unwrap_or_default()), understand(&expected)]
        else {
            panic!("spaces")
        };
        assert!(found.is_same(&expected));
        let gray = ColorProfile::new_gray_with_gamma(1.8).encode().expect("a profile");
        assert_eq!(profile_of_light(gray), None);
        assert_eq!(profile_of_light(b"none".to_vec()), Some(b"none".to_vec()), "to be told of");
    }

    /// Names of any length: readers refuse a profile whose length is none.
    #[test]
    fn profiles_are_as_long_as_they_say() {
        for (primaries, transfer) in [(12, 13), (9, 13), (9, 16), (12, 8), (11, 17)] {
            let Some(icc) = profile_of_code_points(primaries, transfer) else { continue };
            assert_eq!(icc[..4], (icc.len() as u32).to_be_bytes(), "{primaries} {transfer}");
            assert_eq!(icc.len() % 4, 0, "{primaries} {transfer}");
        }
        assert!(profile_of_code_points(12, 13).is_some() && profile_of_code_points(9, 13).is_some());
    }

    #[test]
    fn absurd_places_are_not_believed() {
        let flat = Chromaticities { red: [0.3, 0.3], green: [0.3, 0.3], blue: [0.3, 0.3], white: [0.3, 0.3] };
        let none = Chromaticities { red: [0.0; 2], green: [f32::NAN; 2], blue: [0.0; 2], white: [0.0; 2] };
        for absurd in [flat, none] {
            let icc = profile_of_chromaticities(absurd).unwrap_or_default();
            assert!(matches!(understand(&icc), Understood::Damaged(_)), "{absurd:?}");
        }
    }
}
