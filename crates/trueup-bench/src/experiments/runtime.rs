//! T6: what vanishing points cost in time. Each run has the machine to itself.

use std::collections::BTreeMap;

use trueup::{Error, Inputs, MatchedPhotographs, Result, Silent, StageContext, Stitcher};

use super::paper_figures::SECONDS;
use crate::methods::{LEVELLED, LEVELLED_PUBLISHED, VPG, VPG_PUBLISHED, method};
use crate::progress::Tracker;
use crate::report::document::{Block, Section, Table, number};
use crate::results::{Results, short_name};
use crate::runner::{Runner, thread_pool};
use crate::sets::Catalogue;
use crate::statistics::mean;
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "runtime";

/// With vanishing points and without, on the same mesh.
const PAIRS: [(&str, &str); 2] = [(VPG, LEVELLED), (VPG_PUBLISHED, LEVELLED_PUBLISHED)];
/// Threads; 0 for one per core.
const THREADS: [(usize, &str); 2] = [(1, "one thread"), (0, "a thread per core")];
/// Each run is repeated and the fastest counts: everything else on a machine only adds time.
const REPEATS: usize = 3;

fn variant(method: &str, threads: &str) -> String {
    format!("{method}, {threads}")
}

/// Every method with every number of threads on the study's sets.
fn trials(catalogue: &Catalogue) -> Vec<(Trial, usize)> {
    let mut trials = Vec::new();
    for set in &catalogue.study {
        for (threads, words) in THREADS {
            for one in PAIRS.iter().flat_map(|(ours, other)| [ours, other]).filter_map(|name| method(name)) {
                trials.push((Trial::new(NAME, &set.name, &variant(one.name, words), one.overrides), threads));
            }
        }
    }
    trials
}

/// Aligns every set with every method, one after the other.
///
/// # Errors
/// Those of making sets and of stitching; [`Error::Cancelled`].
pub(crate) fn run(runner: &Runner, catalogue: &Catalogue) -> Result<Vec<Row>> {
    let trials = trials(catalogue);
    let tracker = Tracker::new("timings", trials.len() as u64, runner.quiet);
    let mut rows = Vec::new();
    let mut matched: Option<(&str, usize, MatchedPhotographs)> = None;
    for (trial, threads) in &trials {
        let Some(set) = catalogue.study.iter().find(|set| set.name == trial.set) else { continue };
        tracker.working_on(&trial.set);
        let context = StageContext::new(&Silent, runner.cancel, 0);
        let ready = set.prepare(&runner.data, &context)?;
        let key = trial.key(&ready.fingerprint, &runner.version);
        let row = match runner.store.get(&key) {
            Some(row) => row,
            None => {
                let options = trial.options()?;
                let inputs = Inputs::new(ready.photographs.iter().cloned());
                let pool = thread_pool(*threads)?;
                let photographs = match matched.take() {
                    Some((name, with, known)) if name == trial.set && with == *threads => known,
                    _ => pool.install(|| Stitcher::new(&options, &context).match_photographs(&inputs))?,
                };
                let measures =
                    pool.install(|| fastest(&Stitcher::new(&options, &context), &photographs, &inputs, trial))?;
                matched = Some((&trial.set, *threads, photographs));
                let row = Row { key, measures, note: String::new() };
                runner.store.add(row.clone())?;
                row
            }
        };
        rows.push(row);
        tracker.advance(1);
        tracker.finished(&format!("{} {}", trial.set, trial.variant));
    }
    tracker.close();
    Ok(rows)
}

/// Seconds per stage and in all of the fastest of some alignments; those of matching, which all methods share, included.
fn fastest(
    stitcher: &Stitcher,
    photographs: &MatchedPhotographs,
    inputs: &Inputs,
    trial: &Trial,
) -> Result<BTreeMap<String, f64>> {
    let mut best: Option<BTreeMap<String, f64>> = None;
    for _ in 0..REPEATS {
        let aligned = stitcher.align_matched(photographs, inputs)?;
        let first = aligned.alignments.into_iter().next();
        let first = first.ok_or_else(|| Error::input(&trial.set, "nothing was aligned", "Look at the set."))?;
        let mut stages = first.project.seconds;
        let total: f64 = stages.values().sum();
        if best.as_ref().is_none_or(|known| total < known["total"]) {
            stages.insert("total".to_owned(), total);
            best = Some(stages);
        }
    }
    best.ok_or_else(|| Error::input(&trial.set, "no run was timed", "Report this as a defect."))
}

/// Ratios beside the paper's.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T6: runtime");
    if results.of(NAME).next().is_none() {
        section.blocks.push(Block::Skipped("times are not taken in this run".to_owned()));
        return section;
    }
    section.say(format!(
        "From the photographs' files to the panorama's geometry, on the study's sets: the fastest of {REPEATS} alignments that had \
         the machine to themselves. The methods differ in the prior alone, so that the ratio says what vanishing points cost; \
         decoding, features and matching are shared and timed once, rendering, the same for all, is left out. Seconds on \
         different machines do not compare; the ratios do."
    ));
    let columns = ["set", "methods", "threads", "with vanishing points s", "without s", "ratio"];
    let mut means = Table::new("t6-means", "Means over the sets.", columns);
    let mut each = Table::new("t6-sets", "Every set.", columns);
    for (ours, other) in PAIRS {
        for (_, threads) in THREADS {
            let mut totals: Vec<(f64, f64)> = Vec::new();
            for set in &results.catalogue.study {
                let total =
                    |method| results.values(NAME, &set.name, &variant(method, threads), "total").first().copied();
                let Some((with, without)) = total(ours).zip(total(other)) else { continue };
                totals.push((with, without));
                each.push(cells(short_name(&set.name), &format!("{ours} / {other}"), threads, (with, without)));
            }
            let with: Vec<f64> = totals.iter().map(|pair| pair.0).collect();
            let without: Vec<f64> = totals.iter().map(|pair| pair.1).collect();
            if let Some(pair) = mean(&with).zip(mean(&without)) {
                means.push(cells("mean", &format!("{ours} / {other}"), threads, pair));
            }
        }
    }
    for paper in SECONDS {
        let methods = format!("VPG / GSP (AANAP {:.2} s)", paper.aanap);
        means.push_paper(cells(&format!("paper: {}", paper.sets), &methods, "", (paper.vpg, paper.gsp)));
    }
    section.blocks.extend([means, stages(results), each].map(Block::Table));
    section
}

fn cells(set: &str, methods: &str, threads: &str, (with, without): (f64, f64)) -> [String; 6] {
    [
        set.to_owned(),
        methods.to_owned(),
        threads.to_owned(),
        format!("{with:.2}"),
        format!("{without:.2}"),
        format!("{:.3}", with / without),
    ]
}

/// Mean seconds per stage with one thread.
fn stages(results: &Results) -> Table {
    let threads = THREADS[0].1;
    let methods = [VPG, LEVELLED, VPG_PUBLISHED, LEVELLED_PUBLISHED];
    let columns = std::iter::once("stage").chain(methods);
    let mut table = Table::new("t6-stages", "Mean seconds per stage, one thread.", columns);
    let mut names: Vec<&String> = results.of(NAME).flat_map(|row| row.measures.keys()).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let cells = methods.map(|method| {
            let seconds = results.values_of_all(NAME, &results.catalogue.study, &variant(method, threads), name);
            number(mean(&seconds), 3)
        });
        table.push(std::iter::once(name.clone()).chain(cells));
    }
    table
}
