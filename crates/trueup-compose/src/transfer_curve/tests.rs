use super::*;

fn curves() -> Vec<TransferCurve> {
    let adobe = TransferCurve::gamma(2.199_218_75);
    let pro_photo = TransferCurve::parametric([1.8, 1.0, 0.0, 0.0625, 0.031_25, 0.0, 0.0]);
    let table = TransferCurve::table((0..=1023).map(|step| (f64::from(step) / 1023.0).powf(1.9)).collect());
    let straight = TransferCurve::gamma(1.0);
    [Some(TransferCurve::SRGB), adobe, pro_photo, table, straight].map(|curve| curve.expect("a curve")).into()
}

#[test]
fn every_level_survives_the_round_trip() {
    for curve in curves() {
        let (linearize, encoding) = (Linearize::of(&curve), Encoding::new(curve.clone(), 1.0));
        for level in 0..=255_u8 {
            let linear = linearize.linear(f32::from(level));
            assert_eq!(encoding.linear.level(linear), level, "{curve:?}");
            assert_eq!(encoding.roots.level((linear.sqrt() * 65535.0 + 0.5) as u16), level, "{curve:?}");
        }
    }
}

#[test]
fn encoding_rounds_as_the_formula_does() {
    let steps = 100_000;
    for curve in curves() {
        let encode = Encode::of(&curve);
        for step in 0..=steps {
            let linear = step as f32 / steps as f32;
            let exact = 255.0 * curve.encoded(f64::from(linear));
            let level = f64::from(encode.level(linear));
            assert!((level - exact).abs() <= 0.5 + 1e-3, "{curve:?} {linear}: {level} for {exact}");
        }
        for (value, level) in [(-1.0, 0), (0.0, 0), (1.0, 255), (7.0, 255), (f32::NAN, 0), (f32::INFINITY, 255)] {
            assert_eq!(encode.level(value), level);
        }
    }
}

#[test]
fn a_curve_with_a_level_stretch_is_encoded_without_harm() {
    let curve = TransferCurve::table(vec![0.0, 0.0, 0.4, 0.4, 1.0]).expect("a curve");
    let encoding = Encoding::new(curve, 1.0);
    assert_eq!((encoding.linear.level(0.0), encoding.linear.level(1.0)), (0, 255));
    assert!((127..=192).contains(&encoding.linear.level(0.4)));
}

#[test]
fn sixteen_bits_are_off_by_hardly_more_than_half_a_level() {
    let steps = 1_000_000;
    for curve in curves() {
        // The table of 1024 entries has its sharpest kink behind the first: against the root of light the slope falls
        // from 1.41 to 0.52 there, and the chord across is off by up to 0.9 / 4 / 4095, 3.6 steps.
        let tolerance = if curve == TransferCurve::SRGB { 0.6 } else { 4.2 };
        let encode = Encode16::of(&curve);
        let mut last = 0;
        for step in 0..=steps {
            // Finer near black, where the curve is steep.
            let linear = (step as f32 / steps as f32).powi(2);
            let exact = 65535.0 * curve.encoded(f64::from(linear));
            let level = encode.level(linear);
            assert!((f64::from(level) - exact).abs() <= tolerance, "{curve:?} {linear}: {level} for {exact}");
            assert!(level >= last, "{linear}");
            last = level;
        }
        for (value, level) in [(-1.0, 0), (0.0, 0), (1.0, 65535), (7.0, 65535), (f32::NAN, 0), (f32::INFINITY, 65535)] {
            assert_eq!(encode.level(value), level);
        }
    }
}

/// The roots of neighboring levels differ; a level that passes through them comes back to within the root's own step.
#[test]
fn sixteen_bits_pass_through_roots() {
    let encode = EncodeRoots16::of(&TransferCurve::SRGB);
    for level in 0..=u16::MAX {
        let linear = TransferCurve::SRGB.linear(f64::from(level) / 65535.0);
        let back = encode.level((linear.sqrt() * 65535.0).round() as u16);
        assert!(back.abs_diff(level) <= 1, "{level}: {back}");
    }
    assert_eq!(encode.level(0), 0);
    assert_eq!(encode.level(65535), 65535);
}

#[test]
fn linear_light_between_levels_follows_the_formula() {
    for curve in curves() {
        let linearize = Linearize::of(&curve);
        // The others have kinks.
        let tolerance = if curve == TransferCurve::SRGB { 2e-7 } else { 4e-6 };
        for step in 0..=25_500 {
            let level = step as f32 / 100.0;
            let exact = curve.linear(f64::from(level) / 255.0);
            assert!((f64::from(linearize.linear(level)) - exact).abs() < tolerance, "{curve:?} {level}");
        }
        assert_eq!(linearize.linear(-9.0), 0.0);
        assert_eq!(linearize.linear(400.0), 1.0);
        assert_eq!(linearize.linear(f32::NAN), 0.0);
    }
}
