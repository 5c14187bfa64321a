//! Layers: one page for every photograph.

use std::io::{BufWriter, Write};
use std::path::Path;

use trueup_core::options::StageOptions;
use trueup_core::raster::RowSource;
use trueup_core::{Error, Result, StageContext};

use super::destination::check_sides;
use super::failure::WriteFailure;
use super::metadata::Metadata;
use super::options::{Depth, LayerExtent, OutputOptions};
use super::pending::{PendingFile, check_place};
use super::place::is_standard_output;
use super::strips::BUFFER_BYTES;
use crate::color::InSrgb;
use crate::format::{Output, SideLimit};
use crate::formats::tiff::TIFF;
use crate::formats::tiff::write::{PageForm, PagePlace, SIDES, TiffPages};

/// One page of a file of layers.
pub struct LayerPage<'a> {
    /// Its name.
    pub name: String,
    /// First column and row of the panorama that its pixels lie on.
    pub corner: [usize; 2],
    /// Its pixels, which lie within the panorama.
    pub rows: Box<dyn RowSource + 'a>,
}

impl std::fmt::Debug for LayerPage<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("LayerPage").field("name", &self.name).field("corner", &self.corner).finish()
    }
}

/// Layers to be written, opened one after the other.
pub trait LayerSet {
    /// Width and height of the panorama.
    fn whole(&self) -> [usize; 2];
    /// Number of layers.
    fn count(&self) -> usize;
    /// Pixels that all layers have together, to tell how large the file may become.
    fn pixels(&self) -> u64;
    /// Makes layer `index` ready; the one before is dropped by then.
    ///
    /// # Errors
    /// If its photograph cannot be had.
    fn open(&self, index: usize) -> Result<LayerPage<'_>>;
}

/// Checks that layers could be written to `path`, before the long work that makes them.
///
/// # Errors
/// As [`write_layers`].
pub fn check_layers_place(path: &Path) -> Result<()> {
    if TIFF.names(path) || is_standard_output(path) {
        return check_place(path);
    }
    Err(Error::Unsupported {
        what: format!("writing layers to {}", path.display()),
        hint: "End the name in .tif or .tiff, the format that holds several pages.".to_owned(),
    })
}

/// Writes layers to the pages of a TIFF at `path`, one layer in memory at a time; returns the file's length in bytes.
///
/// Every page has alpha, the name of its layer, its number, and its place in the panorama (XPosition, YPosition at 72
/// pixels an inch; ImageFullWidth, ImageFullLength). [`OutputOptions::layer_extent`] decides whether it is as large as
/// the panorama. Every page has all of `metadata`, whose EXIF is to say nothing of sizes and places. The file appears
/// complete or not at all.
///
/// # Errors
/// Those of [`write()`](crate::encode::write()), and of [`LayerSet::open`].
pub fn write_layers(
    path: &Path,
    set: &dyn LayerSet,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext,
) -> Result<u64> {
    options.check()?;
    check_layers_place(path)?;
    let [width, height] = set.whole();
    check_sides(path, SideLimit { advice: "Lower canvas.scale.", ..SIDES }, width, height)?;
    let mut pending = PendingFile::create(path)?;
    write_pages(pending.file(), set, metadata, options, context).map_err(|failure| failure.at(&pending.place()))?;
    context.check_cancelled()?;
    pending.commit()
}

/// Writes all pages to a file.
pub(super) fn write_pages(
    file: &mut dyn Output,
    set: &dyn LayerSet,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> std::result::Result<(), WriteFailure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    context.progress().begin(OutputOptions::STAGE, set.count() as u64);
    let form = PageForm::of_layers(options);
    write_each(&mut TiffPages::begin(&mut output, is_big(set, form, options))?, set, metadata, options, form, context)?;
    output.flush()?;
    context.progress().finish(OutputOptions::STAGE);
    Ok(())
}

/// Whether the file could become so large that its offsets need 64 bits.
fn is_big(set: &dyn LayerSet, form: PageForm, options: &OutputOptions) -> bool {
    let are_whole = options.layer_extent == LayerExtent::Canvas;
    form.is_big(form.pixels_of_layers(set.pixels(), set.count(), set.whole(), are_whole), options)
}

