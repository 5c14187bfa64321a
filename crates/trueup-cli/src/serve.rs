//! `trueup serve`: a page to stitch in.

use std::path::Path;

use trueup::Error;
use trueup_server::{Network, Serving, serve};

use crate::arguments::ServeArgs;
use crate::failure::Failure;
use crate::output;
use crate::stopping::cancel_token;

pub(crate) fn run(args: ServeArgs) -> Result<(), Failure> {
    let network = match (args.listen, args.password_file) {
        (Some(address), Some(file)) => Some(Network { address, password: first_line(&file)? }),
        _ => None,
    };
    // Any port that is free.
    let port = args.port.unwrap_or(0);
    let serving = Serving { folder: args.folder, port, network };
    let mut printed = Ok(());
    serve(&serving, &cancel_token(), |address| {
        printed = output::print(&format!("Open {address}\nStop with Ctrl-C.\n"));
    })?;
    printed
}

fn first_line(file: &Path) -> Result<String, Failure> {
    let text = std::fs::read_to_string(file).map_err(|error| Error::io("reading the password from", file, error))?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}
