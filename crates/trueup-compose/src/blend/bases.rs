//! The photographs' own coarse levels: in memory, or in the scratch file while they are not wanted.

use std::borrow::Cow;
use std::sync::Arc;

use trueup_core::Result;
use trueup_core::scratch::ScratchFile;

use super::pyramid::{Plane, level_shares};
use crate::render::store::{Pixel, read_pixels, to_bytes};

/// A photograph at the first level that is blended as a whole.
#[derive(Debug, Clone, Default)]
pub(super) struct Base {
    pub(super) plane: Plane<[f32; 4]>,
}

/// Every photograph's [`Base`].
#[derive(Debug, Default)]
pub(super) struct Bases {
    /// Those that are not in memory have no texels.
    held: Vec<Base>,
    spilled: Option<Spilled>,
}

#[derive(Debug)]
struct Spilled {
    file: Arc<dyn ScratchFile>,
    next: u64,
    /// Where each begins.
    offsets: Vec<u64>,
}

impl Bases {
    /// None so far; in memory, or in a file from an offset on.
    pub(super) fn new(file: Option<(Arc<dyn ScratchFile>, u64)>) -> Self {
        let spilled = file.map(|(file, next)| Spilled { file, next, offsets: Vec::new() });
        Self { held: Vec::new(), spilled }
    }

    pub(super) fn len(&self) -> usize {
        self.held.len()
    }

    /// Adds the next photograph's.
    pub(super) fn push(&mut self, mut base: Base) -> Result<()> {
        if let Some(spilled) = &mut self.spilled {
            let bytes = to_bytes(&std::mem::take(&mut base.plane.texels));
            spilled.file.write_at(&bytes, spilled.next)?;
            spilled.offsets.push(spilled.next);
            spilled.next += bytes.len() as u64;
        }
        self.held.push(base);
        Ok(())
    }

    /// That of photograph `at`, as it was made.
    pub(super) fn read(&self, at: usize) -> Result<Cow<'_, Base>> {
        let base = &self.held[at];
        let Some(spilled) = &self.spilled else { return Ok(Cow::Borrowed(base)) };
        let Plane { columns, rows, .. } = &base.plane;
        let texels = read_pixels(spilled.file.as_ref(), spilled.offsets[at], columns.len() * rows.len())?;
        Ok(Cow::Owned(Base { plane: Plane { columns: columns.clone(), rows: rows.clone(), texels } }))
    }

    /// Makes those that are in memory ready for tiles.
    pub(super) fn level_all(&mut self) {
        if self.spilled.is_none() {
            self.held.iter_mut().for_each(|base| level_shares(&mut base.plane));
        }
    }

    /// Has exactly those of `wanted` photographs in memory, ready for tiles, if not all are.
    pub(super) fn hold(&mut self, wanted: impl Fn(usize) -> bool) -> Result<()> {
        if self.spilled.is_none() {
            return Ok(());
        }
        for at in 0..self.held.len() {
            if !wanted(at) {
                self.held[at].plane.texels = Vec::new();
            } else if self.held[at].plane.texels.is_empty() {
                let mut base = self.read(at)?.into_owned();
                level_shares(&mut base.plane);
                self.held[at] = base;
            }
        }
        Ok(())
    }

    /// That of photograph `at`, which is in memory.
    pub(super) fn at(&self, at: usize) -> &Base {
        &self.held[at]
    }
}

/// Bytes of a sample.
pub(super) const SAMPLE_BYTES: usize = <[f32; 4] as Pixel>::BYTES;
