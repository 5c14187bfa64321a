//! `trueup-bench paper`: runs the experiments and writes the report.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use trueup::{Error, Result, check_place, write_atomically};

use crate::arguments::PaperArguments;
use crate::experiments::{CLAIM_EXPERIMENTS, EXPERIMENTS, Experiment, runtime};
use crate::report::csv;
use crate::report::document::{Block, Claim, Document, Section};
use crate::report::{self, overview};
use crate::results::Results;
use crate::runner::Runner;
use crate::sets::Catalogue;
use crate::stopping;
use crate::store::ResultStore;
use crate::trial::{Row, Trial, fingerprint};

/// Runs the experiments that were asked for.
///
/// # Errors
/// Those of making sets, stitching and writing; [`Error::Input`] for experiments that do not exist.
pub(crate) fn run(arguments: &PaperArguments) -> Result<ExitCode> {
    let start = Instant::now();
    let wanted = wanted(arguments)?;
    let make =
        |folder: &Path| fs::create_dir_all(folder).map_err(|error| Error::io("making the folder", folder, error));
    make(&arguments.out)?;
    let data = arguments.data.clone().unwrap_or_else(|| arguments.out.join("data"));
    make(&data)?;
    let rows_file = arguments.out.join("rows.csv");
    check_place(&rows_file)?;
    report::check(&arguments.out)?;
    let catalogue = match arguments.quick {
        true => Catalogue::quick(),
        false => Catalogue::full(arguments.panoramas.as_deref(), &arguments.truth_sets)?,
    };
    let version = program_version()?;
    let store = ResultStore::open(&arguments.out.join("rows.jsonl"), arguments.reuse.then_some(version.as_str()))?;
    let cancel = stopping::cancel_token();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = if arguments.jobs == 0 { cores } else { arguments.jobs };
    let threads = (cores / jobs).max(1);
    let runner = Runner { data, store: &store, version, jobs, threads, cancel: &cancel, quiet: arguments.quiet };

    let experiments: Vec<&Experiment> = EXPERIMENTS.iter().filter(|one| wanted.contains(&one.name)).collect();
    let mut trials: Vec<Trial> = Vec::new();
    for experiment in &experiments {
        trials.extend((experiment.trials)(&catalogue)?);
    }
    let mut rows = runner.run(&catalogue.all(), &trials)?;
    if wanted.contains(&runtime::NAME) {
        rows.extend(runtime::run(&runner, &catalogue)?);
    }
    let results = Results { catalogue: &catalogue, rows };
    let mut claims: Vec<Claim> = experiments.iter().flat_map(|one| (one.claims)(&results)).collect();
    if wanted.contains(&runtime::NAME) {
        claims.extend(runtime::claims(&results));
    }
    let document = document(&results, &experiments, &claims, &runner, &wanted);
    report::write(&document, &arguments.out)?;
    write_rows(&results.rows, &rows_file)?;
    Ok(conclude(arguments, &claims, start.elapsed().as_secs_f64()))
}

/// The names of the experiments to be run.
fn wanted(arguments: &PaperArguments) -> Result<Vec<&'static str>> {
    let all: Vec<&'static str> = EXPERIMENTS.iter().map(|one| one.name).chain([runtime::NAME]).collect();
    if arguments.only.is_empty() {
        return Ok(if arguments.quick { CLAIM_EXPERIMENTS.to_vec() } else { all });
    }
    let known = |name: &String| {
        all.iter().find(|known| *known == name).copied().ok_or_else(|| {
            Error::input(name, "there is no such experiment", format!("Choose from {}.", all.join(", ")))
        })
    };
    arguments.only.iter().map(known).collect()
}

/// The package's version and what stands for this build: results of another build are not taken for this one's.
fn program_version() -> Result<String> {
    let path = std::env::current_exe().map_err(|error| Error::io("finding", Path::new("trueup-bench"), error))?;
    let bytes = fs::read(&path).map_err(|error| Error::io("reading", &path, error))?;
    Ok(format!("{}+{}", env!("CARGO_PKG_VERSION"), &fingerprint(&bytes)[..8]))
}

