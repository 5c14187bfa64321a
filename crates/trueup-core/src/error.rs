//! One error type for the libraries, its variants named by whose fault it is.

use std::path::{Path, PathBuf};

use crate::invalid_option::InvalidOption;

/// The result of every fallible function in trueup's libraries.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong, by whose fault it is.
///
/// Every message names the subject (a file, an option, a stage), the reason, and where possible what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or photograph the user gave cannot be used.
    #[error("{subject}: {reason}. {hint}")]
    Input {
        /// The file, photograph or argument at fault.
        subject: String,
        /// Why it cannot be used, without a closing full stop.
        reason: String,
        /// What the user can do about it, a whole sentence.
        hint: String,
    },
    /// One or more options are outside their allowed range; all of them are listed.
    #[error("{}", list_invalid(.0))]
    Options(Vec<InvalidOption>),
    /// The work would need more than a declared limit allows; refused before allocation.
    #[error("{subject}: {needed} needed, {allowed} allowed. {hint}")]
    Limits {
        /// What is too large.
        subject: String,
        /// What it would take, with its unit.
        needed: String,
        /// What the limit allows, with its unit.
        allowed: String,
        /// Which option or change of input helps, a whole sentence.
        hint: String,
    },
    /// The request is understood but not something this program does.
    #[error("{what} is not supported. {hint}")]
    Unsupported {
        /// The format, feature or combination asked for.
        what: String,
        /// The nearest thing that is supported, a whole sentence.
        hint: String,
    },
    /// The data do not determine an answer.
    #[error("{stage}: {subject}: {why}. {hint}")]
    Unsolvable {
        /// The stage that gave up.
        stage: &'static str,
        /// The photograph, pair or system it gave up on.
        subject: String,
        /// Why there is no answer, without a closing full stop.
        why: String,
        /// What the user can do about it, a whole sentence.
        hint: String,
    },
    /// The method, or another choice, that was made cannot make a panorama of these photographs; another one can.
    #[error("{} is not applicable: {reason}. {hint}", Error::named_choice(.method))]
    NotApplicable {
        /// The method, as in the options, or an option as it is set, `table.option = value`. Messages name it by
        /// [`Error::named_choice`].
        method: String,
        /// Which photograph it cannot place and why, with the angle where the field of view is at fault, without a
        /// closing full stop.
        reason: String,
        /// What the user can do about it, a whole sentence.
        hint: String,
    },
    /// The user asked to stop.
    #[error("stopped on request")]
    Cancelled,
    /// The operating system refused a file operation.
    #[error("{action} {}: {source}", path.display())]
    Io {
        /// What was being done, e.g. "reading".
        action: &'static str,
        /// The file or folder concerned.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
}

impl Error {
    /// An [`Error::Input`]: `subject` cannot be used because of `reason`; `hint` says what to do.
    pub fn input(subject: impl ToString, reason: impl ToString, hint: impl ToString) -> Self {
        Self::Input { subject: subject.to_string(), reason: reason.to_string(), hint: hint.to_string() }
    }

    /// An [`Error::Unsolvable`]: `stage` found no answer for `subject` because of `why`.
    pub fn unsolvable(stage: &'static str, subject: impl ToString, why: impl ToString, hint: impl ToString) -> Self {
        Self::Unsolvable { stage, subject: subject.to_string(), why: why.to_string(), hint: hint.to_string() }
    }

    /// An [`Error::NotApplicable`]: `method` cannot place the photographs because of `reason`; `hint` says what to do.
    pub fn not_applicable(method: impl ToString, reason: impl ToString, hint: impl ToString) -> Self {
        Self::NotApplicable { method: method.to_string(), reason: reason.to_string(), hint: hint.to_string() }
    }

    /// What an [`Error::NotApplicable`] says of its `method` in a sentence: an option as it is set says by itself what
    /// it is, a method's name alone does not.
    pub fn named_choice(method: &str) -> String {
        if method.contains('=') { method.to_owned() } else { format!("the method {method}") }
    }

    /// An [`Error::Io`] for `path`: `action` is what was being done, e.g. "reading".
    pub fn io(action: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::Io { action, path: path.to_owned(), source }
    }
}

fn list_invalid(invalid: &[InvalidOption]) -> String {
    let lines: Vec<String> = invalid.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_that_is_not_applicable_is_not_called_a_method() {
        let text = |choice: &str| Error::not_applicable(choice, "it is one photograph", "Give two.").to_string();
        assert_eq!(text("sphp"), "the method sphp is not applicable: it is one photograph. Give two.");
        assert_eq!(
            text("projection.kind = panini"),
            "projection.kind = panini is not applicable: it is one photograph. Give two."
        );
    }
}
