//! What of a canvas is composed where a part of it is kept.

use trueup_core::raster::{Photograph, RowSource};

use super::within_tests::scene;
use super::*;
use crate::coverage::Coverage;
use crate::crop::{Crop, SizeCheck};
use crate::layout::CanvasOptions;
use crate::light::Corrections;
use crate::test_photographs::{Memory, RamDisk, canvas, gradient, moved, noise};

/// What is rendered with a framing, and without.
fn framed_and_whole(
    input: &RenderInput<'_>,
    options: &CanvasOptions,
    known: Option<&Frame>,
    memory: usize,
) -> [Rendered; 2] {
    let coverage = Coverage::of(input.layout);
    let framing = Framing { coverage: &coverage, options, known, check: None };
    let (look, seams, context) = (RenderOptions::default(), SeamOptions::default(), StageContext::default());
    [Some(&framing), None].map(|framing| {
        let resources = Resources { memory, ceiling: usize::MAX, scratch: &RamDisk::default(), helpers: None };
        run(input, &resources, &look, &seams, framing, &context).expect("room for all of it")
    })
}

/// All samples of what is kept of a canvas, its gaps filled.
fn kept_samples(mut panorama: Panorama, layout: &CanvasLayout, options: &CanvasOptions, kept: &Rectangle) -> Vec<u16> {
    let coverage = Coverage::of(layout);
    let framing = Framing { coverage: &coverage, options, known: None, check: None };
    if let Some(gaps) = framing.gaps(layout, kept) {
        assert!(panorama.fill(&gaps, &StageContext::default()).expect("room") > 0);
    }
    panorama.crop(kept).expect("a part of the canvas");
    let mut samples = vec![0; panorama.width() * panorama.height() * 4];
    for (y, row) in samples.chunks_exact_mut(panorama.width() * 4).enumerate() {
        panorama.rgba16_row(y, row).expect("rows that were composed");
    }
    samples
}

#[test]
fn what_is_kept_is_the_same_and_the_rest_is_left_empty() {
    let (layout, corrections, photographs) = scene();
    let input = RenderInput { layout: &layout, corrections: &corrections, photographs: &photographs };
    let corner = Rectangle { columns: 40..500, rows: 60..180 };
    let known_corner = Frame::Part(corner.clone());
    for memory in [usize::MAX, 1] {
        for (crop, known) in [(Crop::Rectangle, None), (Crop::Auto, None), (Crop::Auto, Some(&known_corner))] {
            let options = CanvasOptions { crop, ..CanvasOptions::default() };
            let [framed, whole] = framed_and_whole(&input, &options, known, memory);
            let Some(Frame::Part(kept)) = framed.frame.clone() else { panic!("{crop:?}: {:?}", framed.frame) };
            assert_eq!(whole.frame, None);
            assert_eq!(framed.seams, whole.seams);
            if known.is_some() {
                assert_eq!(kept, corner);
                // Tiles of 128 pixels up to column 512 and row 256.
                let at = |panorama: &Panorama, x, y| panorama.linear_pixel(x, y).expect("a pixel");
                assert_eq!((at(&framed.panorama, 600, 100), at(&framed.panorama, 300, 300)), ([0.0; 4], [0.0; 4]));
                assert!(at(&whole.panorama, 600, 100)[3] == 1.0 && at(&whole.panorama, 300, 300)[3] == 1.0);
                // Nothing can be read amiss beyond the last tile that was finished.
                assert_eq!(at(&framed.panorama, 1669, 459), [0.0; 4]);
            }
            let [framed, whole] = [framed, whole].map(|one| kept_samples(one.panorama, &layout, &options, &kept));
            assert!(framed == whole, "{crop:?}, {memory}");
        }
    }
}

/// Three photographs of different exposure beside each other, of which each lies lower than the one before: a smooth
/// sky above rough ground. The corners in the sky may be filled, those in the ground may not.
#[test]
fn the_frame_is_chosen_as_it_would_be_by_the_panorama() {
    let ground = noise(600, 400, 1);
    let level = |exposure: f64| {
        let ground = &ground;
        move |x: f64, y: f64| {
            let rough = f64::from(ground.row(y as usize)[x as usize]) * 0.5;
            exposure * if y < 200.0 { 150.0 + 0.1 * y } else { 60.0 + rough }
        }
    };
    let photographs: Vec<Photograph> =
        [1.0, 1.12, 0.92].map(|exposure| gradient(600, 400, level(exposure))).into_iter().collect();
    let placed = (0..3).map(|i| moved(i, 600.0, 400.0, move |p| [p.x + 420.0 * i as f64, p.y + 16.0 * i as f64]));
    let layout = canvas(1440, 432, placed.collect());
    let photographs = Memory(photographs);
    let corrections = Corrections::plain(3);
    let input = RenderInput { layout: &layout, corrections: &corrections, photographs: &photographs };
    let options = CanvasOptions::default();
    let [framed, whole] = framed_and_whole(&input, &options, None, usize::MAX);
    let coverage = Coverage::of(&layout);
    let framing = Framing { coverage: &coverage, options: &options, known: None, check: None };
    let expected = framing.of_panorama(&whole.panorama, &layout).expect("in memory");
    assert_eq!(framed.frame.as_ref(), Some(&expected));
    let Frame::Part(kept) = expected else { panic!("{expected:?}") };
    // Above row 16 two thirds of the sky would be filled, which is not worth it; the row of cells beside it, smooth all
    // along, comes in addition.
    assert_eq!(kept, Rectangle { columns: 0..1440, rows: 12..400 });
    let [framed, whole] = [framed, whole].map(|one| kept_samples(one.panorama, &layout, &options, &kept));
    assert!(framed == whole);
}

/// What refuses every size, and notes it.
#[derive(Debug, Default)]
struct Refusal(std::cell::Cell<Option<[usize; 2]>>);

impl SizeCheck for Refusal {
    fn check(&self, size: [usize; 2]) -> Result<()> {
        self.0.set(Some(size));
        Err(trueup_core::Error::input("pano.webp", "it is too large", "Make it smaller."))
    }
}

/// Of a canvas that is cropped, the size of what is kept counts.
#[test]
fn a_size_that_is_not_accepted_is_refused_before_it_is_composed() {
    let (layout, corrections, photographs) = scene();
    let input = RenderInput { layout: &layout, corrections: &corrections, photographs: &photographs };
    for crop in [Crop::Rectangle, Crop::Auto] {
        let options = CanvasOptions { crop, ..CanvasOptions::default() };
        let [framed, _] = framed_and_whole(&input, &options, None, usize::MAX);
        let kept = framed.frame.expect("a frame").part_of([layout.width, layout.height]).size();
        let coverage = Coverage::of(&layout);
        let refusal = Refusal::default();
        let framing = Framing { coverage: &coverage, options: &options, known: None, check: Some(&refusal) };
        let (look, seams, context) = (RenderOptions::default(), SeamOptions::default(), StageContext::default());
        let disk = RamDisk::default();
        let resources = Resources { memory: usize::MAX, ceiling: usize::MAX, scratch: &disk, helpers: None };
        let refused = run(&input, &resources, &look, &seams, Some(&framing), &context).expect_err("too large");
        assert!(refused.to_string().contains("too large"), "{refused}");
        assert_eq!(refusal.0.get(), Some(kept), "{crop:?}");
    }
}
