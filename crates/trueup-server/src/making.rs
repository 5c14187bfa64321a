//! From wishes to panoramas: stitched, drawn small, cut into tiles, written to files. All of it is the library's work;
//! what is said here is what of it is asked for.

use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};

use serde::Serialize;
use trueup::{
    Alignment, Canvas, Error, Inputs, Metadata, OutputOptions, Outputs, PhotographCache, Project, ProjectionRecord,
    Rendered, Result, SideOutput, StageContext, StitchOptions, Stitcher, write_picture,
};

use crate::keeping::Companions;
use crate::layers::Underlay;
use crate::limits::PREVIEW_PIXELS;
use crate::studio::{Export, ExportedFile, Stitched, Studio, Tiles, Wishes};

/// How a color without opacity is written.
const TRANSPARENT: &str = "transparent";

/// Stitches the photographs as is wished now.
///
/// # Errors
/// Those of [`Stitcher::align`].
pub(crate) fn stitch(studio: &Studio, context: &StageContext) -> Result<()> {
    let (inputs, options, wishes) = {
        let state = studio.state();
        let wishes = state.history.now().clone();
        let wanted = state.photographs.iter().enumerate().filter(|(number, _)| !wishes.left_out.contains(number));
        let photographs: Vec<String> = wanted.map(|(_, listed)| listed.path.display().to_string()).collect();
        let inputs = Inputs { masks: wishes.mask_files(&state.photographs), ..Inputs::new(photographs) };
        (inputs, state.options()?, wishes)
    };
    let cache = PhotographCache::open(&studio.desk.path().join("cache"), options.run.resources.cache_bytes)?;
    let stitcher = Stitcher::new(&options, context).with_cache(Some(&cache));
    let aligned = stitcher.align(&inputs)?.alignments.into_iter().next();
    let alignment =
        aligned.ok_or_else(|| Error::input("photographs", "there is nothing to stitch", "Add photographs."))?;
    keep(studio, context, Kept { alignment, options, wishes })
}

/// What is kept of stitching.
pub(crate) struct Kept {
    pub alignment: Alignment,
    pub options: StitchOptions,
    pub wishes: Wishes,
}

/// Keeps a geometry, unless it was stopped meanwhile.
///
/// # Errors
/// [`Error::Cancelled`].
pub(crate) fn keep(studio: &Studio, context: &StageContext, kept: Kept) -> Result<()> {
    context.check_cancelled()?;
    let Kept { alignment, options, wishes } = kept;
    let older = studio.change(|state| {
        let number = state.number();
        state.stitched = Some(Stitched { number, alignment: Arc::new(alignment), options, wishes });
        state.tiles.take()
    });
    remove_folders(older.map(|tiles| tiles.folder));
    Ok(())
}

/// What is to be made of a geometry.
struct Order {
    stitched: Stitched,
    /// Those of the geometry as it was stitched, of view and light as they are wished.
    options: StitchOptions,
    wishes: Wishes,
}

impl Order {
    /// The order for what is wished now, but for `changes`.
    fn new(studio: &Studio, changes: &[(String, String)]) -> Result<Self> {
        let state = studio.state();
        let hint = "Stitch the photographs first.";
        let stitched = state.stitched.clone().ok_or_else(|| Error::input("panorama", "there is none yet", hint))?;
        let mut wishes = state.history.now().clone();
        wishes.options.extend(changes.iter().cloned());
        let wished = wishes.options(&state.base)?;
        let options = StitchOptions { arrange: wished.arrange, compose: wished.compose, ..stitched.options.clone() };
        Ok(Self { stitched, options, wishes })
    }

    /// The geometry arranged as is ordered: the very one that was stitched, where nothing else is.
    fn alignment(&self, stitcher: &Stitcher) -> Result<Alignment> {
        match self.options == self.stitched.options {
            true => Ok(self.stitched.alignment.as_ref().clone()),
            false => stitcher.rearrange(&self.stitched.alignment, None),
        }
    }

    /// What drawings over a picture are made from that was `rendered` of `alignment`.
    fn underlay(&self, alignment: &Alignment, rendered: &Rendered) -> Underlay {
        Underlay::of(alignment, rendered, &self.stitched.alignment.project)
    }

