//! What may be typed after `trueup batch`.

use std::path::PathBuf;

use clap::Args;

use super::shared::TuningArgs;

/// Seconds without a photograph after which another panorama begins: nobody waits for so long between two frames of one.
const GAP_SECONDS: &str = "300";

const EXAMPLES: &str = "\
Examples:
  trueup batch archive/ -o panoramas                  every folder's panoramas, with a page: panoramas/index.html
  trueup batch archive/ -o panoramas --dry-run        what would be stitched
  trueup batch archive/ -o panoramas --shard 2/4      the second of four parts, on a machine of its own
  trueup batch archive/ -o panoramas --set canvas.scale=0.5 --set resources.memory=2GB

The same command goes on where it was stopped or killed. A set that cannot be stitched is recorded with its reason, and is tried \
again when its photographs or the options change, or with --retry.

Exit status: 0 every set made a panorama, 1 the input or the system failed, 2 wrong usage, 3 some sets made none, 130 stopped by \
Ctrl-C, 143 by a request to terminate.";

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
    #[arg(long, value_name = "FORMAT", default_value = "jpg", value_parser = ["jpg", "png", "tif", "webp"], help_heading = "Output")]
    pub format: String,

    /// Print what would be stitched, and stitch nothing
    #[arg(long, help_heading = "What is stitched")]
    pub dry_run: bool,

    /// Part a folder's photographs where none was taken for longer than this
    #[arg(long, value_name = "SECONDS", default_value = GAP_SECONDS, value_parser = seconds, help_heading = "What is stitched")]
    pub gap: f64,

    /// Stitch every N-th set only, beginning with the K-th: for N machines that share a folder
    #[arg(long, value_name = "K/N", value_parser = shard, help_heading = "What is stitched")]
    pub shard: Option<Shard>,

    /// Try sets again that made no panorama
    #[arg(long, help_heading = "What is stitched")]
    pub retry: bool,

    #[command(flatten)]
    pub tuning: TuningArgs,

    /// Print a line of JSON for every panorama, as batch.jsonl has them
    #[arg(long, conflicts_with = "quiet", help_heading = "Messages")]
    pub json: bool,

    /// Print nothing but errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

/// Which of how many parts of the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shard {
    /// Counted from 1.
    pub number: usize,
    pub count: usize,
}

impl Shard {
    /// Whether the set at this position, counted from 0, belongs to the part.
    pub(crate) fn holds(self, position: usize) -> bool {
        position % self.count + 1 == self.number
    }
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
    fn shards_share_all_sets_and_none_twice() {
        for position in 0..10 {
            let held = (1..=3).filter(|number| shard(&format!("{number}/3")).expect("a shard").holds(position));
            assert_eq!(held.count(), 1);
        }
        for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
    }
}
