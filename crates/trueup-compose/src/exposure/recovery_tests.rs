//! Known light, found again: photographs of a scene are made with gains, casts, vignetting, noise and a response that
//! are known.

use trueup_core::color::TransferCurve;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;

use super::*;
use crate::layout::Placed;
use crate::render_options::Look;

const WIDTH: usize = 300;
const HEIGHT: usize = 200;

/// Standard deviation of the noise, 8-bit levels.
const NOISE: f64 = 1.2;

/// Where the photographs lie, not on whole pixels: a row of three above another.
const PLACES: [[f64; 2]; 6] = [[0.0, 0.0], [138.3, 11.6], [281.7, -4.4], [6.4, 96.2], [147.1, 104.9], [290.5, 90.7]];

/// Numbers from 0 to 1, always the same for a seed.
struct Dice(u64);

impl Dice {
    /// The generator splitmix64 (Steele, Lea, Flood, 2014).
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }

    /// A standard deviation of 1, from the sum of twelve.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.roll()).sum::<f64>() - 6.0
    }
}

/// The scene's linear light from near black to white, with soft things and edges of its own colors.
fn scene(x: f64, y: f64) -> [f64; 3] {
    let slow = 1.3 * (x / 61.0 + 0.7).sin() * (y / 53.0).cos() + 0.8 * (x / 29.0 - y / 41.0).sin();
    let block = ((x / 34.0).floor() * 12.9898 + (y / 27.0).floor() * 78.233).sin();
    let fine = 0.15 * (x / 4.1).sin() * (y / 3.7).cos();
    [0.1, 0.0, -0.1].map(|cast| (-2.3 + 0.75 * slow + 0.6 * block + fine + cast * (x / 80.0).sin()).exp())
}

/// What was done to the light of a photograph.
#[derive(Debug, Clone, Copy)]
struct Light {
    gain: [f64; 3],
    vignetting: [f64; 3],
}

impl Light {
    fn falloff(&self, r2: f64) -> f64 {
        let [a, b, c] = self.vignetting;
        (a * r2 + b * r2 * r2 + c * r2 * r2 * r2).exp()
    }

    /// The photograph at `place`, whose camera writes light by `encoded` (both 0 to 1).
    fn photograph(&self, place: [f64; 2], encoded: impl Fn(f64) -> f64, dice: &mut Dice) -> Raster<u8> {
        let mut raster = Raster::new(WIDTH, HEIGHT, 3);
        let corner = ((WIDTH * WIDTH + HEIGHT * HEIGHT) as f64) / 4.0;
        for row in 0..HEIGHT {
            for column in 0..WIDTH {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let r2 = ((x - WIDTH as f64 / 2.0).powi(2) + (y - HEIGHT as f64 / 2.0).powi(2)) / corner;
                let light = scene(x + place[0], y + place[1]);
                for (channel, sample) in raster.pixel_mut(column, row).iter_mut().enumerate() {
                    let exposed = (light[channel] * self.gain[channel] * self.falloff(r2)).min(1.0);
                    *sample = (255.0 * encoded(exposed) + NOISE * dice.normal()).round().clamp(0.0, 255.0) as u8;
                }
            }
        }
        raster
    }
}

fn layout() -> CanvasLayout {
    let placed = |(photograph, place): (usize, &[f64; 2])| {
        let mut mesh = GridMesh::regular(WIDTH as f64, HEIGHT as f64, 40.0);
        for vertex in &mut mesh.target {
            *vertex = [vertex[0] + place[0], vertex[1] + place[1] + 5.0];
        }
        Placed { photograph, mesh }
    };
    let placed = PLACES.iter().enumerate().map(placed).collect();
    CanvasLayout { width: 600, height: 315, canvas_from_target: 1.0, origin: [0.0; 2], placed, period: None }
}

fn found(lights: &[Light], encoded: impl Fn(f64) -> f64, seed: u64, options: &ExposureOptions) -> Corrections {
    found_beside(&TransferCurve::SRGB, lights, encoded, seed, options)
}

/// The same where the photographs' profile has another curve.
fn found_beside(
    curve: &TransferCurve,
    lights: &[Light],
    encoded: impl Fn(f64) -> f64,
    seed: u64,
    options: &ExposureOptions,
) -> Corrections {
    let mut dice = Dice(seed);
    let rasters: Vec<Raster<u8>> =
        lights.iter().zip(PLACES).map(|(light, place)| light.photograph(place, &encoded, &mut dice)).collect();
    let frame = WorkingFrame::new(WIDTH, HEIGHT, 480_000.0);
    let thumbnail = |raster| Thumbnail { raster, curve, frame, camera: 0 };
    let thumbnails: Vec<Thumbnail> = rasters.iter().map(thumbnail).collect();
    let input = ExposureInput { layout: &layout(), thumbnails: &thumbnails, reference: 0, look: Look::Linear };
    run(&input, options, &StageContext::default()).expect("estimates").corrections
}

