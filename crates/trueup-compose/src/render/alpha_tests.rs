//! Photographs with an alpha channel.

use trueup_core::raster::{Photograph, Raster};

use super::test_rendering::{linear, render};
use super::*;
use crate::coverage::Coverage;
use crate::crop::Crop;
use crate::layout::CanvasOptions;
use crate::light::Corrections;
use crate::test_photographs::{Memory, canvas, moved};

/// Pixels along each side of a photograph.
const SIDE: usize = 200;

/// A gray photograph with so much alpha at its pixels.
fn photograph(alpha: impl Fn(usize, usize) -> u8) -> Photograph {
    let samples = (0..SIDE * SIDE).flat_map(|at| [120, 120, 120, alpha(at % SIDE, at / SIDE)]).collect();
    Photograph::Eight(Raster::from_data(SIDE, SIDE, 4, samples).expect("as many samples"))
}

/// Two photographs beside each other; the second one begins `left` columns after the first.
fn side_by_side(left: usize) -> CanvasLayout {
    let placed = [0, left].map(|left| moved(left.min(1), SIDE as f64, SIDE as f64, |p| [p.x + left as f64, p.y]));
    canvas(left + SIDE, SIDE, placed.into())
}

/// A wedge is transparent in both photographs, from 60 rows at the left end of the canvas to none at the right one.
/// Their grids cover it.
#[test]
fn what_is_transparent_is_not_covered() {
    let layout = side_by_side(150);
    let edge = |x: usize| 60 - 60 * x / layout.width;
    let wedge = |left: usize| photograph(move |x, y| if y < edge(x + left) { 0 } else { u8::MAX });
    let transparent = Memory(vec![wedge(0), wedge(150)]);
    let opaque = Memory([0, 1].map(|_| crate::test_photographs::gradient(SIDE, SIDE, |_, _| 120.0)).into());
    let corrections = Corrections::plain(2);
    let covered = Coverage::of(&layout);
    let canvas_options = CanvasOptions { crop: Crop::Rectangle, ..CanvasOptions::default() };
    let framing = Framing { coverage: &covered, options: &canvas_options, known: None, check: None };
    let (seams, context) = (SeamOptions::default(), StageContext::default());
    for blend in [Blend::MultiBand, Blend::None, Blend::Feather, Blend::Average] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let rendered = |photographs: &Memory| {
            let input = RenderInput { layout: &layout, corrections: &corrections, photographs };
            run(&input, &Resources::unlimited(), &options, &seams, Some(&framing), &context).expect("renders")
        };
        let plain = rendered(&opaque);
        assert!(!plain.has_alpha && plain.frame.is_some() == blend.has_seams(), "{blend:?}");
        let Rendered { panorama, frame, has_alpha, .. } = rendered(&transparent);
        assert_eq!((has_alpha, frame), (true, None), "{blend:?}");
        let seen = panorama.opaque_part(&covered).expect("in memory");
        for x in (0..layout.width).step_by(7) {
            // But for the pixels along the edge, which are seen through in part.
            assert!((0..edge(x).saturating_sub(2)).all(|y| !seen.holds(x, y)), "{blend:?} column {x}");
            assert!((edge(x) + 3..SIDE).all(|y| seen.holds(x, y)), "{blend:?} column {x}");
        }
        let framing = Framing { coverage: &seen, ..framing };
        let Frame::Part(kept) = framing.of_panorama(&panorama, &layout).expect("in memory") else {
            panic!("{blend:?}: not cropped")
        };
        assert!(kept.area() > 300 * 140 && seen.area_within(&kept) == kept.area(), "{blend:?}: {kept:?}");
        for y in kept.rows.clone() {
            let through = kept.columns.clone().find(|&x| linear(&panorama, x, y)[3] < 0.999);
            assert_eq!(through, None, "{blend:?} row {y}");
        }
    }
}

/// Photographs of which all is half transparent: where one is alone, so is the panorama; where two lie over each other,
/// nothing shows through, whichever of them is seen.
#[test]
fn what_is_half_transparent_is_as_opaque_as_all_that_show_it() {
    const HALF: u8 = 128;
    let half = f32::from(HALF) / f32::from(u8::MAX);
    let layout = side_by_side(160);
    for blend in [Blend::None, Blend::MultiBand, Blend::Feather, Blend::Average] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let panorama = render(&layout, [0, 1].map(|_| photograph(|_, _| HALF)).into(), &options);
        for (x, expected) in [(30, half), (150, half), (165, 1.0), (180, 1.0), (195, 1.0), (210, half), (330, half)] {
            let [red, _, _, alpha] = linear(&panorama, x, 100);
            assert!((alpha - expected).abs() < 2e-3, "{blend:?} column {x}: {alpha} for {expected}");
            assert!((red - 0.188).abs() < 2e-3, "{blend:?} column {x}: {red}");
        }
    }
}
