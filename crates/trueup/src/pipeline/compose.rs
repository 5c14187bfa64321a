//! The compose phase: light, then seams and the panorama, from the full-resolution photographs.

use std::path::Path;

use serde::Serialize;
use trueup_compose::crop::{Coverage, Crop, Frame, Framing, Rectangle, SizeCheck};
use trueup_compose::exposure::{self, Corrections, ExposureInput, ExposureOptions, Thumbnail};
use trueup_compose::gaps::Gaps;
use trueup_compose::layout::{CanvasLayout, CanvasOptions};
use trueup_compose::render::{self, Look, RenderInput, Rendered, Resources};
use trueup_core::diagnostics::{Diagnostic, Reported, Subject};
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::source::{PhotographSource, WorkingFrame};
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_io::encode::{self, OutputOptions};

use crate::memo::{KeyMaker, LIGHT, Memo};
use crate::options::ComposeOptions;

/// The code of a panorama that was not cropped because too little would have been left.
pub const CROP_TOO_SMALL: &str = "crop-too-small";

/// A photograph's small copy, with the camera that took it.
#[derive(Debug)]
pub(crate) struct SmallPhotograph<'a> {
    pub thumbnail: &'a Raster<u8>,
    pub frame: WorkingFrame,
    /// Which camera took it: equal numbers for one camera.
    pub camera: usize,
}

/// What evening out the light works on.
#[derive(Debug)]
pub(crate) struct LightInput<'a> {
    /// The photographs, each placed once, in the order of `small`.
    pub layout: &'a CanvasLayout,
    pub small: Vec<SmallPhotograph<'a>>,
    /// Which of them the light is to be like.
    pub reference: usize,
    pub photographs: &'a FilePhotographs,
}

/// What evens out the light of the photographs.
///
/// # Errors
/// Those of [`exposure::run`].
pub(crate) fn light(
    input: &LightInput,
    options: &ComposeOptions,
    context: &StageContext,
) -> Result<Reported<Corrections>> {
    known_light(input, None, Memo::default(), options, context)
}

/// The options that decide how light is evened out.
#[derive(Debug, Serialize)]
struct LightOptions<'a> {
    exposure: &'a ExposureOptions,
    look: Look,
}

/// [`light`], unless an earlier run found it for the same photographs, decided by `key`, at the same places.
///
/// # Errors
/// Those of [`light`].
pub(crate) fn known_light(
    input: &LightInput,
    key: Option<KeyMaker>,
    memo: Memo,
    options: &ComposeOptions,
    context: &StageContext,
) -> Result<Reported<Corrections>> {
    let places: Vec<(usize, &GridMesh)> =
        input.layout.placed.iter().map(|placed| (placed.photograph, &placed.mesh)).collect();
    let size = (input.layout.width, input.layout.height, input.layout.period);
    let small: Vec<(WorkingFrame, usize)> = input.small.iter().map(|one| (one.frame, one.camera)).collect();
    let content = key.map(|key| key.part(&places).part(&size).part(&small).part(&input.reference));
    let decisive = LightOptions { exposure: &options.exposure, look: options.render.look };
    let key = memo.key(LIGHT, content, &decisive);
    let is_whole = |known: &Reported<Corrections>| known.value.photographs.len() == input.small.len();
    match memo.recall(LIGHT, key.as_ref()).filter(is_whole) {
        Some(known) => Ok(known),
        None => memo.make(LIGHT, key.as_ref(), input, &decisive, evened_out, context),
    }
}

fn evened_out(input: &LightInput, options: &LightOptions, context: &StageContext) -> Result<Corrections> {
    let curve = input.photographs.transfer_curve();
    let thumbnails: Vec<Thumbnail> = input
        .small
        .iter()
        .map(|one| Thumbnail { raster: one.thumbnail, curve: &curve, frame: one.frame, camera: one.camera })
        .collect();
    let LightInput { layout, reference, .. } = *input;
    let light = ExposureInput { layout, thumbnails: &thumbnails, reference, look: options.look };
    context.time("exposure", || Ok(exposure::run(&light, options.exposure, context)?.corrections))
}

/// What composing works on.
pub(crate) struct ComposeInput<'a> {
    /// Photographs, their places and their light.
    pub render: RenderInput<'a>,
    /// What it may take of the machine.
    pub resources: Resources<'a>,
    /// What of the canvas is filled and kept.
    pub canvas: &'a CanvasOptions,
    /// What becomes of the canvas, if that is decided.
    pub kept: Option<Frame>,
    /// Where the panorama is to be written, if that is known.
    pub destination: Option<Destination<'a>>,
}

/// A file that a panorama is to be written to. Formats limit its sides, which is found before the panorama is composed
/// for nothing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Destination<'a> {
    pub path: &'a Path,
    pub options: &'a OutputOptions,
}

impl SizeCheck for Destination<'_> {
    fn check(&self, size: [usize; 2]) -> Result<()> {
        encode::check_size(self.path, size, self.options)
    }
}