    /// How pictures for the page are written: with the background that is wished, all else as is usual.
    fn picture_options(&self) -> Result<OutputOptions> {
        let mut options = StitchOptions::default();
        if self.is_transparent() {
            options.set("output.dzi_format=png")?;
        }
        let background = self.options.compose.output.background;
        Ok(OutputOptions { background, ..options.compose.output })
    }

    fn is_transparent(&self) -> bool {
        self.wishes.options.get("output.background").is_some_and(|color| color == TRANSPARENT)
    }
}

/// What pictures for the page tell: how their colors are meant, and nothing that the photographs say of themselves.
fn colors_alone(metadata: &Metadata) -> Metadata {
    Metadata { icc: metadata.icc.clone(), ..Metadata::default() }
}

/// A panorama drawn small.
#[derive(Debug, Serialize)]
pub(crate) struct Preview {
    #[serde(skip)]
    pub bytes: Vec<u8>,
    #[serde(skip)]
    pub media_type: &'static str,
    #[serde(skip)]
    pub underlay: Arc<Underlay>,
    /// The geometry that it shows.
    pub stitched: u64,
    pub canvas: Canvas,
    pub projection: Option<ProjectionRecord>,
    /// What was found on the way and makes it worse, in words.
    pub warnings: Vec<Warning>,
}

/// Something that makes a panorama worse.
#[derive(Debug, Serialize)]
pub(crate) struct Warning {
    pub subject: String,
    pub message: String,
    pub hint: String,
}

/// What makes a panorama worse, in words.
pub(crate) fn warnings(project: &Project) -> Vec<Warning> {
    let names = project.photograph_names();
    let told = project.warnings().map(|one| Warning {
        subject: one.subject.named(&names),
        message: one.message.clone(),
        hint: one.hint.clone(),
    });
    told.collect()
}

/// Draws the panorama small, as is wished now but for `changes`, which are not kept.
///
/// # Errors
/// Those of [`Stitcher::rearrange`] and [`Stitcher::compose`].
pub(crate) fn preview(studio: &Studio, changes: &[(String, String)]) -> Result<Preview> {
    let _one_at_a_time = studio.drawing.lock().unwrap_or_else(PoisonError::into_inner);
    let mut order = Order::new(studio, changes)?;
    let canvas = &mut order.options.arrange.canvas;
    canvas.max_pixels = canvas.max_pixels.min(PREVIEW_PIXELS);
    let context = StageContext::default();
    studio.pool.install(|| {
        let stitcher = Stitcher::new(&order.options, &context);
        let mut alignment = order.alignment(&stitcher)?;
        let rendered = stitcher.compose(&mut alignment)?;
        let (extension, media_type) = if order.is_transparent() { ("png", "image/png") } else { ("jpg", "image/jpeg") };
        let place = studio.pictures().join(format!("preview.{extension}"));
        let metadata = colors_alone(&stitcher.metadata(&alignment));
        write_picture(&place, &rendered.panorama, &metadata, &order.picture_options()?, &context)?;
        let bytes = std::fs::read(&place).map_err(|error| Error::io("reading", &place, error))?;
        let underlay = Arc::new(order.underlay(&alignment, &rendered));
        let warnings = warnings(&alignment.project);
        let project = alignment.project;
        let (canvas, projection) = (project.canvas, project.projection);
        Ok(Preview { bytes, media_type, underlay, stitched: order.stitched.number, canvas, projection, warnings })
    })
}

/// Cuts the whole panorama into tiles, as is wished now.
///
/// # Errors
/// Those of composing and writing.
pub(crate) fn cut_tiles(studio: &Studio, context: &StageContext) -> Result<()> {
    let order = Order::new(studio, &[])?;
    let number = studio.change(crate::studio::State::number);
    let folder = studio.pictures().join(format!("tiles-{number}"));
    make_folder(&folder)?;
    let stitcher = Stitcher::new(&order.options, context);
    let mut alignment = order.alignment(&stitcher)?;
    let rendered = stitcher.compose(&mut alignment)?;
    let metadata = colors_alone(&stitcher.metadata(&alignment));
    write_picture(&folder.join("panorama.dzi"), &rendered.panorama, &metadata, &order.picture_options()?, context)?;
    let underlay = Arc::new(order.underlay(&alignment, &rendered));
    let stitched = order.stitched.number;
    let tiles = Tiles { number, folder, underlay, stitched, wishes: order.wishes };
    let older = studio.change(|state| state.tiles.replace(tiles));
    remove_folders(older.map(|tiles| tiles.folder));
    Ok(())
}

