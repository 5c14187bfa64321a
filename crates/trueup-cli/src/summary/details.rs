//! The parts of the summary that only `--verbose` prints.

use std::collections::BTreeMap;

use trueup::{ImageRecord, ImageStatus, PairRecord, Project};

use super::labeled_lines::LabeledLines;

/// What was found of each photograph that is used.
pub(super) fn photographs(lines: &mut LabeledLines, project: &Project, names: &[String]) {
    for (image, name) in project.images.iter().zip(names) {
        if image.status == ImageStatus::Used {
            lines.item("used", &format!("{name}: {}", geometry(image)));
        }
    }
}

fn geometry(image: &ImageRecord) -> String {
    let known = [
        Some(format!("{} x {} px", image.width, image.height)),
        image.focal_px.map(|focal_px| format!("focal length {focal_px:.0} px")),
        image.theta_deg.map(|theta_deg| format!("turned by {theta_deg:.2} degrees")),
        image.scale.map(|scale| format!("scaled by {scale:.3}")),
        image.gain.map(|gain| format!("gain {gain:.3}")),
    ];
    known.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The verdict on every pair that was tried.
pub(super) fn pairs(lines: &mut LabeledLines, project: &Project, names: &[String]) {
    let joined = project.pairs.iter().filter(|pair| pair.verdict.is_joined()).count();
    lines.entry("pairs", &format!("{joined} joined of {} tried", project.pairs.len()));
    let name = |index: usize| names.get(index).map_or("?", String::as_str);
    for pair in &project.pairs {
        let counts = format!("{} of {} matches agree ({} needed)", pair.inliers, pair.matches, pair.needed);
        lines.item("", &format!("{} - {}: {}, {counts}", name(pair.a), name(pair.b), verdict(pair)));
    }
}

/// The verdict's name in the project file, as words.
fn verdict(pair: &PairRecord) -> String {
    let named = serde_json::to_value(pair.verdict).ok();
    named.as_ref().and_then(serde_json::Value::as_str).unwrap_or_default().replace('-', " ")
}

/// A line per stage.
pub(super) fn seconds(lines: &mut LabeledLines, seconds: &BTreeMap<String, f64>) {
    lines.entry("time", &format!("{:.3} s", seconds.values().sum::<f64>()));
    for (stage, seconds) in seconds {
        lines.item("", &format!("{seconds:>8.3} s  {stage}"));
    }
}
