//! Photographs in files, each decoded once where memory allows, and photographs in memory beside them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use trueup_core::color::{LightRange, TransferCurve};
use trueup_core::mask::{Mask, Masks};
use trueup_core::raster::Photograph;
use trueup_core::source::{AlignedPhotograph, PhotographSource, SourceImage, StackFusion, StackMember, WorkingFrame};
use trueup_core::{Error, Result};

use super::photograph::{decoding_surplus, photograph, sample_bits};
use super::working::{WorkingPicture, reduce_photograph};
use crate::color::{Conversion, PhotographColors, relit};
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
    /// Of each, what shows the camera's carrier.
    carriers: Vec<Option<Arc<Mask>>>,
    colors: Option<PhotographColors>,
    /// The light that all are handed out in, where what is brighter than white is kept, and its curve.
    light: Option<(LightRange, TransferCurve)>,
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
    /// What some of them were last reduced to.
    reduced: Vec<Option<Reduced>>,
    free_bytes: usize,
}

/// A photograph as it was reduced.
#[derive(Debug)]
struct Reduced {
    frame: WorkingFrame,
    thumbnail_max_area: f64,
    picture: WorkingPicture,
}

impl Reduced {
    fn bytes(&self) -> usize {
        size_of_val(self.picture.gray.data()) + size_of_val(self.picture.thumbnail.data())
    }
}

impl Kept {
    /// Nothing of so many photographs.
    fn nothing(photographs: usize, free_bytes: usize) -> Self {
        let nothing = |_| None;
        let reduced = (0..photographs).map(|_| None).collect();
        Self { photographs: (0..photographs).map(nothing).collect(), reduced, free_bytes }
    }

    /// Takes a photograph out. What it was reduced to is let go as well.
    fn take(&mut self, index: usize) -> Option<Photograph> {
        if let Some(reduced) = self.reduced.get_mut(index).and_then(Option::take) {
            self.free_bytes += reduced.bytes();
        }
        let photograph = self.photographs.get_mut(index)?.take()?;
        self.free_bytes += photograph.bytes();
        Some(photograph)
    }
}

/// The masks of what shows the camera's carrier, by photograph: those that are alike, one behind the other, are one.
fn carriers(sources: &[SourceImage]) -> Vec<Option<Arc<Mask>>> {
    let mut carriers: Vec<Option<Arc<Mask>>> = Vec::with_capacity(sources.len());
    for (number, source) in sources.iter().enumerate() {
        let is_alike = |other: &SourceImage| {
            (other.width, other.height, &other.carrier) == (source.width, source.height, &source.carrier)
        };
        let carrier = match number.checked_sub(1) {
            Some(last) if is_alike(&sources[last]) => carriers[last].clone(),
            _ => source.carrier.as_ref().map(|parts| Arc::new(parts.mask([source.width, source.height]))),
        };
        carriers.push(carrier);
    }
    carriers
}

/// What is marked in either of two masks.
fn either(one: Option<Arc<Mask>>, other: Option<Arc<Mask>>) -> Option<Arc<Mask>> {
    match (one, other) {
        (Some(one), Some(other)) => Some(Arc::new(Arc::unwrap_or_clone(one).or(&other))),
        (one, other) => one.or(other),
    }
}

