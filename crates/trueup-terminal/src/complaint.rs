//! Standard error.

use std::io::Write;

/// Prints on standard error. It may be gone, with its terminal or its disk full: that ends no program, as `eprint!`
/// would.
pub fn complain(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}