fn write_each(
    pages: &mut TiffPages<'_>,
    set: &dyn LayerSet,
    metadata: &Metadata,
    options: &OutputOptions,
    form: PageForm,
    context: &StageContext<'_>,
) -> std::result::Result<(), WriteFailure> {
    let whole = set.whole();
    let converted = metadata.profile_to_leave(options, options.depth == Depth::Float);
    let icc = metadata.icc.clone().filter(|_| converted.is_none());
    let metadata = Metadata { icc, ..metadata.clone() };
    for index in 0..set.count() {
        context.check_cancelled()?;
        let page = set.open(index)?;
        let in_srgb = converted.map(|icc| InSrgb::new(page.rows.as_ref(), icc)).transpose()?;
        let rows: &dyn RowSource = in_srgb.as_ref().map_or(page.rows.as_ref(), |rows| rows);
        let number = [index, set.count()].map(|number| u16::try_from(number).unwrap_or(u16::MAX));
        let corner = match options.layer_extent {
            LayerExtent::Cropped => page.corner,
            LayerExtent::Canvas => [0, 0],
        };
        let to_u32 = |pair: [usize; 2]| pair.map(|length| length as u32);
        let place = PagePlace { name: &page.name, number, corner: to_u32(corner), whole: to_u32(whole) };
        // The progress of the whole file is that of its pages.
        let quiet = context.without_progress();
        match options.layer_extent {
            LayerExtent::Cropped => pages.add(rows, &metadata, form, Some(&place), &quiet)?,
            LayerExtent::Canvas => {
                let rows = OnCanvas { layer: rows, corner: page.corner, whole };
                pages.add(&rows, &metadata, form, Some(&place), &quiet)?;
            }
        }
        context.progress().advance(OutputOptions::STAGE, 1);
    }
    Ok(())
}

/// A layer with nothing around it.
struct OnCanvas<'a> {
    layer: &'a dyn RowSource,
    corner: [usize; 2],
    whole: [usize; 2],
}

impl OnCanvas<'_> {
    fn row<S: Copy + Default>(
        &self,
        y: usize,
        row: &mut [S],
        of_layer: impl FnOnce(usize, &mut [S]) -> Result<()>,
    ) -> Result<()> {
        row.fill(S::default());
        let [left, top] = self.corner;
        if (top..top + self.layer.height()).contains(&y) {
            of_layer(y - top, &mut row[4 * left..4 * (left + self.layer.width())])?;
        }
        Ok(())
    }
}

impl RowSource for OnCanvas<'_> {
    fn width(&self) -> usize {
        self.whole[0]
    }
    fn height(&self) -> usize {
        self.whole[1]
    }
    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        self.row(y, row, |y, row| self.layer.rgba8_row(y, row))
    }
    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        self.row(y, row, |y, row| self.layer.rgba16_row(y, row))
    }
    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        self.row(y, row, |y, row| self.layer.linear_row(y, row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::options::{TiffCompression, TiffLayout};

    /// Ten small layers on a panorama of 400 megapixels, which with alpha takes 1.6 GB.
    struct Few;

    impl LayerSet for Few {
        fn whole(&self) -> [usize; 2] {
            [40_000, 10_000]
        }
        fn count(&self) -> usize {
            10
        }
        fn pixels(&self) -> u64 {
            10 * 1_000 * 1_000
        }
        fn open(&self, _: usize) -> Result<LayerPage<'_>> {
            Err(Error::input("layer", "it is not there", ""))
        }
    }

    #[test]
    fn pages_that_are_written_whole_count_whole() {
        let whole = OutputOptions {
            layer_extent: LayerExtent::Canvas,
            tiff_layout: TiffLayout::Strips,
            tiff_compression: TiffCompression::None,
            ..OutputOptions::default()
        };
        let is_big = |options: &OutputOptions| is_big(&Few, PageForm::of_layers(options), options);
        assert!(is_big(&whole), "16 GB");
        assert!(!is_big(&OutputOptions { layer_extent: LayerExtent::Cropped, ..whole.clone() }));
        assert!(!is_big(&OutputOptions { tiff_layout: TiffLayout::Tiles256, ..whole.clone() }));
        assert!(!is_big(&OutputOptions { tiff_compression: TiffCompression::Deflate, ..whole.clone() }));
        // Each layer reaches into no more tiles of 512 than lie along the sides of the panorama.
        assert!(!is_big(&OutputOptions { tiff_layout: TiffLayout::Tiles512, ..whole }));
    }
}
