//! `trueup-bench paper`: runs the experiments and writes the report.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use trueup::{Error, Result, check_place};

use crate::arguments::PaperArguments;
use crate::build_stamp::BuildStamp;
use crate::experiments::{EXPERIMENTS, Experiment, QUICK_CLAIMS, QUICK_EXPERIMENTS, runtime};
use crate::figures;
use crate::report::document::{Block, Claim, Document, Section};
use crate::report::overview::RunDescription;
use crate::report::{self, overview};
use crate::results::Results;
use crate::rows;
use crate::runner::Runner;
use crate::sets::{Catalogue, GivenFolders};
use crate::stopping;
use crate::store::ResultStore;
use crate::trial::{Row, Trial};

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
    let folders = GivenFolders {
        panoramas: arguments.panoramas.as_deref(),
        truth_sets: &arguments.truth_sets,
        photographs: &arguments.photographs,
        vpg_data: arguments.vpg_data.as_deref(),
    };
    let catalogue = if arguments.quick { Catalogue::quick() } else { Catalogue::full(&folders)? };
    let stamp = BuildStamp::of_this_program();
    let store = store(arguments, &stamp)?;
    let cancel = stopping::cancel_token();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = if arguments.jobs == 0 { cores } else { arguments.jobs };
    let threads = (cores / jobs).max(1);
    let runner = Runner {
        data,
        scratch: arguments.out.join("scratch"),
        store: &store,
        version: stamp.identity(),
        jobs,
        threads,
        cancel: &cancel,
        quiet: arguments.quiet,
    };
    if !arguments.quiet {
        eprintln!("trueup-bench: {}; {} results are there already", stamp.in_words(), store.count());
    }

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
    if !arguments.quick && !stamp.is_clean() {
        eprintln!("trueup-bench: not to be cited: the program was not built from a commit without changes");
    }
    let figures = match wanted.contains(&FIGURES) {
        true => Some(figures::section(&runner, &catalogue, &arguments.out)?),
        false => None,
    };
    let minutes = start.elapsed().as_secs_f64() / SECONDS_PER_MINUTE;
    let made = RunDescription { stamp: &stamp, arguments, jobs, threads, minutes, resumed: store.resumed() };
    let document = document(&results, &experiments, &claims, figures, &made, &wanted);
    report::write(&document, &arguments.out)?;
    rows::write(&results.rows, &rows_file)?;
    Ok(conclude(arguments, &claims, start.elapsed().as_secs_f64()))
}

/// The name of the figures among the experiments.
const FIGURES: &str = "figures";
const SECONDS_PER_MINUTE: f64 = 60.0;

/// The results that are there already, of this build, unless the run is to begin anew.
fn store(arguments: &PaperArguments, stamp: &BuildStamp) -> Result<ResultStore> {
    let path = arguments.out.join("rows.jsonl");
    if arguments.anew {
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::io("removing", &path, error));
            }
            _ => {}
        }
    }
    ResultStore::open(&path, &stamp.identity())
}

/// The names of the experiments to be run.
fn wanted(arguments: &PaperArguments) -> Result<Vec<&'static str>> {
    let all: Vec<&'static str> = EXPERIMENTS.iter().map(|one| one.name).chain([runtime::NAME, FIGURES]).collect();
    if arguments.only.is_empty() {
        return Ok(if arguments.quick { QUICK_EXPERIMENTS.to_vec() } else { all });
    }
    let known = |name: &String| {
        all.iter().find(|known| *known == name).copied().ok_or_else(|| {
            Error::input(name, "there is no such experiment", format!("Choose from {}.", all.join(", ")))
        })
    };
    arguments.only.iter().map(known).collect()
}

