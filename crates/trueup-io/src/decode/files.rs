//! Photographs in files, each decoded once where memory allows, and photographs in memory beside them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use trueup_core::color::TransferCurve;
use trueup_core::mask::Masks;
use trueup_core::raster::Photograph;
use trueup_core::source::{AlignedPhotograph, PhotographSource, SourceImage, StackFusion, StackMember, WorkingFrame};
use trueup_core::{Error, Result};

use super::photograph::{decoding_surplus, photograph, sample_bits};
use super::working::{WorkingPicture, reduce_photograph};
use crate::color::{Conversion, PhotographColors};
use crate::source::InMemory;

/// Photographs in files and in memory. What [`working`](Self::working) decodes is kept, within a budget of bytes, until
/// [`photograph`](PhotographSource::photograph) asks for it, so that a small set is decoded once.
///
/// The budget decides only how often files are decoded, never what is returned.
#[derive(Debug)]
pub struct FilePhotographs {
    sources: Vec<SourceImage>,
    /// Those that are no files.
    in_memory: InMemory,
    /// By index; those beyond the end have none.
    masks: Vec<Masks>,
    colors: Option<PhotographColors>,
    /// Who makes one photograph of a stack.
    fusion: Option<Arc<dyn StackFusion>>,
    kept: Mutex<Kept>,
    /// Bytes that the samples of each took when it was decoded; 0 before.
    bytes: Vec<AtomicUsize>,
}

/// Decoded photographs by index, and the bytes that may still be kept.
#[derive(Debug)]
struct Kept {
    photographs: Vec<Option<Photograph>>,
    free_bytes: usize,
}

impl FilePhotographs {
    /// Over `sources`, keeping at most `cache_bytes` bytes of decoded pixels; 0 keeps none.
    pub fn new(sources: Vec<SourceImage>, cache_bytes: usize) -> Self {
        let photographs = sources.iter().map(|_| None).collect();
        let bytes = sources.iter().map(|_| AtomicUsize::new(0)).collect();
        let kept = Mutex::new(Kept { photographs, free_bytes: cache_bytes });
        Self { sources, in_memory: InMemory::default(), masks: Vec::new(), colors: None, fusion: None, bytes, kept }
    }

    /// The same with the pixels of those that are no files: they count for nothing in the budget.
    #[must_use]
    pub fn with_in_memory(self, in_memory: InMemory) -> Self {
        Self { in_memory, ..self }
    }

    /// The same with what the photographer wants of the photographs' parts, in their order.
    #[must_use]
    pub fn with_masks(self, masks: Vec<Masks>) -> Self {
        Self { masks, ..self }
    }

    /// In one color space: `colors` are those of the same photographs. Without, samples are handed out as they are.
    pub fn in_colors(self, colors: PhotographColors) -> Self {
        Self { colors: Some(colors), ..self }
    }

    /// The same, where photographs that are stacks are fused by `fusion`. Without, a stack is its reference.
    #[must_use]
    pub fn fused_by(self, fusion: Arc<dyn StackFusion>) -> Self {
        Self { fusion: Some(fusion), ..self }
    }

    /// Most bytes that decoding one of them takes beyond twice four channels of 8 bits: what the decoder takes, and of a stack the
    /// other exposures and what fusing takes.
    pub fn decoding_surplus(&self) -> usize {
        let fusing = |source: &SourceImage| stack_surplus(source, self.fusion.as_deref());
        decoding_surplus(&self.sources).saturating_add(self.sources.iter().map(fusing).max().unwrap_or(0))
    }

    /// The same, which keeps at most so many bytes of decoded pixels.
    #[must_use]
    pub fn keeping(self, cache_bytes: usize) -> Self {
        let Kept { photographs, .. } = self.kept.into_inner().unwrap_or_else(PoisonError::into_inner);
        Self { kept: Mutex::new(Kept { photographs, free_bytes: cache_bytes }), ..self }
    }

    /// The color space that photographs are handed out in, if it was asked for.
    pub fn colors(&self) -> Option<&PhotographColors> {
        self.colors.as_ref()
    }

    /// The photographs this hands out, in order.
    pub fn sources(&self) -> &[SourceImage] {
        &self.sources
    }

    /// The pixels of photograph `index` if it is no file, as they were given.
    pub fn in_memory(&self, index: usize) -> Option<&Photograph> {
        self.in_memory.of(self.sources.get(index)?).map(Arc::as_ref)
    }

    /// All pixels that are in memory.
    pub fn in_memory_photographs(&self) -> &InMemory {
        &self.in_memory
    }

    /// Bits of a sample of photograph `index`, as [`sample_bits`](super::sample_bits) has them.
    ///
    /// # Errors
    /// As [`sample_bits`](super::sample_bits); [`Error::Input`] if there is no photograph `index`.
    pub fn sample_bits(&self, index: usize) -> Result<u16> {
        match self.in_memory(index) {
            Some(photograph) => Ok(photograph.sample_bits()),
            None => sample_bits(self.source(index)?),
        }
    }

