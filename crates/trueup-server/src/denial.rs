//! What the page is told when something cannot be.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use trueup::{Error, InvalidOption};

/// Why something is not done, for people.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Trouble {
    pub message: String,
    /// What to do about it; empty where that is not known.
    pub hint: String,
}

/// A request that is not served.
#[derive(Debug)]
pub(crate) struct Denial {
    pub status: StatusCode,
    pub trouble: Trouble,
}

impl Denial {
    pub(crate) fn new(status: StatusCode, message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { status, trouble: Trouble { message: message.into(), hint: hint.into() } }
    }

    /// There is no such thing.
    pub(crate) fn missing(what: &str) -> Self {
        Self::new(StatusCode::NOT_FOUND, format!("there is no such {what}"), "Reload the page.")
    }

    /// It cannot be now.
    pub(crate) fn not_now(message: &str, hint: &str) -> Self {
        Self::new(StatusCode::CONFLICT, message, hint)
    }

    /// It cannot be at all.
    pub(crate) fn unacceptable(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, message, hint)
    }

    /// The machine failed.
    pub(crate) fn failure(error: impl std::fmt::Display) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string(), "Look at the disk's free space, and try again.")
    }
}

impl From<Error> for Trouble {
    fn from(error: Error) -> Self {
        let trouble = |message: String, hint: String| Self { message, hint };
        match error {
            Error::Input { subject, reason, hint } => trouble(format!("{subject}: {reason}"), hint),
            Error::Options(invalid) => {
                let lines: Vec<String> = invalid.iter().map(InvalidOption::to_string).collect();
                trouble(lines.join("; "), String::new())
            }
            Error::Limits { subject, needed, allowed, hint } => {
                trouble(format!("{subject}: {needed} needed, {allowed} allowed"), hint)
            }
            Error::Unsupported { what, hint } => trouble(format!("{what} is not supported"), hint),
            Error::Unsolvable { subject, why, hint, .. } => trouble(format!("{subject}: {why}"), hint),
            Error::NotApplicable { method, reason, hint } => {
                trouble(format!("{} cannot be used here: {reason}", Error::named_choice(&method)), hint)
            }
            other => trouble(other.to_string(), String::new()),
        }
    }
}

impl From<Error> for Denial {
    fn from(error: Error) -> Self {
        Self { status: StatusCode::UNPROCESSABLE_ENTITY, trouble: error.into() }
    }
}

impl IntoResponse for Denial {
    fn into_response(self) -> Response {
        (self.status, Json(self.trouble)).into_response()
    }
}
