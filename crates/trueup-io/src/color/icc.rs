//! ICC profiles: reading what they say, and making the two that files name without holding them.

use std::sync::{Arc, LazyLock};

use moxcms::{ColorProfile, DataColorSpace, ProfileText, ToneReprCurve, WHITE_POINT_D50, Xyzd};
use trueup_core::color::TransferCurve;

use super::sanity::{flaw_of_conversion, flaw_of_curve, flaw_of_primaries};

/// Most that two spaces' primaries may differ, as CIE XYZ relative to a white of 1, and be the same for pictures: half
/// an 8-bit level of light. Profiles of one space by different makers differ by a quarter of this.
const SAME_PRIMARIES: f64 = 2e-3;

/// A color space given by primaries and one transfer curve: what a panorama can be composed in.
#[derive(Debug, Clone)]
pub(crate) struct RgbSpace {
    /// The profile as it was embedded; `None` for sRGB that nothing says but custom.
    pub(crate) icc: Option<Arc<[u8]>>,
    pub(crate) profile: Arc<ColorProfile>,
    pub(crate) curve: TransferCurve,
}

impl RgbSpace {
    /// sRGB, which pictures without a profile are in.
    pub(crate) fn srgb() -> Self {
        Self { icc: None, profile: SRGB.0.clone(), curve: TransferCurve::SRGB }
    }

    /// Adobe RGB (1998), which cameras name in EXIF without embedding a profile.
    pub(crate) fn adobe_rgb() -> Self {
        static ADOBE_RGB: LazyLock<(Arc<ColorProfile>, Arc<[u8]>)> = LazyLock::new(|| {
            let bytes = compact(ColorProfile::new_adobe_rgb(), "Adobe RGB (1998) compatible");
            (Arc::new(ColorProfile::new_adobe_rgb()), bytes)
        });
        // 2.19921875 = 563 / 256, as the standard has it.
        let curve = TransferCurve::gamma(563.0 / 256.0).unwrap_or_default();
        Self { icc: Some(ADOBE_RGB.1.clone()), profile: ADOBE_RGB.0.clone(), curve }
    }

    /// Whether samples mean the same colors in both.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= SAME_PRIMARIES;
        let primaries = primaries(&self.profile).into_iter().zip(primaries(&other.profile));
        self.curve.is_same(&other.curve)
            && primaries.into_iter().all(|(a, b)| close(a.x, b.x) && close(a.y, b.y) && close(a.z, b.z))
    }

    /// Size of the gamut: area of the primaries' triangle in the CIE 1976 u'v' diagram, where equal areas look about
    /// equally large.
    pub(crate) fn gamut_area(&self) -> f64 {
        let [r, g, b] = primaries(&self.profile).map(|primary| {
            let sum = primary.x + 15.0 * primary.y + 3.0 * primary.z;
            [4.0 * primary.x / sum, 9.0 * primary.y / sum]
        });
        let area = 0.5 * ((g[0] - r[0]) * (b[1] - r[1]) - (b[0] - r[0]) * (g[1] - r[1])).abs();
        if area.is_finite() { area } else { 0.0 }
    }

    /// The name the profile gives itself.
    pub(crate) fn name(&self) -> String {
        if self.icc.is_none() { "sRGB".to_owned() } else { description(&self.profile) }
    }
}

/// What an embedded profile turned out to be.
#[derive(Debug, Clone)]
pub(crate) enum Understood {
    /// A space a panorama can be composed in.
    Space(RgbSpace),
    /// RGB given by tables or by three different curves: to be converted.
    Tables(Arc<ColorProfile>),
    /// Gray by a curve.
    Gray(TransferCurve),
    /// Of something else than the RGB or gray samples that photographs are decoded to: its name.
    Foreign(&'static str),
    /// Not a profile, or one whose numbers cannot be: why.
    Damaged(String),
}

/// Reads an embedded profile.
pub(crate) fn understand(icc: &[u8]) -> Understood {
    let profile = match ColorProfile::new_from_slice(icc) {
        Ok(profile) => profile,
        Err(error) => return Understood::Damaged(error.to_string()),
    };
    match profile.color_space {
        DataColorSpace::Rgb => {}
        DataColorSpace::Gray => {
            let curve = profile.gray_trc.as_ref().and_then(curve_of);
            let damaged = |reason: &str| Understood::Damaged(reason.to_owned());
            return curve.map_or_else(
                || damaged("its tone curve is missing or falls"),
                |curve| flaw_of_curve(&curve).map_or_else(|| Understood::Gray(curve.simplified()), damaged),
            );
        }
        DataColorSpace::Cmyk => return Understood::Foreign("CMYK"),
        DataColorSpace::Lab => return Understood::Foreign("Lab"),
        _ => return Understood::Foreign("an unusual color space"),
    }
    understand_rgb(profile, icc).unwrap_or_else(Understood::Damaged)
}

/// The same of a profile for RGB samples; why it cannot be used, if it cannot.
fn understand_rgb(profile: ColorProfile, icc: &[u8]) -> Result<Understood, String> {
    let has_tables = profile.lut_a_to_b_perceptual.is_some() || profile.lut_a_to_b_colorimetric.is_some();
    if !has_tables {
        if !profile.is_matrix_shaper() {
            return Err("its primaries or tone curves are missing".to_owned());
        }
        flaw_of_primaries(primaries(&profile)).map_or(Ok(()), |flaw| Err(flaw.to_owned()))?;
    }
    if let Some(flaw) = flaw_of_conversion(&profile) {
        return Err(flaw);
    }
    if has_tables {
        return Ok(Understood::Tables(Arc::new(profile)));
    }
    let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc].map(|trc| trc.as_ref().and_then(curve_of));
    let [Some(red), Some(green), Some(blue)] = curves else {
        return Err("a tone curve falls or does not reach white".to_owned());
    };
    [&red, &green, &blue].into_iter().find_map(flaw_of_curve).map_or(Ok(()), |flaw| Err(flaw.to_owned()))?;
    if !(red.is_same(&green) && red.is_same(&blue)) {
        return Ok(Understood::Tables(Arc::new(profile)));
    }
    Ok(Understood::Space(RgbSpace { icc: Some(icc.into()), profile: Arc::new(profile), curve: red.simplified() }))
}

