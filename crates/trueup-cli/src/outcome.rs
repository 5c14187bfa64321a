//! What is said of panoramas that were written, and whether they are what was asked for.

use trueup::Written;

use crate::arguments::{FailOn, MessageArgs};
use crate::failure::Failure;
use crate::output;
use crate::summary::{self, Measured};
use crate::words::printable;

/// Says what was written, in the form asked for; `takes_output` tells that standard output holds a file,
/// `measured` of which photographs the measures are.
///
/// # Errors
/// What [`MessageArgs::fail_on`] and [`MessageArgs::max_error`] make of it, and those of writing.
pub(crate) fn tell(
    written: &[Written],
    messages: &MessageArgs,
    takes_output: bool,
    measured: Measured,
) -> Result<(), Failure> {
    if messages.quiet {
        trueup_terminal::complain(&printable(&summary::warnings(written)));
    }
    if messages.json {
        output::report(&summary::json(written), takes_output)?;
    } else if !messages.quiet {
        output::report(&summary::of_written(written, messages.verbose, measured), takes_output)?;
    }
    refuse(written, messages)
}

fn refuse(written: &[Written], messages: &MessageArgs) -> Result<(), Failure> {
    let apart = |one: &Written| Some(one.project.measures.as_ref()?.reprojection.as_ref()?.percentile_95_px);
    if messages.max_error.is_some() && written.iter().any(|one| apart(one).is_none()) {
        return Err(Failure::unsatisfied(
            "how far apart matched points land was not measured, so that --max-error cannot tell",
            "The panorama is written. Stitch the photographs with this view, or leave --max-error out.",
        ));
    }
    let widest = written.iter().filter_map(apart).fold(0.0, f64::max);
    if let Some(allowed) = messages.max_error.filter(|&allowed| widest > allowed) {
        return Err(Failure::unsatisfied(
            format!("95 of 100 matched points land within {widest:.3} px, {allowed} px are allowed (--max-error)"),
            "Look at the panorama, which is written. Leave out the photographs that meet worst (`trueup evaluate` names them), or allow more.",
        ));
    }
    let of_panorama = |one: &Written| -> Vec<String> {
        let names = one.project.photograph_names();
        let warnings = one.project.warnings();
        warnings.map(|warning| format!("{}: {}", warning.subject.named(&names), warning.message)).collect()
    };
    let warnings: Vec<String> = written.iter().flat_map(of_panorama).collect();
    match (messages.fail_on, warnings.as_slice()) {
        (None, _) | (_, []) => Ok(()),
        (Some(FailOn::Warning), [first, others @ ..]) => {
            let more = if others.is_empty() { String::new() } else { format!("; and {} more", others.len()) };
            let hint = "The panorama is written; see the summary or the project for every warning.";
            Err(Failure::unsatisfied(format!("a warning is a failure here (--fail-on): {first}{more}"), hint))
        }
    }
}
