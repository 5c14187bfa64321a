//! The summary of a panorama, printed after a stitch and by `trueup inspect`.

mod details;
mod json;
mod labeled_lines;
mod left_out;
mod measures;
mod names;
mod quiet;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::Path;

use trueup::{
    CARRIER_LEFT_OUT, CROP_TOO_SMALL, Crop, DRAWN_BY_CAMERAS, Diagnostic, FRAMES_PASSED_OVER, FRAMES_TAKEN,
    FlatEvidence, FlatSceneRecord, LensKind, LineGuide, ORIENTATION_TAG_STALE, OptionValue, PHOTOGRAPH_TURNED,
    PROJECTION_CUT, Project, RAW_DEVELOPED, Severity, Subject, Written, is_of_measures,
};

use crate::words::file_size;

use left_out::{LeftOut, left_out, tells_of_left_out};
use names::listed;

pub(crate) use json::{json, json_of_project};
pub(crate) use labeled_lines::LabeledLines;
pub(crate) use names::{name_of, names};
pub(crate) use quiet::warnings;

/// Where a panorama was written; a project file does not say.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PanoramaFile<'a> {
    pub panorama: &'a Path,
    pub bytes: u64,
    pub project: Option<&'a Path>,
    pub measured: Measured,
}

/// Of which photographs a panorama's measures are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measured {
    /// Of those that it shows.
    Shown,
    /// Of those that were stitched: composed of a project, it may show others in their place.
    Stitched,
}

/// Stages faster than this, in seconds, are not named in the short list.
const WORTH_NAMING_SECONDS: f64 = 0.05;

/// What was made of which photographs, and why. `verbose` adds every pair, photograph, note and stage. Without a
/// panorama's file, the measures are given for each photograph.
pub(crate) fn text(project: &Project, file: Option<&PanoramaFile>, verbose: bool) -> String {
    let mut lines = LabeledLines::default();
    panorama(&mut lines, project, file);
    let names = names(&project.images);
    photographs(&mut lines, project, &names, verbose);
    told_lens(&mut lines, project);
    if verbose {
        details::photographs(&mut lines, project, &names);
        details::pairs(&mut lines, project, &names);
    }
    match &project.flat_scene {
        Some(scene) => flat_scene(&mut lines, scene),
        None => lines.entry("upright", &upright(project)),
    }
    if let Some(told) = project.manhattan.level_in_words() {
        lines.entry("level by", &told);
    }
    let measured = file.map_or(Measured::Shown, |file| file.measured);
    measures::short(&mut lines, project, &names, measured);
    measures::judged(&mut lines, project);
    if verbose || file.is_none() {
        measures::table(&mut lines, project, &names);
    }
    findings(&mut lines, project, verbose, measured);
    match verbose {
        true => details::seconds(&mut lines, &project.seconds),
        false => lines.entry("time", &seconds_in_short(&project.seconds)),
    }
    lines.into_text()
}

/// The summaries of panoramas that were written, with a blank line between them.
pub(crate) fn of_written(written: &[Written], verbose: bool, measured: Measured) -> String {
    let one = |written: &Written| {
        let (panorama, project) = (&written.outputs.panorama, written.project_file());
        let file = PanoramaFile { panorama, bytes: written.bytes, project, measured };
        text(&written.project, Some(&file), verbose)
    };
    written.iter().map(one).collect::<Vec<_>>().join("\n")
}

/// The measures that the project file holds, all of them.
pub(crate) fn measures(lines: &mut LabeledLines, project: &Project) {
    let names = names(&project.images);
    measures::short(lines, project, &names, Measured::Shown);
    measures::table(lines, project, &names);
}

fn panorama(lines: &mut LabeledLines, project: &Project, file: Option<&PanoramaFile>) {
    let mut size = format!("{} x {} px", project.canvas.width, project.canvas.height);
    if project.canvas.full_turn {
        size.push_str(", a full turn: the ends meet");
    }
    match file {
        None => lines.entry("panorama", &size),
        Some(file) => {
            lines.entry("panorama", &format!("{}  {size}, {}", file.panorama.display(), file_size(file.bytes)));
        }
    }
    if let Some(cropped) = cropped(project) {
        lines.entry("cropped", &cropped);
    }
    if let Some(path) = file.and_then(|file| file.project) {
        lines.entry("project", &path.display().to_string());
    }
}

