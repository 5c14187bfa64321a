//! Cameras and overlaps of one group, found or remembered.

use std::collections::BTreeMap;
use std::sync::Arc;

use trueup_align::{cameras, match_points};
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};

use super::{Component, in_one_step};
use crate::clock::Clock;
use crate::memory::{OverlapMemory, Overlaps};
use crate::options::StitchOptions;

/// Cameras, the pairs that agree with them, and the grids carried across these.
pub(super) fn find(
    component: &Component,
    grids: &[GridMesh],
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
) -> Result<Overlaps> {
    let priors = component.camera_priors();
    let cameras = in_one_step("cameras", context, clock, || {
        let input = cameras::CameraInput { priors: &priors, pairs: &component.pairs, reference: component.reference };
        cameras::run(&input, &options.cameras, context)
    })?;
    let pairs: Vec<PairMatches> = (0..component.pairs.len())
        .filter(|position| cameras.contradicting.binary_search(position).is_err())
        .map(|position| component.pairs[position].clone())
        .collect();
    let warps = clock.time("match points", || {
        match_points::run(&component.frames, grids, &cameras.cameras, &pairs, &options.match_points, context)
    })?;
    Ok(Overlaps { cameras, pairs, warps, findings: Vec::new(), seconds: BTreeMap::new() })
}

/// [`find`], unless `memory` holds what it found: then that, with its findings and times.
pub(super) fn recall(
    memory: &OverlapMemory,
    component: &Component,
    grids: &[GridMesh],
    options: &StitchOptions,
    context: &StageContext,
    clock: &mut Clock,
) -> Result<Arc<Overlaps>> {
    let key = OverlapMemory::key(&component.members, component.reference, options);
    let overlaps = match memory.recall(&key) {
        Some(overlaps) => overlaps,
        None => {
            let mut own_clock = Clock::default();
            let found = context.gather(|context| find(component, grids, options, context, &mut own_clock))?;
            let overlaps = Overlaps { seconds: own_clock.into_seconds(), findings: found.findings, ..found.value };
            let overlaps = Arc::new(overlaps);
            memory.keep(key, &overlaps);
            overlaps
        }
    };
    overlaps.findings.iter().for_each(|one| context.report(one.clone()));
    clock.add_all(&overlaps.seconds);
    Ok(overlaps)
}
