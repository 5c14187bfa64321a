//! Findings a stage reports beside its product: data, not log lines.

use serde::{Deserialize, Serialize};

/// How much a [`Diagnostic`] matters to the panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Worth knowing; the panorama is as good as the photographs allow.
    Note,
    /// The panorama is worse for it, or lacks a photograph.
    Warning,
}

/// One finding about a photograph, a pair or the whole panorama.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Stable machine-readable name in kebab case, e.g. `photograph-left-out`.
    pub code: String,
    /// How much it matters.
    pub severity: Severity,
    /// The photograph's name, "a - b" for a pair, or the stage's name.
    pub subject: String,
    /// What was found, with the numbers that led to it.
    pub message: String,
    /// What the user can do about it; empty when there is nothing to do.
    pub hint: String,
}

impl Diagnostic {
    /// A note. `code` must be a stable kebab-case name.
    pub fn note(code: &str, subject: impl ToString, message: impl ToString, hint: impl ToString) -> Self {
        Self::new(Severity::Note, code, subject, message, hint)
    }

    /// A warning. `code` must be a stable kebab-case name.
    pub fn warning(code: &str, subject: impl ToString, message: impl ToString, hint: impl ToString) -> Self {
        Self::new(Severity::Warning, code, subject, message, hint)
    }

    fn new(
        severity: Severity,
        code: &str,
        subject: impl ToString,
        message: impl ToString,
        hint: impl ToString,
    ) -> Self {
        Self {
            code: code.to_owned(),
            severity,
            subject: subject.to_string(),
            message: message.to_string(),
            hint: hint.to_string(),
        }
    }
}
