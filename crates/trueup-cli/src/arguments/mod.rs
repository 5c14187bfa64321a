//! What may be typed, before any of it is checked against the options' ranges or the disk.

mod batch;
mod compare;
mod compose;
mod option_flags;
mod report;
mod serve;
mod shared;
mod side_outputs;
mod stitch;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;

pub(crate) use batch::BatchArgs;
pub(crate) use compare::CompareArgs;
pub(crate) use compose::ComposeArgs;
pub(crate) use option_flags::TypedOptions;
pub use option_flags::{OPTION_FLAGS, OptionFlag};
pub(crate) use report::ReportArgs;
pub(crate) use serve::ServeArgs;
pub(crate) use shared::{FailOn, FileArgs, MaskArgs, MessageArgs, TuningArgs};
pub(crate) use stitch::StitchArgs;

const EXAMPLES: &str = "\
Examples:
  trueup stitch holiday/ -o holiday.jpg
  trueup stitch IMG_01*.jpg -o pano.png --scale 0.5 --project pano.json
  trueup compose pano.json -o large.tif
  trueup inspect pano.json --verbose
  trueup serve holiday/
  trueup evaluate pano.json --truth truth.json
  trueup report pano.json -o pano.html
  trueup compare holiday/ -o holiday-compared
  trueup batch archive/ -o panoramas
  trueup options --expert";

/// Panoramas that stand upright: photographs in, a natural panorama out, and the reasons why it looks as it does.
#[derive(Debug, Parser)]
#[command(name = "trueup", version, after_help = EXAMPLES, max_term_width = 110)]
pub(crate) struct CommandLine {
    #[command(subcommand)]
    pub task: Task,
}

/// What the command is asked to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Task {
    /// Stitch photographs into a panorama
    ///
    /// Finds out by itself which photographs overlap. Those that belong elsewhere are left out, and the summary says
    /// why.
    Stitch(Box<StitchArgs>),
    /// Compose a stitched panorama again from its project: at another size, in another format, of other photographs
    ///
    /// Nothing is measured or matched: the geometry is the one that `stitch --project` recorded.
    Compose(Box<ComposeArgs>),
    /// Compare methods side by side: every method's panorama of the same photographs, with its measures, in one folder
    ///
    /// Photographs are measured and matched once. The folder holds a page to look at (index.html), a page on which
    /// people rank unnamed panoramas (ranking.html), every figure as JSON, the panoramas and their project files.
    Compare(Box<CompareArgs>),
    /// Stitch a tree of folders: every folder's panoramas, with a page of all of them
    ///
    /// Goes on where it was stopped, and never stops at one bad set. A line of JSON says of every panorama how it came
    /// out.
    Batch(Box<BatchArgs>),
    /// Show a page to stitch in, for one person on this machine, until Ctrl-C
    ///
    /// Prints an address to open in a browser. Photographs stay on this machine, and nobody else is let in.
    Serve(ServeArgs),
    /// Print what a project file says of its panorama: the summary that `stitch` printed, with each photograph's
    /// measures
    Inspect(InspectArgs),
    /// Print every measure of a panorama: its own, against the truth, and of the pixels where photographs overlap
    Evaluate(EvaluateArgs),
    /// Write a page that shows why a panorama looks as it does: outlines, seams, lines, alignment, light, and what to
    /// make of it
    ///
    /// One HTML file that loads nothing. The photographs are read again to draw them; nothing is measured again.
    Report(ReportArgs),
    /// List the options: default, range, unit, meaning
    ///
    /// Those that people have a reason to change for a panorama of their own; with --expert, those of the methods as
    /// well.
    Options(OptionsArgs),
    /// Print what completes commands, flags and their values when Tab is pressed
    ///
    /// For bash: trueup completions bash > ~/.local/share/bash-completion/completions/trueup
    Completions(CompletionsArgs),
    /// Write the manual pages into a folder: trueup.1, and one for every command
    Manual(ManualArgs),
}

#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManualArgs {
    /// The folder; pages that are there are replaced
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// A file that `trueup stitch --project` wrote
    #[arg(value_name = "PROJECT.json")]
    pub project: PathBuf,

    /// Print also the pairs' verdicts, each photograph's geometry, notes, and a line per stage's time
    #[arg(short, long)]
    pub verbose: bool,

    /// As a JSON object, as `stitch --json` prints it
    #[arg(long, conflicts_with = "verbose")]
    pub json: bool,
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
    /// Only the options of this table
    #[arg(value_name = "TABLE")]
    pub table: Option<String>,

    /// Also the options for experts: of the methods' own numbers, for unusual photographs and for experiments
    #[arg(long)]
    pub expert: bool,

    /// As a JSON array of {name, default, allowed, unit, meaning, tier, choices}
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_is_well_formed() {
        CommandLine::command().debug_assert();
    }
}
