use proptest::prelude::*;
use trueup_core::StageContext;
use trueup_core::raster::Photograph;

use super::*;
use crate::layout::Placed;
use crate::light::Corrections;
use crate::render::test_rendering::compose;
use crate::render::{Blend, RenderOptions};
use crate::test_photographs::{Memory, canvas, gradient, moved};

const WIDTH: f64 = 120.0;
const HEIGHT: f64 = 80.0;

/// Photographs side by side, each overlapping the next by a third.
fn row(count: usize, left: f64, top: f64) -> Vec<Placed> {
    (0..count).map(|at| moved(at, WIDTH, HEIGHT, |p| [p.x + left + 80.0 * at as f64, p.y + top])).collect()
}

fn uniform(gains: &[f64]) -> Vec<Correction> {
    gains.iter().map(|&gain| Correction::uniform(gain)).collect()
}

fn factors(local: &LocalExposure, columns: std::ops::Range<usize>) -> Vec<f32> {
    let mut out = Vec::new();
    local.factors(40, columns, &mut out);
    out
}

#[test]
fn what_is_borne_follows_the_formula() {
    let bearing = Bearing { whole_stops: 1.0, most_stops: 1.5 };
    assert_eq!([0.0, 0.6, -1.0].map(|stops| bearing.borne(stops)), [0.0, 0.6, -1.0]);
    // 1 + 0.5 (1 - 1/e) and 1 + 0.5 (1 - 1/e^6)
    assert!((bearing.borne(1.5) - 1.316_060).abs() < 1e-6);
    assert!((bearing.borne(-4.0) + 1.498_761).abs() < 1e-6);
    assert_eq!(Look::Linear.bearing(), None);
}

#[test]
fn like_exposures_are_left_alone_by_every_look() {
    let layout = canvas(280, 80, row(3, 0.0, 0.0));
    for look in [Look::Natural, Look::Linear, Look::Hdr] {
        assert_eq!(local_exposure(&layout, &uniform(&[1.0, 1.1, 0.9]), look), None);
    }
    let two_stops = uniform(&[2.0, 1.0, 0.5]);
    assert_eq!(local_exposure(&layout, &two_stops, Look::Natural), None);
    assert!(local_exposure(&layout, &two_stops, Look::Hdr).is_some());
    assert_eq!(local_exposure(&layout, &uniform(&[30.0, 1.0, 0.05]), Look::Linear), None);
}

#[test]
fn sun_and_shade_go_over_into_each_other_without_a_step() {
    let layout = canvas(200, 80, row(2, 0.0, 0.0));
    // Three stops to either side, of which 1 + 0.5 (1 - 1/e^4) = 1.490842 are evened out.
    let local = local_exposure(&layout, &uniform(&[8.0, 0.125]), Look::Natural).expect("far apart");
    let factors = factors(&local, 0..200);
    let given_back = 2.0_f32.powf(1.490_842 - 3.0);
    assert!((factors[0] / given_back - 1.0).abs() < 0.01, "{} {given_back}", factors[0]);
    assert!((factors[199] * given_back - 1.0).abs() < 0.01);
    assert!((factors[99] * factors[100] - 1.0).abs() < 0.02);
    for pair in factors.windows(2) {
        // Three stops over some 80 pixels, twice as steep in the middle.
        assert!(pair[1] >= pair[0] - 1e-6 && pair[1] / pair[0] < 2.0_f32.powf(0.09), "{pair:?}");
    }
}

#[test]
fn what_is_kept_of_the_canvas_changes_nothing() {
    let gains = uniform(&[10.0, 1.0, 0.1]);
    let whole = canvas(280, 80, row(3, 0.0, 0.0));
    let kept = canvas(100, 60, row(3, -60.0, -7.0));
    let [whole, kept] = [whole, kept].map(|layout| local_exposure(&layout, &gains, Look::Natural).expect("apart"));
    let (mut own, mut others) = (Vec::new(), Vec::new());
    for y in [0, 17, 52] {
        whole.factors(y + 7, 60..160, &mut own);
        kept.factors(y, 0..100, &mut others);
        assert!(own.iter().zip(&others).all(|(one, other)| (one / other - 1.0).abs() < 1e-5));
    }
}

#[test]
fn the_ends_of_a_full_turn_meet() {
    let placed = row(6, -30.0, 0.0);
    let layout = CanvasLayout { period: Some(480), ..canvas(480, 80, placed) };
    let gains = uniform(&[16.0, 1.0, 1.0, 0.1, 1.0, 1.0]);
    let local = local_exposure(&layout, &gains, Look::Natural).expect("apart");
    let factors = factors(&local, 0..480);
    let step = |at: usize| (factors[(at + 1) % 480] / factors[at]).log2().abs();
    let largest = (0..479).map(step).fold(0.0, f32::max);
    assert!(step(479) <= largest && largest < 0.1, "{} {largest}", step(479));
    // The first photograph's middle, 30; its neighbors are alike.
    assert!((factors[30 + 39] / factors[480 + 30 - 40] - 1.0).abs() < 0.02);
}

/// Everything of one light, seen by a photograph that shows it bright and by one that shows it dark.
fn of_one_light(look: Look, blend: Blend) -> Vec<f32> {
    // sRGB levels 188 and 31 are 0.5029 and 0.0137 of the light: factors of 0.1652 and 6.05 make them one.
    let level = |level: f64| -> Photograph { gradient(WIDTH as usize, HEIGHT as usize, move |_, _| level) };
    let photographs = Memory(vec![level(188.0), level(31.0)]);
    let corrections: Corrections = uniform(&[0.165_2, 6.053]).into();
    let options = RenderOptions { look, blend, ..RenderOptions::default() };
    let layout = canvas(200, 80, row(2, 0.0, 0.0));
    let panorama = compose(&layout, &corrections, &photographs, &options, &StageContext::default()).expect("renders");
    (0..200).map(|x| panorama.linear_pixel(x, 40).expect("in memory")[0]).collect()
}

#[test]
fn the_panorama_follows_the_look_however_it_is_blended() {
    for blend in [Blend::MultiBand, Blend::None, Blend::Feather, Blend::Average] {
        let linear = of_one_light(Look::Linear, blend);
        assert!(linear.iter().all(|light| (light / 0.083 - 1.0).abs() < 0.06), "{blend:?} {linear:?}");
        let natural = of_one_light(Look::Natural, blend);
        // 2.598 stops to either side, of which 1.480 are evened out: the rest, 1.118 stops, is given back.
        assert!((natural[5] / linear[5]).log2() > 1.0, "{blend:?} {}", natural[5]);
        assert!((natural[195] / linear[195]).log2() < -1.0, "{blend:?} {}", natural[195]);
        assert!(natural.windows(2).all(|pair| (pair[0] / pair[1]).log2().abs() < 0.12), "{blend:?} {natural:?}");
    }
    let hdr = of_one_light(Look::Hdr, Blend::MultiBand);
    assert!(hdr[5] > of_one_light(Look::Natural, Blend::MultiBand)[5]);
}

proptest! {
    #[test]
    fn more_stops_are_never_fewer_borne(one in -12.0..12.0_f64, other in -12.0..12.0_f64) {
        for bearing in [Look::Natural, Look::Hdr].into_iter().filter_map(Look::bearing) {
            let [a, b] = [one, other].map(|stops| bearing.borne(stops));
            prop_assert!((one <= other) == (a <= b) || (a - b).abs() < 1e-9);
            prop_assert!(a.abs() <= one.abs() && a.abs() <= bearing.most_stops && a * one >= 0.0);
        }
    }
}
