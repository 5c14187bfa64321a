//! One color space for photographs that may be in several.

use std::sync::Arc;

use rayon::prelude::*;
use trueup_core::StageContext;
use trueup_core::color::TransferCurve;
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::source::SourceImage;

use super::convert::Conversion;
use super::embedded;
use super::icc::{RgbSpace, Understood, description, understand};

/// Gamuts whose areas differ by less than this share are equally wide.
const SAME_AREA: f64 = 1e-3;

/// The color space that a set of photographs is brought to, and which of them it changes.
#[derive(Debug, Clone)]
pub struct PhotographColors {
    space: RgbSpace,
    /// For each photograph; `None` where its samples are in that space already.
    conversions: Vec<Option<Conversion>>,
    /// For the other exposures of each photograph that is a stack.
    of_stacks: Vec<Vec<Option<Conversion>>>,
}

/// What the samples of one photograph mean.
struct Meaning {
    /// The profile of RGB samples.
    profile: Arc<moxcms::ColorProfile>,
    /// The space of that profile, if a panorama can be composed in it.
    space: Option<RgbSpace>,
    /// The curve of gray samples.
    gray: TransferCurve,
    /// Whether the file's profile is one of gray.
    is_gray: bool,
    name: String,
}

impl Meaning {
    fn of_space(space: RgbSpace) -> Self {
        Self {
            name: space.name(),
            gray: space.curve.clone(),
            is_gray: false,
            profile: space.profile.clone(),
            space: Some(space),
        }
    }
}

impl PhotographColors {
    /// Reads what photographs say of their colors, from their headers, and chooses a space for all of them.
    ///
    /// Where all are in one space, that is it, and nothing is converted. Otherwise it is the one with the widest gamut,
    /// so that no photograph loses colors; of equals, that of the first photograph. Photographs that say nothing are in
    /// sRGB, or in Adobe RGB if their EXIF names it. Spaces given by tables or by a different curve for each channel
    /// are converted to the one chosen among the others, or to sRGB; gray has no gamut and does not take part in the
    /// choice. A profile that cannot be understood is as good as none; a warning says so.
    pub fn survey(sources: &[SourceImage], context: &StageContext) -> Self {
        Self::surveyed(sources, None, context)
    }

    /// The same with sRGB for all: what light beyond white is composed in.
    pub fn survey_to_srgb(sources: &[SourceImage], context: &StageContext) -> Self {
        Self::surveyed(sources, Some(RgbSpace::srgb()), context)
    }

    fn surveyed(sources: &[SourceImage], wanted: Option<RgbSpace>, context: &StageContext) -> Self {
        let read: Vec<(Meaning, Option<Diagnostic>)> =
            sources.par_iter().enumerate().map(|(number, source)| meaning(number, source)).collect();
        let (meanings, findings): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        // What they say of themselves was told where they were found, each as a photograph.
        let members = |(number, source): (usize, &SourceImage)| -> Vec<Meaning> {
            source.stack.iter().map(|member| meaning(number, &member.source).0).collect()
        };
        let stacks: Vec<Vec<Meaning>> = sources.par_iter().enumerate().map(members).collect();
        findings.into_iter().flatten().for_each(|finding| context.report(finding));
        let mut space: Option<&RgbSpace> = None;
        for candidate in meanings.iter().chain(stacks.iter().flatten()).filter_map(|meaning| meaning.space.as_ref()) {
            let wider = |space: &RgbSpace| candidate.gamut_area() > (1.0 + SAME_AREA) * space.gamut_area();
            if space.is_none_or(wider) {
                space = Some(candidate);
            }
        }
        let space = wanted.or_else(|| space.cloned()).unwrap_or_else(RgbSpace::srgb);
        let conversions: Vec<_> = meanings.iter().map(|meaning| conversion(meaning, &space)).collect();
        let of_stack = |stack: &Vec<Meaning>| stack.iter().map(|meaning| conversion(meaning, &space)).collect();
        let of_stacks = stacks.iter().map(of_stack).collect();
        for (number, (meaning, conversion)) in meanings.iter().zip(&conversions).enumerate() {
            if conversion.as_ref().is_some_and(|conversion| conversion.rgb.is_some()) {
                context.report(Diagnostic::note(
                    "color-converted",
                    Subject::Photograph(number),
                    format!("its colors were converted from {} to the panorama's {}", meaning.name, space.name()),
                    "",
                ));
            }
        }
        Self { space, conversions, of_stacks }
    }