/// How much of what the photographs show was cut off, and how much of the panorama they do not show; `None` if neither
/// is.
fn cropped(project: &Project) -> Option<String> {
    let crop = project.crop.as_ref()?;
    let percent = |share: f64| match 100.0 * share {
        few if few < 1.0 => "less than 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    };
    let lost = (crop.lost > 0.0).then(|| format!("{} of what the photographs cover was cut off", percent(crop.lost)));
    let filled = (crop.filled > 0.0).then(|| format!("{} of the panorama was filled", percent(crop.filled)));
    let told: Vec<String> = lost.into_iter().chain(filled).collect();
    let all = if is_cut_by_view(project) { "all that the view shows" } else { "all" };
    (!told.is_empty()).then(|| format!("{} (--crop none keeps {all})", told.join(", ")))
}

/// Whether the view cuts off parts of photographs, which no crop brings back.
fn is_cut_by_view(project: &Project) -> bool {
    project.diagnostics.iter().any(|one| one.code == PROJECTION_CUT)
}

/// How many of the photographs in the panorama are fused of how many exposures; `None` if none is.
fn fused_stacks(project: &Project) -> Option<String> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for image in project.used_images().filter(|image| !image.stack.is_empty()) {
        *counts.entry(image.stack.len() + 1).or_default() += 1;
    }
    let stacks = |(exposures, count): (&usize, &usize)| match count {
        1 => format!("one of {exposures} exposures"),
        _ => format!("{count} of {exposures} exposures each"),
    };
    let told: Vec<String> = counts.iter().map(stacks).collect();
    let how = if project.light.is_some() { "merged to light" } else { "fused" };
    (!told.is_empty()).then(|| format!("{}, {how} (--stacks none stitches each by itself)", told.join(", ")))
}

/// How many were used, and each one left out with its reason and what to do about it.
fn photographs(lines: &mut LabeledLines, project: &Project, names: &[String], verbose: bool) {
    let reference = project.images.iter().position(|image| image.path == project.reference);
    let reference = reference.map_or(String::new(), |index| format!("; the reference is {}", names[index]));
    lines.entry("photographs", &format!("{} of {} used{reference}", project.used(), project.images.len()));
    if let Some(fused) = fused_stacks(project) {
        lines.entry("stacks", &fused);
    }
    let groups = left_out(project, names, |_| true);
    for (index, LeftOut { photographs, reason, hint }) in groups.iter().enumerate() {
        let listed = if verbose { photographs.join(", ") } else { listed(photographs) };
        lines.item("left out", &format!("{listed}: {reason}"));
        // One that the next line has, too, stands there.
        let is_repeated = groups.get(index + 1).is_some_and(|next| next.hint == *hint);
        if !hint.is_empty() && !is_repeated {
            lines.item("", hint);
        }
    }
}

/// What the user told of the lens, if anything.
fn told_lens(lines: &mut LabeledLines, project: &Project) {
    let cameras = &project.options.align.cameras;
    let of_project = project.lens_from.as_ref().map(|file| {
        let told = project.used_images().filter(|image| image.lens_told).count();
        format!("that of {file}, for {told} of {} photographs", project.used())
    });
    let kind = (cameras.lens != LensKind::Auto).then(|| cameras.lens.display());
    let wide = (cameras.fov > 0.0).then(|| format!("{} degrees across the longer side", cameras.fov));
    let told: Vec<String> = [of_project, kind, wide].into_iter().flatten().collect();
    if !told.is_empty() {
        lines.entry("lens", &format!("told: {}", told.join("; ")));
    }
}

/// That the photographs are drawn as they lie in a plane, by what evidence, and what stands them upright there.
fn flat_scene(lines: &mut LabeledLines, scene: &FlatSceneRecord) {
    let FlatEvidence { told, explained, plane_rms_px, rotating_rms_px, rotating_focal, straight_on } = scene.evidence;
    let cameras = if straight_on {
        "scanned, or seen straight on, by cameras that moved along it"
    } else {
        "seen by moving cameras"
    };
    lines.entry("scene", &format!("a flat scene, {cameras}: drawn as a plane"));
    let told = if told { "told; " } else { "" };
    // Full width over focal length is twice the tangent of half the angle.
    let view_deg = 2.0 * (0.5 / rotating_focal).atan().to_degrees();
    lines.entry(
        "",
        &format!(
            "{told}the plane explains {:.0} % of the matches, to {plane_rms_px:.1} px on average; cameras that only turn would, \
             {view_deg:.0} degrees wide, to {rotating_rms_px:.1}",
            100.0 * explained
        ),
    );
    lines.entry(
        "upright",
        &match scene.turned_by_lines_deg {
            Some(turned) => format!("by the lines on it, {turned:.1} degrees from how the photographs were held"),
            None => "as the photographs were held, on average: lines do not agree".to_owned(),
        },
    );
}

