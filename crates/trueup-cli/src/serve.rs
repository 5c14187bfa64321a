//! `trueup serve`: a page to stitch in.

use std::path::Path;

use serde_json::json;
use trueup::Error;
use trueup_server::{Network, Serving, serve};
use trueup_terminal::Ending;

use crate::arguments::ServeArgs;
use crate::failure::Failure;
use crate::output;

pub(crate) fn run(args: ServeArgs) -> Result<(), Failure> {
    let network = match (args.listen, args.password_file) {
        (Some(address), Some(file)) => Some(Network { address, password: first_line(&file)? }),
        _ => None,
    };
    // Any port that is free.
    let port = args.port.unwrap_or(0);
    let serving = Serving { folder: args.folder, port, network };
    let (mut printed, json) = (Ok(()), args.json);
    // The server waits for no work long, and removes its temporary files at the end.
    let cancel = trueup_terminal::cancel_token("trueup", "", Ending::Soon);
    let served = serve(&serving, &cancel, |address| {
        let told = json!({ "format": "trueup-serve", "version": 1, "address": address });
        printed = output::print(&match json {
            true => format!("{told}\n"),
            false => format!("Open {address}\nStop with Ctrl-C.\n"),
        });
    });
    // Work that did not stop in time ends with the program.
    trueup::abandon_unfinished();
    served?;
    printed
}

fn first_line(file: &Path) -> Result<String, Failure> {
    let text =
        trueup::text::read_to_string(file).map_err(|error| Error::io("reading the password from", file, error))?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}
