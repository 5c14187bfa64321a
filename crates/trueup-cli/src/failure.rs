//! What the command says when it fails, and with which status it ends.

use std::fmt;

use trueup::{Error, InvalidOption};
use trueup_terminal::status_of_stopping;

use crate::words::one_line;

/// The input or the system failed.
pub(crate) const STATUS_FAILURE: u8 = 1;
/// Wrong usage: arguments or options that cannot be.
const STATUS_USAGE: u8 = 2;
/// A panorama was written, and is not as good as was asked for.
const STATUS_UNSATISFIED: u8 = 3;

/// An error as the user sees it, printed once.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    status: u8,
    message: String,
    /// Further findings, a line each.
    details: Vec<String>,
    /// What to do about it; empty when there is nothing to say.
    hint: String,
}

impl Failure {
    /// Wrong usage.
    pub(crate) fn usage(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { status: STATUS_USAGE, message: message.into(), details: Vec::new(), hint: hint.into() }
    }

    /// What was written is not as good as was asked for.
    pub(crate) fn unsatisfied(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { status: STATUS_UNSATISFIED, ..Self::usage(message, hint) }
    }

    /// Options that cannot be, all of them.
    pub(crate) fn options(mut wrong: Vec<String>) -> Self {
        let hint = "List all options with their ranges with `trueup options --expert`.";
        match wrong.len() {
            1 => Self::usage(wrong.remove(0), hint),
            count => Self { details: wrong, ..Self::usage(format!("{count} options cannot be used:"), hint) },
        }
    }

    /// The status that the command ends with.
    pub(crate) fn status(&self) -> u8 {
        self.status
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let failed =
            |message: String, hint: String| Self { status: STATUS_FAILURE, message, details: Vec::new(), hint };
        match error {
            Error::Input { subject, reason, hint } => failed(format!("{subject}: {reason}"), hint),
            Error::Options(invalid) => Self::options(invalid.iter().map(InvalidOption::to_string).collect()),
            Error::Limits { subject, needed, allowed, hint } => {
                failed(format!("{subject}: {needed} needed, {allowed} allowed"), hint)
            }
            Error::Unsupported { what, hint } => Self::usage(format!("{what} is not supported"), hint),
            Error::Unsolvable { stage, subject, why, hint } => failed(format!("{stage}: {subject}: {why}"), hint),
            Error::NotApplicable { method, reason, hint } => {
                failed(format!("{} is not applicable: {reason}", Error::named_choice(&method)), hint)
            }
            Error::Cancelled => Self { status: status_of_stopping(), ..failed(error.to_string(), String::new()) },
            other => failed(other.to_string(), String::new()),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A name may hold line ends, and what follows them must not pass for another line.
        writeln!(formatter, "trueup: error: {}", one_line(&self.message))?;
        for detail in &self.details {
            writeln!(formatter, "  {}", one_line(detail))?;
        }
        if self.hint.is_empty() { Ok(()) } else { writeln!(formatter, "trueup: hint: {}", one_line(&self.hint)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hint_has_a_line_of_its_own() {
        let failure = Failure::from(Error::input("a.jpg", "it is a text", "Give a photograph."));
        assert_eq!(failure.to_string(), "trueup: error: a.jpg: it is a text\ntrueup: hint: Give a photograph.\n");
        assert_eq!(failure.status, STATUS_FAILURE);
    }

    /// File names may hold line ends.
    #[test]
    fn no_name_makes_a_line_of_its_own() {
        let failure = Failure::from(Error::input("a\ntrueup: hint: Run it.\n.jpg", "it is a text", "Give b\nc.jpg."));
        let lines = ["trueup: error: a\\ntrueup: hint: Run it.\\n.jpg: it is a text", "trueup: hint: Give b\\nc.jpg."];
        assert_eq!(failure.to_string(), format!("{}\n{}\n", lines[0], lines[1]));
    }

    #[test]
    fn several_wrong_options_are_listed_below_each_other() {
        let text = Failure::options(vec!["one".to_owned(), "two".to_owned()]).to_string();
        assert!(text.starts_with("trueup: error: 2 options cannot be used:\n  one\n  two\n"), "{text}");
    }

    #[test]
    fn a_request_to_stop_has_its_own_status_and_no_hint() {
        let failure = Failure::from(Error::Cancelled);
        assert_eq!((failure.status, failure.to_string()), (130, "trueup: error: stopped on request\n".to_owned()));
    }
}
