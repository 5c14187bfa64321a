//! A photograph at the finest level that is blended as a whole.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use trueup_core::mask::Masks;
use trueup_core::mesh::GridMesh;

use super::sampling::{HALVING, SAMPLING, scaled};
use crate::ignored::{IgnoredPart, ShownElsewhere};
use crate::layout::Placed;
use crate::light::PhotographLight;
use crate::pyramid::{LEAST_SHARE, NEXT_TO_NOTHING, PyramidPlane};
use crate::warped::{SamplingMemory, WarpedPhotograph};
use crate::window::Window;

/// A photograph at the first level that is blended as a whole.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct CoarseLevel {
    pub(crate) plane: PyramidPlane<[f32; 4]>,
}

/// Samples around a photograph that its coarser levels reach.
pub(crate) const RIM: usize = 8;

/// A photograph, and where it is to be sampled.
pub(super) struct CoarseLevelInput<'a> {
    /// The photograph as it was reduced for its small view.
    pub(super) larger: &'a WarpedPhotograph<'a>,
    pub(super) placed: &'a Placed,
    /// Its light on the canvas on which it is placed.
    pub(super) light: PhotographLight<'a>,
    /// Width and height of the canvas on which it is placed.
    pub(super) canvas: [usize; 2],
    /// Log2 of the canvas pixels per sample.
    pub(super) first_level: u32,
    pub(super) masks: &'a Masks,
    /// Where others are shown instead of what is ignored; `None` if nothing is.
    pub(super) elsewhere: Option<&'a Arc<ShownElsewhere>>,
}

impl CoarseLevel {
    /// Samples a photograph.
    pub(super) fn new(input: &CoarseLevelInput<'_>) -> Self {
        let level = input.first_level - SAMPLED_BELOW;
        let step = f64::from(1_u32 << level);
        // Sample i lies on the middle of pixel i * step.
        let mesh = scaled(&input.placed.mesh, [step.recip(); 2], 0.5 - 0.5 / step);
        let (photograph, [width, height]) = input.larger.photograph();
        let mesh = GridMesh { width, height, ..mesh };
        let size = input.canvas.map(|length| length.div_ceil(1 << level));
        let local = input.light.local.map(|local| local.over([step; 2], [0.5 - 0.5 * step; 2]));
        let light = PhotographLight { local: local.as_ref(), ..input.light };
        let warped = WarpedPhotograph::new(Cow::Borrowed(photograph), &mesh, size, light, &HALVING)
            .without(IgnoredPart::new(input.masks, input.elsewhere, size));
        // Room for the interpolated rim, from a sample that every coarser level has.
        let grown = |range: Range<usize>, length: usize| {
            (range.start / RIM * RIM).saturating_sub(RIM)..(range.end + RIM).min(length)
        };
        let (columns, rows) = (grown(warped.columns(), size[0]), grown(warped.rows(), size[1]));
        let mut plane = PyramidPlane::new(columns.clone(), rows.clone());
        let window = Window { columns: &columns, rows: &rows };
        warped.sample(window, &mut plane.texels, &SAMPLING, &mut SamplingMemory::default());
        for texel in &mut plane.texels {
            let [r, g, b, share] = *texel;
            *texel = [r * share, g * share, b * share, share];
        }
        Self { plane: coarser_than_two_samples(plane) }
    }
}

/// Photographs are sampled for the coarse levels at the level so far below the first level.
const SAMPLED_BELOW: u32 = 1;

/// The first level of a photograph from its samples [`SAMPLED_BELOW`] it: what of it is coarser than two samples.
///
/// Photographs are read at different places between their own samples; what they say of the finest contours there
/// differs although they agree. The band that is left out here is blended with the fine levels.
fn coarser_than_two_samples(sampled: PyramidPlane<[f32; 4]>) -> PyramidPlane<[f32; 4]> {
    let mut level = sampled;
    for _ in 0..SAMPLED_BELOW {
        level = level.reduced();
    }
    let mut base = level.reduced().expanded(&level.columns, &level.rows);
    spread(&mut base);
    base
}

/// Gives samples beside covered ones their neighbors' color with next to no share, so that finer samples between the
/// two always have something to be compared with.
fn spread(plane: &mut PyramidPlane<[f32; 4]>) {
    let (width, height) = (plane.columns.len(), plane.rows.len());
    let old = plane.texels.clone();
    for (at, texel) in plane.texels.iter_mut().enumerate() {
        if old[at][3] > LEAST_SHARE {
            continue;
        }
        let (x, y) = (at % width, at / width);
        let mut sum = [0.0_f32; 4];
        for v in y.saturating_sub(1)..(y + 2).min(height) {
            for u in x.saturating_sub(1)..(x + 2).min(width) {
                for (sum, value) in sum.iter_mut().zip(old[v * width + u]) {
                    *sum += value;
                }
            }
        }
        if sum[3] > LEAST_SHARE {
            *texel = sum.map(|value| value / sum[3] * NEXT_TO_NOTHING);
        }
    }
}
