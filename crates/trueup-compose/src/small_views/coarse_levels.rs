//! The photographs' own coarse levels: in memory, or in the scratch file while they are not wanted.

use std::borrow::Cow;
use std::sync::Arc;

use trueup_core::Result;
use trueup_core::scratch::ScratchFile;

use super::coarse_level::CoarseLevel;
use crate::memory_plan::SpillPlace;
use crate::pyramid::{PyramidPlane, level_shares};
use crate::store::{Pixel, read_pixels, to_bytes};

/// Every photograph's [`CoarseLevel`].
#[derive(Debug, Default)]
pub(crate) struct CoarseLevels {
    /// Those that are not in memory have no texels.
    held: Vec<CoarseLevel>,
    spilled: Option<Spilled>,
}

#[derive(Debug)]
struct Spilled {
    file: Arc<dyn ScratchFile>,
    next: u64,
    /// Where each begins.
    offsets: Vec<u64>,
}

impl CoarseLevels {
    /// None so far; in memory, or where the plan wants them in its scratch file.
    pub(crate) fn new(place: Option<SpillPlace>) -> Self {
        let spilled = place.map(|SpillPlace { file, offset }| Spilled { file, next: offset, offsets: Vec::new() });
        Self { held: Vec::new(), spilled }
    }

    pub(crate) fn len(&self) -> usize {
        self.held.len()
    }

    /// Adds the next photograph's.
    pub(crate) fn push(&mut self, mut level: CoarseLevel) -> Result<()> {
        if let Some(spilled) = &mut self.spilled {
            let bytes = to_bytes(&std::mem::take(&mut level.plane.texels));
            spilled.file.write_at(&bytes, spilled.next)?;
            spilled.offsets.push(spilled.next);
            spilled.next += bytes.len() as u64;
        }
        self.held.push(level);
        Ok(())
    }

    /// That of photograph `at`, as it was made.
    pub(crate) fn read(&self, at: usize) -> Result<Cow<'_, CoarseLevel>> {
        let level = &self.held[at];
        let Some(spilled) = &self.spilled else { return Ok(Cow::Borrowed(level)) };
        let PyramidPlane { columns, rows, .. } = &level.plane;
        let texels = read_pixels(spilled.file.as_ref(), spilled.offsets[at], columns.len() * rows.len())?;
        Ok(Cow::Owned(CoarseLevel { plane: PyramidPlane { columns: columns.clone(), rows: rows.clone(), texels } }))
    }

    /// Makes those that are in memory ready for tiles.
    pub(crate) fn level_all(&mut self) {
        if self.spilled.is_none() {
            self.held.iter_mut().for_each(|level| level_shares(&mut level.plane));
        }
    }

    /// Has exactly those of `wanted` photographs in memory, ready for tiles, if not all are.
    pub(crate) fn hold(&mut self, wanted: impl Fn(usize) -> bool) -> Result<()> {
        if self.spilled.is_none() {
            return Ok(());
        }
        for at in 0..self.held.len() {
            if !wanted(at) {
                self.held[at].plane.texels = Vec::new();
            } else if self.held[at].plane.texels.is_empty() {
                let mut level = self.read(at)?.into_owned();
                level_shares(&mut level.plane);
                self.held[at] = level;
            }
        }
        Ok(())
    }

    /// A copy of that of photograph `at`, ready for tiles, after [`Self::level_all`].
    pub(crate) fn ready(&self, at: usize) -> Result<CoarseLevel> {
        let mut level = self.read(at)?.into_owned();
        if self.spilled.is_some() {
            level_shares(&mut level.plane);
        }
        Ok(level)
    }

    /// Those of some placements, ready for tiles; the others are empty.
    pub(crate) fn of_some(count: usize, some: impl IntoIterator<Item = (usize, CoarseLevel)>) -> Self {
        let mut held = vec![CoarseLevel::default(); count];
        for (at, level) in some {
            if let Some(held) = held.get_mut(at) {
                *held = level;
            }
        }
        Self { held, spilled: None }
    }

    /// That of photograph `at`, which is in memory.
    pub(crate) fn at(&self, at: usize) -> &CoarseLevel {
        &self.held[at]
    }
}

/// Bytes of a sample.
pub(crate) const SAMPLE_BYTES: usize = <[f32; 4] as Pixel>::BYTES;