/// Gains relative to the first photograph from 1/4 to 4, casts of up to 10 % and vignetting, different for every seed.
fn lights(seed: u64) -> Vec<Light> {
    let mut dice = Dice(1000 + seed);
    let vignetting = [-0.6 * dice.roll(), -0.4 * dice.roll(), 0.4 * dice.roll() - 0.2];
    let mut light = |_| {
        let gain = 4.0_f64.powf(2.0 * dice.roll() - 1.0);
        Light { gain: [1.0, 0.0, -1.0].map(|tint| gain * (0.1 * tint * (2.0 * dice.roll() - 1.0)).exp()), vignetting }
    };
    let mut lights: Vec<Light> = (0..PLACES.len()).map(&mut light).collect();
    lights[0].gain = [1.0; 3];
    // The ends of the range are always there.
    lights[1].gain = lights[1].gain.map(|gain| 0.25 * gain / lights[1].gain[1]);
    lights[4].gain = lights[4].gain.map(|gain| 4.0 * gain / lights[4].gain[1]);
    lights
}

/// The largest errors of the gains, and of what is left of the vignetting halfway to the corners and there.
fn errors(lights: &[Light], found: &Corrections) -> [f64; 2] {
    assert_eq!(found.photographs.len(), lights.len());
    let mut errors = [0.0_f64; 2];
    for (light, correction) in lights.iter().zip(&found.photographs) {
        for channel in 0..3 {
            errors[0] = errors[0].max((correction.gain[channel] * light.gain[channel] - 1.0).abs());
        }
        for r2 in [0.25, 1.0] {
            errors[1] = errors[1].max((correction.at_radius(r2) * light.falloff(r2) - 1.0).abs());
        }
    }
    errors
}

#[test]
fn known_gains_and_vignetting_are_recovered_within_two_percent() {
    for seed in 0..5 {
        let lights = lights(seed);
        let options = ExposureOptions { anchor: GainAnchor::Reference, ..ExposureOptions::default() };
        let found = found(&lights, |light| TransferCurve::SRGB.encoded(light), seed, &options);
        let errors = errors(&lights, &found);
        assert!(errors[0] < 0.02 && errors[1] < 0.02, "{seed}: {errors:?} {found:?}");
    }
}

/// How far what is found of the response is from the `truth` (light by encoded value), but for a power and a factor,
/// which gains make up for: the largest difference of natural logarithms over the levels from 25 to 242.
fn response_error(found: &Response, truth: impl Fn(f64) -> f64) -> f64 {
    let points: Vec<[f64; 2]> = (25..=242)
        .map(|level| {
            let e = f64::from(level) / 255.0;
            [found.light(&TransferCurve::SRGB, e).ln(), truth(e).ln()]
        })
        .collect();
    let mean = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64);
    let products = |a: usize, b: usize| points.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>();
    let slope = products(0, 1) / products(0, 0);
    points.iter().map(|p| (p[1] - mean[1] - slope * (p[0] - mean[0])).abs()).fold(0.0, f64::max)
}

/// Three exposures of cameras that bend the light in ways of their own.
#[test]
fn the_response_is_recovered_from_three_exposures() {
    let exposures = [1.0, 0.5, 2.0, 0.5, 2.0, 1.0];
    let lights = exposures.map(|gain| Light { gain: [gain; 3], vignetting: [-0.2, -0.1, 0.0] });
    // An S, light by encoded value, and a film's: 1 - exp(-2.5 l), stretched to end at white, whose inverse is a
    // logarithm.
    let s_shaped = Response { coefficients: [0.0, -0.5, 0.4, 0.1] }.curve(&TransferCurve::SRGB).expect("a curve");
    let white = 1.0 - f64::exp(-2.5);
    let film = |e: f64| -(1.0 - white * TransferCurve::SRGB.linear(e)).ln() / 2.5;
    let by_film = |light: f64| TransferCurve::SRGB.encoded((1.0 - (-2.5 * light).exp()) / white);
    let options = ExposureOptions::default();
    let by_s = found(&lights, |light| s_shaped.encoded(light), 1, &options).response;
    let by_film = found(&lights, by_film, 2, &options).response;
    let none = Response::default();
    for (name, found, without) in [
        ("S", response_error(&by_s, |e| s_shaped.linear(e)), response_error(&none, |e| s_shaped.linear(e))),
        ("film", response_error(&by_film, film), response_error(&none, film)),
    ] {
        assert!(found < 0.08 && without > 0.3, "{name}: {found}, without {without}");
    }
}

