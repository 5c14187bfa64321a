//! What the refinements of the mesh are made from: the working pictures' pixels, matched lines, long lines.

use std::borrow::Cow;

use rayon::prelude::*;
use trueup_align::match_points::OverlapWarp;
use trueup_align::mesh::{GrayPyramid, LineAlignmentInput, PhotometricInput, Refinements, StraightInput};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::lines::PairLines;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::line_matching::{self, PhotographWithLines};

use super::component::Component;
use crate::options::{AlignOptions, Evidence};
use crate::pipeline::measure::{THUMBNAIL_PIXELS, eight_bit};

/// The code of the note that lines and pixels were taken because of parallax.
pub(crate) const PARALLAX: &str = "parallax";

/// Whether the mesh is to be refined whatever comes, so that the photographs' pixels are worth keeping.
pub(crate) fn needs_pixels(options: &AlignOptions) -> bool {
    options.stitch.align.uses_lines() || options.stitch.align.uses_pixels()
}

/// What draws overlaps together where it is left to the photographs, of whose matched points `misaligned_share` stay
/// apart by what neighbors have in common.
///
/// The note `parallax` says so where lines and pixels are taken.
pub(super) fn asked_for(misaligned_share: f64, context: &StageContext) -> Evidence {
    /// Photographs taken from one point come to less (65 of 66 sets with known cameras, 32 of 33 in which people walk).
    /// Of 60 photographed sets, the same 51 come to more by what stayed as came to 0.015 by all.
    const WORTH_REFINING: f64 = 0.012;
    if misaligned_share < WORTH_REFINING {
        return Evidence::Points;
    }
    let percent = 100.0 * misaligned_share;
    context.report(Diagnostic::note(
        PARALLAX,
        Subject::stage("mesh"),
        format!(
            "matched lines and pixels align it as well: {percent:.0} % of the matched points are kept apart by parallax"
        ),
        "",
    ));
    Evidence::LinesPhotometric
}

/// What the refinements by some evidence are made from.
#[derive(Debug)]
pub(super) struct RefinementSources {
    evidence: Evidence,
    pyramids: Vec<GrayPyramid>,
    matched: Vec<PairLines>,
}

impl RefinementSources {
    /// Pyramids and line matches from the pixels that were kept; photographs that were measured without keeping theirs
    /// are decoded again.
    ///
    /// # Errors
    /// Those of decoding; [`trueup_core::Error::Cancelled`].
    pub(super) fn new(
        evidence: Evidence,
        component: &Component,
        grids: &[GridMesh],
        warps: &[OverlapWarp],
        photographs: &FilePhotographs,
        context: &StageContext,
    ) -> Result<Self> {
        let mut sources = Self { evidence, pyramids: Vec::new(), matched: Vec::new() };
        let grays: Vec<Cow<Raster<u8>>> = (0..component.members.len())
            .into_par_iter()
            .map(|k| {
                context.check_cancelled()?;
                if let Some(kept) = component.grays[k] {
                    return Ok(Cow::Borrowed(kept));
                }
                let picture = photographs.working(component.members[k], &component.frames[k], THUMBNAIL_PIXELS)?;
                Ok(Cow::Owned(eight_bit(&picture.gray)))
            })
            .collect::<Result<_>>()?;
        if evidence.uses_lines() {
            let each_once: Vec<&OverlapWarp> = warps.iter().filter(|warp| warp.from < warp.to).collect();
            sources.matched = each_once
                .into_par_iter()
                .map(|warp| {
                    context.check_cancelled()?;
                    let side = |k: usize| PhotographWithLines { gray: &grays[k], lines: &component.lines[k] };
                    let (a, b) = (side(warp.from), side(warp.to));
                    let carry = |point| warp.at(&grids[warp.from], point);
                    let found = line_matching::find(a, b, carry);
                    let lines = found.iter().map(|one| [a.lines[one.in_a], b.lines[one.in_b]]).collect();
                    Ok(PairLines { a: warp.from, b: warp.to, lines })
                })
                .collect::<Result<_>>()?;
        }
        if evidence.uses_pixels() {
            sources.pyramids = grays.par_iter().map(|gray| GrayPyramid::new(gray)).collect();
        }
        Ok(sources)
    }

    /// The refinements by the evidence. `met` are the pairs whose overlaps are to coincide.
    pub(super) fn refinements<'a>(
        &'a self,
        component: &'a Component,
        met: &'a [PairMatches],
        options: &'a AlignOptions,
    ) -> Refinements<'a> {
        let AlignOptions { line_alignment, photometric, mesh, .. } = options;
        let lines = LineAlignmentInput { matched: &self.matched, points: met, options: line_alignment };
        let pixels = PhotometricInput { pyramids: &self.pyramids, options: photometric };
        Refinements {
            lines: self.evidence.uses_lines().then_some(lines),
            straight: (line_alignment.straightness > 0.0)
                .then_some(StraightInput { lines: &component.lines, options: line_alignment }),
            photometric: self.evidence.uses_pixels().then_some(pixels),
            outline_weight: mesh.outline_weight,
        }
    }
}
