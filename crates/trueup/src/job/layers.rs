//! What people who finish a panorama by hand want beside it: every photograph as a layer, and who is shown where.

use std::path::Path;

use trueup_compose::layout::CanvasLayout;
use trueup_compose::render::{self, Rendered};
use trueup_compose::seam::{NOBODY, Seams};
use trueup_core::{Error, Result};
use trueup_io::encode::{self, LabelMap, LayerPage, LayerSet, Metadata, OutputOptions};
use trueup_io::provenance::{self, PanoramaPart};

use crate::pipeline::{Alignment, Stitcher};

impl Alignment {
    /// Most bits that a sample of the photographs used has: 8, 16, or 32 and 64 for floating point.
    ///
    /// # Errors
    /// If a photograph's file can no longer be read.
    pub fn photograph_bits(&self) -> Result<u16> {
        let photographs = self.photographs();
        let mut bits = self.layout().placed.iter().map(|placed| photographs.sample_bits(placed.photograph));
        bits.try_fold(8, |most, bits| bits.map(|bits| most.max(bits)))
    }

    fn name(&self, position: usize) -> String {
        self.photographs().sources()[self.layout().placed[position].photograph].name.clone()
    }
}

impl Stitcher<'_> {
    /// How the panorama is written to `path`: the options, with the depth that its photographs ask for.
    ///
    /// # Errors
    /// Those of [`Alignment::photograph_bits`].
    pub fn output_options(&self, alignment: &Alignment, path: &Path) -> Result<OutputOptions> {
        let output = &self.options().compose.output;
        // Photographs are asked only where it matters.
        match output.depth {
            encode::Depth::Auto => Ok(output.with_depth_for(path, alignment.photograph_bits()?)),
            _ => Ok(output.clone()),
        }
    }

    /// Writes every photograph of `alignment`, aligned and corrected, to a page of a TIFF; returns its length in bytes.
    ///
    /// # Errors
    /// Those of [`encode::write_layers`] and of reading the photographs.
    pub fn write_layers(&self, alignment: &Alignment, path: &Path) -> Result<u64> {
        let options = self.output_options(alignment, path)?;
        let layout = alignment.kept_layout();
        let shown = shown(&layout);
        let layers = Layers { stitcher: self, alignment, layout, shown };
        let metadata = Metadata {
            icc: self.metadata(alignment).icc,
            ..provenance::of_part(PanoramaPart::Layers, options.metadata)
        };
        encode::write_layers(path, &layers, &metadata, &options, self.context())
    }

    /// Writes which photograph what was `rendered`, composed of `alignment`, shows at every pixel to a PNG; returns its
    /// length in bytes.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if photographs were averaged; those of [`encode::write_labels`].
    pub fn write_seams(&self, alignment: &Alignment, rendered: &Rendered, path: &Path) -> Result<u64> {
        let seams = rendered.seams.as_ref().ok_or_else(no_seams)?;
        let labels = Labels { alignment, seams };
        let options = &self.options().compose.output;
        encode::write_labels(
            path,
            &labels,
            &provenance::of_part(PanoramaPart::Seams, options.metadata),
            options,
            self.context(),
        )
    }
}

/// The refusal of seams where photographs are averaged.
pub(crate) fn no_seams() -> Error {
    Error::Unsupported {
        what: "writing the seams of a panorama whose photographs are averaged".to_owned(),
        hint: "Set render.blend to multiband or none.".to_owned(),
    }
}

/// Positions of the photographs that lie on the canvas.
fn shown(layout: &CanvasLayout) -> Vec<usize> {
    (0..layout.placed.len()).filter(|&position| !render::layer_size(layout, position).contains(&0)).collect()
}

struct Layers<'a> {
    stitcher: &'a Stitcher<'a>,
    alignment: &'a Alignment,
    /// That of the panorama.
    layout: CanvasLayout,
    shown: Vec<usize>,
}

impl LayerSet for Layers<'_> {
    fn whole(&self) -> [usize; 2] {
        [self.layout.width, self.layout.height]
    }

    fn count(&self) -> usize {
        self.shown.len()
    }

    fn pixels(&self) -> u64 {
        let size = |&position: &usize| render::layer_size(&self.layout, position);
        self.shown.iter().map(size).map(|[width, height]| width as u64 * height as u64).sum()
    }

    fn open(&self, index: usize) -> Result<LayerPage<'_>> {
        let position = self.shown[index];
        let options = &self.stitcher.options().compose.render;
        let rows = render::layer_rows(&self.alignment.render_input_on(&self.layout), position, options)?;
        let name = self.alignment.name(position);
        let rows = rows.ok_or_else(|| Error::input(&name, "it lies outside the panorama", "Leave it out."))?;
        Ok(LayerPage { name, corner: [rows.left, rows.top], rows: Box::new(rows) })
    }
}

struct Labels<'a> {
    alignment: &'a Alignment,
    seams: &'a Seams,
}

impl LabelMap for Labels<'_> {
    fn size(&self) -> [usize; 2] {
        self.alignment.kept().size()
    }

    fn names(&self) -> Vec<String> {
        (0..self.alignment.layout().placed.len()).map(|position| self.alignment.name(position)).collect()
    }

    fn row(&self, y: usize, row: &mut Vec<u16>) -> Result<()> {
        let (layout, kept) = (self.alignment.layout(), self.alignment.kept());
        self.seams.row(kept.rows.start + y, &kept.columns, [layout.width, layout.height], row);
        // The first photograph is 1; NOBODY is the largest label.
        row.iter_mut().for_each(|label| *label = if *label == NOBODY { encode::NOTHING } else { *label + 1 });
        Ok(())
    }
}
