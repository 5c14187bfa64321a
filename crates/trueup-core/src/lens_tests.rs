//! The lens against values worked out by hand, its own inverse, and finite differences.

use proptest::prelude::*;

use super::*;

fn brown(radial: [f64; 4], tangential: [f64; 2]) -> Lens {
    Lens::new(LensTerms { projection: LensProjection::Rectilinear, radial, tangential })
}

fn fisheye(radial: [f64; 4]) -> Lens {
    Lens::new(LensTerms { projection: LensProjection::Equidistant, radial, tangential: [0.0; 2] })
}

/// x = 1/2, y = 1/4: r^2 = 5/16; with k1 = -1/10 and k2 = 1/100 the factor is 1 - 1/32 + 1/1024 = 993/1024. The
/// tangential terms p1 = 1/100 and p2 = -1/50 add 2/800 - (5/16 + 1/2)/50 = -11/800 and (5/16 + 1/8)/100 - 4/800 =
/// -1/1600.
#[test]
fn brown_bends_as_computed_by_hand() {
    let lens = brown([-0.1, 0.01, 0.0, 0.0], [0.01, -0.02]);
    let place = lens.place(Vector3::new(1.0, 0.5, 2.0)).expect("in front");
    assert!((place.x - (0.5 * 993.0 / 1024.0 - 11.0 / 800.0)).abs() < 1e-15, "{place}");
    assert!((place.y - (0.25 * 993.0 / 1024.0 - 1.0 / 1600.0)).abs() < 1e-15, "{place}");
}

/// 90 degrees to the right, and straight back to within a degree.
#[test]
fn a_fisheye_sees_all_round() {
    let right = fisheye([0.0; 4]).place(Vector3::x()).expect("seen");
    assert!((right - Vector2::new(std::f64::consts::FRAC_PI_2, 0.0)).norm() < 1e-15);
    let back = fisheye([0.0; 4]).place(Vector3::new(0.0, 179_f64.to_radians().sin(), 179_f64.to_radians().cos()));
    assert!((back.expect("seen").y - 179_f64.to_radians()).abs() < 1e-12);
    assert!(fisheye([0.0; 4]).place(-Vector3::z()).is_none());
    assert!(brown([0.1; 4], [0.0; 2]).place(Vector3::x()).is_none());
}

#[test]
fn terms_survive_being_written() {
    let lens = brown([-0.3, 0.02, 0.001, 0.0], [1e-3, 0.0]);
    let text = serde_json::to_string(&lens).expect("written");
    assert_eq!(serde_json::from_str::<Lens>(&text).expect("read"), lens);
    assert!(serde_json::from_str::<Lens>("{\"projection\":\"rectilinear\"}").expect("read").is_pinhole());
    assert!(brown([f64::NAN, f64::INFINITY, 0.0, 0.0], [0.0; 2]).is_pinhole());
}

fn any_lens() -> impl Strategy<Value = Lens> {
    let radial = prop::array::uniform4(-0.6..0.6_f64);
    (any::<bool>(), radial, prop::array::uniform2(-2e-3..2e-3_f64)).prop_map(|(round, [k1, k2, k3, k4], tangential)| {
        let projection = if round { LensProjection::Equidistant } else { LensProjection::Rectilinear };
        Lens::new(LensTerms { projection, radial: [k1, 0.3 * k2, 0.1 * k3, 0.01 * k4], tangential })
    })
}

proptest! {
    /// However wild the terms, a ray comes back from its place.
    #[test]
    fn rays_come_back(lens in any_lens(), longitude in 0.0..6.3_f64, angle in 0.0..1.3_f64) {
        let ray = Vector3::new(angle.sin() * longitude.cos(), angle.sin() * longitude.sin(), angle.cos());
        let place = lens.place(ray).expect("in front");
        let back = lens.ray(place);
        prop_assert!(back.normalize().dot(&ray) > 1.0 - 1e-12, "{:?} {} {}", lens, ray, back);
    }

    #[test]
    fn derivatives_are_those_of_finite_differences(lens in any_lens(), longitude in 0.0..6.3_f64, angle in 0.01..1.2_f64) {
        let ray = Vector3::new(angle.sin() * longitude.cos(), angle.sin() * longitude.sin(), angle.cos()) * 1.7;
        let at = lens.derivatives(ray).expect("in front");
        let step = 1e-6;
        let close = |analytic: Vector2<f64>, numeric: Vector2<f64>| (analytic - numeric).norm() < 1e-5 * (1.0 + numeric.norm());
        for axis in 0..3 {
            let moved = |amount: f64| lens.place(ray + Vector3::ith(axis, amount)).expect("in front");
            let numeric = (moved(step) - moved(-step)) / (2.0 * step);
            prop_assert!(close(at.by_ray.column(axis).into(), numeric), "ray {} {} {}", axis, at.by_ray, numeric);
        }
        // The limit moves with the terms; beyond it the derivative by them is another.
        let radius = lens.terms.projection.place(ray).expect("in front").norm();
        prop_assume!(radius < 0.99 * lens.limit && lens.terms.radial != [0.0; 4]);
        for term in 0..6 {
            let moved = |amount: f64| {
                let mut terms = lens.terms();
                if term < 4 { terms.radial[term] += amount } else { terms.tangential[term - 4] += amount }
                Lens::new(terms).place(ray).expect("in front")
            };
            let numeric = (moved(step) - moved(-step)) / (2.0 * step);
            let analytic = if term < 4 { at.by_radial.column(term).into() } else { at.by_tangential.column(term - 4).into() };
            prop_assert!(close(analytic, numeric), "term {}", term);
        }
    }
}
