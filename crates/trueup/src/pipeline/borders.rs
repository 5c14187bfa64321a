//! The borders phase: photographs that lie inside an even border in their files, or askew in them, are measured again
//! without what lies beside them.

use trueup_core::diagnostics::{Diagnostic, Reported, Subject, add_seconds};
use trueup_core::inset::Inset;
use trueup_core::outline::Outline;
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};
use trueup_vision::border::EvenBorder;
use trueup_vision::padding::{CommonPadding, Padding, StraightSided};

use super::measure::{self, MeasureInput, Measurements, OfOneSize};
use super::measured::Measured;
use super::photographs::PhotographSet;
use super::shelf::Shelf;
use crate::memo::Memo;
use crate::options::StitchOptions;

/// Most that the borders of pictures of one size differ to be one and the same, in working pixels: a dark place or a
/// bright one beside a border hides where it ends.
const SAME_BORDER: usize = 2;

/// What the phase works on: the photographs as they were given, and what was told of them.
pub(super) struct BordersInput<'a> {
    pub found: Reported<PhotographSet>,
    pub measurements: Reported<Measurements>,
    pub memo: Memo<'a>,
    pub shelf: &'a Shelf<'a>,
    pub keep_grays: bool,
}

/// Photographs without borders.
pub(super) struct Unbordered {
    pub found: Reported<PhotographSet>,
    pub measurements: Reported<Measurements>,
}

/// What of a picture is no part of the photograph in it.
#[derive(Debug, Clone, Default, PartialEq)]
struct Beside {
    /// Strips along the sides, in full pixels.
    inset: Inset,
    /// Or inside of what the photograph lies, in full pixels, where it is not parallel to these.
    outline: Option<Outline>,
}

impl Beside {
    fn is_nothing(&self) -> bool {
        self.inset.is_none() && self.outline.is_none()
    }

    /// The photograph in the picture `image`.
    fn inside(&self, image: &SourceImage) -> SourceImage {
        match &self.outline {
            Some(outline) => SourceImage { outline: Some(outline.clone()), ..image.clone() },
            None => image.clone().inside(self.inset).unwrap_or_else(|| image.clone()),
        }
    }
}

/// Takes what lies beside them from the photographs inside a border, or askew, and measures them again; without any,
/// everything stays as it was.
///
/// # Errors
/// [`trueup_core::Error::Limits`]; [`trueup_core::Error::Cancelled`].
pub(super) fn run(input: BordersInput, options: &StitchOptions, context: &StageContext) -> Result<Unbordered> {
    let BordersInput { found, mut measurements, memo, shelf, keep_grays } = input;
    let beside = beside(&found.value.images, &measurements.value);
    let cut: Vec<usize> = (0..beside.len()).filter(|&number| !beside[number].is_nothing()).collect();
    if cut.is_empty() {
        return Ok(Unbordered { found, measurements });
    }
    let (set, mut told) = found.split();
    let mut photographs = set.into_found();
    for (image, beside) in photographs.images.iter_mut().zip(&beside) {
        *image = beside.inside(image);
    }
    for (masks, beside) in photographs.masks.masks.iter_mut().zip(&beside) {
        *masks = std::mem::take(masks).inside(beside.inset);
    }
    let set = PhotographSet::reopened(photographs, options, context)?;
    let input = MeasureInput { set: &set, memo, shelf, keep_grays, workers: None };
    let (again, told_again) = measure::some(&input, &cut, &options.measure, context)?.split();
    // What was told of features and lines was of those with the border's.
    measurements
        .findings
        .retain(|one| !matches!(one.subject, Subject::Photograph(number) if !beside[number].is_nothing()));
    measurements.findings.extend(told_again.findings);
    add_seconds(&mut measurements.seconds, told_again.seconds);
    let Measurements { photographs, keys } = again;
    for (number, (one, key)) in cut.iter().copied().zip(photographs.into_iter().zip(keys)) {
        measurements.value.photographs[number] = one;
        measurements.value.keys[number] = key;
    }
    told.findings.extend(cut.iter().map(|&number| note(number, &set.images[number])));
    Ok(Unbordered { found: told.map(|()| set), measurements })
}

/// What of each photograph's file lies beside it.
fn beside(images: &[SourceImage], measurements: &Measurements) -> Vec<Beside> {
    let mut beside = vec![Beside::default(); images.len()];
    for (size, OfOneSize { numbers, measured }) in measurements.by_size(images) {
        let borders: Vec<EvenBorder> = measured.iter().map(|measured| measured.border).collect();
        for ((&number, inset), measured) in numbers.iter().zip(of_one_size(&borders)).zip(&measured) {
            let full = |pixels: usize| (pixels as f64 / measured.frame.working_from_full).ceil() as usize;
            let inset = inset.map(full);
            // Of a picture of a few pixels, nothing may be left.
            if inset.inner(size).is_some() {
                beside[number].inset = inset;
            }
        }
        for ((&number, outline), measured) in numbers.iter().zip(outlines(&measured)).zip(&measured) {
            if let Some(outline) = outline {
                let outline = Some(outline.scaled(1.0 / measured.frame.working_from_full));
                beside[number] = Beside { inset: Inset::default(), outline };
            }
        }
    }
    beside
}