/// The same where a gain would exceed its limit: no response then.
#[test]
fn no_response_drives_gains_to_their_limit() {
    let exposures = [1.0, 0.5, 2.0, 0.5, 2.0, 1.0];
    let lights = exposures.map(|gain| Light { gain: [gain; 3], vignetting: [0.0; 3] });
    let white = 1.0 - f64::exp(-2.5);
    let by_film = |light: f64| TransferCurve::SRGB.encoded((1.0 - (-2.5 * light).exp()) / white);
    let found_within =
        |max_gain: f64| found(&lights, by_film, 1, &ExposureOptions { max_gain, ..ExposureOptions::default() });
    assert!(!found_within(4.0).response.is_plain());
    let limited = found_within(1.2);
    assert!(limited.response.is_plain(), "{limited:?}");
    let without = ExposureOptions { max_gain: 1.2, response: false, ..ExposureOptions::default() };
    assert_eq!(limited, found(&lights, by_film, 1, &without));
}

/// A profile that stands still for some levels, where the response falls: together they make no curve, and so the
/// profile stays as it is.
#[test]
fn a_response_that_makes_no_curve_with_the_profile_is_left_out() {
    let exposures = [1.0, 0.5, 2.0, 0.5, 2.0, 1.0];
    let lights = exposures.map(|gain| Light { gain: [gain; 3], vignetting: [0.0; 3] });
    let s_shaped = Response { coefficients: [0.0, -0.5, 0.4, 0.1] }.curve(&TransferCurve::SRGB).expect("a curve");
    let still = |e: f64| if (0.30..0.34).contains(&e) { 0.30 } else { e };
    let light = (0..=1024).map(|step| TransferCurve::SRGB.linear(still(f64::from(step) / 1024.0))).collect();
    let profile = TransferCurve::table(light).expect("a curve");
    let options = ExposureOptions::default();
    let found = found_beside(&profile, &lights, |light| s_shaped.encoded(light), 1, &options);
    assert!(found.response.curve(&profile).is_ok(), "{found:?}");
    assert_eq!(found.photographs.len(), lights.len());
}

#[test]
fn photographs_of_one_exposure_say_nothing_of_the_response() {
    let lights = [Light { gain: [1.0; 3], vignetting: [0.0; 3] }; PLACES.len()];
    let film = |light: f64| TransferCurve::SRGB.encoded((1.0 - (-1.2 * light).exp()) / (1.0 - f64::exp(-1.2)));
    let found = found(&lights, film, 3, &ExposureOptions::default());
    assert!(found.response.is_plain(), "{:?}", found.response);
}

/// Three exposures tell a camera that clips hard from one that levels highlights off; one exposure tells nothing.
#[test]
fn a_shoulder_is_told_from_hard_clipping() {
    let of = |exposures: [f64; PLACES.len()]| exposures.map(|gain| Light { gain: [gain; 3], vignetting: [0.0; 3] });
    let three = of([1.0, 0.5, 2.0, 0.5, 2.0, 1.0]);
    let hard = |light: f64| TransferCurve::SRGB.encoded(light);
    // Of two exposures a factor f apart, y and f y / (1 + s (f^4 - 1) y^4)^(1/4) are the same light, with s = k / (1 +
    // k).
    let levelled = |k: f64| {
        move |light: f64| TransferCurve::SRGB.encoded(light * ((1.0 + k) / (1.0 + k * light.powi(4))).powf(0.25))
    };
    let options = ExposureOptions { response: false, ..ExposureOptions::default() };
    for seed in 0..3 {
        let shoulder = |lights: &[Light], encoded: &dyn Fn(f64) -> f64, options: &ExposureOptions| {
            let found = found(lights, encoded, seed, options).photographs;
            assert!(found.iter().all(|one| one.shoulder == found[0].shoulder), "{found:?}");
            found[0].shoulder
        };
        let found = [shoulder(&three, &hard, &options), shoulder(&three, &hard, &ExposureOptions::default())];
        assert!(found.iter().all(|&found| found < 0.1), "{seed}: {found:?}");
        // Half a shoulder, and 0.9 of one; what is expected of none is a whole.
        let found = [shoulder(&three, &levelled(1.0), &options), shoulder(&three, &levelled(9.0), &options)];
        assert!((found[0] - 0.5).abs() < 0.15 && (found[1] - 0.9).abs() < 0.15, "{seed}: {found:?}");
        let found = shoulder(&of([1.0; PLACES.len()]), &hard, &options);
        assert!(found > 0.9, "{seed}: {found}");
    }
}
