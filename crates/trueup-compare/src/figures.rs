//! What is measured of every panorama, described once for tables and pages.

use std::collections::BTreeMap;

use serde::Serialize;

use super::compared::Compared;

/// Which of two values of a figure is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// The lower one.
    Lower,
    /// The higher one.
    Higher,
    /// Neither; it tells how far the others can be trusted.
    Neither,
}

/// One figure: what it means and how it is shown.
#[derive(Debug, Clone, Serialize)]
pub struct ComparisonFigure {
    /// Names it in [`Compared::figures`].
    pub key: &'static str,
    /// For people.
    pub name: &'static str,
    /// Its unit; may be empty.
    pub unit: &'static str,
    /// Decimals worth showing; values equal to this precision are equally good.
    pub decimals: usize,
    /// Which value is better.
    pub better: Better,
    /// Whether it belongs to the short list.
    pub main: bool,
    /// Whether it needs the truth.
    pub needs_truth: bool,
    /// What it means.
    pub meaning: &'static str,
    #[serde(skip)]
    of: fn(&Compared) -> Option<f64>,
}

/// Bends are shown in thousandths of a line's length.
const THOUSANDTHS: f64 = 1e3;
/// Shares are shown in hundredths.
const PER_CENT: f64 = 1e2;

macro_rules! figure {
    ($key:literal, $name:literal, $unit:literal, $decimals:literal, $better:ident, $main:literal, $truth:literal, $of:expr, $meaning:literal) => {
        ComparisonFigure {
            key: $key,
            name: $name,
            unit: $unit,
            decimals: $decimals,
            better: Better::$better,
            main: $main,
            needs_truth: $truth,
            meaning: $meaning,
            of: $of,
        }
    };
}

/// Every figure, in the order to be shown.
#[rustfmt::skip]
const FIGURES: [ComparisonFigure; 23] = [
    figure!("upright_deg", "upright", "°", 2, Lower, true, false,
        |c| Some(c.measures.as_ref()?.upright.as_ref()?.mean_deg),
        "How far what is vertical leans, expected mean over the photographs of which lines tell it to a degree."),
    figure!("upright_max_deg", "upright, worst photograph", "°", 2, Lower, true, false,
        |c| Some(c.measures.as_ref()?.upright.as_ref()?.max_deg),
        "The largest lean that is estimated of a photograph."),
    figure!("lean_deg", "vertical lines lean by", "°", 2, Lower, true, false,
        |c| mean(c.measures.as_ref()?.photographs.iter().filter_map(|photograph| photograph.lean_deg)),
        "Mean lean, with its sign, over all photographs of which lines tell it, however unsure."),
    figure!("vertical_lines", "vertical lines", "", 0, Neither, false, false,
        |c| Some(c.measures.as_ref()?.photographs.iter().map(|photograph| photograph.vertical_lines as f64).sum()),
        "Line segments that point to the vertical: what upright is judged by."),
    figure!("upright_pictures", "photographs judged upright", "", 0, Neither, false, false,
        |c| Some(c.measures.as_ref()?.upright.as_ref()?.measured as f64),
        "Photographs of which lines tell the lean to a degree."),
    figure!("estimated_gdic_deg", "GDIC, estimated", "°", 2, Lower, false, false,
        |c| c.measures.as_ref()?.estimated_gdic_deg,
        "Global direction inconsistency, with each photograph's true direction taken from the lines of all photographs."),
    figure!("bend", "bend of long lines", "‰", 2, Lower, true, false,
        |c| Some(THOUSANDTHS * c.measures.as_ref()?.long_lines.as_ref()?.mean_bend),
        "How far long straight lines stray from straight, in thousandths of their length."),
    figure!("bent_lines", "bent lines", "", 0, Lower, false, false,
        |c| Some(c.measures.as_ref()?.long_lines.as_ref()?.bent as f64),
        "Long lines that stray by more than 0.003 of their length."),
    figure!("longest_bent", "longest bent line, off by", "%", 1, Lower, true, false,
        |c| {
            let lines = c.measures.as_ref()?.long_lines.as_ref()?;
            Some(lines.longest_bent.as_ref().map_or(0.0, |line| PER_CENT * line.off_px / line.length_px))
        },
        "Largest distance from straight of the longest bent line, in hundredths of its length; 0 if none is bent."),
    figure!("reprojection_px", "points meet within", "px", 2, Lower, true, false,
        |c| Some(c.measures.as_ref()?.reprojection.as_ref()?.mean_px),
        "Mean distance of matched points in the panorama, in the photographs' own pixels."),
    figure!("reprojection_95_px", "95 of 100 within", "px", 2, Lower, false, false,
        |c| Some(c.measures.as_ref()?.reprojection.as_ref()?.percentile_95_px),
        "95 of 100 matched points are not farther apart."),
    figure!("ncc", "overlap NCC", "", 4, Lower, true, false,
        |c| Some(c.pixels.as_ref()?.ncc_rmse),
        "How unlike the photographs look where they overlap: root mean square of 1 - normalized cross correlation; 0 is perfect."),
    figure!("ssim", "overlap SSIM", "", 4, Higher, false, false,
        |c| c.pixels.as_ref()?.ssim,
        "How alike the photographs look where they overlap: structural similarity; 1 is perfect."),
    figure!("ld", "LD", "e-2", 2, Lower, true, false,
        |c| Some(c.measures.as_ref()?.ld),
        "Local distortion: how unevenly grid cells are stretched outside the overlaps, worst photograph."),
    figure!("ld_mean", "LD, mean", "e-2", 2, Lower, false, false,
        |c| Some(c.measures.as_ref()?.ld_mean),
        "The same, mean over the photographs."),
    figure!("folds", "folded cells", "", 0, Lower, true, false,
        |c| Some(c.measures.as_ref()?.folds as f64),
        "Grid cells that lie over themselves."),
    figure!("true_upright_deg", "upright, true", "°", 2, Lower, true, true,
        |c| Some(c.evaluation.as_ref()?.upright_deg),
        "How far the photographs' middles are from upright by the truth, mean."),
    figure!("gdic_deg", "GDIC", "°", 2, Lower, true, true,
        |c| Some(c.evaluation.as_ref()?.gdic_deg),
        "Global direction inconsistency: how differently photographs are turned from what their true cameras say."),
    figure!("gdic_similarity_deg", "GDIC-P", "°", 2, Lower, false, true,
        |c| Some(c.evaluation.as_ref()?.gdic_similarity_deg),
        "GDIC with each photograph's best similarity in place of its smallest rectangle."),
    figure!("theta_error_deg", "theta error", "°", 2, Lower, true, true,
        |c| c.evaluation.as_ref()?.theta_error_deg,
        "Error of the rotations that the similarity prior wants, before the mesh."),
    figure!("align_px", "alignment, true", "px", 2, Lower, true, true,
        |c| c.evaluation.as_ref()?.align_px,
        "Distance of the two places of what two photographs both show, in the photographs' own pixels."),
    figure!("used", "photographs used", "", 0, Higher, false, false,
        |c| Some(c.panorama.as_ref()?.used as f64),
        "Photographs in the panorama."),
    figure!("seconds", "seconds", "s", 1, Lower, true, false,
        |c| c.panorama.as_ref().map(|_| c.seconds.values().sum()),
        "Time that the method takes alone at this size, with reading, measuring and matching the photographs."),
];

