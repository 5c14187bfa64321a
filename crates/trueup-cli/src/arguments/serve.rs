//! The arguments of `trueup serve`.

use std::net::IpAddr;
use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// The folder of the photographs; photographs can be dropped on the page, too
    #[arg(value_name = "FOLDER")]
    pub folder: Option<PathBuf>,

    /// The port to listen at, in place of any that is free
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,

    /// Listen at another address than this machine's own, for who knows the password
    ///
    /// What is sent is not encrypted: do so in a network that you trust.
    #[arg(long, value_name = "ADDRESS", requires = "password_file")]
    pub listen: Option<IpAddr>,

    /// A file with the password for --listen in its first line
    #[arg(long, value_name = "FILE", requires = "listen")]
    pub password_file: Option<PathBuf>,

    /// Print the address as a JSON object
    #[arg(long)]
    pub json: bool,
}