fn document(
    results: &Results,
    experiments: &[&Experiment],
    claims: &[Claim],
    figures: Option<Section>,
    made: &RunDescription,
    wanted: &[&str],
) -> Document {
    let mut sections = vec![overview::summary(claims, made), overview::measures(), overview::sets(results.catalogue)];
    sections.extend(figures);
    sections.extend(experiments.iter().map(|one| (one.section)(results)));
    if wanted.contains(&runtime::NAME) {
        sections.push(runtime::section(results));
    }
    sections.push(overview::how_it_was_made(results, made));
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

/// Prints what came of the claims, last of all; the exit status says whether all that are expected to hold do.
fn conclude(arguments: &PaperArguments, claims: &[Claim], seconds: f64) -> ExitCode {
    let tried: Vec<&Claim> = claims.iter().filter(|claim| claim.holds.is_some()).collect();
    let failed: Vec<&&Claim> = tried.iter().filter(|claim| claim.holds == Some(false)).collect();
    for claim in &failed {
        eprintln!("trueup-bench: does not hold: {} {}", claim.text, claim.evidence);
    }
    for claim in claims.iter().filter(|claim| claim.holds.is_none()) {
        eprintln!("trueup-bench: not tried for want of results: {}", claim.text);
    }
    println!("report: {}", arguments.out.join("report.html").display());
    let briefs: Vec<&str> = claims.iter().map(|claim| claim.brief.as_str()).collect();
    let command = if arguments.quick { "paper --quick" } else { "paper" };
    let holding = tried.len() - failed.len();
    println!("{command}: {holding} of {} claims hold ({}) in {seconds:.0} s", claims.len(), briefs.join(", "));
    match as_expected(arguments, claims) {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

/// Whether every claim holds that is expected to: of a quick run those of [`QUICK_CLAIMS`], each of which must have
/// been tried unless its experiment was not asked for; of others all that were tried.
fn as_expected(arguments: &PaperArguments, claims: &[Claim]) -> bool {
    if !arguments.quick {
        return claims.iter().all(|claim| claim.holds != Some(false));
    }
    let holds = |id: &&str| match claims.iter().find(|claim| claim.id == *id) {
        // A quick run that could not try a claim has shown nothing.
        Some(claim) => claim.holds == Some(true),
        None => !arguments.only.is_empty(),
    };
    QUICK_CLAIMS.iter().all(holds)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::arguments::{Arguments, BenchCommand};

    fn quick(more: &[&str]) -> PaperArguments {
        let words = ["trueup-bench", "paper", "--quick", "--out", "x"].into_iter().chain(more.iter().copied());
        match Arguments::parse_from(words).command {
            BenchCommand::Paper(arguments) => arguments,
            BenchCommand::Quality(_) | BenchCommand::Speed(_) => unreachable!("paper was asked for"),
        }
    }

    fn claim(id: &'static str, holds: Option<bool>) -> Claim {
        let (text, evidence, brief) = (String::new(), String::new(), String::new());
        Claim { id, text, holds, evidence, reason: "", brief }
    }

    #[test]
    fn a_quick_run_fails_when_an_expected_claim_does_not_hold_or_was_not_tried() {
        let with = |id: &str, holds| -> Vec<Claim> {
            let known = QUICK_CLAIMS.map(|known| claim(known, if known == id { holds } else { Some(true) }));
            known.into_iter().chain([claim("warps-distortion", Some(false))]).collect()
        };
        assert!(as_expected(&quick(&[]), &with("gate", Some(true))));
        for holds in [Some(false), None] {
            for id in QUICK_CLAIMS {
                assert!(!as_expected(&quick(&[]), &with(id, holds)), "{id}");
            }
        }
        let missing = &with("gate", Some(true))[1..];
        assert!(!as_expected(&quick(&[]), missing) && as_expected(&quick(&["--only", "gate"]), missing));
    }

    #[test]
    fn every_expected_claim_is_one_of_a_quick_experiment() {
        let catalogue = Catalogue::quick();
        let results = Results { catalogue: &catalogue, rows: Vec::new() };
        let of_quick = EXPERIMENTS.iter().filter(|one| QUICK_EXPERIMENTS.contains(&one.name));
        let ids: Vec<&str> = of_quick.flat_map(|one| (one.claims)(&results)).map(|claim| claim.id).collect();
        assert!(QUICK_CLAIMS.iter().all(|id| ids.contains(id)), "{ids:?}");
        let mut all: Vec<&str> =
            EXPERIMENTS.iter().flat_map(|one| (one.claims)(&results)).map(|claim| claim.id).collect();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count, "a name for each claim");
    }
}
