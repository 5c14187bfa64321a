use trueup_core::color::LightRange;
use trueup_core::geometry::Homography;

use super::*;

const WIDTH: usize = 300;
const HEIGHT: usize = 220;

/// Dark on the left and light on the right, over eight stops of light, with detail everywhere.
fn light(x: usize, y: usize) -> f32 {
    let detail = 1.0 + 0.3 * ((x as f32 * 0.9).sin() * (y as f32 * 0.7).cos());
    (8.0 * (x as f32 / WIDTH as f32 - 0.5)).exp2() * 0.2 * detail
}

/// What is recorded of it at this exposure; of things in `box_of_light`, as much light as is said there.
fn taken(exposure: f32, thing: Option<([Range<usize>; 2], f32)>) -> Photograph {
    let mut picture = Raster::new(WIDTH, HEIGHT, 3);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let own = match &thing {
                Some(([columns, rows], thing)) if columns.contains(&x) && rows.contains(&y) => *thing,
                _ => light(x, y),
            };
            for (channel, color) in picture.pixel_mut(x, y).iter_mut().zip([1.0, 0.8, 0.6]) {
                *channel = (255.0 * (exposure * color * own).powf(1.0 / 2.2)).clamp(0.0, 255.0).round() as u8;
            }
        }
    }
    Photograph::Eight(picture)
}

fn member(photograph: Photograph) -> AlignedPhotograph {
    AlignedPhotograph { photograph, reference_from_member: Homography::identity().to_rows() }
}

fn eight(photograph: &Photograph) -> &Raster<u8> {
    match photograph {
        Photograph::Eight(raster) => raster,
        Photograph::Sixteen(_) => panic!("8 bits"),
    }
}

/// Mean and standard deviation of green over a box.
fn green(photograph: &Photograph, columns: Range<usize>, rows: Range<usize>) -> (f64, f64) {
    let raster = eight(photograph);
    let all: Vec<f64> = rows
        .flat_map(|y| columns.clone().map(move |x| (x, y)))
        .map(|(x, y)| f64::from(raster.pixel(x, y)[1]))
        .collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    (mean, (all.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt())
}

#[test]
fn what_one_exposure_loses_another_one_shows() {
    let (reference, dark, bright) = (taken(1.0, None), taken(0.12, None), taken(8.0, None));
    let fused = fuse(&reference, &[member(dark), member(bright)]).expect("fused");
    assert_eq!((fused.width(), fused.height(), fused.channels(), fused.sample_bits()), (WIDTH, HEIGHT, 3, 8));
    // The reference is white on the right; there is as much detail now as in its middle.
    let right = || (250..290, 20..200);
    let (before, after) = (green(&reference, right().0, right().1), green(&fused, right().0, right().1));
    assert!(before.1 < 5.0 && after.1 > 10.0 && after.0 < 245.0, "{before:?} {after:?}");
    let left = || (10..50, 20..200);
    let (before, after) = (green(&reference, left().0, left().1), green(&fused, left().0, left().1));
    assert!(after.0 >= before.0 && after.1 > 1.5 * before.1, "{before:?} {after:?}");
}

/// A thing that only another exposure shows is nowhere in the fused picture, nor is its border; one of the reference is
/// there, and nothing of what the others show in its place.
#[test]
fn what_moved_is_where_the_reference_has_it() {
    let others = |dark, bright| [member(taken(0.12, dark)), member(taken(8.0, bright))];
    let still = fuse(&taken(1.0, None), &others(None, None)).expect("fused");
    let thing = |columns: Range<usize>, light: f32| Some(([columns, 60..150], light));
    let moved = fuse(&taken(1.0, None), &others(thing(100..140, 3.0), thing(170..210, 0.002))).expect("fused");
    for (columns, place) in [(96..144, "dark"), (166..214, "bright")] {
        let worst = (56..154)
            .flat_map(|y| columns.clone().map(move |x| (x, y)))
            .map(|(x, y)| eight(&moved).pixel(x, y)[1].abs_diff(eight(&still).pixel(x, y)[1]))
            .max();
        // The brightness of the unmoved is what the reference expects of it, to the scatter of its own detail.
        assert!(worst.is_some_and(|worst| worst <= 25), "{place}: {worst:?}");
    }
    let own = fuse(&taken(1.0, thing(100..140, 0.2)), &others(None, None)).expect("fused");
    let (_, deviation) = green(&own, 105..135, 65..145);
    assert!(deviation < 3.0, "an even thing stays even: {deviation}");
}

#[test]
fn threads_and_depth_change_nothing() {
    let (reference, other) = (taken(1.0, None), member(taken(0.12, None)));
    let fused = fuse(&reference, std::slice::from_ref(&other)).expect("fused");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    assert_eq!(pool.install(|| fuse(&reference, std::slice::from_ref(&other))).expect("fused"), fused);
    let deep = |photograph: &Photograph| {
        let raster = eight(photograph);
        let data = raster.data().iter().map(|&level| u16::from(level) * 257).collect();
        Photograph::Sixteen(Raster::from_data(raster.width(), raster.height(), 3, data).expect("samples"))
    };
    let other = AlignedPhotograph { photograph: deep(&other.photograph), ..other };
    let Photograph::Sixteen(sixteen) = fuse(&deep(&reference), &[other]).expect("fused") else { panic!("16 bits") };
    let far = |(&deep, &flat): (&u16, &u8)| (f64::from(deep) / 257.0 - f64::from(flat)).abs();
    let worst = sixteen.data().iter().zip(eight(&fused).data()).map(far).fold(0.0, f64::max);
    assert!(worst < 0.6, "{worst}");
}

/// What the member does not reach is as if it had been reached: nothing is seen of its border.
#[test]
fn a_members_border_is_not_seen() {
    let shift = 20;
    let reference = taken(1.0, None);
    let whole = fuse(&reference, &[member(taken(8.0, None))]).expect("fused");
    let mut moved = Raster::new(WIDTH, HEIGHT, 3);
    let bright = taken(8.0, None);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let own: [u8; 3] = std::array::from_fn(|c| eight(&bright).pixel((x + shift).min(WIDTH - 1), y)[c]);
            moved.pixel_mut(x, y).copy_from_slice(&own);
        }
    }
    // Its pixel x shows what the reference has at x + shift.
    let mut map = Homography::identity().to_rows();
    map[0][2] = shift as f64;
    let other = AlignedPhotograph { photograph: Photograph::Eight(moved), reference_from_member: map };
    let fused = fuse(&reference, &[other]).expect("fused");
    let (expected, found) = (green(&whole, 0..40, 20..200), green(&fused, 0..40, 20..200));
    assert!((expected.0 - found.0).abs() < 6.0, "{expected:?} {found:?}");
}

