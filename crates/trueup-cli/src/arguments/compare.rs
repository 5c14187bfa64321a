//! What may be typed after `trueup compare`.

use std::path::PathBuf;

use clap::Args;

use super::option_flags::TypedOptions;
use super::shared::{GeometryArgs, MaskArgs, PhotographsParser, TuningArgs, photographs_help};

const EXAMPLES: &str = "\
Examples:
  trueup compare holiday/ -o compared                     every method; open compared/index.html
  trueup compare holiday/ -o compared --methods vpg,apap
  trueup compare holiday/ -o compared --entry 'thin mesh: mesh.cell_px=20'
  trueup compare set/ -o compared --truth set/truth.json  with GDIC and theta error
  trueup compare --tally results-*.json                   mean scores of what people ranked

Exit status: 0 at least one panorama was made, 1 the input or the system failed, 2 wrong usage, 130 stopped by Ctrl-C, 143 by \
a request to terminate.
The folder appears when it is complete. An older comparison of that name is replaced then; no other folder is.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    /// What the photographs are named by.
    #[arg(value_name = "PHOTOS", help = photographs_help(), required_unless_present = "tally", value_parser = PhotographsParser)]
    pub photographs: Vec<String>,

    /// The folder to write
    #[arg(short, long, value_name = "DIR", required_unless_present = "tally", help_heading = "Output")]
    pub output: Option<PathBuf>,

    /// The methods to compare; without it, all (`trueup stitch --help` names them)
    #[arg(long, value_name = "METHOD,...", value_delimiter = ',', help_heading = "What is compared")]
    pub methods: Vec<String>,

    /// A panorama with options of its own beside the methods; may be repeated
    #[arg(long, value_name = "NAME: TABLE.OPTION=VALUE, ...", help_heading = "What is compared")]
    pub entry: Vec<String>,

    /// What is exactly known of the photographs, to measure against
    #[arg(long, value_name = "TRUTH.json", help_heading = "What is compared")]
    pub truth: Option<PathBuf>,

    /// Two to four entries to be ranked on ranking.html
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', help_heading = "What is compared")]
    pub rank: Option<Vec<String>>,

    /// Size of the panoramas, relative to the reference photograph's pixels; without it, one that suits a page
    #[arg(long, value_name = "S", allow_hyphen_values = true, help_heading = "Output")]
    pub scale: Option<f64>,

    /// The panoramas' format: jpg, png or webp
    #[arg(long, value_name = "FORMAT", help_heading = "Output")]
    pub format: Option<String>,

    #[command(flatten)]
    pub geometry: GeometryArgs,

    #[command(flatten)]
    pub masks: MaskArgs,

    #[command(flatten)]
    pub typed: TypedOptions,

    #[command(flatten)]
    pub tuning: TuningArgs,

    /// Sum up what ranking.html saved: the mean score of every method
    #[arg(
        long,
        value_name = "RESULTS.json",
        num_args = 1..,
        conflicts_with_all = ["photographs", "output"],
        help_heading = "Rankings"
    )]
    pub tally: Vec<PathBuf>,

    /// Print nothing but errors
    #[arg(short, long, conflicts_with = "json", help_heading = "Messages")]
    pub quiet: bool,

    /// Print a JSON object: what compare.json holds, or with --tally the scores
    #[arg(long, help_heading = "Messages")]
    pub json: bool,
}
