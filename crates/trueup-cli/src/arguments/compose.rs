//! What may be typed after `trueup compose`.

use std::path::PathBuf;

use clap::Args;

use super::option_flags::TypedOptions;
use super::shared::{FileArgs, MaskArgs, MessageArgs, TuningArgs};

const EXAMPLES: &str = "\
Examples:
  trueup compose pano.json -o pano.tif                        the same panorama in another format
  trueup compose pano.json -o small.jpg --scale 0.25
  trueup compose pano.json -o round.jpg --projection equirectangular --crop none
  trueup compose pano.json -o pano.jpg --photos developed/    other photographs of the same names and sizes

The options of the project are overruled by --config, that by --set, and that by the flags of their own. Options of what
comes before composing are recorded with the geometry: to change them, stitch again.

Exit status: 0 the panorama was written, 1 the input or the system failed, 2 wrong usage, 3 written, but not as good as --fail-on \
or --max-error ask for, 130 stopped by Ctrl-C, 143 by a \
request to terminate.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ComposeArgs {
    /// A file that `trueup stitch --project` wrote
    #[arg(value_name = "PROJECT.json")]
    pub recorded: PathBuf,

    #[command(flatten)]
    pub files: FileArgs,

    /// The folder of the photographs, if they moved, or of others of the same names and sizes
    #[arg(long, value_name = "DIR", help_heading = "Photographs")]
    pub photos: Option<PathBuf>,

    #[command(flatten)]
    pub masks: MaskArgs,

    #[command(flatten)]
    pub typed: TypedOptions,

    #[command(flatten)]
    pub tuning: TuningArgs,

    #[command(flatten)]
    pub messages: MessageArgs,
}
