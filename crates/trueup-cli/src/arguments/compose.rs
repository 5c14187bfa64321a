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
  trueup compose rig.json -o 0002.jpg --photos shot2/ --relight  the next shot of a rig, by the lenses and places found once
  trueup compose aligned.pto -o pano.jpg                      what was aligned in Hugin

The options of the project are overruled by --config, that by --set, and that by the flags of their own. Options of what
comes before composing are recorded with the geometry: to change them, stitch again.

Exit status: 0 the panorama was written, 1 the input or the system failed, 2 wrong usage, 3 written, but not as good as --fail-on \
or --max-error ask for, 130 stopped by Ctrl-C, 143 by a \
request to terminate.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ComposeArgs {
    /// A file that `trueup stitch --project` wrote, or a Hugin project (.pto)
    #[arg(value_name = "PROJECT")]
    pub recorded: PathBuf,

    #[command(flatten)]
    pub files: FileArgs,

    /// The folder of the photographs, if they moved, or of others of the same names and sizes
    #[arg(long, value_name = "DIR", help_heading = "Photographs")]
    pub photos: Option<PathBuf>,

    /// Even out the light of these photographs anew instead of as recorded: for another shot of a rig
    #[arg(long, help_heading = "Photographs")]
    pub relight: bool,

    #[command(flatten)]
    pub masks: MaskArgs,

    #[command(flatten)]
    pub typed: TypedOptions,

    #[command(flatten)]
    pub tuning: TuningArgs,

    #[command(flatten)]
    pub messages: MessageArgs,
}
