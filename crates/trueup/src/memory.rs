//! What earlier alignments of the same matches found, so that experiments need not find it again.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use trueup_align::cameras::Cameras;
use trueup_align::match_points::OverlapWarp;
use trueup_core::diagnostics::Diagnostic;
use trueup_core::matches::PairMatches;

use crate::options::StitchOptions;

/// Results kept, the latest first: enough for trials that take turns with a few forms of the mesh.
const KEPT: usize = 3;

/// Cameras and the overlaps that follow from them.
#[derive(Debug)]
pub(crate) struct Overlaps {
    pub cameras: Cameras,
    /// The pairs that the cameras agree with.
    pub pairs: Vec<PairMatches>,
    pub warps: Vec<OverlapWarp>,
    /// What was reported on the way.
    pub findings: Vec<Diagnostic>,
    /// Wall seconds that finding them took, by stage.
    pub seconds: BTreeMap<String, f64>,
}

/// A few [`Overlaps`] by what they were made from.
#[derive(Debug, Default)]
pub(crate) struct OverlapMemory(Mutex<Vec<(String, Arc<Overlaps>)>>);

impl OverlapMemory {
    /// What decides the overlaps of photographs that are matched already.
    pub fn key(members: &[usize], reference: usize, options: &StitchOptions) -> String {
        let StitchOptions { cameras, match_points, mesh, .. } = options;
        format!("{members:?} {reference} {cameras:?} {match_points:?} {}", mesh.cell_px)
    }

    pub fn recall(&self, key: &str) -> Option<Arc<Overlaps>> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.iter().find(|(made_from, _)| made_from == key).map(|(_, overlaps)| overlaps.clone())
    }

    pub fn keep(&self, key: String, overlaps: &Arc<Overlaps>) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(0, (key, overlaps.clone()));
        known.truncate(KEPT);
    }
}
