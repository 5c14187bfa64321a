//! Which profiles are believed.

use moxcms::{ColorProfile, ToneReprCurve};
use proptest::prelude::*;

use super::icc::{Understood, understand};
use super::sanity::{flaw_of_conversion, flaw_of_curve};

fn reason(profile: &ColorProfile) -> Option<String> {
    match understand(&profile.encode().expect("a profile")) {
        Understood::Damaged(reason) => Some(reason),
        _ => None,
    }
}

#[test]
fn spaces_in_use_are_sane() {
    let linear = {
        let mut profile = ColorProfile::new_bt2020();
        let curve = Some(ToneReprCurve::Lut(Vec::new()));
        (profile.red_trc, profile.green_trc, profile.blue_trc) = (curve.clone(), curve.clone(), curve);
        profile
    };
    for (name, profile) in [
        ("sRGB", ColorProfile::new_srgb()),
        ("Display P3", ColorProfile::new_display_p3()),
        ("Adobe RGB", ColorProfile::new_adobe_rgb()),
        ("ProPhoto RGB", ColorProfile::new_pro_photo_rgb()),
        ("Rec. 2020", ColorProfile::new_bt2020()),
        ("linear Rec. 2020", linear),
        ("DCI P3", ColorProfile::new_dci_p3()),
        ("ACES 2065-1", ColorProfile::new_aces_aces_2065_1_linear()),
        ("ACEScg", ColorProfile::new_aces_cg_linear()),
    ] {
        assert_eq!(reason(&profile), None, "{name}");
    }
}

/// Profiles that can be read and would turn photographs into something else.
#[test]
fn absurd_profiles_are_not_believed() {
    let with = |change: &dyn Fn(&mut ColorProfile)| {
        let mut profile = ColorProfile::new_display_p3();
        change(&mut profile);
        reason(&profile).expect("absurd")
    };
    let curve = |profile: &mut ColorProfile, curve: ToneReprCurve| {
        (profile.red_trc, profile.green_trc, profile.blue_trc) =
            (Some(curve.clone()), Some(curve.clone()), Some(curve));
    };
    assert!(with(&|profile| curve(profile, ToneReprCurve::Lut(vec![50 * 256]))).contains("too steep"));
    assert!(with(&|profile| curve(profile, ToneReprCurve::Lut(vec![26]))).contains("too flat"));
    let steps = |step: u16| if step < 40 { 2000 + step } else { 60_000 + step };
    let staircase: Vec<u16> = [0].into_iter().chain((1..63).map(steps)).chain([65535]).collect();
    let message = with(&|profile| curve(profile, ToneReprCurve::Lut(staircase.clone())));
    assert!(message.contains("one level of many"), "{message}");
    assert!(with(&|profile| profile.red_colorant.x = 9.0).contains("primaries"));
    assert!(
        with(&|profile| std::mem::swap(&mut profile.blue_colorant.z, &mut profile.blue_colorant.x))
            .contains("primaries")
    );
    assert!(with(&|profile| profile.green_colorant = profile.red_colorant).contains("primaries"));
    // Curves of the channels that have nothing to do with each other.
    let message = with(&|profile| profile.green_trc = Some(ToneReprCurve::Lut(vec![6 * 256])));
    assert!(message.contains("colored"), "{message}");
}

proptest! {
    /// Whatever happens to a profile on the way: what is believed leaves grays gray, bright ones bright.
    #[test]
    fn damage_is_harmless_or_found(at in 0_usize..10_000, bits in 1_u8..=255) {
        let mut bytes = ColorProfile::new_display_p3().encode().expect("a profile");
        let at = at % bytes.len();
        bytes[at] ^= bits;
        match understand(&bytes) {
            Understood::Space(space) => prop_assert_eq!(flaw_of_conversion(&space.profile), None),
            Understood::Tables(profile) => prop_assert_eq!(flaw_of_conversion(&profile), None),
            Understood::Gray(curve) => prop_assert_eq!(flaw_of_curve(&curve), None),
            Understood::Foreign(_) | Understood::Damaged(_) => {}
        }
    }
}
