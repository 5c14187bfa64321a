//! How much memory the work may take, and how the stages divide it. The division decides what is kept and what is done
//! at once, never what comes out.

use trueup_compose::render::Resources;
use trueup_core::memory::{MemoryBudget, needed_in_words, room_in_words};
use trueup_core::scratch::ScratchSpace;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};
use trueup_io::decode::FilePhotographs;

use super::machine::{self, MachineMemory};
use crate::options::ResourceOptions;

/// What the program takes beside what is counted: itself, features and matches, meshes, and what the allocator cannot
/// give back. A whole stitch of five small photographs peaks at 111 MB, of which their pixels are a part.
const PROGRAM_BYTES: usize = 96_000_000;

/// The share of the machine's memory that is taken without being asked for less or more: 1 / 4.
const AUTOMATIC_SHARE: u64 = 4;

/// The share of the machine's memory that is divided among pieces of work that are done at once, without being asked
/// for less or more: 1 / 2. Each may take no more than its part, while a single one may where less is too little.
const SHARE_OF_SEVERAL: u64 = 2;

/// Bytes that finding features takes per working pixel: the levels of the scale space of a photograph of twice the
/// size.
const FEATURE_BYTES: f64 = 240.0;

/// Working pixels of a photograph that are counted at least, where as many are allowed: of small ones, what is taken
/// beside their pixels is more than these.
const LEAST_COUNTED: f64 = 480_000.0;

/// Bytes of a pixel of a photograph that was reduced to its working size, with what its thumbnail takes.
const REDUCED_BYTES: f64 = 4.5;

/// Bytes of a photograph's pixel that was not decoded yet.
const PIXEL_BYTES: usize = 4;

/// A photograph on its way into memory takes this many times its size: what the decoder holds beside its pixels, and
/// its copy when it is turned upright.
const DECODING: usize = 2;

/// Bytes of a photograph's features, as detailed ones have: 5,000 descriptors, of 170 bytes with their points, and what
/// surrounds them.
const FEATURES_OF_ONE: usize = 1_330_000;

/// The part of the memory that features may have at least until they are matched, whatever measuring leaves: 1 / 16,
/// and of what is counted for the program a little.
const FEATURE_PART: usize = 16;

/// With room for so many photographs per thread, no more are worked at at once.
pub(super) const MANY_PER_THREAD: usize = 4;

/// What to do where it is the option that allows too little.
const RAISE_OPTION: &str = "Raise --memory (resources.memory), or give smaller photographs.";

/// What each of `at_once` pieces of work may take of `memory`.
pub(crate) fn memory_of_each(memory: MemoryBudget, at_once: usize) -> MemoryBudget {
    if at_once < 2 {
        return memory;
    }
    let whole = match memory {
        MemoryBudget::Bytes(bytes) => bytes,
        MemoryBudget::Auto => machine::memory(rayon::current_num_threads()).total / SHARE_OF_SEVERAL,
    };
    MemoryBudget::Bytes(whole / at_once as u64)
}

/// Memory to be divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Budget {
    /// Bytes to be taken in all.
    memory: usize,
    /// Bytes that may be taken where less is too little to work at all.
    ceiling: usize,
    /// What to do where that is too little.
    advice: &'static str,
}

impl Budget {
    /// What the options allow on this machine: never more than the limits under which the program runs.
    pub(super) fn new(options: &ResourceOptions) -> Self {
        Self::of(options, machine::memory(rayon::current_num_threads()))
    }

    fn of(options: &ResourceOptions, machine: MachineMemory) -> Self {
        let (memory, ceiling) = match options.memory {
            MemoryBudget::Bytes(bytes) => (bytes, bytes),
            MemoryBudget::Auto => {
                let memory = machine.total / AUTOMATIC_SHARE;
                (memory, machine.free.max(memory))
            }
        };
        let limit = machine.hard.filter(|hard| hard.bytes <= ceiling);
        let most = limit.map_or(u64::MAX, |hard| hard.bytes);
        let bytes = |amount: u64| usize::try_from(amount.min(most)).unwrap_or(usize::MAX);
        let advice = limit.map_or(RAISE_OPTION, |hard| hard.by.advice());
        Self { memory: bytes(memory), ceiling: bytes(ceiling), advice }
    }

