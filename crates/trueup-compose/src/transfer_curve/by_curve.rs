//! The tables of the usual curve, made once.

use std::sync::{Arc, LazyLock};

use trueup_core::color::TransferCurve;

/// The table of a curve: sRGB's own if it is that, else a new one.
pub(super) fn table_of<T>(curve: &TransferCurve, srgb: &LazyLock<Arc<T>>, new: impl Fn(&TransferCurve) -> T) -> Arc<T> {
    if *curve == TransferCurve::SRGB { (**srgb).clone() } else { Arc::new(new(curve)) }
}