    /// Photograph `index`, reduced as [`working`](super::working) does; what had to be decoded or converted for it is kept if it
    /// fits.
    ///
    /// # Errors
    /// As [`working`](super::working); [`Error::Input`] if there is no photograph `index`.
    pub fn working(&self, index: usize, frame: &WorkingFrame, thumbnail_max_area: f64) -> Result<WorkingPicture> {
        let source = self.source(index)?;
        let whole = |photograph: &Photograph| reduce_photograph(photograph, &source.name, frame, thumbnail_max_area);
        // As it is, without a copy.
        let is_as_given = self.conversion(index).is_none() && source.stack.is_empty();
        if let Some(photograph) = self.in_memory(index).filter(|_| is_as_given) {
            return whole(photograph);
        }
        let photograph = self.photograph(index)?;
        let working = whole(&photograph)?;
        self.keep(index, photograph);
        Ok(working)
    }

    /// Forgets photograph `index` if it is kept: for those that will not be asked for again.
    pub fn forget(&self, index: usize) {
        drop(self.take(index));
    }

    /// Bytes of the photographs that are kept now.
    pub fn kept_bytes(&self) -> usize {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.photographs.iter().flatten().map(Photograph::bytes).sum()
    }

    fn decode(&self, index: usize, source: &SourceImage) -> Result<Photograph> {
        let mut photograph = match self.in_memory(index) {
            Some(photograph) => photograph.clone(),
            None => photograph(source)?,
        };
        if let Some(conversion) = self.conversion(index) {
            photograph = conversion.apply(photograph, &source.name)?;
        }
        if let (Some(fusion), false) = (&self.fusion, source.stack.is_empty()) {
            photograph = fusion.fuse(&photograph, &self.decoded_stack(index, source)?)?;
        }
        if let Some(bytes) = self.bytes.get(index) {
            bytes.store(photograph.bytes(), Ordering::Relaxed);
        }
        Ok(photograph)
    }

    /// The other exposures of photograph `index`.
    fn decoded_stack(&self, index: usize, source: &SourceImage) -> Result<Vec<AlignedPhotograph>> {
        let decoded = |(number, member): (usize, &StackMember)| {
            let given = self.in_memory.of(&member.source).map(|photograph| photograph.as_ref().clone());
            let mut decoded = given.map_or_else(|| photograph(&member.source), Ok)?;
            if let Some(conversion) = self.colors.as_ref().and_then(|colors| colors.member_conversion(index, number)) {
                decoded = conversion.apply(decoded, &member.source.name)?;
            }
            let reference_from_member = member.reference_from_member;
            Ok(AlignedPhotograph { photograph: decoded, reference_from_member })
        };
        source.stack.iter().enumerate().map(decoded).collect()
    }

    fn conversion(&self, index: usize) -> Option<&Conversion> {
        self.colors.as_ref()?.conversion(index)
    }

    fn source(&self, index: usize) -> Result<&SourceImage> {
        self.sources.get(index).ok_or_else(|| {
            let reason = format!("there are only {} photographs", self.sources.len());
            Error::input(format!("photograph number {index}"), reason, "Ask for one of them.")
        })
    }

    fn keep(&self, index: usize, photograph: Photograph) {
        let bytes = photograph.bytes();
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Kept { photographs, free_bytes } = &mut *kept;
        let Some(place) = photographs.get_mut(index) else { return };
        if place.is_none() && bytes <= *free_bytes {
            *free_bytes -= bytes;
            *place = Some(photograph);
        }
    }

    fn take(&self, index: usize) -> Option<Photograph> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let photograph = kept.photographs.get_mut(index)?.take()?;
        kept.free_bytes += photograph.bytes();
        Some(photograph)
    }
}

/// Bytes of a pixel as they are counted before it is decoded.
const PIXEL_BYTES: usize = 4;

/// What fusing a stack takes beside its reference, which is decoded like any photograph.
fn stack_surplus(source: &SourceImage, fusion: Option<&dyn StackFusion>) -> usize {
    let (Some(fusion), others @ 1..) = (fusion, source.stack.len()) else { return 0 };
    let each = others.saturating_mul(PIXEL_BYTES).saturating_add(fusion.bytes_per_pixel(others + 1));
    source.width.saturating_mul(source.height).saturating_mul(each)
}

impl PhotographSource for FilePhotographs {
    /// Hands out a kept photograph, which is then no longer kept, or decodes the file, or copies what is in memory.
    fn photograph(&self, index: usize) -> Result<Photograph> {
        let source = self.source(index)?;
        match self.take(index) {
            Some(photograph) => Ok(photograph),
            None => self.decode(index, source),
        }
    }

    fn masks(&self, index: usize) -> Masks {
        self.masks.get(index).cloned().unwrap_or_default()
    }

    fn bytes(&self, index: usize) -> Option<usize> {
        self.bytes.get(index).map(|bytes| bytes.load(Ordering::Relaxed)).filter(|&bytes| bytes > 0)
    }

    fn transfer_curve(&self) -> TransferCurve {
        self.colors.as_ref().map_or(TransferCurve::SRGB, |colors| colors.transfer_curve().clone())
    }
}
