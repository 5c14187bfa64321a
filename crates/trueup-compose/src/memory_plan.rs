//! What composing may take, and how it divides that. The division decides what is held, kept or read again, never what
//! comes out.

use std::sync::Arc;

use trueup_core::memory::{check_room, needed_in_words, room_in_words};
use trueup_core::scratch::{ScratchFile, ScratchSpace};
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result};

use crate::layout::{CanvasLayout, Placed};
use crate::store::{CanvasBlocks, Pixel, PixelStore, SumPixel};

/// What composing may take.
#[derive(Clone, Copy)]
pub(crate) struct Allowed<'a> {
    /// Bytes of memory for the photographs, the canvas and all that is made on the way.
    pub(crate) memory: usize,
    /// Bytes that may be taken where `memory` is too little to compose at all.
    pub(crate) ceiling: usize,
    /// Where the canvas goes if it does not fit.
    pub(crate) scratch: &'a dyn ScratchSpace,
}

/// Where something begins that goes to the scratch file.
#[derive(Debug, Clone)]
pub(crate) struct SpillPlace {
    pub(crate) file: Arc<dyn ScratchFile>,
    /// Bytes of the file before it.
    pub(crate) offset: u64,
}

/// The division.
#[derive(Debug)]
pub(crate) struct MemoryPlan {
    /// Where the canvas is to be kept, if not in memory.
    file: Option<Arc<dyn ScratchFile>>,
    /// Where coarse levels of the photographs are to be kept, if not in memory: the rest of the file from there on.
    pub(crate) coarse_levels: Option<SpillPlace>,
    /// Bytes of decoded photographs that may be held beside those that are being decoded.
    pub(crate) photographs: usize,
    /// The same where one place shows so many that fewer will not do.
    pub(crate) most_photographs: usize,
    /// Whether of a photograph only those rows are held that what is worked at shows. It is decoded again for others.
    pub(crate) in_parts: bool,
    /// Bytes of decoded photographs that may be kept from when they are made small until the canvas is finished.
    pub(crate) kept: usize,
    /// Photographs decoded at once.
    pub(crate) at_a_time: usize,
    /// Photographs whose coarse levels are blended at once.
    pub(crate) levels_at_a_time: usize,
    /// Bytes of the canvas that may be summed up at once, where photographs are averaged.
    sums: usize,
}

/// Bytes of a pixel of a photograph that was not decoded yet: 8 bits, four channels.
const UNKNOWN_PIXEL_BYTES: usize = 4;

/// A photograph on its way into memory takes this many times its size: what the decoder holds beside its pixels, its
/// copy when it is turned upright, and its reduced copies.
const DECODING: usize = 2;

/// So many photographs are wanted at once at one place: the four at the corners of a grid.
const AT_ONE_PLACE: usize = 4;

impl MemoryPlan {
    /// Divides what is `allowed` for one canvas; opens the scratch file if there is to be one.
    ///
    /// # Errors
    /// [`Error::Limits`] with the numbers if there is too little memory or too little room on the disk.
    pub(crate) fn new(needs: &MemoryNeeds, allowed: &Allowed<'_>) -> Result<Self> {
        // Whole photographs are held where that is allowed at all: of parts, most are decoded several times.
        let parts = needs.in_parts.filter(|_| needs.least_whole() > allowed.ceiling);
        let least = if parts.is_some() { needs.least() } else { needs.least_whole() };
        if least > allowed.ceiling {
            return Err(needs.refusal(allowed.ceiling));
        }
        let work = &needs.work;
        let memory = allowed.memory.max(least);
        // Half of what is left may be canvas.
        let left = memory - least;
        let in_memory = needs.canvas() <= left / 2;
        if in_memory {
            check_room("the canvas", needs.canvas())?;
        }
        let left = left - if in_memory { needs.canvas() } else { 0 };
        // The photographs' own coarse levels are smaller than the photographs, which are to be had again, too.
        let hold_levels = work.coarse_levels <= left / 4;
        let left = left - if hold_levels { work.coarse_levels } else { 0 };
        let threads = rayon::current_num_threads().max(1);
        let one = decoding_bytes(needs.largest);
        // A quarter of the rest for further photographs at once; the first is counted in what is needed at least.
        let more = (left / 4).checked_div(one).unwrap_or(threads).min(threads - 1);
        let left = left - more * one;
        let sums = if in_memory { usize::MAX } else { (work.band + left) / 2 };
        let [width, height] = needs.size;
        let canvas_bytes = (width as u64 * height as u64) * work.pixel_bytes as u64;
        let on_disk = if in_memory { 0 } else { canvas_bytes };
        let total = on_disk + if hold_levels { 0 } else { work.coarse_levels as u64 };
        let file: Option<Arc<dyn ScratchFile>> =
            if total > 0 { Some(Arc::from(allowed.scratch.create(total)?)) } else { None };
        if let Some(file) = file.as_deref().filter(|_| on_disk > 0) {
            // Its last tiles may never be finished, and are read all the same.
            file.write_at(&[0], on_disk - 1)?;
        }
        let place = file.clone().map(|file| SpillPlace { file, offset: on_disk });
        let photographs = parts.map_or(needs.at_one_place, |parts| parts.photographs).saturating_add(left);
        let levels_at_a_time = match parts {
            None => threads,
            Some(parts) => 1 + left.checked_div(parts.levels_of_one).unwrap_or(threads).min(threads - 1),
        };
        Ok(Self {
            in_parts: parts.is_some(),
            kept: if parts.is_some() { 0 } else { photographs },
            levels_at_a_time,
            coarse_levels: place.filter(|_| !hold_levels),
            file: file.filter(|_| !in_memory),
            photographs,
            most_photographs: photographs.saturating_add(allowed.ceiling.saturating_sub(memory)),
            at_a_time: 1 + more,
            sums,
        })
    }

