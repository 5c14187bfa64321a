//! From an alignment to its panorama.

use std::path::{Path, PathBuf};

use trueup_compose::crop::Coverage;
use trueup_compose::fidelity::{self, Fidelity};
use trueup_compose::gaps::Gaps;
use trueup_compose::layout::CanvasLayout;
use trueup_compose::render::{self, RenderInput, Rendered};
use trueup_core::Result;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_io::encode::{self, Metadata};
use trueup_io::scratch::{ScratchFolder, check_room};

use super::{Alignment, Stitcher};
use crate::budget::Budget;
use crate::provenance;

impl Alignment {
    /// What the panorama is rendered from.
    pub(crate) fn render_input(&self) -> RenderInput<'_> {
        RenderInput { layout: &self.layout, corrections: &self.corrections, photographs: self.photographs.as_ref() }
    }
}

impl<'a> Stitcher<'a> {
    /// Says where composed panoramas will be written: scratch files go into the same folder, unless `stitch.scratch` names
    /// one, and leave room for them. Without, scratch files go where the system wants temporary files.
    #[must_use]
    pub fn writing_to(self, output: &'a Path) -> Self {
        Self { output: Some(output), ..self }
    }

    /// Renders an aligned panorama from the full-resolution photographs, within `stitch.memory`.
    ///
    /// # Errors
    /// Those of reading the photographs and of a scratch file; [`Error::Limits`] with the numbers, before any photograph is
    /// read, if the canvas is too large for the memory or the disk; [`Error::Cancelled`].
    ///
    /// [`Error::Cancelled`]: trueup_core::Error::Cancelled
    /// [`Error::Limits`]: trueup_core::Error::Limits
    pub fn compose(&self, alignment: &Alignment) -> Result<Rendered> {
        let layout = &alignment.layout;
        let scratch = self.scratch(layout)?;
        let mut rendered = render::run(
            &alignment.render_input(),
            &Budget::new(self.options).composing(alignment.photographs.kept_bytes(), &scratch),
            &self.options.render,
            &self.options.seam,
            self.context,
        )?;
        if self.options.canvas.fill > 0.0 {
            let gaps = Gaps::find(layout, Coverage::of(layout), self.options.canvas.fill);
            let filled = rendered.panorama.fill(&gaps, self.context)?;
            self.report_filled(filled, layout);
        }
        Ok(rendered)
    }

    /// Says how much of a panorama no photograph shows.
    fn report_filled(&self, filled: usize, layout: &CanvasLayout) {
        if filled > 0 {
            let percent = 100.0 * filled as f64 / (layout.width as f64 * layout.height as f64);
            let message =
                format!("{percent:.2} % of it is shown by no photograph and was filled with a smooth surface");
            let hint = "Leave --fill out to leave it empty.";
            self.context.report(Diagnostic::note("gaps-filled", Subject::stage("panorama"), message, hint));
        }
    }

    /// Where a scratch file would go. Refuses a panorama for which there is no room.
    fn scratch(&self, layout: &CanvasLayout) -> Result<ScratchFolder> {
        let named = Some(&self.options.stitch.scratch).filter(|named| !named.is_empty()).map(PathBuf::from);
        let Some(output) = self.output else {
            return Ok(ScratchFolder::new(named.unwrap_or_else(std::env::temp_dir)));
        };
        let folder = output.parent().unwrap_or(Path::new(""));
        let bytes = encode::expected_bytes(output, layout.width, layout.height, &self.options.output);
        check_room(folder, bytes, "the panorama")?;
        Ok(ScratchFolder::new(named.unwrap_or_else(|| folder.to_owned())).beside(folder, bytes))
    }

    /// What the panorama's file is to tell: its color profile, and of its photographs what the options let pass.
    pub fn metadata(&self, alignment: &Alignment) -> Metadata {
        provenance::metadata(&alignment.project, alignment.photographs.colors(), &self.options.output)
    }

    /// Measures how true what was `rendered`, composed of `alignment`, is to its photographs: steps across its seams, and ghosts.
    /// Renders every photograph alone on the canvas, nine bytes a pixel of each.
    ///
    /// # Errors
    /// Those of reading the photographs; [`Error::Input`] if the two do not belong together; [`Error::Cancelled`].
    ///
    /// [`Error::Cancelled`]: trueup_core::Error::Cancelled
    /// [`Error::Input`]: trueup_core::Error::Input
    pub fn fidelity(&self, alignment: &Alignment, rendered: &Rendered) -> Result<Fidelity> {
        let layout = &alignment.layout;
        let layers = (0..layout.placed.len())
            .map(|position| {
                self.context.check_cancelled()?;
                render::layer(&alignment.render_input(), position, &self.options.render)
            })
            .collect::<Result<Vec<_>>>()?;
        let (size, around) = ([layout.width, layout.height], layout.period.is_some());
        let shown = match &rendered.seams {
            Some(seams) => seams.on_canvas(size),
            None => fidelity::deepest(&layers, size, around)?,
        };
        fidelity::measure(&rendered.panorama, &layers, &shown, around)
    }
}
