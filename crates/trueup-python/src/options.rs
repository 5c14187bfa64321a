//! The reference of the options, as JSON: Python makes classes of it.

use pyo3::prelude::*;
use trueup::{Error, StitchOptions};
use trueup_cli::OPTION_FLAGS;

use crate::errors::exception;
use crate::keywords::keyword_of;

/// Every option as JSON: an array of {name, default, allowed, unit, meaning, tier, choices}, and the defaults by table,
/// whose types are those of the options.
#[pyfunction]
pub(crate) fn options(py: Python<'_>) -> PyResult<(String, String)> {
    let written = |error| exception(py, Error::input("options", error, "Report this as a defect."));
    let described = serde_json::to_string(&StitchOptions::describe()).map_err(written)?;
    let defaults = serde_json::to_string(&StitchOptions::default()).map_err(written)?;
    Ok((described, defaults))
}

/// The options with a keyword of their own: the keyword, the option, and the subcommands whose functions take it.
#[pyfunction]
pub(crate) fn option_flags() -> Vec<(String, &'static str, Vec<&'static str>)> {
    OPTION_FLAGS.iter().map(|flag| (keyword_of(flag), flag.option, flag.subcommands.to_vec())).collect()
}