    /// How many photographs may be measured at once on copies of `working_pixels`, and how many bytes of them kept
    /// until they are composed.
    ///
    /// # Errors
    /// [`Error::Limits`] with the numbers if the largest is too large to be measured alone.
    pub(super) fn measuring(&self, photographs: &FilePhotographs, working_pixels: f64) -> Result<Measuring> {
        let images = photographs.sources();
        let bytes = |image: &SourceImage| {
            let [width, height] = image.picture_size();
            width.saturating_mul(height).saturating_mul(PIXEL_BYTES)
        };
        let Some(largest) = images.iter().max_by_key(|image| bytes(image)) else {
            return Ok(Measuring { at_once: usize::MAX, kept_bytes: 0, held_features: 0 });
        };
        // Photographs are made smaller for measuring, never larger.
        let most_pixels = ((bytes(largest) / PIXEL_BYTES) as f64).max(LEAST_COUNTED);
        let working_pixels = working_pixels.min(most_pixels);
        // One after the other: what is not kept of a photograph is let go before features are found in its working
        // copy.
        let reduced = (REDUCED_BYTES * working_pixels) as usize;
        let features = ((FEATURE_BYTES * working_pixels) as usize).saturating_add(reduced);
        let decoding = bytes(largest).saturating_mul(DECODING).saturating_add(photographs.decoding_surplus());
        let one = decoding.saturating_add(reduced).max(features);
        let least = one.saturating_add(PROGRAM_BYTES);
        if least > self.ceiling {
            return Err(Error::Limits {
                subject: format!("measuring {} ({} x {} px)", largest.name, largest.width, largest.height),
                needed: format!("at least {} of memory", needed_in_words(least as u64)),
                allowed: room_in_words(self.ceiling as u64),
                hint: self.advice.to_owned(),
            });
        }
        let memory = self.memory.max(least) - PROGRAM_BYTES;
        // Keeping some of many saves little; keeping all of a small set saves decoding it twice.
        let all = images.iter().map(|image| bytes(image).saturating_add(reduced)).fold(0, usize::saturating_add);
        let kept_bytes = if all <= memory / 4 { all } else { 0 };
        let at_once = ((memory - kept_bytes) / one).max(1);
        let busy = at_once.min(MANY_PER_THREAD * rayon::current_num_threads()).saturating_mul(one);
        let left = (memory - kept_bytes).saturating_sub(busy).max(memory / FEATURE_PART);
        let held_features = left.min(images.len().saturating_mul(FEATURES_OF_ONE));
        Ok(Measuring { at_once, kept_bytes, held_features })
    }

    /// What composing may take beside what the program takes already, and what the decoders of some photographs take:
    /// every thread's, or where that is too much, one's. What is refused depends on the photographs alone: what is
    /// known of many leaves less room, but never none.
    pub(super) fn composing<'a>(&self, photographs: &FilePhotographs, scratch: &'a dyn ScratchSpace) -> Resources<'a> {
        let taken = machine::taken().and_then(|bytes| usize::try_from(bytes).ok()).unwrap_or(0);
        let counted = PROGRAM_BYTES.saturating_add(photographs.kept_bytes());
        let surplus = photographs.decoding_surplus();
        let left = |bytes: usize, taken: usize, decoders: usize| {
            bytes.saturating_sub(taken.saturating_add(surplus.saturating_mul(decoders)))
        };
        let memory = left(self.memory, counted.max(taken), rayon::current_num_threads());
        Resources { memory, ceiling: left(self.ceiling, counted, 1), scratch, helpers: None }
    }
}

/// How photographs are measured within the budget.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Measuring {
    /// Photographs at once, at least 1.
    pub at_once: usize,
    /// Bytes of decoded photographs to be kept.
    pub kept_bytes: usize,
    /// Bytes of features that stay in memory until they are matched; those beyond go to a scratch file.
    pub held_features: usize,
}

#[cfg(test)]
mod tests {
    use super::super::machine::{HardLimit, LimitedBy};
    use super::*;
    use crate::options::StitchOptions;

    fn images(count: usize, width: usize, height: usize) -> FilePhotographs {
        let image = |index: usize| {
            let name = format!("{index}.jpg");
            SourceImage::unknown(&name, name.clone(), [width, height])
        };
        FilePhotographs::new((0..count).map(image).collect(), 0)
    }

    const WORKING_PIXELS: f64 = 480_000.0;

    fn budget(memory: &str) -> Budget {
        let mut options = StitchOptions::default();
        options.set(&format!("resources.memory={memory}")).expect("an amount");
        Budget::of(&options.run.resources, MachineMemory { total: 8_000_000_000, free: 3_000_000_000, hard: None })
    }

    #[test]
    fn work_at_once_shares_the_memory_and_a_single_piece_keeps_it() {
        let each = |memory: MemoryBudget, at_once| memory_of_each(memory, at_once);
        assert_eq!(each(MemoryBudget::Bytes(4_000_000_000), 4), MemoryBudget::Bytes(1_000_000_000));
        assert_eq!(each(MemoryBudget::Auto, 1), MemoryBudget::Auto);
        let MemoryBudget::Bytes(two) = each(MemoryBudget::Auto, 2) else { panic!("a part of the machine's") };
        assert!(two <= machine::memory(1).total / 4, "{two}");
    }

