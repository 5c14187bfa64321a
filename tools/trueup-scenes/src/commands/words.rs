//! What the subcommands say.

use trueup_core::StageContext;
use trueup_core::truth::{Level, LevelOrigin};

/// A level in words.
pub(super) fn describe(level: &Level) -> String {
    let [x, y, z] = level.down;
    let down = format!("down [{x:.6}, {y:.6}, {z:.6}], {:.2} degrees off level", level.tilt_deg());
    let figures = match (level.lines, level.standard_error_deg, level.halves_deg) {
        (Some(lines), Some(error), Some(halves)) => {
            format!(" ({lines} lines, standard error {error:.3} degrees, halves {halves:.3} degrees apart)")
        }
        (Some(lines), _, _) => format!(" ({lines} lines)"),
        _ => String::new(),
    };
    match level.origin {
        LevelOrigin::Given => format!("given: {down}{figures}"),
        LevelOrigin::Measured => format!("measured: {down}{figures}"),
        LevelOrigin::Panorama => {
            let reason = level.reason.as_deref().unwrap_or("nothing better is known");
            format!("uncertain, the panorama's own is used: {reason}{figures}")
        }
    }
}

/// Prints what the stages reported.
pub(super) fn print_findings(context: &StageContext) {
    for finding in context.findings() {
        eprintln!("{}: {}. {}", finding.subject.named(&[] as &[&str]), finding.message, finding.hint);
    }
}