/// Inside of what the photographs of pictures of one size lie, in working pixels.
fn outlines(measured: &[&Measured]) -> Vec<Option<Outline>> {
    // The casts are of sizes of rasters, to the nearest whole pixel.
    let Some(size) = measured.first().map(|one| [one.frame.width as usize, one.frame.height as usize]) else {
        return Vec::new();
    };
    let paddings: Vec<&Padding> = measured.iter().map(|measured| &measured.padding).collect();
    let common = CommonPadding::of(&paddings, size);
    let alone: Vec<Option<StraightSided>> = paddings.iter().map(|padding| padding.quadrilateral(size)).collect();
    // Those that lie straight keep the size of the others: one camera took them.
    let is_askew = alone.iter().flatten().any(|found| found.is_askew);
    let of_one = |(padding, alone): (&&Padding, Option<StraightSided>)| match &common {
        Some(common) if common.suits(padding) => Some(common.outline.clone()),
        _ => alone.filter(|_| is_askew).map(|found| found.outline),
    };
    paddings.iter().zip(alone).map(of_one).collect()
}

/// The borders of pictures of one size, which often have one in common. Half of them tell it; where it ends beside a
/// sky as bright, or a night as dark, as itself, the others do.
fn of_one_size(borders: &[EvenBorder]) -> Vec<Inset> {
    let common: [Option<usize>; 4] = std::array::from_fn(|side| {
        let mut widths: Vec<usize> =
            borders.iter().map(|one| one.border.sides()[side]).filter(|&width| width > 0).collect();
        widths.sort_unstable_by(|a, b| b.cmp(a));
        let tell = |&width: &usize| widths.iter().filter(|&&other| is_same(width, other)).count();
        widths.iter().copied().find(|width| 2 * tell(width) >= borders.len())
    });
    let inset = |one: &EvenBorder| {
        Inset::from_sides(std::array::from_fn(|side| {
            let (own, even) = (one.border.sides()[side], one.even.sides()[side]);
            match common[side] {
                Some(common) if own == 0 && even + 1 >= common => common,
                Some(common) if own > 0 && is_same(common, own) => common,
                _ => own,
            }
        }))
    };
    borders.iter().map(inset).collect()
}

fn is_same(one: usize, other: usize) -> bool {
    one.abs_diff(other) <= SAME_BORDER
}

fn note(number: usize, image: &SourceImage) -> Diagnostic {
    let message = match &image.outline {
        Some(outline) => {
            let percent = 100.0 * (1.0 - outline.share_of([image.width, image.height]));
            format!(
                "it lies askew, or with bent sides, in an even picture, whose rest is left out ({percent:.1} % of it)"
            )
        }
        None => {
            let [left, top, right, bottom] = image.inset.sides();
            format!(
                "it lies inside an even border, which is left out ({left}, {top}, {right} and {bottom} px at the left, top, right and bottom)"
            )
        }
    };
    Diagnostic::note(
        "border-left-out",
        Subject::Photograph(number),
        message,
        "If that is part of the picture, cut off one of its sides.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(border: [usize; 2], even: [usize; 2]) -> EvenBorder {
        let inset = |[top, bottom]: [usize; 2]| Inset { top, bottom, ..Inset::default() };
        EvenBorder { border: inset(border), even: inset(even) }
    }

    #[test]
    fn photographs_of_one_film_share_its_border() {
        let told = [
            rows([13, 13], [12, 12]),
            rows([12, 13], [11, 12]),
            // Its sky is as bright as the border.
            rows([0, 0], [40, 12]),
            // Nothing of it is even, or not enough.
            rows([0, 0], [0, 11]),
        ];
        let found = of_one_size(&told).into_iter().map(|Inset { top, bottom, .. }| [top, bottom]);
        assert_eq!(found.collect::<Vec<_>>(), [[13, 13], [13, 13], [13, 13], [0, 0]]);
        // As narrow as what borders may differ by, it is still none of those that show nothing of it.
        let narrow = of_one_size(&[rows([2, 2], [1, 1]), rows([0, 0], [0, 0])]);
        assert_eq!(narrow[1], Inset::default());
        // One of four tells nothing of the others.
        let alone = [told[0], rows([0, 0], [40, 40]), rows([0, 0], [40, 40]), rows([0, 0], [0, 0])];
        assert_eq!(of_one_size(&alone)[1], Inset::default());
        assert_eq!(of_one_size(&alone)[0].top, 13);
    }
}