/// Whether vanishing points guided the panorama, with the divergence against its threshold; or the one reason why not.
fn upright(project: &Project) -> String {
    let manhattan = &project.manhattan;
    // Without the zeros at its end.
    let threshold = (1000.0 * manhattan.threshold).round() / 1000.0;
    let trusted = format!("up to {threshold} is trusted");
    let divergence = manhattan.divergence.map(|divergence| format!("divergence {divergence:.3}, {trusted}"));
    let slope = manhattan
        .slope_deg
        .map_or(String::new(), |slope| format!("; lines along a slope of {slope:.1} degrees do not count"));
    let certain = manhattan
        .vertical_deviation_deg
        .map_or(String::new(), |deviation| format!(", certain to {deviation:.1} degrees"));
    match manhattan.guide() {
        Some(LineGuide::AllLines) => format!("guided by the lines of all photographs together{certain}{slope}"),
        Some(LineGuide::UprightLines) => format!("guided by upright lines alone{certain}{slope}"),
        Some(LineGuide::VanishingPoints) => format!(
            "guided by vanishing points ({}; {} of {} photographs agree){slope}",
            divergence.unwrap_or(trusted),
            manhattan.inliers.len(),
            project.used()
        ),
        None => format!("not guided by vanishing points{}", manhattan.refusal_in_words()),
    }
}

/// Warnings, and with `verbose` notes, that are not told elsewhere; always, that another thing was drawn than the
/// method means, or of other files than were named, that a photograph may lie on its side or is taken to, that what the
/// camera is fixed to is not looked at, where all is wanted what the view cuts off, and that a panorama is left with
/// its ragged borders. What was found of the figures of photographs that were `measured` before comes without advice,
/// which is for who stitches them.
fn findings(lines: &mut LabeledLines, project: &Project, verbose: bool, measured: Measured) {
    /// The codes of these notes.
    const ALWAYS: [&str; 8] = [
        CARRIER_LEFT_OUT,
        CROP_TOO_SMALL,
        DRAWN_BY_CAMERAS,
        FRAMES_PASSED_OVER,
        FRAMES_TAKEN,
        ORIENTATION_TAG_STALE,
        PHOTOGRAPH_TURNED,
        RAW_DEVELOPED,
    ];
    // Who asks for all is to know what is missing all the same.
    let wants_all = project.options.arrange.canvas.crop == Crop::None;
    let names = project.photograph_names();
    let is_wanted = |diagnostic: &Diagnostic| {
        let code = diagnostic.code.as_str();
        let is_note = diagnostic.severity == Severity::Note;
        verbose || !is_note || ALWAYS.contains(&code) || (wants_all && code == PROJECTION_CUT)
    };
    let mut told: Vec<&Diagnostic> =
        project.diagnostics.iter().filter(|one| is_wanted(one) && !tells_of_left_out(one, project)).collect();
    while let [diagnostic, others @ ..] = told.as_slice() {
        let diagnostic = *diagnostic;
        let is_same = |other: &Diagnostic| !verbose && is_told_alike(diagnostic, other);
        let (mut alike, rest): (Vec<&Diagnostic>, Vec<&Diagnostic>) =
            others.iter().copied().partition(|other| is_same(other));
        alike.insert(0, diagnostic);
        told = rest;
        let label = match diagnostic.severity {
            Severity::Warning => "warning",
            Severity::Note => "note",
        };
        let subjects: Vec<String> = alike.iter().map(|one| one.subject.named(&names)).collect();
        let subjects = listed(&subjects.iter().map(String::as_str).collect::<Vec<_>>());
        let is_earlier = measured == Measured::Stitched && is_of_measures(diagnostic);
        let when = if is_earlier { "when stitched, " } else { "" };
        lines.entry(label, &format!("{subjects}: {when}{}", diagnostic.message));
        if !diagnostic.hint.is_empty() && !is_earlier {
            lines.entry("", &diagnostic.hint);
        }
    }
}

/// Whether two findings say the same of two photographs.
fn is_told_alike(one: &Diagnostic, other: &Diagnostic) -> bool {
    let of_photographs = [one, other].iter().all(|found| matches!(found.subject, Subject::Photograph(_)));
    of_photographs
        && (&one.code, one.severity, &one.message, &one.hint)
            == (&other.code, other.severity, &other.message, &other.hint)
}

/// "3.2 s: features 1.1, matching 0.7": the longest first.
fn seconds_in_short(seconds: &BTreeMap<String, f64>) -> String {
    let mut stages: Vec<(&String, f64)> = seconds.iter().map(|(stage, &seconds)| (stage, seconds)).collect();
    stages.sort_by(|one, two| two.1.total_cmp(&one.1));
    let named: Vec<String> = stages
        .iter()
        .filter(|(_, seconds)| *seconds >= WORTH_NAMING_SECONDS)
        .map(|(stage, seconds)| format!("{stage} {seconds:.1}"))
        .collect();
    let colon = if named.is_empty() { "" } else { ": " };
    format!("{:.1} s{colon}{}", seconds.values().sum::<f64>(), named.join(", "))
}