#[test]
fn members_of_other_sizes_and_without_a_place_are_refused() {
    let reference = taken(1.0, None);
    let other = member(Photograph::Eight(Raster::new(WIDTH - 1, HEIGHT, 3)));
    assert!(matches!(fuse(&reference, &[other]), Err(Error::Input { .. })));
    let nowhere = AlignedPhotograph { reference_from_member: [[0.0; 3]; 3], ..member(taken(1.0, None)) };
    assert!(matches!(fuse(&reference, &[nowhere]), Err(Error::Input { .. })));
}

/// The curve by which [`taken`] records light.
fn samples() -> TransferCurve {
    TransferCurve::gamma(2.2).expect("a curve")
}

/// The light that is merged of a reference and others, in units in which white is 1 in the reference.
fn merged_light(reference: &Photograph, others: &[AlignedPhotograph]) -> Raster<f64> {
    let range = LightRange { white: 1.0, peak: 64.0 };
    let curve = TransferCurve::light(range).expect("a range");
    let Photograph::Sixteen(raster) = merge(reference, others, &samples(), &curve).expect("merged") else {
        panic!("16 bits")
    };
    let light = raster.data().iter().map(|&level| range.peak * curve.linear(f64::from(level) / 65535.0)).collect();
    Raster::from_data(raster.width(), raster.height(), raster.channels(), light).expect("samples")
}

/// Largest part by which merged light is off within a box.
fn worst(merged: &Raster<f64>, columns: Range<usize>, rows: Range<usize>, light: impl Fn(usize, usize) -> f32) -> f64 {
    let colors = [1.0, 0.8, 0.6];
    let off = |(x, y): (usize, usize)| {
        let far = |k: usize| (merged.pixel(x, y)[k] / (colors[k] * f64::from(light(x, y))) - 1.0).abs();
        (0..3).map(far).fold(0.0, f64::max)
    };
    rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(off).fold(0.0, f64::max)
}

#[test]
fn light_of_all_exposures_is_that_of_the_scene() {
    let merged = merged_light(&taken(1.0, None), &[member(taken(0.12, None)), member(taken(8.0, None))]);
    // The exposures are not told; eight stops of light, up to four times the reference's white.
    let off = worst(&merged, 0..WIDTH, 0..HEIGHT, light);
    assert!(merged.pixel(WIDTH - 1, 0)[0] > 2.0 && off < 0.03, "{off}");
    // What is white in every exposure is as bright as the darkest says.
    let bright = merged_light(&taken(30.0, None), &[member(taken(8.0, None))]);
    assert!((bright.pixel(WIDTH - 1, 5)[0] / (30.0 / 8.0) - 1.0).abs() < 0.02, "{:?}", bright.pixel(WIDTH - 1, 5));
}

#[test]
fn light_of_what_moved_is_that_of_the_reference() {
    let thing = |columns: Range<usize>, light: f32| Some(([columns, 60..150], light));
    let others = [member(taken(0.12, thing(100..140, 3.0))), member(taken(8.0, thing(170..210, 0.002)))];
    let merged = merged_light(&taken(1.0, None), &others);
    for columns in [96..144, 166..214] {
        let off = worst(&merged, columns.clone(), 56..154, light);
        // One exposure alone, and its noise of rounding.
        assert!(off < 0.08, "{columns:?}: {off}");
    }
    let own = merged_light(&taken(1.0, thing(100..140, 0.2)), &[member(taken(0.12, None)), member(taken(8.0, None))]);
    assert!(worst(&own, 108..132, 68..142, |_, _| 0.2) < 0.03);
}

#[test]
fn merging_wants_a_curve_of_light_and_members_that_fit() {
    let reference = taken(1.0, None);
    let light = TransferCurve::light(LightRange { white: 1.0, peak: 8.0 }).expect("a range");
    let other = [member(Photograph::Eight(Raster::new(WIDTH - 1, HEIGHT, 3)))];
    assert!(matches!(merge(&reference, &other, &samples(), &light), Err(Error::Input { .. })));
    assert!(matches!(merge(&reference, &[], &samples(), &samples()), Err(Error::Input { .. })));
    // An exposure of which nothing can be compared tells nothing.
    let black = [member(Photograph::Eight(Raster::new(WIDTH, HEIGHT, 3)))];
    let alone = merge(&reference, &[], &samples(), &light).expect("merged");
    assert_eq!(merge(&reference, &black, &samples(), &light).expect("merged"), alone);
}
