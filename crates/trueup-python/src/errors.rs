//! Errors as exceptions of the same names.

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trueup::Error;

/// Where the exceptions are declared.
const MODULE: &str = "trueup._errors";

/// The exception that stands for `error`, with what the error knows as its attributes.
pub(crate) fn exception(py: Python<'_>, error: Error) -> PyErr {
    made(py, error).unwrap_or_else(|failure| failure)
}

fn made(py: Python<'_>, error: Error) -> PyResult<PyErr> {
    let message = error.to_string();
    let facts = PyDict::new(py);
    let class = match error {
        Error::Input { subject, reason, hint } => {
            facts.set_item("subject", subject)?;
            facts.set_item("reason", reason)?;
            facts.set_item("hint", hint)?;
            "InputError"
        }
        Error::Options(invalid) => {
            let invalid: Vec<(String, String, String)> =
                invalid.into_iter().map(|one| (one.name, one.value, one.allowed)).collect();
            facts.set_item("invalid", invalid)?;
            "OptionsError"
        }
        Error::Limits { subject, needed, allowed, hint } => {
            facts.set_item("subject", subject)?;
            facts.set_item("needed", needed)?;
            facts.set_item("allowed", allowed)?;
            facts.set_item("hint", hint)?;
            "LimitsError"
        }
        Error::Unsupported { what, hint } => {
            facts.set_item("what", what)?;
            facts.set_item("hint", hint)?;
            "UnsupportedError"
        }
        Error::Unsolvable { stage, subject, why, hint } => {
            facts.set_item("stage", stage)?;
            facts.set_item("subject", subject)?;
            facts.set_item("reason", why)?;
            facts.set_item("hint", hint)?;
            "UnsolvableError"
        }
        Error::NotApplicable { method, reason, hint } => {
            facts.set_item("method", method)?;
            facts.set_item("reason", reason)?;
            facts.set_item("hint", hint)?;
            "NotApplicableError"
        }
        // Work is cancelled here by an exception alone, which is then raised instead.
        Error::Cancelled => return Ok(PyKeyboardInterrupt::new_err(message)),
        Error::Io { action, path, source } => {
            facts.set_item("action", action)?;
            facts.set_item("filename", path)?;
            facts.set_item("errno", source.raw_os_error())?;
            facts.set_item("strerror", source.to_string())?;
            "IoError"
        }
        // Kinds of errors that a later version of the library may have.
        _ => "Error",
    };
    let exception = py.import(MODULE)?.getattr(class)?.call((message,), Some(&facts))?;
    Ok(PyErr::from_value(exception))
}