    #[test]
    fn small_sets_are_kept_and_large_ones_are_measured_a_few_at_a_time() {
        let measuring = |memory: &str, count: usize| {
            budget(memory).measuring(&images(count, 6000, 4000), WORKING_PIXELS).expect("enough")
        };
        assert_eq!(measuring("4GB", 8).kept_bytes, 8 * (96_000_000 + 2_160_000));
        assert_eq!(measuring("4GB", 60).kept_bytes, 0);
        // One takes 192 MB while it is decoded and reduced to 2 MB; its features, 115 MB, come after.
        assert_eq!(measuring("4GB", 60).at_once, 20);
        assert_eq!(measuring("500MB", 60).at_once, 2);
    }

    #[test]
    fn the_number_in_a_refusal_is_enough() {
        let refused = |memory: &str| {
            budget(memory).measuring(&images(3, 6000, 4000), WORKING_PIXELS).err().map(|error| error.to_string())
        };
        let message = refused("100MB").expect("too little");
        assert!(
            message.contains("2.jpg (6000 x 4000 px): at least 291 MB of memory needed, 100 MB allowed"),
            "{message}"
        );
        assert_eq!(refused("291MB"), None);
    }

    /// The features of a small photograph take more than decoding it: 115 MB and 2 MB.
    #[test]
    fn photographs_of_eight_megapixels_are_measured_in_a_quarter_of_a_gigabyte() {
        let measuring = budget("256MB").measuring(&images(5, 3264, 2448), WORKING_PIXELS).expect("enough");
        assert_eq!((measuring.at_once, measuring.kept_bytes), (1, 0));
        // Of 160 MB 117 are for one at a time: 43 MB are left, more than five need.
        assert_eq!(measuring.held_features, 5 * FEATURES_OF_ONE);
        let many = budget("256MB").measuring(&images(500, 3264, 2448), WORKING_PIXELS).expect("enough");
        assert_eq!((many.at_once, many.held_features), (1, 160_000_000 - 117_360_000));
        assert!(budget("200MB").measuring(&images(1, 3264, 2448), WORKING_PIXELS).is_err());
    }

    /// Of 1000 x 800 pixels, 800,000 are all there is to measure; of 256 x 171 half a million are counted.
    #[test]
    fn small_photographs_take_little_however_many_pixels_are_allowed() {
        let measuring = |size: [usize; 2], pixels: f64| {
            budget("400MB").measuring(&images(5, size[0], size[1]), pixels).expect("enough")
        };
        assert_eq!(measuring([1000, 800], 1e8), measuring([1000, 800], 800_000.0));
        assert_eq!(measuring([1000, 800], 1e8).at_once, 304_000_000 / 195_600_000);
        assert_eq!(measuring([256, 171], 1e8), measuring([256, 171], LEAST_COUNTED));
    }

    #[test]
    fn without_a_word_a_share_of_the_machine_is_taken_and_more_if_it_must_be() {
        let machine = MachineMemory { total: 8_000_000_000, free: 3_000_000_000, hard: None };
        let Budget { memory, ceiling, .. } = Budget::of(&ResourceOptions::default(), machine);
        assert_eq!((memory, ceiling), (2_000_000_000, 3_000_000_000));
        let Budget { memory, ceiling, .. } = Budget::new(&ResourceOptions::default());
        assert!(memory > 0 && ceiling >= memory);
    }

    /// Whatever was asked for: beyond these the program is killed, or its allocations fail.
    #[test]
    fn limits_of_containers_and_shells_are_never_exceeded() {
        for by in [LimitedBy::ControlGroup, LimitedBy::Process] {
            let hard = Some(HardLimit { bytes: 150_000_000, by });
            let machine = MachineMemory { total: 150_000_000, free: 150_000_000, hard };
            for memory in ["auto", "2GB"] {
                let mut options = StitchOptions::default();
                options.set(&format!("resources.memory={memory}")).expect("an amount");
                let budget = Budget::of(&options.run.resources, machine);
                let refused =
                    budget.measuring(&images(3, 6000, 4000), WORKING_PIXELS).err().map(|error| error.to_string());
                let message = refused.expect("too little");
                assert!(message.contains("150 MB allowed") && message.ends_with(by.advice()), "{message}");
            }
            let mut options = StitchOptions::default();
            options.set("resources.memory=100MB").expect("an amount");
            assert_eq!(Budget::of(&options.run.resources, machine).advice, RAISE_OPTION);
        }
    }
}
