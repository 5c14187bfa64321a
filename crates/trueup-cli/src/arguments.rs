//! What may be typed, before any of it is checked against the options' ranges or the disk.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// More threads than this are a typing mistake, and starting them would hang the machine.
const MAX_THREADS: i64 = 1024;

const EXAMPLES: &str = "\
Examples:
  trueup stitch holiday/ -o holiday.jpg
  trueup stitch IMG_01*.jpg -o pano.png --scale 0.5 --project pano.json
  trueup compose pano.json -o large.tif
  trueup inspect pano.json --verbose
  trueup evaluate pano.json --truth truth.json
  trueup compare holiday/ -o holiday-compared
  trueup options mesh";

const STITCH_EXAMPLES: &str = "\
Examples:
  trueup stitch a.jpg b.jpg c.jpg -o pano.jpg
  trueup stitch holiday/ -o pano.tif                     every picture of a folder
  trueup stitch 'holiday/IMG_*.jpg' -o pano.jpg --all    pano-1.jpg, pano-2.jpg, ...
  trueup stitch holiday/ -o small.webp --scale 0.25      a quick preview
  trueup stitch holiday/ -o pano.jpg --set mesh.cell_px=30 --set exposure.enabled=false
  trueup stitch holiday/ -o pano.jpg --config mine.toml  [mesh] cell_px = 30.0

Defaults are overruled by --config, that by --set, and that by the flags of their own (--scale, --quality, ...).

Exit status: 0 a panorama was written, 1 the input or the system failed, 2 wrong usage, 130 stopped by Ctrl-C.
The first Ctrl-C stops at the next safe place and leaves nothing half written; the second kills at once.";

/// Panoramas that stand upright: photographs in, a natural panorama out, and the reasons why it looks as it does.
#[derive(Debug, Parser)]
#[command(name = "trueup", version, after_help = EXAMPLES, max_term_width = 110)]
pub(crate) struct LowArgs {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Stitch photographs into a panorama
    ///
    /// Finds out by itself which photographs overlap. Those that belong elsewhere are left out, and the summary says why.
    Stitch(Box<StitchArgs>),
    /// Compose a stitched panorama again from its project: at another size, in another format, of other photographs
    ///
    /// Nothing is measured or matched: the geometry is the one that `stitch --project` recorded.
    Compose(Box<ComposeArgs>),
    /// Compare methods side by side: every method's panorama of the same photographs, with its measures, in one folder
    ///
    /// Photographs are measured and matched once. The folder holds a page to look at (index.html), a page on which people
    /// rank unnamed panoramas (ranking.html), every figure as JSON, the panoramas and their project files.
    Compare(Box<CompareArgs>),
    /// Print what a project file says of its panorama: the summary that `stitch` printed, with each picture's measures
    Inspect(InspectArgs),
    /// Print every measure of a panorama: its own, against the truth, and of the pixels where photographs overlap
    Evaluate(EvaluateArgs),
    /// List every option of every stage: default, range, unit, meaning
    Options(OptionsArgs),
}

#[derive(Debug, Args)]
#[command(after_help = STITCH_EXAMPLES)]
pub(crate) struct StitchArgs {
    /// Files, folders (their pictures, not those of folders inside) or glob patterns; JPEG, PNG, TIFF, WebP
    #[arg(value_name = "PHOTOS", required = true)]
    pub photographs: Vec<String>,

    /// The panorama; .jpg, .png, .tif, .webp or .dzi (Deep Zoom) chooses the format
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: PathBuf,

    /// Write the record of the stitch (geometry, pairs, reasons, timings) as JSON
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    pub project: Option<PathBuf>,

    #[command(flatten)]
    pub picture: PictureArgs,

    /// Stitch every group of overlapping photographs, not only the largest; several panoramas are numbered
    #[arg(long, help_heading = "Photographs")]
    pub all: bool,

    /// Fail unless every photograph given is used
    #[arg(long, help_heading = "Photographs")]
    pub require_all: bool,

    /// The photograph that sets the pixel scale and stays in place: auto, or its name
    #[arg(long, value_name = "auto|NAME", help_heading = "Photographs")]
    pub reference: Option<String>,

    /// Match only the pairs in this file, one `NAME -- NAME` a line
    #[arg(long, value_name = "FILE", help_heading = "Photographs")]
    pub graph: Option<PathBuf>,

    /// A picture of the photograph NAME's size: what is black or transparent in it is ignored, and not shown where another
    /// photograph can be; may be repeated
    #[arg(long, value_name = "NAME=FILE", help_heading = "Photographs")]
    pub mask: Vec<String>,

