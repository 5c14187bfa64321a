use trueup_core::color::TransferCurve;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;

use super::*;
use crate::layout::Placed;
use crate::render_options::Look;

/// The scene's linear light, smooth with some texture.
fn scene(x: f64, y: f64) -> f64 {
    0.08 + 0.03 * (x / 37.0).sin() + 0.02 * (y / 23.0).cos() + 0.01 * (x / 5.0 + y / 7.0).sin()
}

fn encoded(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let value = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * value).round() as u8
}

const WIDTH: usize = 240;
const HEIGHT: usize = 160;

/// A photograph at x = `shift` whose light is `gain` times the scene's.
fn photograph(shift: f64, gain: f64) -> Raster<u8> {
    let data = (0..WIDTH * HEIGHT)
        .flat_map(|i| [encoded(gain * scene((i % WIDTH) as f64 + shift, (i / WIDTH) as f64)); 3])
        .collect();
    Raster::from_data(WIDTH, HEIGHT, 3, data).expect("as many samples")
}

fn layout(shifts: &[f64]) -> CanvasLayout {
    let placed = shifts
        .iter()
        .enumerate()
        .map(|(photograph, shift)| {
            let mut mesh = GridMesh::regular(WIDTH as f64, HEIGHT as f64, 40.0);
            for vertex in &mut mesh.target {
                vertex[0] += shift;
            }
            Placed { photograph, mesh }
        })
        .collect();
    let width = WIDTH + shifts.iter().copied().fold(0.0, f64::max) as usize;
    CanvasLayout { width, height: HEIGHT, canvas_from_target: 1.0, origin: [0.0; 2], placed, period: None }
}

