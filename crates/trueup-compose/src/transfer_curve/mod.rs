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
///
/// Pixels hold square roots of light; of light that may be brighter than white, which spans many more stops, fourth
/// roots.
#[derive(Debug, Clone)]
pub(crate) struct Encoding {
    curve: TransferCurve,
    /// The color profile's own curve, where pixels are light by another one.
    profile: Option<TransferCurve>,
    /// What the curve takes for 1 is so much of the light that a pixel's 1 stands for.
    most: f64,
    pub(crate) linear: Arc<Encode>,
    pub(crate) roots: Arc<EncodeRoots>,
    linear16: OnceLock<Arc<Encode16>>,
    roots16: OnceLock<Arc<EncodeRoots16>>,
}

impl Encoding {
    /// By a curve, where a pixel's light of 1 is `most` times the curve's.
    pub(crate) fn new(curve: TransferCurve, most: f64) -> Self {
        let scaled = ScaledCurve { curve: &curve, most };
        let (linear, roots) = (Encode::of(scaled), EncodeRoots::of(scaled));
        Self { linear, roots, linear16: OnceLock::new(), roots16: OnceLock::new(), curve, profile: None, most }
    }

    /// Whether what is brighter than white is kept.
    pub(crate) fn keeps_light(&self) -> bool {
        self.curve.light_range().is_some()
    }

    /// The light of the root that a pixel holds.
    pub(crate) fn light_of_root(&self, root: f32) -> f32 {
        let square = root * root;
        if self.keeps_light() { square * square } else { square }
    }

    /// The levels of small views, by the roots that pixels hold; `None` where these are the levels.
    pub(crate) fn view_levels(&self) -> Option<&EncodeRoots> {
        self.keeps_light().then(|| self.roots.as_ref())
    }

    /// The root, from 0 to 1, that a pixel holds, of a small view's level from 0 to 1.
    pub(crate) fn root_of_view(&self, level: f32) -> f32 {
        match self.keeps_light() {
            true => (self.curve.linear(f64::from(level)) / self.most).sqrt().sqrt() as f32,
            false => level,
        }
    }

    /// The same for a picture with the color profile of `profile`, whatever light its pixels hold.
    pub(crate) fn of_profile(self, profile: &TransferCurve) -> Self {
        Self { profile: (self.curve != *profile).then(|| profile.clone()), ..self }
    }

    /// The color profile's linear light of what a pixel holds, 1 for white.
    pub(crate) fn profile_light(&self, light: f32) -> f32 {
        if let Some(range) = self.curve.light_range() {
            return (f64::from(light) * self.most * range.peak) as f32;
        }
        match &self.profile {
            Some(profile) => profile.linear(self.curve.encoded(f64::from(light))) as f32,
            None => light,
        }
    }

    /// To 16 bits from linear light.
    pub(crate) fn linear16(&self) -> &Encode16 {
        self.linear16.get_or_init(|| Encode16::of(self.scaled()))
    }

    /// To 16 bits from roots.
    pub(crate) fn roots16(&self) -> &EncodeRoots16 {
        self.roots16.get_or_init(|| EncodeRoots16::of(self.scaled()))
    }

    fn scaled(&self) -> ScaledCurve<'_> {
        ScaledCurve { curve: &self.curve, most: self.most }
    }
}

/// A curve, and what is light of 1 for a pixel, in what is for the curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScaledCurve<'a> {
    curve: &'a TransferCurve,
    most: f64,
}

impl ScaledCurve<'_> {
    /// The encoded value, 0 to 1, of a pixel's light.
    fn encoded(&self, light: f64) -> f64 {
        self.curve.encoded(light * self.most)
    }

    /// The light of an encoded value.
    fn linear(&self, encoded: f64) -> f64 {
        self.curve.linear(encoded) / self.most
    }

    /// The light of the root that a pixel holds.
    fn light_of_root(&self, root: f64) -> f64 {
        let square = root * root;
        if self.keeps_light() { square * square } else { square }
    }

    /// Whether what is brighter than white is kept.
    fn keeps_light(&self) -> bool {
        self.curve.light_range().is_some()
    }

    /// Whether it is sRGB's as it is.
    fn is_srgb(&self) -> bool {
        self.most == 1.0 && *self.curve == TransferCurve::SRGB
    }
}

impl<'a> From<&'a TransferCurve> for ScaledCurve<'a> {
    fn from(curve: &'a TransferCurve) -> Self {
        Self { curve, most: 1.0 }
    }
}

impl PartialEq for Encoding {
    /// The tables follow from the curve.
    fn eq(&self, other: &Self) -> bool {
        self.curve == other.curve && self.profile == other.profile && self.most == other.most
    }
}

#[cfg(test)]
mod tests;