/// Files that are asked for.
#[derive(Debug)]
pub(crate) struct ExportOrder {
    /// The name of the panorama's file.
    pub name: String,
    /// What is wanted beside it, by their files' names.
    pub beside: Vec<(SideOutput, String)>,
    /// Whether they are to be put into the folder that is open, and not to be fetched.
    pub into_folder: bool,
}

impl ExportOrder {
    /// Whether one of them is a record that names photographs and masks.
    fn has_record(&self) -> bool {
        self.beside.iter().any(|(kind, _)| matches!(kind, SideOutput::Project | SideOutput::HuginProject))
    }
}

/// Writes the panorama, and what is wanted beside it, as is wished now.
///
/// # Errors
/// Those of [`Outputs::write`]; [`Error::Input`] where a file is there already.
pub(crate) fn export(studio: &Studio, ordered: &ExportOrder, context: &StageContext) -> Result<()> {
    let order = Order::new(studio, &[])?;
    let number = studio.change(crate::studio::State::number);
    let open = studio.state().folder.clone().filter(|_| ordered.into_folder);
    let folder = match &open {
        Some(folder) => folder.path().to_owned(),
        None => {
            let folder = studio.exports().join(number.to_string());
            make_folder(&folder)?;
            folder
        }
    };
    let mut outputs = Outputs::new(folder.join(&ordered.name));
    for (kind, name) in &ordered.beside {
        outputs = outputs.with(*kind, folder.join(name));
    }
    let names: Vec<&String> =
        std::iter::once(&ordered.name).chain(ordered.beside.iter().map(|(_, name)| name)).collect();
    for name in &names {
        // A link to nowhere is there, too.
        if folder.join(name).symlink_metadata().is_ok() {
            return Err(Error::input(name, "there is a file of this name already", "Take another name."));
        }
    }
    outputs.check(&order.options)?;
    let stitcher = Stitcher::new(&order.options, context);
    let mut alignment = order.alignment(&stitcher)?;
    let companions = match ordered.has_record() {
        true => {
            let among = open.is_some().then_some(folder.as_path());
            Companions::of(&alignment.project, &ordered.name, &studio.dropped(), among)
        }
        false => Companions::default(),
    };
    alignment.project.rename_files(companions.renamed());
    companions.copy_to(&folder)?;
    outputs.write(&stitcher, alignment).inspect_err(|_| companions.remove_from(&folder))?;
    let length = |name: &String| std::fs::metadata(folder.join(name)).map_or(0, |facts| facts.len());
    let names = names.into_iter().chain(companions.names());
    let files = names.map(|name| ExportedFile { name: name.clone(), bytes: length(name) }).collect();
    let to_fetch = open.is_none().then_some(folder);
    let forgotten = studio.change(|state| {
        state.exports.push(Export { number, folder: to_fetch, files });
        let too_many = state.exports.len().saturating_sub(crate::limits::MAX_EXPORTS);
        state.exports.drain(..too_many).collect::<Vec<_>>()
    });
    remove_folders(forgotten.into_iter().filter_map(|export| export.folder));
    Ok(())
}

/// The record of the panorama as is wished now, as the command writes it beside a panorama.
///
/// # Errors
/// Those of [`Stitcher::rearrange`].
pub(crate) fn record(studio: &Studio) -> Result<String> {
    let order = Order::new(studio, &[])?;
    let context = StageContext::default();
    studio.pool.install(|| {
        let stitcher = Stitcher::new(&order.options, &context);
        order.alignment(&stitcher)?.project.to_json()
    })
}

/// Removes folders of what is no longer shown. What cannot be removed goes with the desk.
pub(crate) fn remove_folders(folders: impl IntoIterator<Item = PathBuf>) {
    for folder in folders {
        drop(std::fs::remove_dir_all(folder));
    }
}

fn make_folder(folder: &Path) -> Result<()> {
    std::fs::create_dir(folder).map_err(|error| Error::io("making the folder", folder, error))
}