impl FilePhotographs {
    /// Over `sources`, keeping at most `cache_bytes` bytes of decoded pixels; 0 keeps none.
    pub fn new(sources: Vec<SourceImage>, cache_bytes: usize) -> Self {
        let bytes = sources.iter().map(|_| AtomicUsize::new(0)).collect();
        let kept = Mutex::new(Kept::nothing(sources.len(), cache_bytes));
        let carriers = carriers(&sources);
        Self {
            sources,
            in_memory: InMemory::default(),
            masks: Vec::new(),
            carriers,
            colors: None,
            light: None,
            fusion: None,
            bytes,
            kept,
        }
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

    /// The same, which hands all of them out as light of a range, 16 bits a sample, in which what is brighter than
    /// white is kept: stacks are merged to it. Those of floating point numbers have the same [`SourceImage::light`]. A
    /// range that is not sound is none.
    #[must_use]
    pub fn in_light(self, range: Option<LightRange>) -> Self {
        let light = range.and_then(|range| Some((range, TransferCurve::light(range)?)));
        Self { light, ..self }
    }

    /// The same, where photographs that are stacks are fused, or merged, by `fusion`. Without, a stack is its
    /// reference.
    #[must_use]
    pub fn fused_by(self, fusion: Arc<dyn StackFusion>) -> Self {
        Self { fusion: Some(fusion), ..self }
    }

    /// Most bytes that decoding one of them takes beyond twice four channels of 8 bits: what the decoder takes, and of
    /// a stack the other exposures and what fusing takes.
    pub fn decoding_surplus(&self) -> usize {
        let fusing = |source: &SourceImage| stack_surplus(source, self.fusion.as_deref());
        decoding_surplus(&self.sources).saturating_add(self.sources.iter().map(fusing).max().unwrap_or(0))
    }

    /// The color space that photographs are handed out in, if it was asked for.
    pub fn colors(&self) -> Option<&PhotographColors> {
        self.colors.as_ref()
    }

    /// The light that all are handed out in, if what is brighter than white is kept.
    pub fn light(&self) -> Option<LightRange> {
        self.light.as_ref().map(|(range, _)| *range)
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

    /// Photograph `index`, reduced as [`working`](super::working) does; what had to be decoded or converted for it is
    /// kept if it fits, and so is what it was reduced to.
    ///
    /// # Errors
    /// As [`working`](super::working); [`Error::Input`] if there is no photograph `index`.
    pub fn working(&self, index: usize, frame: &WorkingFrame, thumbnail_max_area: f64) -> Result<WorkingPicture> {
        let source = self.source(index)?;
        if let Some(known) = self.reduced(index, frame, thumbnail_max_area) {
            return Ok(known);
        }
        let whole = |photograph: &Photograph| reduce_photograph(photograph, &source.name, frame, thumbnail_max_area);
        // As it is, without a copy.
        let is_as_given = self.conversion(index).is_none()
            && source.stack.is_empty()
            && self.light.is_none()
            && source.inset.is_none()
            && source.outline.is_none();
        if let Some(photograph) = self.in_memory(index).filter(|_| is_as_given) {
            return whole(photograph);
        }
        let photograph = self.photograph(index)?;
        let picture = whole(&photograph)?;
        if self.keep(index, photograph) {
            self.keep_reduced(index, Reduced { frame: *frame, thumbnail_max_area, picture: picture.clone() });
        }
        Ok(picture)
    }

    /// What the photographer wants of the parts of photograph `index`.
    pub fn given_masks(&self, index: usize) -> Masks {
        self.masks.get(index).cloned().unwrap_or_default()
    }

    /// What of photograph `index` is not to be looked at: the parts that its photographer ignores, those that show the
    /// camera's carrier, and what lies beside its outline.
    pub fn not_looked_at(&self, index: usize) -> Option<Arc<Mask>> {
        let ignored = self.masks(index).ignored;
        let source = self.sources.get(index)?;
        let Some(outline) = &source.outline else { return ignored };
        let beside = outline.beside([source.width, source.height]);
        either(Some(Arc::new(beside)), ignored)
    }

    /// Forgets photograph `index` if it is kept: for those that will not be asked for again.
    pub fn forget(&self, index: usize) {
        drop(self.take(index));
    }

    /// Bytes of the photographs that are kept now, and of what they were reduced to.
    pub fn kept_bytes(&self) -> usize {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let reduced: usize = kept.reduced.iter().flatten().map(Reduced::bytes).sum();
        kept.photographs.iter().flatten().map(Photograph::bytes).sum::<usize>() + reduced
    }

    fn decode(&self, index: usize, source: &SourceImage) -> Result<Photograph> {
        let reference = self.decoded(source, self.conversion(index))?;
        let photograph = match &self.fusion {
            Some(fusion) if !source.stack.is_empty() => self.of_stack(index, source, reference, fusion.as_ref())?,
            _ => self.in_common_light(reference, source)?,
        };
        let photograph = match &source.outline {
            Some(outline) => outline.cut(&photograph),
            None => photograph,
        };
        if let Some(bytes) = self.bytes.get(index) {
            bytes.store(photograph.bytes(), Ordering::Relaxed);
        }
        Ok(photograph)
    }

    /// One file, or what is in memory in its place, in the common color space.
    fn decoded(&self, source: &SourceImage, conversion: Option<&Conversion>) -> Result<Photograph> {
        let given = self
            .in_memory
            .of(source)
            .map(|photograph| source.inset.cut(photograph.as_ref().clone()).map(Photograph::without_full_alpha));
        let decoded = given.unwrap_or_else(|| photograph(source))?;
        match (conversion, source.light.and_then(TransferCurve::light)) {
            (None, _) => Ok(decoded),
            (Some(conversion), None) => conversion.apply(decoded, &source.name),
            (Some(conversion), Some(curve)) => conversion.apply_to_light(decoded, &curve, &source.name),
        }
    }

    /// A photograph in the light that all are handed out in.
    fn in_common_light(&self, photograph: Photograph, source: &SourceImage) -> Result<Photograph> {
        match &self.light {
            Some((range, curve)) if source.light.is_none() => {
                relit(&photograph, &self.profile_curve(), curve, range.peak)
            }
            _ => Ok(photograph),
        }
    }

    /// What becomes of the stack whose `reference` is photograph `index`.
    fn of_stack(
        &self,
        index: usize,
        source: &SourceImage,
        reference: Photograph,
        fusion: &dyn StackFusion,
    ) -> Result<Photograph> {
        let conversion =
            |number: usize| self.colors.as_ref().and_then(|colors| colors.member_conversion(index, number));
        // Files of whole numbers are merged as they are, which know where they end.
        let is_light = source.light.is_some() || source.stack.iter().any(|member| member.source.light.is_some());
        let in_light = |photograph: Photograph, source: &SourceImage| match is_light {
            true => self.in_common_light(photograph, source),
            false => Ok(photograph),
        };
        let member = |(number, member): (usize, &StackMember)| {
            let photograph = in_light(self.decoded(&member.source, conversion(number))?, &member.source)?;
            Ok(AlignedPhotograph { photograph, reference_from_member: member.reference_from_member })
        };
        let others = source.stack.iter().enumerate().map(member).collect::<Result<Vec<_>>>()?;
        match &self.light {
            None => fusion.fuse(&reference, &others),
            Some((_, light)) if is_light => fusion.merge(&in_light(reference, source)?, &others, light, light),
            Some((_, light)) => fusion.merge(&reference, &others, &self.profile_curve(), light),
        }
    }

    /// How samples in the common color space stand for light.
    fn profile_curve(&self) -> TransferCurve {
        self.colors.as_ref().map_or(TransferCurve::SRGB, |colors| colors.transfer_curve().clone())
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

    /// What photograph `index` was last reduced to, if that is kept and was asked for the same way.
    fn reduced(&self, index: usize, frame: &WorkingFrame, thumbnail_max_area: f64) -> Option<WorkingPicture> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let known = kept.reduced.get(index)?.as_ref()?;
        (known.frame == *frame && known.thumbnail_max_area == thumbnail_max_area).then(|| known.picture.clone())
    }

    fn keep_reduced(&self, index: usize, reduced: Reduced) {
        let bytes = reduced.bytes();
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Kept { reduced: all, free_bytes, .. } = &mut *kept;
        let Some(place) = all.get_mut(index) else { return };
        if place.is_none() && bytes <= *free_bytes {
            *free_bytes -= bytes;
            *place = Some(reduced);
        }
    }

    /// Keeps a photograph if there is room; returns whether it is kept.
    fn keep(&self, index: usize, photograph: Photograph) -> bool {
        let bytes = photograph.bytes();
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Kept { photographs, free_bytes, .. } = &mut *kept;
        let Some(place) = photographs.get_mut(index) else { return false };
        if place.is_none() && bytes <= *free_bytes {
            *free_bytes -= bytes;
            *place = Some(photograph);
        }
        place.is_some()
    }

    fn take(&self, index: usize) -> Option<Photograph> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).take(index)
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
        let Masks { ignored, kept } = self.given_masks(index);
        Masks { ignored: either(ignored, self.carriers.get(index).cloned().flatten()), kept }
    }

    fn bytes(&self, index: usize) -> Option<usize> {
        self.bytes.get(index).map(|bytes| bytes.load(Ordering::Relaxed)).filter(|&bytes| bytes > 0)
    }

    fn transfer_curve(&self) -> TransferCurve {
        self.light.as_ref().map_or_else(|| self.profile_curve(), |(_, curve)| curve.clone())
    }
}
