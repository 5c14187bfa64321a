//! What the panorama's own lines and matches say of it.

use trueup::{FEWEST_CERTAIN, Judgement, Measures, PhotographMeasures, Project, lean_side};

use super::Measured;
use super::labeled_lines::LabeledLines;
use super::names::{listed, name_of};

/// One or two lines: how upright, how well aligned, how straight, of photographs that were `measured` now or before.
pub(crate) fn short(lines: &mut LabeledLines, project: &Project, names: &[String], measured: Measured) {
    let Some(measures) = &project.measures else { return };
    let when = match measured {
        Measured::Shown => "",
        Measured::Stitched => "when stitched, not anew: ",
    };
    lines.entry("measured", &format!("{when}{}", upright(measures, project, names)));
    let rest: Vec<String> = [alignment(measures), bent_line(measures, project, names)].into_iter().flatten().collect();
    if !rest.is_empty() {
        lines.entry("", &rest.join("; "));
    }
}

/// "upright good, alignment fair, lines look at it": a plain word for each.
pub(super) fn judged(lines: &mut LabeledLines, project: &Project) {
    let Judgement { upright, alignment, lines: straight } = project.judgement();
    let words: Vec<String> = [("upright", upright), ("alignment", alignment), ("lines", straight)]
        .into_iter()
        .filter_map(|(what, verdict)| Some(format!("{what} {}", verdict?)))
        .collect();
    if !words.is_empty() {
        lines.entry("judged", &words.join(", "));
    }
}

/// What is less, in degrees, would be shown as nothing.
const LEAST_TOLD_DEG: f64 = 0.05;

/// "upright within 0.6 degrees at 95 %, 0.3 expected on average (8 photographs measured, 2 uncertain: 03.jpg, 07.jpg)"
fn upright(measures: &Measures, project: &Project, names: &[String]) -> String {
    let Some(upright) = &measures.upright else {
        return not_measured(measures);
    };
    let uncertain: Vec<&str> = measures
        .photographs
        .iter()
        .filter(|photograph| !photograph.certain)
        .map(|photograph| name_of(&photograph.path, project, names))
        .collect();
    let measured = format!("{} measured", photographs_in_words(upright.measured));
    let uncertain = match uncertain.len() {
        0 => String::new(),
        count => format!(", {count} uncertain: {}", listed(&uncertain)),
    };
    let (most, mean) = (upright.max_deg, upright.mean_deg);
    match upright.within_deg {
        Some(within) => {
            let expected = if mean < LEAST_TOLD_DEG { "less than 0.1".to_owned() } else { format!("{mean:.1}") };
            format!(
                "upright within {within:.1} degrees at 95 %, {expected} expected on average ({measured}{uncertain})"
            )
        }
        // A project of an earlier version states no interval.
        None => format!("upright within {most:.1} degrees, {mean:.1} on average ({measured}{uncertain})"),
    }
}

/// Why it is not told how upright: "upright not measured: vertical lines tell it of 1 of 2 photographs (2 needed)".
/// What guided the panorama need not be vertical.
fn not_measured(measures: &Measures) -> String {
    let told = measures.photographs.iter().filter(|photograph| photograph.certain).count();
    let all = photographs_in_words(measures.photographs.len());
    format!("upright not measured: vertical lines tell it of {told} of {all} ({FEWEST_CERTAIN} needed)")
}

fn photographs_in_words(count: usize) -> String {
    if count == 1 { "1 photograph".to_owned() } else { format!("{count} photographs") }
}

fn alignment(measures: &Measures) -> Option<String> {
    let found = measures.reprojection.as_ref()?;
    Some(format!(
        "points meet within {:.1} px on average, 95 of 100 within {:.1}",
        found.mean_px, found.percentile_95_px
    ))
}

fn bent_line(measures: &Measures, project: &Project, names: &[String]) -> Option<String> {
    // A full turn bows level lines, as it should.
    let lines = measures.long_lines.as_ref().filter(|_| !project.canvas.full_turn)?;
    Some(match &lines.longest_bent {
        None => format!("none of {} long lines is bent", lines.lines),
        Some(line) => format!(
            "longest bent line: {:.0} px, {:.1} px off, in {}",
            line.length_px,
            line.off_px,
            name_of(&line.path, project, names)
        ),
    })
}

/// The figures that the short form leaves out, and a line per photograph.
pub(super) fn table(lines: &mut LabeledLines, project: &Project, names: &[String]) {
    let Some(measures) = &project.measures else { return };
    if let Some(degrees) = measures.estimated_gdic_deg {
        lines.item("GDIC", &format!("{degrees:.2} degrees, estimated from the photographs' lines"));
    }
    let (ld, mean, folds) = (measures.ld, measures.ld_mean, measures.folds);
    lines.item("LD", &format!("{ld:.3}e-2 at most, {mean:.3}e-2 on average; {folds} folded cells"));
    if let Some(long) = &measures.long_lines {
        let bend = 1000.0 * long.mean_bend;
        lines.item("lines", &format!("{} of {} long lines bent; {bend:.2} in 1000 off", long.bent, long.lines));
    }
    for photograph in &measures.photographs {
        lines.item("", &format!("{}: {}", name_of(&photograph.path, project, names), lean(photograph)));
    }
}

/// "leans to the left by 0.02 +- 0.29 degrees at 95 % (34 vertical lines)"
fn lean(photograph: &PhotographMeasures) -> String {
    /// Decimals of degrees that are told of a photograph.
    const DECIMALS: usize = 2;
    let lines = match photograph.vertical_lines {
        0 => "no vertical lines".to_owned(),
        1 => "1 vertical line".to_owned(),
        count => format!("{count} vertical lines"),
    };
    let uncertain = if photograph.certain { "" } else { "uncertain: " };
    let Some(lean) = photograph.lean_deg else { return lines };
    let (side, size) = (lean_side(lean, DECIMALS), lean.abs());
    match photograph.within_deg {
        Some(within) => {
            format!("{uncertain}leans{side} by {size:.DECIMALS$} +- {within:.DECIMALS$} degrees at 95 % ({lines})")
        }
        // A project of an earlier version states no interval.
        None => format!("{uncertain}leans{side} by {size:.DECIMALS$} degrees ({lines})"),
    }
}