/// What comes of composing.
pub(crate) struct Composed {
    /// The panorama, cropped.
    pub rendered: Rendered,
    /// What became of the canvas, if it was to be cropped.
    pub kept: Option<Frame>,
    /// See [`CropRecord::lost`](crate::project::record::CropRecord).
    pub lost: f64,
    /// See [`CropRecord::filled`](crate::project::record::CropRecord).
    pub filled: f64,
}

/// Renders a panorama, fills gaps, and crops it.
///
/// # Errors
/// Those of reading the photographs and of a scratch file; [`trueup_core::Error::Limits`];
/// [`trueup_core::Error::Cancelled`].
pub(crate) fn run(
    input: &ComposeInput,
    options: &ComposeOptions,
    context: &StageContext,
) -> Result<Reported<Composed>> {
    let ComposeInput { render: photographs, resources, canvas, kept, destination } = input;
    let layout = photographs.layout;
    let check = destination.as_ref().map(|destination| destination as &dyn SizeCheck);
    if let Some(check) = check.filter(|_| canvas.crop == Crop::None) {
        check.check([layout.width, layout.height])?;
    }
    context.gather(|context| {
        let render = |framing: Option<&Framing>| {
            context.time("render", || {
                render::run(photographs, resources, &options.render, &options.seam, framing, context)
            })
        };
        let fills = canvas.fill > 0.0;
        if !fills && canvas.crop == Crop::None {
            return Ok(Composed { rendered: render(None)?, kept: None, lost: 0.0, filled: 0.0 });
        }
        let photographed = context.time("crop", || Coverage::of(layout));
        let framing = Framing { coverage: &photographed, options: canvas, known: kept.as_ref(), check };
        // What is filled counts as covered: where all gaps are, the frame is chosen last.
        let mut rendered = render((!fills).then_some(&framing))?;
        context.time("crop", || {
            let photographed = match rendered.has_alpha {
                true => rendered.panorama.opaque_part(&photographed)?,
                false => photographed.clone(),
            };
            let framing = Framing { coverage: &photographed, ..framing };
            if !fills {
                return framed(rendered, layout, &framing, &photographed, context);
            }
            let gaps = Gaps::find(layout, photographed.clone(), canvas.fill);
            report_filled(rendered.panorama.fill(&gaps, context)?, layout, context);
            let coverage = gaps.filled_coverage();
            framed(rendered, layout, &Framing { coverage: &coverage, ..framing }, &photographed, context)
        })
    })
}

/// Crops what was rendered on the canvas of `layout`, and fills what is missing of what is kept.
fn framed(
    mut rendered: Rendered,
    layout: &CanvasLayout,
    framing: &Framing,
    photographed: &Coverage,
    context: &StageContext,
) -> Result<Composed> {
    context.check_cancelled()?;
    let frame = match rendered.frame.take() {
        Some(frame) => frame,
        None => framing.of_panorama(&rendered.panorama, layout)?,
    };
    let Frame::Part(kept) = frame else {
        let whole = Rectangle::whole([layout.width, layout.height]);
        report_kept_whole(photographed, &whole, framing.options, context);
        let kept = (framing.options.crop != Crop::None).then_some(Frame::Whole);
        return Ok(Composed { rendered, kept, lost: 0.0, filled: 0.0 });
    };
    let filled = match framing.gaps(layout, &kept) {
        Some(gaps) => rendered.panorama.fill(&gaps, context)?,
        None => 0,
    };
    rendered.panorama.crop(&kept)?;
    let share = |part: usize, of: usize| part as f64 / of.max(1) as f64;
    let lost = 1.0 - share(photographed.area_within(&kept), photographed.area());
    let filled = share(filled, kept.area());
    Ok(Composed { rendered, kept: Some(Frame::Part(kept)), lost, filled })
}

/// Says how much of a panorama no photograph shows.
fn report_filled(filled: usize, layout: &CanvasLayout, context: &StageContext) {
    if filled > 0 {
        let percent = 100.0 * filled as f64 / (layout.width as f64 * layout.height as f64);
        let message = format!("{percent:.2} % of it is shown by no photograph and was filled with what lies beside it");
        let hint = "Leave --fill out to leave it empty.";
        context.report(Diagnostic::note("gaps-filled", Subject::stage("panorama"), message, hint));
    }
}

/// Says that a panorama was not cropped though that was wanted.
fn report_kept_whole(photographed: &Coverage, whole: &Rectangle, options: &CanvasOptions, context: &StageContext) {
    let empty = whole.area() - photographed.area();
    if options.crop != Crop::None && empty > 0 {
        let percent = 100.0 * empty as f64 / whole.area() as f64;
        let message = format!(
            "it was not cropped, and {percent:.0} % of it are empty: no rectangle without holes keeps {:.0} % of what the \
             photographs show",
            100.0 * options.min_kept
        );
        let hint = "Give --crop rectangle to crop it all the same, or another --projection.";
        context.report(Diagnostic::note(CROP_TOO_SMALL, Subject::stage("panorama"), message, hint));
    }
}
