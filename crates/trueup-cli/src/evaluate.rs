//! `trueup evaluate`: every measure of a panorama, against the truth where there is one.

use std::path::Path;

use serde_json::json;
use trueup::{Error, Evaluation, MatchEvaluation, Measures, PixelEvaluation, Project, Result, StatedEvaluation};

use crate::arguments::EvaluateArgs;
use crate::failure::Failure;
use crate::inspect;
use crate::output;
use crate::progress;
use crate::summary::{self, LabeledLines};

/// What the photographs themselves tell, or why they do not.
type Outcome<T> = std::result::Result<T, String>;

/// What takes the photographs.
struct Photographed {
    matches: Outcome<MatchEvaluation>,
    pixels: Outcome<PixelEvaluation>,
}

pub(crate) fn run(args: &EvaluateArgs) -> std::result::Result<(), Failure> {
    let project = inspect::read_to_use(&args.project)?;
    let evaluation = args.truth.as_deref().map(|truth| against(&project, &args.project, truth)).transpose()?;
    let photographed = match args.no_pixels {
        true => None,
        false => Some(photographed(&project, &args.project)?),
    };
    if args.json {
        let whole = json!({
            "format": "trueup-evaluation",
            "version": 1,
            "project": args.project.display().to_string(),
            "measures": project.measures.as_ref().map(Measures::without_places),
            "truth": evaluation,
            "matches": photographed.as_ref().and_then(|found| found.matches.as_ref().ok()),
            "matches_skipped": photographed.as_ref().and_then(|found| found.matches.as_ref().err()),
            "pixels": photographed.as_ref().and_then(|found| found.pixels.as_ref().ok()),
            "pixels_skipped": photographed.as_ref().and_then(|found| found.pixels.as_ref().err()),
        });
        return output::print(&format!("{whole:#}\n"));
    }
    output::print(&text(&project, evaluation.as_ref(), photographed.as_ref()))
}

/// Measures against a truth file; what does not fit is told of both files.
fn against(project: &Project, project_file: &Path, truth_file: &Path) -> Result<Evaluation> {
    let truth = trueup::read_truth(truth_file)?;
    trueup::evaluate(project, &truth).map_err(|error| match error {
        Error::Input { subject, reason, hint } => {
            let files = format!("{} against {}", project_file.display(), truth_file.display());
            Error::Input { subject: format!("{files}: {subject}"), reason, hint }
        }
        other => other,
    })
}

/// Photographs that are gone or cannot be compared leave the other measures as they are.
fn photographed(project: &Project, project_file: &Path) -> Result<Photographed> {
    let folder = project_file.parent().unwrap_or(Path::new(""));
    progress::shown(false, |context| {
        let matches = outcome(trueup::evaluate_matches(project, folder, context))?;
        let pixels = outcome(trueup::evaluate_pixels(project, folder, context))?;
        Ok(Photographed { matches, pixels })
    })
}

fn outcome<T>(measured: Result<T>) -> Result<Outcome<T>> {
    match measured {
        Ok(found) => Ok(Ok(found)),
        Err(Error::Input { subject, reason, .. }) => Ok(Err(format!("{reason}: {subject}"))),
        Err(Error::Unsolvable { why, .. }) => Ok(Err(why)),
        Err(other) => Err(other),
    }
}

fn text(project: &Project, evaluation: Option<&Evaluation>, photographed: Option<&Photographed>) -> String {
    let mut lines = LabeledLines::default();
    summary::measures(&mut lines, project);
    match (&project.measures, project.used()) {
        (Some(_), _) => {}
        (None, 1) => lines.entry("measured", "nothing: it takes two photographs, and this panorama has one"),
        (None, _) => lines.entry("measured", "the project file holds no measures: stitch again with this program"),
    }
    if let Some(evaluation) = evaluation {
        truth(&mut lines, evaluation);
    }
    if let Some(Photographed { matches, pixels }) = photographed {
        match matches {
            Err(why) => lines.entry("matches", &format!("skipped: {why}")),
            Ok(found) => matched(&mut lines, project, found),
        }
        match pixels {
            Err(why) => lines.entry("pixels", &format!("skipped: {why}")),
            Ok(found) => compared(&mut lines, found),
        }
    }
    lines.into_text()
}

