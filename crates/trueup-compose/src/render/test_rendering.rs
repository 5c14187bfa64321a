//! What the tests of rendering share: panoramas without a limit on memory, and readings of them.

use trueup_core::raster::{Photograph, RowSource};

use super::panorama::PanoramaPixels;
use super::*;
use crate::light::Corrections;
use crate::test_photographs::Memory;

pub(crate) fn render(layout: &CanvasLayout, photographs: Vec<Photograph>, options: &RenderOptions) -> Panorama {
    let corrections = Corrections::plain(layout.placed.len());
    compose(layout, &corrections, &Memory(photographs), options, &StageContext::default()).expect("renders")
}

pub(crate) fn compose(
    layout: &CanvasLayout,
    corrections: &Corrections,
    photographs: &Memory,
    options: &RenderOptions,
    context: &StageContext,
) -> Result<Panorama> {
    let input = RenderInput { layout, corrections, photographs };
    let rendered = run(&input, &Resources::unlimited(), options, &SeamOptions::default(), None, context)?;
    Ok(rendered.panorama)
}

pub(super) fn linear(panorama: &Panorama, x: usize, y: usize) -> [f32; 4] {
    panorama.linear_pixel(x, y).expect("pixels in memory")
}

/// Everything a panorama holds, exactly.
pub(super) fn bits(panorama: &Panorama) -> Vec<[u32; 4]> {
    (0..panorama.height())
        .flat_map(|y| match &panorama.pixels {
            PanoramaPixels::Sums(sums) => {
                sums.row(y).expect("a row").iter().map(|sum| sum.map(f32::to_bits)).collect::<Vec<_>>()
            }
            PanoramaPixels::Roots(roots) => {
                roots.row(y).expect("a row").iter().map(|root| root.map(u32::from)).collect()
            }
        })
        .collect()
}

pub(super) fn rows(panorama: &Panorama) -> Vec<u8> {
    let mut bytes = vec![0; panorama.width() * panorama.height() * 4];
    for (y, row) in bytes.chunks_exact_mut(panorama.width() * 4).enumerate() {
        panorama.rgba8_row(y, row).expect("rows in memory");
    }
    bytes
}

/// All pixels of a panorama that was composed along seams, in memory.
pub(crate) fn roots(panorama: &Panorama) -> Vec<RootPixel> {
    let PanoramaPixels::Roots(PixelStore::Memory { pixels, .. }) = &panorama.pixels else {
        panic!("composed along seams, in memory")
    };
    pixels.clone()
}
