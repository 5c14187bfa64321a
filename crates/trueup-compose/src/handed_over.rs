//! What programs that compose one panorama hand to each other.

use trueup_core::Error;

/// The error when what is handed over between programs does not belong to what both of them render.
pub(crate) fn not_asked_for() -> Error {
    Error::input(
        "work that is divided",
        "what one program handed to another does not belong to this panorama",
        "Run the same version of trueup on all machines, with the same photographs.",
    )
}
