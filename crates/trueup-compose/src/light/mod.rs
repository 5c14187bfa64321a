//! What photographs' samples stand for: their cameras' response, and the factors that even out their light.

mod by_response;
mod correction;
mod local_exposure;
mod response;
mod table;

pub(crate) use by_response::ByResponse;
pub use correction::{Correction, Corrections, VIGNETTING_TERMS};
pub(crate) use local_exposure::{ExposureMap, LocalExposure};
pub use response::{RESPONSE_TERMS, Response};
#[cfg(target_arch = "x86_64")]
pub(crate) use table::{LEAST_DIVISOR, NEAR_WHITE, WARMEST, WHITENED};
pub(crate) use table::{LEAST_WHITE, LightTable, PhotographLight, exposed, shown};