    /// Zeros, in blocks of `side` if in a file.
    pub(crate) fn store<P: Pixel>(&self, size: [usize; 2], side: [usize; 2]) -> PixelStore<P> {
        match &self.file {
            None => PixelStore::in_memory(size),
            Some(file) => PixelStore::Scratch(CanvasBlocks::new(file.clone(), 0, size, side)),
        }
    }

    /// Rows of a canvas of `width` columns that may be summed up at once, a multiple of `step`.
    pub(crate) fn sum_rows(&self, width: usize, step: usize) -> usize {
        (self.sums / (width * SumPixel::BYTES).max(1) / step).max(1).saturating_mul(step)
    }

    /// Whether the canvas is in a file.
    pub(crate) fn on_disk(&self) -> bool {
        self.file.is_some()
    }
}

/// Bytes of each photograph of a layout.
pub(crate) fn photograph_bytes(layout: &CanvasLayout, source: &dyn PhotographSource) -> Vec<usize> {
    let bytes = |placed: &Placed| {
        // The cast saturates.
        let pixels = (placed.mesh.width * placed.mesh.height) as usize;
        source.bytes(placed.photograph).unwrap_or(pixels.saturating_mul(UNKNOWN_PIXEL_BYTES))
    };
    layout.placed.iter().map(bytes).collect()
}

/// Bytes that decoding a photograph of so many takes.
pub(crate) fn decoding_bytes(photograph: usize) -> usize {
    DECODING.saturating_mul(photograph)
}

/// Bytes that a way of composing takes beside the photographs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WorkBytes {
    /// Of a pixel of the canvas.
    pub(crate) pixel_bytes: usize,
    /// Small views, search of the seams, coarse levels, tiles: whichever of them takes the most.
    pub(crate) working: usize,
    /// The photographs' own coarse levels.
    pub(crate) coarse_levels: usize,
    /// Of the rows of the canvas that are summed up at once, at least.
    pub(crate) band: usize,
}

/// Bytes that composing along seams takes where photographs are held in parts, one is decoded at a time, and nothing is
/// kept from one step to the next that can be had again: in each step, with what earlier ones left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PartsBytes {
    /// A photograph is decoded and made small, beside the small views of all others.
    pub(crate) making_small: usize,
    /// Seams are sought.
    pub(crate) seams: usize,
    /// Coarse levels are blended, one photograph's at a time.
    pub(crate) coarse: usize,
    /// What a further photograph's coarse levels take.
    pub(crate) levels_of_one: usize,
    /// Tiles are finished: what all of them need, and either the tiles or a photograph that is decoded.
    pub(crate) finishing: usize,
    /// Rows of photographs that one tile is made of, at most.
    pub(crate) photographs: usize,
}

impl PartsBytes {
    fn least(&self) -> usize {
        let finishing = self.finishing.saturating_add(self.photographs);
        self.making_small.max(self.seams).max(self.coarse).max(finishing)
    }
}

/// Bytes that composing takes.
#[derive(Debug)]
pub(crate) struct MemoryNeeds {
    /// Width and height of the canvas.
    size: [usize; 2],
    work: WorkBytes,
    /// Of the largest photograph.
    largest: usize,
    /// Of the largest photographs, as many as may be wanted at one place.
    at_one_place: usize,
    /// What it takes with photographs in parts, if they may be.
    in_parts: Option<PartsBytes>,
}

impl MemoryNeeds {
    /// For the photographs of `layout`, of so many `bytes` each, composed in a way that takes `work`, or `in_parts` if
    /// that may be.
    pub(crate) fn new(
        layout: &CanvasLayout,
        mut bytes: Vec<usize>,
        work: WorkBytes,
        in_parts: Option<PartsBytes>,
    ) -> Self {
        bytes.sort_unstable_by(|a, b| b.cmp(a));
        let largest = bytes.first().copied().unwrap_or(0);
        let at_one_place = bytes.iter().take(AT_ONE_PLACE).sum();
        Self { size: [layout.width, layout.height], work, largest, at_one_place, in_parts }
    }

    /// Where neither the canvas nor all of the photographs' own levels are held: others have them.
    pub(crate) fn of_a_part(self) -> Self {
        Self { work: WorkBytes { pixel_bytes: 0, coarse_levels: 0, ..self.work }, ..self }
    }

    /// Of the whole canvas.
    fn canvas(&self) -> usize {
        self.size[0].saturating_mul(self.size[1]).saturating_mul(self.work.pixel_bytes)
    }

    /// With the canvas and the photographs' own levels on disk, and one photograph decoded at a time.
    pub(crate) fn least_whole(&self) -> usize {
        [self.work.working, self.work.band, self.at_one_place, decoding_bytes(self.largest)]
            .iter()
            .fold(0, |sum, &one| sum.saturating_add(one))
    }

    /// The same, with photographs in parts where they may be and that is less.
    pub(crate) fn least(&self) -> usize {
        self.in_parts.map_or(usize::MAX, |parts| parts.least()).min(self.least_whole())
    }

    fn refusal(&self, allowed: usize) -> Error {
        let words = |bytes: usize| needed_in_words(bytes as u64);
        let [width, height] = self.size;
        Error::Limits {
            subject: format!("composing {width} x {height} px"),
            needed: format!(
                "at least {} of memory for photographs of up to {}, their seams and blending",
                words(self.least()),
                words(self.largest),
            ),
            allowed: room_in_words(allowed as u64),
            hint: "Raise --memory (resources.memory) by the difference, or make a smaller panorama (--scale)."
                .to_owned(),
        }
    }
}