    /// A picture of the photograph NAME's size: what is white in it is shown; may be repeated
    #[arg(long, value_name = "NAME=FILE", help_heading = "Photographs")]
    pub keep: Vec<String>,

    /// Keep what is found in the photographs in this folder, so that later runs need not find it again
    #[arg(long, value_name = "DIR", help_heading = "Photographs")]
    pub cache: Option<PathBuf>,

    /// How the panorama's shape is found (stitch.method; `trueup options stitch` names the methods)
    #[arg(long, value_name = "METHOD", help_heading = "Tuning")]
    pub method: Option<String>,

    /// What draws overlapping photographs together: points, lines, photometric or lines+photometric (stitch.align)
    #[arg(long, value_name = "ALIGN", help_heading = "Tuning")]
    pub align: Option<String>,

    /// What is kept of the photographs' structure: none or lines (stitch.structure)
    #[arg(long, value_name = "STRUCTURE", help_heading = "Tuning")]
    pub structure: Option<String>,

    /// Every random choice derives from this number (stitch.seed)
    #[arg(long, value_name = "N", allow_hyphen_values = true, help_heading = "Tuning")]
    pub seed: Option<String>,

    /// Set any option of any stage; may be repeated
    #[arg(long, value_name = "STAGE.OPTION=VALUE", allow_hyphen_values = true, help_heading = "Tuning")]
    pub set: Vec<String>,

    /// Read options from a TOML file with a table per stage
    #[arg(long, value_name = "FILE.toml", help_heading = "Tuning")]
    pub config: Option<PathBuf>,

    /// Number of threads; 0 for one per core. The panorama is the same for any number
    #[arg(
        long,
        value_name = "N",
        allow_hyphen_values = true,
        value_parser = clap::value_parser!(u16).range(0..=MAX_THREADS),
        help_heading = "Tuning"
    )]
    pub threads: Option<u16>,

    #[command(flatten)]
    pub budget: BudgetArgs,

    /// Print nothing but errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Messages")]
    pub quiet: bool,

    /// Print also the pairs' verdicts, each picture's geometry, notes, and a line per stage's time
    #[arg(short, long, help_heading = "Messages")]
    pub verbose: bool,
}

/// What the panorama looks like, and what is written beside it.
#[derive(Debug, Args)]
pub(crate) struct PictureArgs {
    /// Write the cameras as a project of the Hugin stitcher
    #[arg(long, value_name = "FILE.pto", help_heading = "Output")]
    pub pto: Option<PathBuf>,

    /// Write the photographs as layers, aligned and corrected, one to a page (output.layer_extent)
    #[arg(long, value_name = "FILE.tif", help_heading = "Output")]
    pub layers: Option<PathBuf>,

    /// Write which photograph is shown where
    #[arg(long, value_name = "FILE.png", help_heading = "Output")]
    pub seams: Option<PathBuf>,

    /// Size of the panorama: 1 keeps the pixel scale of the reference photograph (canvas.scale)
    #[arg(long, value_name = "S", allow_hyphen_values = true, help_heading = "Output")]
    pub scale: Option<String>,

    /// JPEG quality (output.jpeg_quality)
    #[arg(long, value_name = "Q", allow_hyphen_values = true, help_heading = "Output")]
    pub quality: Option<String>,

    /// Bits of a sample: auto, 8, 16 or float (output.depth)
    #[arg(long, value_name = "DEPTH", help_heading = "Output")]
    pub depth: Option<String>,

    /// What the panorama is drawn on: mesh, auto, equirectangular, cylindrical, perspective, mercator, panini or
    /// stereographic (projection.kind)
    #[arg(long, value_name = "PROJECTION", help_heading = "View")]
    pub projection: Option<String>,

    /// Turn the viewer right, degrees; with a projection other than mesh, as the next three (projection.yaw)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, help_heading = "View")]
    pub yaw: Option<String>,

    /// Turn the viewer up, degrees (projection.pitch)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, help_heading = "View")]
    pub pitch: Option<String>,

    /// Turn the viewer clockwise, degrees (projection.roll)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, help_heading = "View")]
    pub roll: Option<String>,

    /// Horizontal field of view, degrees; without it, what is there as far as the projection carries (projection.fov)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, help_heading = "View")]
    pub fov: Option<String>,

    /// What is kept: none (all), rectangle (the largest without holes) or auto (that, if it keeps most) (canvas.crop)
    #[arg(long, value_name = "CROP", help_heading = "View")]
    pub crop: Option<String>,

    /// Fill gaps up to so wide, in shares of a photograph's side, with a smooth surface: 0.1 for ragged borders (canvas.fill)
    #[arg(long, value_name = "SHARE", allow_hyphen_values = true, help_heading = "View")]
    pub fill: Option<String>,

