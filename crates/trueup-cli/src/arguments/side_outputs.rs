//! Flags for the files that can be wanted beside the panorama: as the library declares them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Arg, ArgMatches, Args, Command, Error, FromArgMatches};
use trueup::SideOutput;

/// The files that were asked for beside the panorama.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct SideOutputArgs(pub BTreeMap<SideOutput, PathBuf>);

impl FromArgMatches for SideOutputArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut given = Self::default();
        given.update_from_arg_matches(matches)?;
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        let path = |kind: &SideOutput| Some((*kind, matches.get_one::<PathBuf>(kind.flag())?.clone()));
        self.0 = SideOutput::ALL.iter().filter_map(path).collect();
        Ok(())
    }
}

impl Args for SideOutputArgs {
    fn augment_args(command: Command) -> Command {
        SideOutput::ALL.iter().fold(command, |command, kind| {
            let argument = Arg::new(kind.flag()).long(kind.flag()).value_name(kind.value_name());
            let parser = clap::value_parser!(PathBuf);
            command.arg(argument.value_parser(parser).help(kind.meaning()).help_heading("Output"))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}
