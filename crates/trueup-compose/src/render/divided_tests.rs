//! Rendering that is divided, by helpers that take everything in the wrong order and hand it over as bytes.

use std::ops::Range;
use std::sync::Mutex;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::test_rendering::bits;
use super::within_tests::scene;
use super::*;
use crate::coverage::Coverage;
use crate::crop::{BorderDeviations, Crop};
use crate::layout::{CanvasLayout, CanvasOptions};
use crate::light::Corrections;
use crate::pyramid::PyramidPlane;
use crate::small_views::{CoarseLevel, MadeSmall, SmallView};
use crate::test_photographs::RamDisk;

/// How helpers fail.
#[derive(Debug, Clone, Copy)]
enum Fault {
    Never,
    /// One photograph, or region, is handed over twice.
    Twice,
    /// The last is forgotten.
    Forgotten,
    /// Tiles of another region come for the first.
    Exchanged,
    /// Photographs that were made small are no such.
    Damaged(Damage),
}

/// What is done to a photograph that was made small.
type Damage = fn(&mut Made);

/// [`MadeSmall`], as it is written.
#[derive(Serialize, Deserialize)]
struct Made {
    view: SmallView,
    coarse_levels: Vec<CoarseLevel>,
    border: BorderDeviations,
    bytes: usize,
    has_alpha: bool,
}

/// Helpers in this program.
struct Here<'a> {
    input: RenderInput<'a>,
    options: &'a RenderOptions,
    fault: Fault,
    regions: Mutex<usize>,
}

fn handed_over<T: Serialize + DeserializeOwned>(value: &T) -> T {
    taken_for(value)
}

/// What is written of one thing, read as another.
fn taken_for<T: DeserializeOwned>(value: &impl Serialize) -> T {
    rmp_serde::from_slice(&rmp_serde::to_vec_named(value).expect("written")).expect("read")
}

impl RenderHelpers for Here<'_> {
    fn make_small(&self, work: &SmallWork, positions: &[usize], take: TakeSmall<'_>) -> Result<()> {
        let skipped = usize::from(matches!(self.fault, Fault::Forgotten));
        for position in positions.iter().rev().skip(skipped) {
            let mut made = |position, one: MadeSmall| {
                match self.fault {
                    Fault::Twice => take(position, handed_over(&one))?,
                    Fault::Damaged(damage) => {
                        let mut made: Made = taken_for(&one);
                        damage(&mut made);
                        return take(position, taken_for(&made));
                    }
                    Fault::Never | Fault::Forgotten | Fault::Exchanged => {}
                }
                take(position, handed_over(&one))
            };
            let (work, context) = (handed_over(work), StageContext::default());
            make_small(&self.input, &Resources::unlimited(), self.options, &work, &[*position], &context, &mut made)?;
        }
        Ok(())
    }

    fn finish(&self, work: &RegionWork, count: usize, region: RegionOf<'_>, take: TakeRegion<'_>) -> Result<()> {
        *self.regions.lock().expect("no test failed") = count;
        for number in (0..count).rev() {
            let (work, context) = (handed_over(work), StageContext::default());
            let resources = Resources::unlimited();
            let asked = if matches!(self.fault, Fault::Exchanged) { (number + 1) % count } else { number };
            let region = handed_over(&region(asked)?);
            let finished = finish_region(&self.input, &resources, self.options, &work, region, &context)?;
            take(number, handed_over(&finished))?;
        }
        Ok(())
    }
}

/// The panorama by itself, and by helpers, within so much memory.
fn both(
    layout: &CanvasLayout,
    options: &RenderOptions,
    fault: Fault,
    memory: usize,
    crop: Crop,
) -> Result<([Rendered; 2], usize)> {
    let (_, corrections, photographs) = scene();
    let (seams, context) = (SeamOptions::default(), StageContext::default());
    let input = RenderInput { layout, corrections: &corrections, photographs: &photographs };
    let coverage = Coverage::of(layout);
    let canvas = CanvasOptions { crop, ..CanvasOptions::default() };
    let framing = Framing { coverage: &coverage, options: &canvas, known: None, check: None };
    let helpers = Here { input, options, fault, regions: Mutex::default() };
    let rendered = |helpers: Option<&dyn RenderHelpers>| {
        let resources = Resources { memory, ceiling: usize::MAX, scratch: &RamDisk::default(), helpers };
        run(&input, &resources, options, &seams, Some(&framing), &context)
    };
    let pair = [rendered(None)?, rendered(Some(&helpers))?];
    let regions = *helpers.regions.lock().expect("no test failed");
    Ok((pair, regions))
}

