//! What may be typed after `trueup report`.

use std::path::PathBuf;

use clap::Args;

use super::shared::threads_argument;

const EXAMPLES: &str = "\
Examples:
  trueup stitch holiday/ -o holiday.jpg --project holiday.json
  trueup report holiday.json -o holiday.html
  trueup stitch holiday/ -o holiday.jpg --report holiday.html   both at once

Exit status: 0 the page was written, 1 the input or the system failed, 2 wrong usage, 130 stopped by Ctrl-C, 143 by a request \
to terminate.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReportArgs {
    /// A file that `trueup stitch --project` wrote
    #[arg(value_name = "PROJECT.json")]
    pub project: PathBuf,

    /// The page to write
    #[arg(short, long, value_name = "FILE.html")]
    pub output: PathBuf,

    /// The folder of the photographs, if they moved
    #[arg(long, value_name = "DIR")]
    pub photos: Option<PathBuf>,

    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = threads_argument(), help = "Number of threads; 0 for one per core")]
    pub threads: Option<u16>,

    /// Print nothing but errors
    #[arg(short, long, conflicts_with = "json")]
    pub quiet: bool,

    /// Print which file was written as a JSON object
    #[arg(long)]
    pub json: bool,
}