    /// What shows where no photograph is, in formats without transparency: black, gray or white (output.background)
    #[arg(long, value_name = "COLOUR", help_heading = "View")]
    pub background: Option<String>,
}

/// What the work may take.
#[derive(Debug, Args)]
pub(crate) struct BudgetArgs {
    /// Memory that the work may take, such as 2GB or 512MB; auto is a quarter of the machine's (stitch.memory)
    #[arg(long, value_name = "AMOUNT", help_heading = "Tuning")]
    pub memory: Option<String>,

    /// Folder for the scratch file of a panorama that does not fit in memory, instead of the output's (stitch.scratch)
    #[arg(long, value_name = "DIR", help_heading = "Tuning")]
    pub scratch: Option<String>,
}

const COMPOSE_EXAMPLES: &str = "\
Examples:
  trueup compose pano.json -o pano.tif                        the same panorama in another format
  trueup compose pano.json -o small.jpg --scale 0.25
  trueup compose pano.json -o round.jpg --projection equirectangular --crop auto
  trueup compose pano.json -o pano.jpg --photos developed/    other photographs of the same names and sizes

The options of the project are overruled by --config, that by --set, and that by the flags of their own. Options of what
comes before composing are recorded with the geometry: to change them, stitch again.

Exit status: 0 the panorama was written, 1 the input or the system failed, 2 wrong usage, 130 stopped by Ctrl-C.";

#[derive(Debug, Args)]
#[command(after_help = COMPOSE_EXAMPLES)]
pub(crate) struct ComposeArgs {
    /// A file that `trueup stitch --project` wrote
    #[arg(value_name = "PROJECT.json")]
    pub recorded: PathBuf,

    /// The panorama; .jpg, .png, .tif, .webp or .dzi (Deep Zoom) chooses the format
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: PathBuf,

    /// Write the new panorama's own record as JSON
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    pub project: Option<PathBuf>,

    #[command(flatten)]
    pub picture: PictureArgs,

    /// The folder of the photographs, if they moved, or of others of the same names and sizes
    #[arg(long, value_name = "DIR", help_heading = "Photographs")]
    pub photos: Option<PathBuf>,

    /// A picture of the photograph NAME's size: what is black or transparent in it is ignored, and not shown where another
    /// photograph can be; may be repeated
    #[arg(long, value_name = "NAME=FILE", help_heading = "Photographs")]
    pub mask: Vec<String>,

    /// A picture of the photograph NAME's size: what is white in it is shown; may be repeated
    #[arg(long, value_name = "NAME=FILE", help_heading = "Photographs")]
    pub keep: Vec<String>,

    /// Set any option of the stages from the canvas on; may be repeated
    #[arg(long, value_name = "STAGE.OPTION=VALUE", allow_hyphen_values = true, help_heading = "Tuning")]
    pub set: Vec<String>,

    /// Read options from a TOML file with a table per stage
    #[arg(long, value_name = "FILE.toml", help_heading = "Tuning")]
    pub config: Option<PathBuf>,

    /// Number of threads; 0 for one per core. The panorama is the same for any number
    #[arg(
        long,
        value_name = "N",
        allow_hyphen_values = true,
        value_parser = clap::value_parser!(u16).range(0..=MAX_THREADS),
        help_heading = "Tuning"
    )]
    pub threads: Option<u16>,

    #[command(flatten)]
    pub budget: BudgetArgs,

    /// Print nothing but errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Messages")]
    pub quiet: bool,

    /// Print also each picture's geometry, notes, which file is shown, and a line per stage's time
    #[arg(short, long, help_heading = "Messages")]
    pub verbose: bool,
}

const COMPARE_EXAMPLES: &str = "\
Examples:
  trueup compare holiday/ -o compared                     every method; open compared/index.html
  trueup compare holiday/ -o compared --methods vpg,apap
  trueup compare holiday/ -o compared --entry 'thin mesh: mesh.cell_px=20'
  trueup compare set/ -o compared --truth set/truth.json  with GDIC and theta error
  trueup compare --tally results-*.json                   mean scores of what people ranked

Exit status: 0 at least one panorama was made, 1 the input or the system failed, 2 wrong usage, 130 stopped by Ctrl-C.
The folder appears when it is complete. An older comparison of that name is replaced then; no other folder is.";

#[derive(Debug, Args)]
#[command(after_help = COMPARE_EXAMPLES)]
pub(crate) struct CompareArgs {
    /// Files, folders (their pictures, not those of folders inside) or glob patterns; JPEG, PNG, TIFF, WebP
    #[arg(value_name = "PHOTOS", required_unless_present = "tally")]
    pub photographs: Vec<String>,