fn document(
    results: &Results,
    experiments: &[&Experiment],
    claims: &[Claim],
    runner: &Runner,
    wanted: &[&str],
) -> Document {
    let mut sections = vec![overview::summary(claims), overview::measures(), overview::sets(results.catalogue)];
    sections.extend(experiments.iter().map(|one| (one.section)(results)));
    if wanted.contains(&runtime::NAME) {
        sections.push(runtime::section(results));
    }
    sections.push(overview::how_it_was_made(results, &runner.version, runner.jobs, runner.threads));
    let failed: Vec<&Row> = results.rows.iter().filter(|row| row.measures.contains_key("failed")).collect();
    if !failed.is_empty() {
        let mut section = Section::new("failed", "Runs without a result");
        section.say(format!(
            "{} of {} runs ended with an error; they are missing above.",
            failed.len(),
            results.rows.len()
        ));
        let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        for row in failed {
            *counts.entry((&row.key.set, &row.note)).or_default() += 1;
        }
        let points = counts.into_iter().map(|((set, note), count)| format!("{set} ({count}): {note}"));
        section.blocks.push(Block::List(points.collect()));
        sections.push(section);
    }
    Document {
        title: "Vanishing Point Guided Natural Image Stitching: the paper's experiments on our sets".to_owned(),
        sections,
    }
}

/// Every result, a column per measure.
fn write_rows(rows: &[Row], path: &Path) -> Result<()> {
    let mut measures: Vec<&str> = rows.iter().flat_map(|row| row.measures.keys().map(String::as_str)).collect();
    measures.sort_unstable();
    measures.dedup();
    let heads = ["experiment", "set", "variant", "seed", "reference", "pictures", "note", "version"];
    let mut text = csv::line(heads.into_iter().chain(measures.iter().copied()));
    let optional = |number: Option<usize>| number.map_or(String::new(), |number| number.to_string());
    for Row { key, measures: found, note } in rows {
        let (seed, reference, photographs) =
            (key.seed.to_string(), optional(key.reference), optional(key.photograph_count));
        let heads = [&key.experiment, &key.set, &key.variant, &seed, &reference, &photographs, note, &key.version];
        let figures: Vec<String> =
            measures.iter().map(|name| found.get(*name).map_or(String::new(), f64::to_string)).collect();
        text.push_str(&csv::line(heads.into_iter().chain(&figures).map(String::as_str)));
    }
    write_atomically(path, text.as_bytes())
}

/// Prints what came of the claims, last of all; the exit status says whether all hold.
fn conclude(arguments: &PaperArguments, claims: &[Claim], seconds: f64) -> ExitCode {
    let tried: Vec<&Claim> = claims.iter().filter(|claim| claim.holds.is_some()).collect();
    let failed: Vec<&&Claim> = tried.iter().filter(|claim| claim.holds == Some(false)).collect();
    let untried: Vec<&Claim> = claims.iter().filter(|claim| claim.holds.is_none()).collect();
    for claim in &failed {
        eprintln!("trueup-bench: does not hold: {} {}", claim.text, claim.evidence);
    }
    for claim in &untried {
        eprintln!("trueup-bench: not tried for want of results: {}", claim.text);
    }
    println!("report: {}", arguments.out.join("report.html").display());
    let briefs: Vec<&str> = claims.iter().map(|claim| claim.brief.as_str()).collect();
    let command = if arguments.quick { "paper --quick" } else { "paper" };
    let holding = tried.len() - failed.len();
    println!("{command}: {holding} of {} claims hold ({}) in {seconds:.0} s", claims.len(), briefs.join(", "));
    // A quick run that could not try a claim has shown nothing.
    match failed.is_empty() && (!arguments.quick || untried.is_empty()) {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}