/// Whether samples in the space of this profile mean sRGB colors.
pub(crate) fn is_srgb(icc: &[u8]) -> bool {
    matches!(understand(icc), Understood::Space(space) if space.is_same(&RgbSpace::srgb()))
}

/// A small sRGB profile, to be embedded where a format has no shorter way to say sRGB.
pub fn srgb_profile() -> &'static [u8] {
    &SRGB.1
}

static SRGB: LazyLock<(Arc<ColorProfile>, Arc<[u8]>)> = LazyLock::new(|| {
    (Arc::new(ColorProfile::new_srgb()), compact(ColorProfile::new_srgb(), "sRGB IEC61966-2.1 compatible"))
});

/// Place of the twelve bytes of the date in a profile's header (ICC.1:2022, section 7.2), and the date written there:
/// without one of its own, a profile would change with every run. 1 January 2000.
const DATE: std::ops::Range<usize> = 24..36;
const FIXED_DATE: [u8; 12] = [0x07, 0xd0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0];

/// Where a profile says how many bytes it has, which are so many at a time (ICC.1:2022, sections 7.2.2 and 7.1.2).
const SIZE: std::ops::Range<usize> = 0..4;
const ALIGNMENT: usize = 4;

/// A profile as bytes that are always the same, without what pictures do not need.
pub(super) fn compact(mut profile: ColorProfile, name: &str) -> Arc<[u8]> {
    profile.cicp = None;
    // Of a display, version 4 wants the adapted white here; the chromatic adaptation tag tells the unadapted.
    profile.media_white_point = Some(WHITE_POINT_D50.to_xyzd());
    if let Some(ProfileText::Localizable(texts)) = &mut profile.description {
        for text in texts {
            text.value = name.to_owned();
        }
    }
    // Encoding fails for tables only, which these have none of.
    let mut bytes = profile.encode().unwrap_or_default();
    // The encoder does not pad the last tag; readers refuse what is not aligned.
    bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
    let length = (bytes.len() as u32).to_be_bytes();
    if let Some(size) = bytes.get_mut(SIZE) {
        size.copy_from_slice(&length);
    }
    if let Some(date) = bytes.get_mut(DATE) {
        date.copy_from_slice(&FIXED_DATE);
    }
    bytes.into()
}

fn primaries(profile: &ColorProfile) -> [Xyzd; 3] {
    [profile.red_colorant, profile.green_colorant, profile.blue_colorant]
}

/// The curve that a profile's tag gives.
///
/// # Source
/// ICC.1:2022, sections 10.6 (curveType) and 10.18 (parametricCurveType).
fn curve_of(tag: &ToneReprCurve) -> Option<TransferCurve> {
    match tag {
        ToneReprCurve::Lut(samples) => match samples.as_slice() {
            [] => TransferCurve::gamma(1.0),
            [gamma] => TransferCurve::gamma(f64::from(*gamma) / 256.0),
            samples => TransferCurve::table(samples.iter().map(|&sample| f64::from(sample) / 65535.0).collect()),
        },
        ToneReprCurve::Parametric(numbers) => {
            let numbers: Vec<f64> = numbers.iter().map(|&number| f64::from(number)).collect();
            match *numbers.as_slice() {
                [g] => TransferCurve::gamma(g),
                [g, a, b] => TransferCurve::parametric([g, a, b, 0.0, -b / a, 0.0, 0.0]),
                [g, a, b, c] => TransferCurve::parametric([g, a, b, 0.0, -b / a, c, c]),
                [g, a, b, c, d] => TransferCurve::parametric([g, a, b, c, d, 0.0, 0.0]),
                [g, a, b, c, d, e, f] => TransferCurve::parametric([g, a, b, c, d, e, f]),
                _ => None,
            }
        }
    }
}

/// The name a profile gives itself.
pub(crate) fn description(profile: &ColorProfile) -> String {
    let text = match &profile.description {
        Some(ProfileText::PlainString(text)) => text.clone(),
        Some(ProfileText::Localizable(texts)) => texts.first().map(|text| text.value.clone()).unwrap_or_default(),
        Some(ProfileText::Description(text)) => text.ascii_string.clone(),
        None => String::new(),
    };
    let text = text.trim_matches(|character: char| character.is_whitespace() || character == '\0');
    if text.is_empty() { "an unnamed profile".to_owned() } else { text.to_owned() }
}
