//! Arguments that several commands have.

use std::ffi::OsStr;
use std::path::PathBuf;

use clap::builder::{NonEmptyStringValueParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command};

use super::side_outputs::SideOutputArgs;

/// More threads than this are a typing mistake, and starting them would hang the machine.
const MAX_THREADS: i64 = 1024;

/// The help on photographs.
pub(crate) fn photographs_help() -> String {
    let formats = trueup::readable_formats();
    format!("Files, folders (their photographs, not those of folders inside) or glob patterns; {formats}")
}

/// Takes the name of a photograph, a folder or a pattern, and says which one cannot be taken.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhotographsParser;

impl TypedValueParser for PhotographsParser {
    type Value = String;

    fn parse_ref(&self, command: &Command, argument: Option<&Arg>, value: &OsStr) -> Result<String, clap::Error> {
        if value.to_str().is_none() {
            let name = value.display();
            let reason = format!("the name \"{name}\" is not UTF-8; rename it, or give the folder it lies in");
            return Err(command.clone().error(ErrorKind::InvalidUtf8, reason));
        }
        NonEmptyStringValueParser::new().parse_ref(command, argument, value)
    }
}

fn panorama_help() -> String {
    format!("The panorama; {} chooses the format", trueup::written_extensions())
}

/// Takes a number of threads.
pub(crate) fn threads_argument() -> clap::builder::RangedI64ValueParser<u16> {
    clap::value_parser!(u16).range(0..=MAX_THREADS)
}

/// What is written.
#[derive(Debug, Args)]
pub(crate) struct FileArgs {
    /// The panorama's file.
    #[arg(short, long, value_name = "FILE", help = panorama_help(), help_heading = "Output")]
    pub output: PathBuf,

    #[command(flatten)]
    pub beside: SideOutputArgs,

    /// Write a page that shows why the panorama looks as it does
    #[arg(long, value_name = "FILE.html", help_heading = "Output")]
    pub report: Option<PathBuf>,
}

/// How the geometry is found where none is recorded.
#[derive(Debug, Args)]
pub(crate) struct GeometryArgs {
    /// Fail unless every photograph given is used
    #[arg(long, help_heading = "Photographs")]
    pub require_all: bool,

    /// The photograph that sets the pixel scale and stays in place: auto, or its name
    #[arg(long, value_name = "auto|NAME", help_heading = "Photographs")]
    pub reference: Option<String>,

    /// Match only the pairs in this file, one `NAME -- NAME` a line
    #[arg(long, value_name = "FILE", help_heading = "Photographs")]
    pub graph: Option<PathBuf>,

    /// Take the lens from the project of other photographs through it
    #[arg(long, value_name = "PROJECT.json", help_heading = "Photographs")]
    pub lens_from: Option<PathBuf>,

    /// Keep what is found in the photographs in this folder, so that later runs need not find it again
    #[arg(long, value_name = "DIR", help_heading = "Photographs")]
    pub cache: Option<PathBuf>,
}

/// Pictures that say what of a photograph is to be seen.
#[derive(Debug, Args)]
pub(crate) struct MaskArgs {
    /// A picture of the photograph NAME's size: what is black or transparent in it is ignored, and not shown where
    /// another photograph can be; may be repeated
    #[arg(long, value_name = "NAME=FILE", help_heading = "Photographs")]
    pub mask: Vec<String>,

    /// A picture of the photograph NAME's size: what is white in it is shown; may be repeated
    #[arg(long, value_name = "NAME=FILE", help_heading = "Photographs")]
    pub keep: Vec<String>,
}

/// Options of every phase, and how the work is done.
#[derive(Debug, Args)]
pub(crate) struct TuningArgs {
    /// Set any option; may be repeated
    #[arg(long, value_name = "TABLE.OPTION=VALUE", allow_hyphen_values = true, help_heading = "Tuning")]
    pub set: Vec<String>,

    /// Read options from a TOML file
    #[arg(long, value_name = "FILE.toml", help_heading = "Tuning")]
    pub config: Option<PathBuf>,

    /// Number of threads; 0 for one per core. The panorama is the same for any number
    #[arg(
        long,
        value_name = "N",
        allow_hyphen_values = true,
        value_parser = threads_argument(),
        help_heading = "Tuning"
    )]
    pub threads: Option<u16>,
}

/// What is printed, and what of it is a failure.
#[derive(Debug, Clone, Args)]
pub(crate) struct MessageArgs {
    /// Print nothing but errors and warnings, each in one line on standard error
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Messages")]
    pub quiet: bool,

    /// Print also the pairs' verdicts, each photograph's geometry, notes, and a line per stage's time
    #[arg(short, long, help_heading = "Messages")]
    pub verbose: bool,

    /// Print the summary as JSON
    #[arg(long, conflicts_with = "verbose", help_heading = "Messages")]
    pub json: bool,

    /// End with status 3 if there is a warning; what was made is written all the same
    #[arg(long, value_name = "warning", value_enum, help_heading = "Messages")]
    pub fail_on: Option<FailOn>,

    /// End with status 3 if matched points land farther apart than this, 95 of 100, in the photographs' pixels; what
    /// was made is written all the same
    #[arg(long, value_name = "PX", allow_hyphen_values = true, value_parser = distance, help_heading = "Messages")]
    pub max_error: Option<f64>,
}

/// What is a failure though a panorama was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum FailOn {
    /// Any warning.
    Warning,
}

/// A distance, not below 0.
fn distance(typed: &str) -> Result<f64, String> {
    match typed.parse::<f64>() {
        Ok(distance) if distance >= 0.0 && distance.is_finite() => Ok(distance),
        _ => Err("a number of pixels, 0 or more, is wanted".to_owned()),
    }
}