/// The figures worth showing: all, or those that need no truth.
pub(crate) fn shown(with_truth: bool) -> Vec<ComparisonFigure> {
    FIGURES.iter().filter(|figure| with_truth || !figure.needs_truth).cloned().collect()
}

/// Mean of the magnitudes of some angles; `None` without any.
fn mean(angles: impl Iterator<Item = f64>) -> Option<f64> {
    let magnitudes: Vec<f64> = angles.map(f64::abs).collect();
    (!magnitudes.is_empty()).then(|| magnitudes.iter().sum::<f64>() / magnitudes.len() as f64)
}

impl ComparisonFigure {
    /// A value as far as it is worth showing, as a whole number.
    fn rounded(&self, value: f64) -> f64 {
        // The table's decimals are few.
        (value * 10_f64.powi(self.decimals as i32)).round()
    }
}

/// Fills in every entry's figures, and marks the best. Where all are equally good, or only one was measured, none is
/// marked.
pub(crate) fn fill(entries: &mut [Compared], figures: &[ComparisonFigure]) {
    for entry in entries.iter_mut() {
        let found = figures.iter().filter_map(|figure| Some((figure.key, (figure.of)(entry)?)));
        let found: BTreeMap<&'static str, f64> = found.filter(|(_, value)| value.is_finite()).collect();
        entry.figures = found;
        entry.best.clear();
    }
    for figure in figures {
        let sign = match figure.better {
            Better::Lower => 1.0,
            Better::Higher => -1.0,
            Better::Neither => continue,
        };
        let values: Vec<Option<f64>> =
            entries.iter().map(|entry| Some(sign * figure.rounded(*entry.figures.get(figure.key)?))).collect();
        let Some(best) = values.iter().flatten().copied().min_by(f64::total_cmp) else { continue };
        if values.iter().flatten().all(|&value| value == best) {
            continue;
        }
        for (entry, value) in entries.iter_mut().zip(values) {
            if value == Some(best) {
                entry.best.push(figure.key);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entry::ComparisonEntry;

    fn figure(better: Better) -> ComparisonFigure {
        ComparisonFigure { better, decimals: 1, of: |c| c.seconds.get("it").copied(), ..FIGURES[0].clone() }
    }

    fn entry(value: Option<f64>) -> Compared {
        let entry = ComparisonEntry { name: String::new(), meaning: String::new(), overrides: Vec::new() };
        let seconds = value.map(|value| ("it".to_owned(), value)).into_iter().collect();
        Compared { seconds, ..Compared::of(&entry) }
    }

    /// The positions of the entries that are marked.
    fn marked(values: &[Option<f64>], better: Better) -> Vec<usize> {
        let mut entries: Vec<Compared> = values.iter().map(|&value| entry(value)).collect();
        fill(&mut entries, &[figure(better)]);
        (0..entries.len()).filter(|&k| !entries[k].best.is_empty()).collect()
    }

    #[test]
    fn the_best_is_marked_and_ties_are_marked_together() {
        // 0.21 and 0.19 are both shown as 0.2.
        let values = [Some(0.21), None, Some(0.19), Some(0.4), Some(f64::NAN)];
        assert_eq!(marked(&values, Better::Lower), [0, 2]);
        assert_eq!(marked(&values, Better::Higher), [3]);
        assert!(marked(&values, Better::Neither).is_empty());
        assert!(marked(&[Some(1.0), Some(1.0)], Better::Lower).is_empty());
        assert!(marked(&[Some(1.0), None], Better::Lower).is_empty());
    }

    #[test]
    fn figures_have_keys_of_their_own() {
        for (index, figure) in FIGURES.iter().enumerate() {
            assert!(FIGURES[..index].iter().all(|other| other.key != figure.key), "{}", figure.key);
            assert!(figure.meaning.ends_with(|last: char| last == '.' || last.is_alphanumeric()), "{}", figure.key);
        }
        assert!(shown(false).len() < shown(true).len());
    }
}
