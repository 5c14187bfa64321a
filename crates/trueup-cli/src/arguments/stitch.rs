//! What may be typed after `trueup stitch`.

use clap::Args;

use super::option_flags::TypedOptions;
use super::shared::{FileArgs, GeometryArgs, MaskArgs, MessageArgs, PhotographsParser, TuningArgs, photographs_help};

const EXAMPLES: &str = "\
Examples:
  trueup stitch a.jpg b.jpg c.jpg -o pano.jpg
  trueup stitch holiday/ -o pano.tif                     every photograph of a folder
  trueup stitch 'holiday/IMG_*.jpg' -o pano.jpg --all    pano-1.jpg, pano-2.jpg, ...
  trueup stitch holiday/ -o small.webp --scale 0.25      a quick preview
  trueup stitch holiday/ -o pano.jpg --set mesh.cell_px=30 --set exposure.enabled=false
  trueup stitch holiday/ -o pano.jpg --config mine.toml  [mesh] cell_px = 30.0

Defaults are overruled by --config, that by --set, and that by the flags of their own (--scale, --quality, ...).

Exit status: 0 a panorama was written, 1 the input or the system failed, 2 wrong usage, 3 written, but not as good as --fail-on or \
--max-error ask for, 130 stopped by Ctrl-C, 143 by a \
request to terminate. The first Ctrl-C stops at the next safe place and leaves nothing half written; the second kills at \
once.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct StitchArgs {
    /// What the photographs are named by.
    #[arg(value_name = "PHOTOS", help = photographs_help(), required = true, value_parser = PhotographsParser)]
    pub photographs: Vec<String>,

    #[command(flatten)]
    pub files: FileArgs,

    /// Stitch every group of overlapping photographs, not only the largest; several panoramas are numbered
    #[arg(long, help_heading = "Photographs")]
    pub all: bool,

    #[command(flatten)]
    pub geometry: GeometryArgs,

    #[command(flatten)]
    pub masks: MaskArgs,

    #[command(flatten)]
    pub typed: TypedOptions,

    #[command(flatten)]
    pub tuning: TuningArgs,

    #[command(flatten)]
    pub messages: MessageArgs,
}