    /// The folder to write
    #[arg(short, long, value_name = "DIR", required_unless_present = "tally", help_heading = "Output")]
    pub output: Option<PathBuf>,

    /// The methods to compare; without it, all (`trueup options stitch` names them)
    #[arg(long, value_name = "METHOD,...", value_delimiter = ',', help_heading = "What is compared")]
    pub methods: Vec<String>,

    /// A panorama with options of its own beside the methods; may be repeated
    #[arg(long, value_name = "NAME: STAGE.OPTION=VALUE, ...", help_heading = "What is compared")]
    pub entry: Vec<String>,

    /// What is exactly known of the photographs, to measure against
    #[arg(long, value_name = "TRUTH.json", help_heading = "What is compared")]
    pub truth: Option<PathBuf>,

    /// Two to four entries to be ranked on ranking.html
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', help_heading = "What is compared")]
    pub rank: Option<Vec<String>>,

    /// Size of the panoramas, relative to the reference photograph's pixels; without it, one that suits a page (compare.scale)
    #[arg(long, value_name = "S", allow_hyphen_values = true, help_heading = "Output")]
    pub scale: Option<String>,

    /// The panoramas' format (compare.format)
    #[arg(long, value_name = "FORMAT", help_heading = "Output")]
    pub format: Option<String>,

    /// JPEG quality (output.jpeg_quality)
    #[arg(long, value_name = "Q", allow_hyphen_values = true, help_heading = "Output")]
    pub quality: Option<String>,

    /// Fail unless every photograph given is used
    #[arg(long, help_heading = "Photographs")]
    pub require_all: bool,

    /// The photograph that sets the pixel scale and stays in place: auto, or its name
    #[arg(long, value_name = "auto|NAME", help_heading = "Photographs")]
    pub reference: Option<String>,

    /// Match only the pairs in this file, one `NAME -- NAME` a line
    #[arg(long, value_name = "FILE", help_heading = "Photographs")]
    pub graph: Option<PathBuf>,

    /// Keep what is found in the photographs in this folder, so that later runs need not find it again
    #[arg(long, value_name = "DIR", help_heading = "Photographs")]
    pub cache: Option<PathBuf>,

    /// Every random choice derives from this number (stitch.seed)
    #[arg(long, value_name = "N", allow_hyphen_values = true, help_heading = "Tuning")]
    pub seed: Option<String>,

    /// Set any option of any stage, for all that is compared; may be repeated
    #[arg(long, value_name = "STAGE.OPTION=VALUE", allow_hyphen_values = true, help_heading = "Tuning")]
    pub set: Vec<String>,

    /// Read options from a TOML file with a table per stage
    #[arg(long, value_name = "FILE.toml", help_heading = "Tuning")]
    pub config: Option<PathBuf>,

    /// Number of threads; 0 for one per core. The panoramas are the same for any number
    #[arg(
        long,
        value_name = "N",
        allow_hyphen_values = true,
        value_parser = clap::value_parser!(u16).range(0..=MAX_THREADS),
        help_heading = "Tuning"
    )]
    pub threads: Option<u16>,

    /// Sum up what ranking.html saved: the mean score of every method
    #[arg(
        long,
        value_name = "RESULTS.json",
        num_args = 1..,
        conflicts_with_all = ["photographs", "output"],
        help_heading = "Rankings"
    )]
    pub tally: Vec<PathBuf>,

    /// With --tally: as a JSON object
    #[arg(long, requires = "tally", help_heading = "Rankings")]
    pub json: bool,

    /// Print nothing but errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// A file that `trueup stitch --project` wrote
    #[arg(value_name = "PROJECT.json")]
    pub project: PathBuf,

    /// Print also the pairs' verdicts, each picture's geometry, notes, and a line per stage's time
    #[arg(short, long)]
    pub verbose: bool,
}

#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// A file that `trueup stitch --project` wrote
    #[arg(value_name = "PROJECT.json")]
    pub project: PathBuf,

    /// What is exactly known of the photographs: cameras and directions, as `trueup-scenes` writes them
    #[arg(long, value_name = "TRUTH.json")]
    pub truth: Option<PathBuf>,

    /// As a JSON object
    #[arg(long)]
    pub json: bool,

    /// Do not read the photographs again to compare their pixels
    #[arg(long)]
    pub no_pixels: bool,
}

#[derive(Debug, Args)]
pub(crate) struct OptionsArgs {
    /// Only the options of this stage
    #[arg(value_name = "STAGE")]
    pub stage: Option<String>,

    /// As a JSON array of {name, default, allowed, unit, meaning}
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_is_well_formed() {
        LowArgs::command().debug_assert();
    }
}