fn estimate_of(layout: &CanvasLayout, thumbnails: &[Thumbnail<'_>], options: &ExposureOptions) -> Result<Exposure> {
    run(&ExposureInput { layout, thumbnails, reference: 0, look: Look::Linear }, options, &StageContext::default())
}

fn estimate(shifts: &[f64], rasters: &[Raster<u8>], options: &ExposureOptions) -> Exposure {
    let frame = WorkingFrame::new(WIDTH, HEIGHT, 480_000.0);
    let thumbnails: Vec<Thumbnail> =
        rasters.iter().map(|raster| Thumbnail { raster, curve: &TransferCurve::SRGB, frame, camera: 0 }).collect();
    estimate_of(&layout(shifts), &thumbnails, options).expect("estimates")
}

fn gains(exposure: &Exposure) -> Vec<f64> {
    exposure.corrections.photographs.iter().map(Correction::brightness).collect()
}

/// ln of the light that reaches the sensor at the squared radius `r2`, relative to the middle.
fn falloff(r2: f64) -> f64 {
    -0.5 * r2 - 0.2 * r2 * r2
}

/// Columns of the cylinder in the tests of full turns.
const AROUND: usize = 480;

/// A photograph at column `shift` of the cylinder whose light is `gain` times the scene's.
fn photograph_around(shift: usize, gain: f64) -> Raster<u8> {
    let level = |i: usize| encoded(gain * scene(((i % WIDTH + shift) % AROUND) as f64, (i / WIDTH) as f64));
    let data = (0..WIDTH * HEIGHT).flat_map(|i| [level(i); 3]).collect();
    Raster::from_data(WIDTH, HEIGHT, 3, data).expect("as many samples")
}

/// Two photographs on a cylinder of 480 columns, the second 300 to the right of the first: they meet only across the
/// ends.
#[test]
fn overlaps_across_the_ends_of_a_full_turn_count() {
    let rasters = [photograph_around(0, 1.0), photograph_around(300, 0.7)];
    let frame = WorkingFrame::new(WIDTH, HEIGHT, 480_000.0);
    let thumbnails: Vec<Thumbnail> =
        rasters.iter().map(|raster| Thumbnail { raster, curve: &TransferCurve::SRGB, frame, camera: 0 }).collect();
    let options = ExposureOptions { model: ExposureModel::Gain, ..ExposureOptions::default() };
    let flat = layout(&[0.0, 300.0]);
    for (shifts, swapped) in
        [([0.0, 300.0], false), ([-90.0, 210.0], false), ([100.0, -80.0], false), ([300.0, 0.0], true)]
    {
        let order = if swapped { [1, 0] } else { [0, 1] };
        let layout = CanvasLayout { width: AROUND, period: Some(AROUND), ..layout(&shifts) };
        let thumbnails = order.map(|k| thumbnails[k]);
        let found = estimate_of(&layout, &thumbnails, &options).expect("estimates");
        assert_eq!(found.pairs.len(), 1, "{shifts:?}");
        let gains = gains(&found);
        let expected = if swapped { 0.7 } else { 1.0 / 0.7 };
        assert!((gains[1] / gains[0] - expected).abs() < 0.03, "{shifts:?}: {gains:?}");
    }
    let alone = estimate_of(&flat, &thumbnails, &options).expect("estimates");
    assert!(alone.pairs.is_empty());
    // A vertex that has no place, as one at a pole may not, is none that samples are counted from.
    let mut torn = CanvasLayout { width: AROUND, period: Some(AROUND), ..layout(&[0.0, 300.0]) };
    torn.placed[0].mesh.target[0] = [f64::NAN; 2];
    assert_eq!(estimate_of(&torn, &thumbnails, &options).expect("estimates").pairs.len(), 1);
}

/// The same samples are compared wherever the turn is cut open, though the cuts lie between them.
#[test]
fn a_full_turn_is_corrected_alike_wherever_it_is_cut_open() {
    let shifts = [0_usize, 170, 330];
    let rasters = [photograph_around(0, 1.0), photograph_around(170, 0.7), photograph_around(330, 1.4)];
    let frame = WorkingFrame::new(WIDTH, HEIGHT, 480_000.0);
    let thumbnails: Vec<Thumbnail> =
        rasters.iter().map(|raster| Thumbnail { raster, curve: &TransferCurve::SRGB, frame, camera: 0 }).collect();
    let cut_at = |cut: f64| {
        let around = |shift: usize| (shift as f64 - cut).rem_euclid(AROUND as f64) - 0.25 * WIDTH as f64;
        let layout = CanvasLayout { width: AROUND, period: Some(AROUND), ..layout(&shifts.map(around)) };
        estimate_of(&layout, &thumbnails, &ExposureOptions::default()).expect("estimates")
    };
    let whole = cut_at(0.0);
    assert_eq!(whole.pairs.len(), 3);
    for cut in [0.7, 33.3, 201.6, 239.9, 424.25] {
        let other = cut_at(cut);
        assert_eq!(other.pairs.len(), 3, "{cut}");
        for (one, other) in whole.corrections.photographs.iter().zip(&other.corrections.photographs) {
            for channel in 0..3 {
                let ratio = one.gain[channel] / other.gain[channel];
                assert!((ratio - 1.0).abs() < 1e-9, "{cut}: {one:?} {other:?}");
            }
            assert!((one.at_radius(1.0) / other.at_radius(1.0) - 1.0).abs() < 1e-9, "{cut}: {one:?} {other:?}");
        }
    }
}

#[test]
fn gain_color_and_vignetting_are_recovered_together() {
    let shifts = [0.0, 110.0, 190.0, 300.0, 400.0];
    let lights = [1.0, 0.25, 1.9, 4.0, 0.6];
    let casts = [[1.0, 1.0, 1.0], [1.1, 1.0, 0.9], [0.92, 1.0, 1.05], [1.0, 1.05, 1.1], [0.95, 1.0, 1.0]];
    let rasters: Vec<Raster<u8>> = (0..shifts.len())
        .map(|k| {
            let mut raster = Raster::new(WIDTH, HEIGHT, 3);
            for y in 0..HEIGHT {
                for x in 0..WIDTH {
                    let (u, v) = (x as f64 + 0.5 - WIDTH as f64 / 2.0, y as f64 + 0.5 - HEIGHT as f64 / 2.0);
                    let r2 = (u * u + v * v) * 4.0 / ((WIDTH * WIDTH + HEIGHT * HEIGHT) as f64);
                    let light = lights[k] * falloff(r2).exp() * scene(x as f64 + shifts[k], y as f64);
                    raster.pixel_mut(x, y).copy_from_slice(&casts[k].map(|cast| encoded(cast * light)));
                }
            }
            raster
        })
        .collect();
    // A passer-by in one photograph does not count.
    let mut rasters = rasters;
    for y in 60..120 {
        for x in 130..170 {
            rasters[1].pixel_mut(x, y).copy_from_slice(&[20, 60, 20]);
        }
    }
    let options = ExposureOptions { anchor: GainAnchor::Reference, ..ExposureOptions::default() };
    let exposure = estimate(&shifts, &rasters, &options);
    assert_eq!(exposure.corrections.photographs.len(), shifts.len());
    let truth = |k: usize, c: usize| lights[0] * casts[0][c] / (lights[k] * casts[k][c]);
    for (k, correction) in exposure.corrections.photographs.iter().enumerate() {
        for c in 0..3 {
            assert!((correction.gain[c] / truth(k, c) - 1.0).abs() < 0.02, "{k}: {correction:?}");
        }
        for r2 in [0.25, 0.5, 0.75, 1.0_f64] {
            let lifted = correction.at_radius(r2) * falloff(r2).exp();
            assert!((lifted - 1.0).abs() < 0.02, "{lifted} at {r2}: {correction:?}");
        }
    }
    let plain = ExposureOptions { model: ExposureModel::Gain, ..ExposureOptions::default() };
    for correction in estimate(&shifts, &rasters, &plain).corrections.photographs {
        assert_eq!(correction, Correction::uniform(correction.gain[0]));
    }
}

#[test]
fn gains_from_a_quarter_to_four_are_recovered() {
    let shifts = [0.0, 150.0, 300.0, 450.0];
    let lights = [1.0, 0.25, 4.0, 1.7];
    let rasters: Vec<_> = shifts.iter().zip(lights).map(|(&shift, light)| photograph(shift, light)).collect();
    for anchor in [GainAnchor::Mean, GainAnchor::Reference, GainAnchor::Scene] {
        let exposure = estimate(&shifts, &rasters, &ExposureOptions { anchor, ..ExposureOptions::default() });
        assert_eq!(exposure.pairs.len(), 3);
        let corrections = exposure.corrections.photographs.iter();
        let products: Vec<f64> =
            corrections.clone().zip(lights).flat_map(|(one, light)| one.gain.map(|gain| gain * light)).collect();
        for product in &products {
            assert!((product / products[0] - 1.0).abs() < 0.02, "{products:?}");
        }
        match anchor {
            GainAnchor::Reference => assert_eq!(exposure.corrections.photographs[0].gain, [1.0; 3]),
            GainAnchor::Mean => assert!(corrections.map(|one| one.brightness().ln()).sum::<f64>().abs() < 1e-9),
            // Nothing is lost, and no photograph is more than two stops from the reference.
            GainAnchor::Scene => assert!((0.5..=2.0).contains(&exposure.corrections.photographs[0].gain[0])),
        }
    }
}

/// From sun to shade, as cameras that expose by themselves go: four stops from the reference to the other end.
#[test]
fn exposures_four_stops_apart_are_followed() {
    let lights = [4.0, 1.0, 0.25];
    let shifts = [0.0, 100.0, 200.0];
    let rasters: Vec<_> = shifts.iter().zip(lights).map(|(&shift, light)| photograph(shift, light)).collect();
    let options = ExposureOptions { anchor: GainAnchor::Reference, ..ExposureOptions::default() };
    let gains = gains(&estimate(&shifts, &rasters, &options));
    assert!((gains[1] / 4.0 - 1.0).abs() < 0.02 && (gains[2] / 16.0 - 1.0).abs() < 0.03, "{gains:?}");
}

/// A reference that is four stops too dark, beside three photographs as they should be.
#[test]
fn a_dark_reference_does_not_make_the_panorama_dark() {
    let shifts = [0.0, 100.0, 200.0, 300.0];
    let lights = [1.0 / 16.0, 1.0, 1.0, 1.0];
    let rasters: Vec<_> = shifts.iter().zip(lights).map(|(&shift, light)| photograph(shift, light)).collect();
    let by_anchor = |anchor: GainAnchor| {
        let options = ExposureOptions { anchor, model: ExposureModel::Gain, ..ExposureOptions::default() };
        gains(&estimate(&shifts, &rasters, &options))
    };
    let (scene, reference) = (by_anchor(GainAnchor::Scene), by_anchor(GainAnchor::Reference));
    assert!(reference[1] < 0.08, "{reference:?}");
    // The others cost nothing from a stop below their exposure on, which is where the stops from the reference are
    // fewest.
    assert!((scene[1] / 0.5 - 1.0).abs() < 0.1, "{scene:?}");
    for (one, other) in scene.iter().zip(&reference) {
        assert!((one / other / (scene[0] / reference[0]) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn photographs_of_nearly_one_exposure_keep_the_level_of_the_reference() {
    let shifts = [0.0, 100.0, 200.0];
    let rasters: Vec<_> = shifts.iter().zip([1.0, 1.4, 0.8]).map(|(&shift, light)| photograph(shift, light)).collect();
    let exposure = estimate(&shifts, &rasters, &ExposureOptions::default());
    assert_eq!(exposure.corrections.photographs[0].gain, [1.0; 3]);
}

#[test]
fn saturated_and_moving_things_do_not_count() {
    let shifts = [0.0, 100.0];
    let mut rasters = [photograph(0.0, 1.0), photograph(100.0, 2.0)];
    for y in 0..HEIGHT {
        for x in 110..WIDTH {
            // A third of the overlap is blown out in both, a fifth is a dark passer-by in the second only.
            if y < HEIGHT / 3 {
                rasters[0].pixel_mut(x, y).fill(255);
                rasters[1].pixel_mut(x - 100, y).fill(255);
            } else if y > HEIGHT * 4 / 5 {
                rasters[1].pixel_mut(x - 100, y).fill(30);
            }
        }
    }
    let exposure = estimate(&shifts, &rasters, &ExposureOptions::default());
    assert!((gains(&exposure)[0] / gains(&exposure)[1] - 2.0).abs() < 0.04, "{exposure:?}");
}

#[test]
fn photographs_without_overlap_keep_their_brightness() {
    let rasters = [photograph(0.0, 1.0), photograph(150.0, 2.0), photograph(900.0, 3.0)];
    let exposure = estimate(&[0.0, 150.0, 900.0], &rasters, &ExposureOptions::default());
    assert_eq!(gains(&exposure)[2], 1.0);
    assert!((gains(&exposure)[0] / gains(&exposure)[1] - 2.0).abs() < 0.04);
    let alone = estimate(&[0.0], &rasters[..1], &ExposureOptions::default());
    assert_eq!(gains(&alone), [1.0]);
    let off = ExposureOptions { enabled: false, ..ExposureOptions::default() };
    assert_eq!(estimate(&[0.0, 150.0, 900.0], &rasters, &off).corrections, Corrections::plain(3));
}

#[test]
fn gains_stay_within_their_limit_and_black_says_nothing() {
    let rasters = [photograph(0.0, 1.0), photograph(150.0, 8.0)];
    let options = ExposureOptions { max_gain: 1.5, ..ExposureOptions::default() };
    let bounded = estimate(&[0.0, 150.0], &rasters, &ExposureOptions { anchor: GainAnchor::Mean, ..options });
    assert!((gains(&bounded)[0] - 1.5).abs() < 1e-9 && (gains(&bounded)[1] - 1.5_f64.recip()).abs() < 1e-9);
    let black = Raster::new(WIDTH, HEIGHT, 3);
    let exposure = estimate(&[0.0, 150.0], &[black, photograph(150.0, 1.0)], &ExposureOptions::default());
    assert_eq!(gains(&exposure), [1.0; 2]);
}

#[test]
fn input_that_does_not_fit_is_refused() {
    let options = ExposureOptions::default();
    let none = estimate_of(&layout(&[0.0, 9.0]), &[], &options);
    assert!(matches!(none, Err(Error::Input { .. })));
}
