//! `trueup completions` and `trueup manual`: what belongs to an installed command, from the declaration of its
//! arguments.

use clap::{Command, CommandFactory};
use clap_mangen::Man;
use trueup::Error;

use crate::arguments::{CommandLine, CompletionsArgs, ManualArgs};
use crate::failure::Failure;
use crate::output;

/// Section of the manual: programs.
const SECTION: &str = "1";

pub(crate) fn completions(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut CommandLine::command(), "trueup", &mut text);
    output::print(&String::from_utf8_lossy(&text))
}

pub(crate) fn manual(args: &ManualArgs) -> Result<(), Failure> {
    let mut command = CommandLine::command().disable_help_subcommand(true);
    command.build();
    for (name, page) in pages(&command) {
        let mut text = Vec::new();
        let path = args.folder.join(format!("{name}.{SECTION}"));
        page.render(&mut text).map_err(|error| Error::io("writing", &path, error))?;
        trueup::write_atomically(&path, &text)?;
    }
    Ok(())
}

/// The page of the command, and those of its subcommands, by their names.
fn pages(command: &Command) -> Vec<(String, Man)> {
    let page = |name: String, command: &Command| {
        let man = Man::new(command.clone().name(name.clone()).display_name(name.clone())).section(SECTION);
        (name, man)
    };
    let own = page(command.get_name().to_owned(), command);
    let subcommands = command.get_subcommands().map(|one| page(format!("trueup-{}", one.get_name()), one));
    std::iter::once(own).chain(subcommands).collect()
}