    /// The profile to embed in the panorama; `None` for sRGB.
    pub fn icc(&self) -> Option<&[u8]> {
        self.space.icc.as_deref()
    }

    /// Whether the space is sRGB.
    pub fn is_srgb(&self) -> bool {
        self.space.is_same(&RgbSpace::srgb())
    }

    /// How the panorama's samples stand for light.
    pub fn transfer_curve(&self) -> &TransferCurve {
        &self.space.curve
    }

    /// The name of the space.
    pub fn name(&self) -> String {
        self.space.name()
    }

    /// What has to be done to photograph `index`.
    pub(crate) fn conversion(&self, index: usize) -> Option<&Conversion> {
        self.conversions.get(index)?.as_ref()
    }

    /// What has to be done to the other exposure `member` of photograph `index`.
    pub(crate) fn member_conversion(&self, index: usize, member: usize) -> Option<&Conversion> {
        self.of_stacks.get(index)?.get(member)?.as_ref()
    }
}

fn meaning(number: usize, source: &SourceImage) -> (Meaning, Option<Diagnostic>) {
    let embedded = embedded::read(&source.path);
    let srgb = || Meaning::of_space(RgbSpace::srgb());
    let Some(icc) = embedded.icc else {
        let space = if embedded.is_adobe_rgb { RgbSpace::adobe_rgb() } else { RgbSpace::srgb() };
        return (Meaning::of_space(space), None);
    };
    match understand(&icc) {
        Understood::Space(space) => (Meaning::of_space(space), None),
        Understood::Tables(profile) => {
            let name = description(&profile);
            (Meaning { profile, space: None, gray: TransferCurve::SRGB, is_gray: false, name }, None)
        }
        // Gray samples say nothing of a gamut, and colors in the same file say nothing of themselves.
        Understood::Gray(gray) => (Meaning { space: None, gray, is_gray: true, ..srgb() }, None),
        Understood::Foreign(kind) => {
            let finding = Diagnostic::note(
                "color-profile-ignored",
                Subject::Photograph(number),
                format!("its ICC profile is for {kind}; its colors are taken for sRGB"),
                "Export it in sRGB if its colors look wrong.",
            );
            (srgb(), Some(finding))
        }
        Understood::Damaged(reason) => {
            let finding = Diagnostic::warning(
                "color-profile-damaged",
                Subject::Photograph(number),
                format!("its ICC profile cannot be used ({reason}); its colors are taken for sRGB"),
                "Export the photograph again with its profile, or in sRGB.",
            );
            (srgb(), Some(finding))
        }
    }
}

fn conversion(meaning: &Meaning, space: &RgbSpace) -> Option<Conversion> {
    let srgb = RgbSpace::srgb();
    let is_there = match &meaning.space {
        Some(own) => own.is_same(space),
        // Colors beside a gray profile are sRGB; tables always have to be followed.
        None => Arc::ptr_eq(&meaning.profile, &srgb.profile) && srgb.is_same(space),
    };
    let rgb = (!is_there).then(|| meaning.profile.clone());
    let gray = (!meaning.gray.is_same(&space.curve)).then(|| meaning.gray.clone());
    (rgb.is_some() || gray.is_some()).then(|| Conversion {
        rgb,
        gray,
        is_gray: meaning.is_gray,
        target: space.profile.clone(),
        target_curve: space.curve.clone(),
    })
}
