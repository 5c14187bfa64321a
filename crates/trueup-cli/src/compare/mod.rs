//! `trueup compare`: methods side by side, and the sums of what people ranked.

mod pages;
mod summary;

use trueup::{Error, Inputs, StitchOptions};
use trueup_compare::{
    CompareJob, Comparison, ComparisonEntry, ComparisonPage, Drawing, PanoramaFormat, read_rankings, tally,
};

use crate::arguments::CompareArgs;
use crate::chosen;
use crate::failure::Failure;
use crate::output;
use crate::progress;

pub(crate) fn run(args: CompareArgs) -> Result<(), Failure> {
    if !args.tally.is_empty() {
        return sum_up(&args);
    }
    let (quiet, json) = (args.quiet, args.json);
    let (job, options) = checked(args)?;
    let compared = progress::shown(quiet, |context| job.run(&options, context, &pages))?;
    match (quiet, json) {
        (true, _) => Ok(()),
        (false, true) => print_json("comparison", &compared),
        (false, false) => output::print(&summary::text(&compared, &job.output)),
    }
}

/// Prints `what` as JSON.
fn print_json(what: &str, value: &impl serde::Serialize) -> Result<(), Failure> {
    let json =
        serde_json::to_string_pretty(value).map_err(|error| Error::input(what, error, "Report this as a defect."))?;
    output::print(&format!("{json}\n"))
}

/// The pages of a comparison.
fn pages(comparison: &Comparison, drawings: &[Drawing]) -> Result<Vec<ComparisonPage>, Error> {
    let mut pages =
        vec![ComparisonPage { name: "index.html".to_owned(), text: pages::side_by_side(comparison, drawings)? }];
    if let Some(ranking) = &comparison.ranking {
        pages
            .push(ComparisonPage { name: "ranking.html".to_owned(), text: pages::blind_ranking(comparison, ranking)? });
    }
    Ok(pages)
}

fn sum_up(args: &CompareArgs) -> Result<(), Failure> {
    let results = args.tally.iter().map(|path| read_rankings(path)).collect::<Result<Vec<_>, _>>()?;
    let tally = tally(&results)?;
    if args.json { print_json("tally", &tally) } else { output::print(&summary::scores(&tally)) }
}

/// Arguments that make sense: what the library needs.
fn checked(args: CompareArgs) -> Result<(CompareJob, StitchOptions), Failure> {
    let options = chosen::options(StitchOptions::default(), &args.tuning, &args.typed)?;
    let entries = entries(&args.methods, &args.entry, &options)?;
    let inputs = Inputs {
        photographs: args.photographs,
        reference: chosen::reference(args.geometry.reference),
        graph: args.geometry.graph,
        lens_from: args.geometry.lens_from,
        all: false,
        masks: chosen::masks(&args.masks)?,
        require_all: args.geometry.require_all,
        ..Inputs::default()
    };
    let threads = chosen::threads(&args.tuning);
    // The command demands an output wherever this is called.
    let output = args.output.unwrap_or_default();
    let cache = args.geometry.cache;
    let job = CompareJob {
        inputs,
        entries,
        truth: args.truth,
        ranked: args.rank,
        scale: args.scale,
        format: format(args.format.as_deref())?,
        output,
        cache,
        threads,
    };
    Ok((job, options))
}

/// The panoramas' format that was typed; JPEG without one.
fn format(typed: Option<&str>) -> Result<PanoramaFormat, Failure> {
    let Some(typed) = typed else { return Ok(PanoramaFormat::Jpeg) };
    PanoramaFormat::named(typed).ok_or_else(|| {
        let allowed = PanoramaFormat::NAMES.join(" | ");
        Failure::options(vec![format!("--format {typed}: \"{typed}\" cannot be (allowed: {allowed})")])
    })
}

/// The methods that were named, or all, then the entries that were typed. Every one that cannot be is listed.
fn entries(methods: &[String], typed: &[String], options: &StitchOptions) -> Result<Vec<ComparisonEntry>, Failure> {
    let mut wrong = Vec::new();
    let mut entries = if methods.is_empty() { ComparisonEntry::methods() } else { Vec::new() };
    let named = methods.iter().map(|name| (format!("--methods {name}"), ComparisonEntry::method(name.trim())));
    let typed = typed.iter().map(|text| (format!("--entry \"{text}\""), ComparisonEntry::parse(text)));
    for (argument, entry) in named.chain(typed) {
        match entry.and_then(|entry| entry.options(options).map(|_| entry)) {
            Ok(entry) => entries.push(entry),
            Err(Error::Options(invalid)) => wrong.extend(invalid.iter().map(|one| format!("{argument}: {one}"))),
            Err(error) => wrong.push(format!("{argument}: {}", chosen::reason(error))),
        }
    }
    if wrong.is_empty() { Ok(entries) } else { Err(Failure::options(wrong)) }
}
