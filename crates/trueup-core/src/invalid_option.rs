//! Options that cannot be.

use std::fmt;

/// An option whose value is outside its allowed range.
#[derive(Debug, Clone, PartialEq)]
pub struct InvalidOption {
    /// Stage and option, `table.option`.
    pub name: String,
    /// The value given.
    pub value: String,
    /// The allowed values in words.
    pub allowed: String,
}

impl fmt::Display for InvalidOption {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "invalid {} = {} (allowed: {})", self.name, self.value, self.allowed)
    }
}
