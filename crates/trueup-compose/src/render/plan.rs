//! What composing may take, and how it divides that. The division decides what is held, kept or read again, never what
//! comes out.

use std::sync::Arc;

use trueup_core::memory::bytes_in_words;
use trueup_core::scratch::{NoScratch, ScratchFile, ScratchSpace};
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result};

use super::store::{Blocks, Pixel, Store};
use super::{Blend, RenderOptions};
use crate::blend;
use crate::layout::{CanvasLayout, Placed};
use crate::seam::SeamOptions;

/// What composing may take.
#[derive(Clone, Copy)]
pub struct Resources<'a> {
    /// Bytes of memory for the photographs, the canvas and all that is made on the way.
    pub memory: usize,
    /// Bytes that may be taken where `memory` is too little to compose at all; `memory` itself if that is the user's word.
    pub ceiling: usize,
    /// Where the canvas goes if it does not fit.
    pub scratch: &'a dyn ScratchSpace,
}

impl std::fmt::Debug for Resources<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { memory, ceiling, .. } = self;
        formatter.debug_struct("Resources").field("memory", memory).field("ceiling", ceiling).finish_non_exhaustive()
    }
}

impl Resources<'static> {
    /// Everything is held in memory, however much that is.
    pub fn unlimited() -> Self {
        Self { memory: usize::MAX, ceiling: usize::MAX, scratch: &NoScratch }
    }
}

/// The division.
#[derive(Debug)]
pub(crate) struct Plan {
    /// Where the canvas is to be kept, if not in memory.
    file: Option<Arc<dyn ScratchFile>>,
    /// Where coarse levels of the photographs are to be kept, if not in memory: the rest of the file from here on.
    pub(crate) bases: Option<(Arc<dyn ScratchFile>, u64)>,
    /// Bytes of decoded photographs that may be held beside those that are being decoded.
    pub(crate) photographs: usize,
    /// Photographs decoded at once.
    pub(crate) at_a_time: usize,
    /// Bytes of the canvas that may be summed up at once, where photographs are averaged.
    sums: usize,
}

/// Bytes of a pixel of the canvas: square roots of light.
const ROOT_BYTES: usize = size_of::<blend::Finished>();

/// Bytes of a pixel of the canvas: sums.
const SUM_BYTES: usize = size_of::<[f32; 4]>();

/// Bytes of a pixel of a photograph that was not decoded yet: 8 bits, four channels.
const UNKNOWN_PIXEL_BYTES: usize = 4;

/// A photograph on its way into memory takes this many times its size: what the decoder holds beside its pixels, its copy
/// when it is turned upright, and its reduced copies.
const DECODING: usize = 2;

/// Where photographs meet, so many are wanted at once: the four at the corners of a grid.
const MEETING: usize = 4;

impl Plan {
    /// Divides `resources` for one canvas; opens the scratch file if there is to be one.
    ///
    /// # Errors
    /// [`Error::Limits`] with the numbers if there is too little memory or too little room on the disk.
    pub(crate) fn new(
        layout: &CanvasLayout,
        source: &dyn PhotographSource,
        options: &RenderOptions,
        seams: &SeamOptions,
        resources: &Resources<'_>,
    ) -> Result<Self> {
        let bytes: Vec<usize> = layout.placed.iter().map(|placed| photograph_bytes(placed, source)).collect();
        let needs = Needs::new(layout, &bytes, options, seams)?;
        let least = needs.least();
        if least > resources.ceiling {
            return Err(needs.refusal(layout, resources.ceiling));
        }
        let memory = resources.memory.max(least);
        // Half of what is left may be canvas.
        let left = memory - least;
        let in_memory = needs.canvas <= left / 2;
        let left = left - if in_memory { needs.canvas } else { 0 };
        // The photographs' own coarse levels are smaller than the photographs, which are to be had again, too.
        let hold_bases = needs.bases <= left / 4;
        let left = left - if hold_bases { needs.bases } else { 0 };
        let threads = rayon::current_num_threads().max(1);
        let one = DECODING * needs.largest;
        // A quarter of the rest for further photographs at once; the first is counted in what is needed at least.
        let more = (left / 4).checked_div(one).unwrap_or(threads).min(threads - 1);
        let left = left - more * one;
        let sums = if in_memory { usize::MAX } else { (needs.band + left) / 2 };
        let canvas_bytes = (layout.width as u64 * layout.height as u64) * needs.pixel_bytes as u64;
        let on_disk = if in_memory { 0 } else { canvas_bytes };
        let total = on_disk + if hold_bases { 0 } else { needs.bases as u64 };
        let file: Option<Arc<dyn ScratchFile>> =
            if total > 0 { Some(Arc::from(resources.scratch.create(total)?)) } else { None };
        Ok(Self {
            bases: if hold_bases { None } else { file.clone().map(|file| (file, on_disk)) },
            file: file.filter(|_| !in_memory),
            photographs: needs.meeting.saturating_add(left),
            at_a_time: 1 + more,
            sums,
        })
    }

    /// Zeros, in blocks of `side` if in a file.
    pub(crate) fn store<P: Pixel>(&self, size: [usize; 2], side: [usize; 2]) -> Store<P> {
        match &self.file {
            None => Store::in_memory(size),
            Some(file) => Store::Scratch(Blocks::new(file.clone(), 0, size, side)),
        }
    }

    /// Rows of a canvas of `width` columns that may be summed up at once, a multiple of `step`.
    pub(crate) fn sum_rows(&self, width: usize, step: usize) -> usize {
        (self.sums / (width * SUM_BYTES).max(1) / step).max(1).saturating_mul(step)
    }

