//! What may be typed after `trueup batch`.

use std::path::PathBuf;

use clap::Args;
use trueup::{BatchJob, Shard};

use super::option_flags::TypedOptions;
use super::shared::TuningArgs;

/// More sets at once than this are a typing mistake.
const MAX_JOBS: i64 = 256;

const EXAMPLES: &str = "\
Examples:
  trueup batch archive/ -o panoramas                  every folder's panoramas, with a page: panoramas/index.html
  trueup batch archive/ -o panoramas --dry-run        what would be stitched
  trueup batch archive/ -o panoramas --jobs 4 --memory 8GB
  trueup batch archive/ -o panoramas --shard 2/4      the second of four parts
  trueup batch archive/ -o panoramas --scale 0.5 --set mesh.cell_px=30

The same command goes on where it was stopped or killed, and may run several times at once, on one machine or on many that share \
the folders: a set is made by one of them. A set that cannot be stitched is recorded with its reason, and is tried again when its \
photographs or the options change, or with --retry.

Exit status: 0 every set made a panorama or is a single photograph, 1 the input or the system failed, 2 wrong usage, 3 some sets \
failed, 130 stopped by Ctrl-C, 143 by a request to terminate.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct BatchArgs {
    /// The folder that holds the photographs, or folders of them
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,

    /// The folder to write; made if it is not there
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    pub output: PathBuf,

    /// The panoramas' format: jpg, png, tif or webp
    #[arg(long, value_name = "FORMAT", default_value = BatchJob::EXTENSION, value_parser = ["jpg", "png", "tif", "webp"], help_heading = "Output")]
    pub format: String,

    /// Print what would be stitched, and stitch nothing
    #[arg(long, help_heading = "What is stitched")]
    pub dry_run: bool,

    /// Part a folder's photographs where none was taken for longer than this; inf parts nothing
    #[arg(long, value_name = "SECONDS", default_value_t = BatchJob::GAP_SECONDS, value_parser = seconds, help_heading = "What is stitched")]
    pub gap: f64,

    /// Stitch every N-th set only, beginning with the K-th
    #[arg(long, value_name = "K/N", value_parser = shard, help_heading = "What is stitched")]
    pub shard: Option<Shard>,

    /// Try sets again that made no panorama
    #[arg(long, help_heading = "What is stitched")]
    pub retry: bool,

    #[command(flatten)]
    pub typed: TypedOptions,

    /// Sets worked at at once; threads and memory are divided among them. More than one is faster where sets are small
    #[arg(long, value_name = "N", default_value = "1", allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=MAX_JOBS), help_heading = "Tuning")]
    pub jobs: u16,

    #[command(flatten)]
    pub tuning: TuningArgs,

    /// Print a line of JSON for every panorama, as batch.jsonl has them
    #[arg(long, conflicts_with = "quiet", help_heading = "Messages")]
    pub json: bool,

    /// Print nothing but errors and warnings, each in one line on standard error
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

fn shard(typed: &str) -> Result<Shard, String> {
    let numbers = typed.split_once('/').and_then(|(number, count)| Some((number.parse().ok()?, count.parse().ok()?)));
    match numbers {
        Some((number, count)) if (1..=count).contains(&number) => Ok(Shard { number, count }),
        _ => Err("K/N is wanted, with K from 1 to N".to_owned()),
    }
}

fn seconds(typed: &str) -> Result<f64, String> {
    match typed.parse::<f64>() {
        Ok(seconds) if seconds >= 0.0 => Ok(seconds),
        _ => Err("a number of seconds, 0 or more, is wanted".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_typed_is_read_or_refused() {
        assert_eq!(shard("2/3"), Ok(Shard { number: 2, count: 3 }));
        for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
        assert_eq!((seconds("2.5"), seconds("inf")), (Ok(2.5), Ok(f64::INFINITY)));
        assert!(seconds("-1").is_err() && seconds("NaN").is_err());
    }
}
