//! trueup for Python, the part that is not Python: arrays in and out, exceptions, progress, and the interpreter let go.
//!
//! The package that people import is in the folder `python`; it holds what needs no Rust. No algorithm and no default
//! lives in either.

mod alignment;
mod batch;
mod errors;
mod keywords;
mod options;
mod panorama;
mod photographs;
mod work;
mod workers;

use pyo3::prelude::*;

/// The native part of the package trueup. What it shares between threads is locked or never changed: the lock of the
/// interpreter is not asked for.
#[pymodule(gil_used = false)]
mod _trueup {
    #[pymodule_export]
    use super::alignment::{Alignment, align, open_project};
    #[pymodule_export]
    use super::batch::{batch, plan};
    #[pymodule_export]
    use super::options::{option_flags, options};
    #[pymodule_export]
    use super::panorama::{Panorama, png};
    #[pymodule_export]
    use super::workers::Worker;
    #[pymodule_export]
    use super::{command, version};
}

/// Runs the `trueup` command with these arguments, of which the first is its own name; returns its exit status.
#[pyfunction]
fn command(py: Python<'_>, arguments: Vec<std::ffi::OsString>) -> u8 {
    py.detach(|| trueup_cli::run(arguments))
}

/// The version of trueup.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