fn truth(lines: &mut LabeledLines, found: &Evaluation) {
    lines.entry("truth", &format!("{} of {} photographs measured", found.used, found.given));
    let (mean, most, spread) = (found.upright_deg, found.upright_max_deg, found.spread_deg);
    lines.item("upright", &format!("{mean:.3} degrees off on average, {most:.3} at most; spread {spread:.3}"));
    let by_reference = found
        .gdic_reference_deg
        .map_or(String::new(), |degrees| format!(", {degrees:.3} from the project's reference"));
    let (gdic, similarity) = (found.gdic_deg, found.gdic_similarity_deg);
    lines.item("GDIC", &format!("{gdic:.3} degrees from the first photograph{by_reference}"));
    lines.item("GDIC-P", &format!("{similarity:.3} degrees, by similarities instead of rectangles"));
    if let Some((mean, most)) = found.theta_error_deg.zip(found.theta_error_max_deg) {
        lines.item("theta", &format!("{mean:.3} degrees off on average, {most:.3} at most"));
    }
    let (ld, mean, corners) = (found.ld, found.ld_mean, found.ld_corners);
    lines.item("LD", &format!("{ld:.3}e-2 at most, {mean:.3}e-2 on average; {corners:.3}e-2 by center and corners"));
    lines.item("folds", &format!("{} folded cells", found.folds));
    lines.item(
        "alignment",
        &match found.align_px {
            Some(pixels) => format!("{pixels:.3} px"),
            None => "unknown: no overlaps, or photographs from different places".to_owned(),
        },
    );
    if let Some(stated) = &found.stated {
        lines.item("stated", &beside_the_truth(stated));
    }
    for photograph in &found.photographs {
        let theta = photograph.theta_error_deg.map_or(String::new(), |degrees| format!(", theta {degrees:+.3}"));
        let off_upright = match photograph.upright_deg {
            Some(degrees) => format!("{degrees:+.3} degrees off upright"),
            None => "its middle is not shown".to_owned(),
        };
        lines.item("", &format!("{}: {off_upright}{theta}", photograph.file));
    }
}

/// "the truth within 9 of 9 intervals of 95 %; upright 0.124 stated, 0.060 true; GDIC 0.482 estimated"
fn beside_the_truth(stated: &StatedEvaluation) -> String {
    let intervals = match stated.intervals {
        0 => "no lean".to_owned(),
        count => format!("the truth within {} of {count} intervals of 95 %", stated.holding),
    };
    let upright = stated.stated_upright_deg.zip(stated.upright_deg);
    let upright = upright.map(|(stated, found)| format!("upright {stated:.3} stated, {found:.3} true"));
    let gdic = stated.estimated_gdic_deg.map(|degrees| format!("GDIC {degrees:.3} estimated"));
    [Some(intervals), upright, gdic].into_iter().flatten().collect::<Vec<_>>().join("; ")
}

fn matched(lines: &mut LabeledLines, project: &Project, found: &MatchEvaluation) {
    let MatchEvaluation { matches, pairs, rms_px, median_px, by_pair } = found;
    let [overlaps, of_pairs] = match pairs {
        1 => ["1 overlap".to_owned(), String::new()],
        _ => [format!("{pairs} overlaps"), " (medians over the overlaps)".to_owned()],
    };
    lines.entry("matches", &format!("{matches} that are consistent, in {overlaps}"));
    lines.item("apart", &format!("root mean square {rms_px:.2}, median {median_px:.2} px of the panorama{of_pairs}"));
    if let Some(worst) = by_pair.iter().max_by(|one, two| one.rms_px.total_cmp(&two.rms_px)).filter(|_| *pairs > 1) {
        let names = summary::names(&project.images);
        let [a, b] = [&worst.a, &worst.b].map(|path| summary::name_of(path, project, &names));
        let (rms_px, median_px) = (worst.rms_px, worst.median_px);
        lines.item("farthest", &format!("{a} and {b}: root mean square {rms_px:.2}, median {median_px:.2} px"));
    }
}

fn compared(lines: &mut LabeledLines, found: &PixelEvaluation) {
    let (pairs, scale) = (found.pairs, found.scale);
    lines.entry("pixels", &format!("{} in {pairs} overlaps, at {scale:.3} of the panorama's size", found.pixels));
    lines.item("NCC", &format!("RMSE {:.4}, MSE {:.4}", found.ncc_rmse, found.ncc_mse));
    lines.item("gray", &format!("MSE {:.2}", found.intensity_mse));
    let quality = [
        found.psnr_db.map(|decibels| format!("PSNR {decibels:.2} dB")),
        found.ssim.map(|similarity| format!("SSIM {similarity:.4}")),
    ];
    lines.item("", &quality.into_iter().flatten().collect::<Vec<_>>().join(", "));
}