    /// Whether the canvas is in a file.
    pub(crate) fn on_disk(&self) -> bool {
        self.file.is_some()
    }
}

fn photograph_bytes(placed: &Placed, source: &dyn PhotographSource) -> usize {
    // The cast saturates.
    let pixels = (placed.mesh.width * placed.mesh.height) as usize;
    source.bytes(placed.photograph).unwrap_or(pixels.saturating_mul(UNKNOWN_PIXEL_BYTES))
}

/// Bytes that composing takes.
#[derive(Debug)]
struct Needs {
    /// Of the whole canvas.
    canvas: usize,
    pixel_bytes: usize,
    /// Small pictures, search of the seams, coarse levels, tiles: whichever of them takes the most.
    working: usize,
    /// The photographs' own coarse levels.
    bases: usize,
    /// Of the largest photograph.
    largest: usize,
    /// Of the largest photographs, as many as may meet.
    meeting: usize,
    /// Of the rows of the canvas that are summed up at once, at least.
    band: usize,
}

impl Needs {
    fn new(layout: &CanvasLayout, bytes: &[usize], options: &RenderOptions, seams: &SeamOptions) -> Result<Self> {
        let canvas = [layout.width, layout.height];
        let pixels = layout.width.saturating_mul(layout.height);
        let mut sorted = bytes.to_vec();
        sorted.sort_unstable_by(|a, b| b.cmp(a));
        let largest = sorted.first().copied().unwrap_or(0);
        let seamed = matches!(options.blend, Blend::MultiBand | Blend::None) && !layout.placed.is_empty();
        let (working, bases) = if seamed { blend::needed_bytes(layout, options, seams)? } else { (0, 0) };
        let pixel_bytes = if seamed { ROOT_BYTES } else { SUM_BYTES };
        let band = if seamed { 0 } else { canvas[0] * super::BAND_ROWS * SUM_BYTES };
        let meeting = sorted.iter().take(MEETING).sum();
        Ok(Self { canvas: pixels.saturating_mul(pixel_bytes), pixel_bytes, working, bases, largest, meeting, band })
    }

    /// With the canvas and the photographs' own levels on disk, and one photograph decoded at a time.
    fn least(&self) -> usize {
        [self.working, self.band, self.meeting, DECODING * self.largest]
            .iter()
            .fold(0, |sum, &one| sum.saturating_add(one))
    }

    fn refusal(&self, layout: &CanvasLayout, allowed: usize) -> Error {
        let photographs = self.meeting.saturating_add(DECODING * self.largest);
        let words = |bytes: usize| bytes_in_words(bytes as u64);
        Error::Limits {
            subject: format!("composing {} x {} px", layout.width, layout.height),
            needed: format!(
                "at least {} of memory ({} for photographs of up to {}, {} for seams and blending)",
                words(self.least()),
                words(photographs),
                words(self.largest),
                words(self.least() - photographs)
            ),
            allowed: words(allowed),
            hint: "Raise --memory (stitch.memory) by the difference, or make a smaller panorama (--scale).".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::mesh::GridMesh;

    use super::*;
    use crate::render::test_pictures::{Memory, RamDisk};

    fn layout(count: usize) -> CanvasLayout {
        let placed = (0..count)
            .map(|photograph| {
                let mut mesh = GridMesh::regular(4000.0, 3000.0, 400.0);
                mesh.target.iter_mut().for_each(|vertex| vertex[0] += 2000.0 * photograph as f64);
                Placed { photograph, mesh }
            })
            .collect();
        let width = 2000 * (count + 1);
        CanvasLayout { width, height: 3000, canvas_from_target: 1.0, origin: [0.0; 2], placed, period: None }
    }

    fn plan(memory: usize, ceiling: usize, blend: Blend) -> Result<Plan> {
        let disk = RamDisk::default();
        let resources = Resources { memory, ceiling, scratch: &disk };
        let options = RenderOptions { blend, ..RenderOptions::default() };
        Plan::new(&layout(20), &Memory(Vec::new()), &options, &SeamOptions::default(), &resources)
    }

    #[test]
    fn with_enough_memory_nothing_goes_to_disk_and_with_little_most_does() {
        for blend in [Blend::MultiBand, Blend::None, Blend::Feather] {
            let all = plan(usize::MAX, usize::MAX, blend).expect("everything fits");
            assert!(!all.on_disk() && all.bases.is_none() && all.at_a_time == rayon::current_num_threads());
            assert!(all.sum_rows(42_000, 16) >= 3000);
            let little = plan(1, usize::MAX, blend).expect("the least is taken");
            assert!(little.on_disk() && little.at_a_time == 1, "{blend:?}");
            // Four of 48 MB.
            assert_eq!(little.photographs, 4 * 4000 * 3000 * 4);
        }
    }

    #[test]
    fn the_number_in_a_refusal_is_enough() {
        for blend in [Blend::MultiBand, Blend::None, Blend::Feather, Blend::Average] {
            let refused = plan(1000, 1000, blend).expect_err("a thousand bytes").to_string();
            assert!(refused.contains("composing 42000 x 3000 px: at least "), "{refused}");
            let layout = layout(20);
            let bytes = vec![48_000_000; 20];
            let options = RenderOptions { blend, ..RenderOptions::default() };
            let needs = Needs::new(&layout, &bytes, &options, &SeamOptions::default());
            let least = needs.expect("few photographs").least();
            assert!(refused.contains(&bytes_in_words(least as u64)), "{refused}");
            assert!(plan(least, least, blend).is_ok() && plan(least, least - 1, blend).is_err());
        }
    }
}
