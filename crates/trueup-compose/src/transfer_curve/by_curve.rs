//! The tables of the usual curve, made once.

use std::sync::{Arc, LazyLock};

use trueup_core::color::TransferCurve;

use super::ScaledCurve;

/// The same of a scaled one.
pub(super) fn scaled_table_of<T>(
    curve: ScaledCurve<'_>,
    srgb: &LazyLock<Arc<T>>,
    new: impl Fn(ScaledCurve<'_>) -> T,
) -> Arc<T> {
    if curve.is_srgb() { (**srgb).clone() } else { Arc::new(new(curve)) }
}

/// The table of a curve: sRGB's own if it is that, else a new one.
pub(super) fn table_of<T>(curve: &TransferCurve, srgb: &LazyLock<Arc<T>>, new: impl Fn(&TransferCurve) -> T) -> Arc<T> {
    if *curve == TransferCurve::SRGB { (**srgb).clone() } else { Arc::new(new(curve)) }
}
