//! The compose phase: light, then seams and the panorama, from the full-resolution photographs.

use trueup_compose::crop::Coverage;
use trueup_compose::exposure::{self, Corrections, ExposureInput, Thumbnail};
use trueup_compose::gaps::Gaps;
use trueup_compose::layout::CanvasLayout;
use trueup_compose::render::{self, RenderInput, Rendered, Resources};
use trueup_core::diagnostics::{Diagnostic, Reported, Subject};
use trueup_core::raster::Raster;
use trueup_core::source::{PhotographSource, WorkingFrame};
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;

use crate::options::ComposeOptions;

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
    let curve = input.photographs.transfer_curve();
    let thumbnails: Vec<Thumbnail> = input
        .small
        .iter()
        .map(|one| Thumbnail { raster: one.thumbnail, curve: &curve, frame: one.frame, camera: one.camera })
        .collect();
    let light = ExposureInput { layout: input.layout, thumbnails: &thumbnails, reference: input.reference };
    context.gather(|context| {
        context.time("exposure", || Ok(exposure::run(&light, &options.exposure, context)?.corrections))
    })
}

/// What composing works on.
pub(crate) struct ComposeInput<'a> {
    /// Photographs, their places and their light.
    pub render: RenderInput<'a>,
    /// What it may take of the machine.
    pub resources: Resources<'a>,
    /// Largest gap that is filled, `canvas.fill`.
    pub fill: f64,
}

/// Renders a panorama.
///
/// # Errors
/// Those of reading the photographs and of a scratch file; [`trueup_core::Error::Limits`];
/// [`trueup_core::Error::Cancelled`].
pub(crate) fn run(
    input: &ComposeInput,
    options: &ComposeOptions,
    context: &StageContext,
) -> Result<Reported<Rendered>> {
    let ComposeInput { render: photographs, resources, fill } = input;
    context.gather(|context| {
        let mut rendered = render::run(photographs, resources, &options.render, &options.seam, context)?;
        if *fill > 0.0 {
            let gaps = Gaps::find(photographs.layout, Coverage::of(photographs.layout), *fill);
            let filled = rendered.panorama.fill(&gaps, context)?;
            report_filled(filled, photographs.layout, context);
        }
        Ok(rendered)
    })
}

/// Says how much of a panorama no photograph shows.
fn report_filled(filled: usize, layout: &CanvasLayout, context: &StageContext) {
    if filled > 0 {
        let percent = 100.0 * filled as f64 / (layout.width as f64 * layout.height as f64);
        let message = format!("{percent:.2} % of it is shown by no photograph and was filled with a smooth surface");
        let hint = "Leave --fill out to leave it empty.";
        context.report(Diagnostic::note("gaps-filled", Subject::stage("panorama"), message, hint));
    }
}