#[test]
fn what_helpers_did_is_the_same_to_the_last_bit() {
    let (plane, ..) = scene();
    // Around: what lies beyond the right end lies before the left one as well.
    let around = CanvasLayout { width: 1536, period: Some(1536), ..plane.clone() };
    for (name, layout) in [("plane", &plane), ("around", &around)] {
        for blend in [Blend::MultiBand, Blend::None, Blend::Feather] {
            for memory in [usize::MAX, 1] {
                let options = RenderOptions { blend, ..RenderOptions::default() };
                let divided = both(layout, &options, Fault::Never, memory, Crop::Auto);
                let ([alone, divided], regions) = divided.expect("rendered");
                assert!(bits(&alone.panorama) == bits(&divided.panorama), "{name} {blend:?} {memory}");
                assert_eq!((alone.seams, alone.frame), (divided.seams, divided.frame), "{name} {blend:?}");
                assert_eq!(regions > 1, blend.has_seams(), "{name} {blend:?}: {regions}");
            }
        }
    }
}

#[test]
fn helpers_that_mix_things_up_are_told() {
    let (layout, ..) = scene();
    for fault in [Fault::Twice, Fault::Forgotten, Fault::Exchanged] {
        let refused = both(&layout, &RenderOptions::default(), fault, usize::MAX, Crop::None).map(drop);
        let message = refused.expect_err("a fault").to_string();
        assert!(message.contains("does not belong to this panorama"), "{fault:?}: {message}");
    }
}

#[test]
fn damaged_photographs_are_told() {
    let (plane, ..) = scene();
    let around = CanvasLayout { width: 1536, period: Some(1536), ..plane.clone() };
    let damages: [Damage; 10] = [
        |made| made.view.pixels.truncate(9),
        |made| made.view.columns = move_by_9000(&made.view.columns),
        |made| made.view.rows = move_by_9000(&made.view.rows),
        |made| made.view = SmallView { columns: 0..0, rows: 0..usize::MAX, pixels: Vec::new() },
        |made| made.view = SmallView { columns: 0..2, rows: 0..usize::MAX / 2 + 1, pixels: Vec::new() },
        |made| made.coarse_levels.truncate(0),
        |made| made.coarse_levels[0].plane.columns = move_by_9000(&made.coarse_levels[0].plane.columns),
        |made| made.coarse_levels[0].plane.rows = move_by_9000(&made.coarse_levels[0].plane.rows),
        |made| made.coarse_levels[0].plane = PyramidPlane { columns: 9..usize::MAX, ..PyramidPlane::default() },
        |made| made.bytes = usize::MAX,
    ];
    for (number, damage) in damages.into_iter().enumerate() {
        for layout in [&plane, &around] {
            let refused = both(layout, &RenderOptions::default(), Fault::Damaged(damage), usize::MAX, Crop::None);
            let message = refused.map(drop).expect_err("a fault").to_string();
            assert!(message.contains("does not belong to this panorama"), "{number}: {message}");
        }
    }
}

fn move_by_9000(range: &Range<usize>) -> Range<usize> {
    range.start + 9000..range.end + 9000
}

#[test]
fn work_of_another_panorama_is_refused() {
    let (layout, corrections, photographs) = scene();
    let options = RenderOptions::default();
    let input = RenderInput { layout: &layout, corrections: &corrections, photographs: &photographs };
    let context = StageContext::default();
    let resources = Resources::unlimited();
    let seams = Seams::of_one(10, 10);
    let work = RegionWork { seams, blended: None, bytes: vec![0; layout.placed.len()] };
    let region = Region { parts: vec![Rectangle::whole([layout.width, layout.height])], own: Vec::new() };
    let refused = finish_region(&input, &resources, &options, &work, region, &context).expect_err("other seams");
    assert!(refused.to_string().contains("does not belong to this panorama"), "{refused}");
    let none = Corrections::plain(1);
    let fewer = RenderInput { corrections: &none, ..input };
    let work = SmallWork { border: None };
    assert!(make_small(&fewer, &resources, &options, &work, &[0], &context, &mut |_, _| Ok(())).is_err());
    assert!(make_small(&input, &resources, &options, &work, &[99], &context, &mut |_, _| Ok(())).is_err());
}
