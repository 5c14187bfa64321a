//! The transfer curve of the panorama's color space, both ways, by table.
//!
//! The tables of sRGB's curve are made once; those of another curve when they are asked for, which takes less than a
//! millisecond.

mod by_curve;
mod encode16;
mod encode8;
mod linearize;

use std::sync::{Arc, OnceLock};

use trueup_core::color::TransferCurve;

pub(crate) use encode8::{Encode, EncodeRoots};
pub(crate) use encode16::{Encode16, EncodeRoots16};
pub(crate) use linearize::Linearize;

/// How a finished picture is written: its curve, and that curve's tables.
#[derive(Debug, Clone)]
pub(crate) struct Encoding {
    curve: TransferCurve,
    /// The color profile's own curve, where pixels are light by another one.
    profile: Option<TransferCurve>,
    pub(crate) linear: Arc<Encode>,
    pub(crate) roots: Arc<EncodeRoots>,
    linear16: OnceLock<Arc<Encode16>>,
    roots16: OnceLock<Arc<EncodeRoots16>>,
}

impl Encoding {
    /// By a curve.
    pub(crate) fn new(curve: TransferCurve) -> Self {
        let (linear, roots) = (Encode::of(&curve), EncodeRoots::of(&curve));
        Self { linear, roots, linear16: OnceLock::new(), roots16: OnceLock::new(), curve, profile: None }
    }

    /// The same for a picture with the color profile of `profile`, whatever light its pixels hold.
    pub(crate) fn of_profile(self, profile: &TransferCurve) -> Self {
        Self { profile: (self.curve != *profile).then(|| profile.clone()), ..self }
    }

    /// The color profile's linear light of what the curve takes for `light`.
    pub(crate) fn profile_light(&self, light: f32) -> f32 {
        match &self.profile {
            Some(profile) => profile.linear(self.curve.encoded(f64::from(light))) as f32,
            None => light,
        }
    }

    /// To 16 bits from linear light.
    pub(crate) fn linear16(&self) -> &Encode16 {
        self.linear16.get_or_init(|| Encode16::of(&self.curve))
    }

    /// To 16 bits from roots.
    pub(crate) fn roots16(&self) -> &EncodeRoots16 {
        self.roots16.get_or_init(|| EncodeRoots16::of(&self.curve))
    }
}

impl PartialEq for Encoding {
    /// The tables follow from the curve.
    fn eq(&self, other: &Self) -> bool {
        self.curve == other.curve && self.profile == other.profile
    }
}

#[cfg(test)]
mod tests;
