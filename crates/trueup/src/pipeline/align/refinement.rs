//! What the refinements of the mesh are made from: the working pictures' pixels, matched lines, long lines.

use std::borrow::Cow;

use rayon::prelude::*;
use trueup_align::match_points::OverlapWarp;
use trueup_align::mesh::{
    GrayPyramid, LineAlignmentInput, PhotometricInput, Refinements, StraightInput, StructureInput,
};
use trueup_core::lines::{LineSegment, PairLines};
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::line_matching::{self, PhotographWithLines};
use trueup_vision::lines;

use super::component::Component;
use crate::options::{AlignOptions, Structure};
use crate::pipeline::measure::{THUMBNAIL_PIXELS, eight_bit};

/// Whether the mesh is refined by the photographs' pixels, so that they are worth keeping.
pub(crate) fn needs_pixels(options: &AlignOptions) -> bool {
    options.stitch.align.uses_lines() || options.stitch.align.uses_pixels()
}

/// What the refinements that the options ask for are made from.
#[derive(Debug, Default)]
pub(super) struct RefinementSources {
    pyramids: Vec<GrayPyramid>,
    matched: Vec<PairLines>,
    chains: Vec<Vec<LineSegment>>,
}

impl RefinementSources {
    /// Pyramids and line matches from the pixels that were kept; photographs that were measured without keeping theirs are
    /// decoded again.
    ///
    /// # Errors
    /// Those of decoding; [`trueup_core::Error::Cancelled`].
    pub(super) fn new(
        component: &Component,
        grids: &[GridMesh],
        warps: &[OverlapWarp],
        photographs: &FilePhotographs,
        options: &AlignOptions,
        context: &StageContext,
    ) -> Result<Self> {
        let mut sources = Self::default();
        if options.stitch.structure == Structure::Lines {
            sources.chains = component.lines.par_iter().map(|lines| lines::merged(lines)).collect();
        }
        if !needs_pixels(options) {
            return Ok(sources);
        }
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
        if options.stitch.align.uses_lines() {
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
        if options.stitch.align.uses_pixels() {
            sources.pyramids = grays.par_iter().map(|gray| GrayPyramid::new(gray)).collect();
        }
        Ok(sources)
    }

    /// The refinements that the options ask for. `met` are the pairs whose overlaps are to coincide.
    pub(super) fn refinements<'a>(
        &'a self,
        component: &'a Component,
        met: &'a [PairMatches],
        options: &'a AlignOptions,
    ) -> Refinements<'a> {
        let align = options.stitch.align;
        Refinements {
            closure: None,
            structure: (options.stitch.structure == Structure::Lines)
                .then_some(StructureInput { chains: &self.chains, options: &options.structure }),
            lines: align.uses_lines().then_some(LineAlignmentInput {
                matched: &self.matched,
                points: met,
                options: &options.line_alignment,
            }),
            straight: (needs_pixels(options) && options.line_alignment.straightness > 0.0)
                .then_some(StraightInput { lines: &component.lines, options: &options.line_alignment }),
            photometric: align
                .uses_pixels()
                .then_some(PhotometricInput { pyramids: &self.pyramids, options: &options.photometric }),
            outline_weight: options.mesh.outline_weight,
        }
    }
}
