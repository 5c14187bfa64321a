//! T6: what vanishing points cost in time. Each run has the machine to itself.

use std::collections::BTreeMap;

use trueup::{Error, Inputs, MatchedPhotographs, Method, Result, Silent, StageContext, Stitcher};

use super::paper_figures::SECONDS;
use crate::methods::{GSP_3D, GSP_3D_PUBLISHED, VPG, VPG_PUBLISHED, method};
use crate::progress::Tracker;
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::{Results, short_name};
use crate::runner::{Runner, thread_pool};
use crate::sets::Catalogue;
use crate::statistics::mean;
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "runtime";

/// With vanishing points and without, on the same mesh.
const PAIRS: [MethodPair; 2] =
    [MethodPair { with: VPG, without: GSP_3D }, MethodPair { with: VPG_PUBLISHED, without: GSP_3D_PUBLISHED }];
/// The stages between matches and panorama, and all of them from the photographs' files on.
const TOTALS: [(&str, &str); 2] = [(TOTAL, "whole"), (GEOMETRY, "geometry")];
const TOTAL: &str = "total";
const GEOMETRY: &str = "geometry";
/// The stages of [`GEOMETRY`].
const GEOMETRY_STAGES: [&str; 5] = ["cameras", "match points", VANISHING, "prior", "mesh"];
/// The stage that is run for every method, since a project records the directions, but serves those that heed them alone.
const VANISHING: &str = "vanishing points";
/// VPG is to take at most this multiple of GSP-3D's time; the paper's own is 1.04 on its sets and 1.23 on GSP's.
const MAX_RATIO: f64 = 1.25;
/// Threads; 0 for one per core.
const THREADS: [(usize, &str); 2] = [(1, "one thread"), (0, "a thread per core")];
/// Each run is repeated and the fastest counts: everything else on a machine only adds time.
const REPEATS: usize = 3;

/// A method with vanishing points and the one without that it is compared with, by name.
#[derive(Debug, Clone, Copy)]
struct MethodPair {
    with: &'static str,
    without: &'static str,
}

/// What the two methods of a pair take, seconds.
#[derive(Debug, Clone, Copy)]
struct PairSeconds {
    with: f64,
    without: f64,
}

fn variant(method: &str, threads: &str) -> String {
    format!("{method}, {threads}")
}

/// Every method with every number of threads on the study's sets.
fn trials(catalogue: &Catalogue) -> Vec<(Trial, usize)> {
    let mut trials = Vec::new();
    for set in &catalogue.study {
        for (threads, words) in THREADS {
            for one in PAIRS.iter().flat_map(|pair| [pair.with, pair.without]).filter_map(method) {
                trials.push((Trial::new(NAME, &set.name, &variant(one.name, words), &one.overrides()), threads));
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
        let context = StageContext::new(&Silent, runner.cancel);
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
    let heeds_directions =
        matches!(trial.options()?.align.stitch.method, Method::Vpg | Method::VpgPublished | Method::VpgLiteral);
    for _ in 0..REPEATS {
        let aligned = stitcher.align_matched(photographs, inputs)?;
        let first = aligned.alignments.into_iter().next();
        let first = first.ok_or_else(|| Error::input(&trial.set, "nothing was aligned", "Look at the set."))?;
        let mut stages = first.project.seconds;
        if !heeds_directions {
            stages.remove(VANISHING);
        }
        let total: f64 = stages.values().sum();
        if best.as_ref().is_none_or(|known| total < known[TOTAL]) {
            let geometry = GEOMETRY_STAGES.iter().filter_map(|stage| stages.get(*stage)).sum();
            stages.extend([(TOTAL.to_owned(), total), (GEOMETRY.to_owned(), geometry)]);
            best = Some(stages);
        }
    }
    best.ok_or_else(|| Error::input(&trial.set, "no run was timed", "Report this as a defect."))
}

/// Seconds with vanishing points and without, of every set that has both.
fn seconds(results: &Results, pair: MethodPair, threads: &str, total: &str) -> Vec<(String, PairSeconds)> {
    let of_set = |set: &crate::sets::SetSpec| {
        let value = |method| results.values(NAME, &set.name, &variant(method, threads), total).first().copied();
        let seconds = PairSeconds { with: value(pair.with)?, without: value(pair.without)? };
        Some((short_name(&set.name).to_owned(), seconds))
    };
    results.catalogue.study.iter().filter_map(of_set).collect()
}

/// Means over the sets of [`seconds`].
fn mean_seconds(results: &Results, pair: MethodPair, threads: &str, total: &str) -> Option<PairSeconds> {
    let of_sets = seconds(results, pair, threads, total);
    let mean_of = |side: fn(&PairSeconds) -> f64| mean(&of_sets.iter().map(|(_, both)| side(both)).collect::<Vec<_>>());
    Some(PairSeconds { with: mean_of(|both| both.with)?, without: mean_of(|both| both.without)? })
}

/// VPG costs little more than GSP.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let ratio = |pair, threads, total| mean_seconds(results, pair, threads, total).map(|both| both.with / both.without);
    let all = |total| -> Vec<f64> {
        PAIRS.iter().flat_map(|pair| THREADS.iter().filter_map(move |(_, words)| ratio(*pair, words, total))).collect()
    };
    let largest = |ratios: &[f64]| ratios.iter().copied().max_by(f64::total_cmp);
    let (whole, geometry) = (largest(&all(TOTAL)), largest(&all(GEOMETRY)));
    vec![Claim {
        text: format!("VPG takes at most {MAX_RATIO} times as long as GSP-3D."),
        holds: whole.zip(geometry).map(|(whole, geometry)| whole.max(geometry) <= MAX_RATIO),
        evidence: format!(
            "On either mesh and for either number of threads at most {} times from the files to the geometry, {} times for \
             the geometry alone, means over the sets.",
            number(whole, 3),
            number(geometry, 3)
        ),
        brief: format!("time ratio {} (geometry {})", number(whole, 2), number(geometry, 2)),
    }]
}

/// Ratios beside the paper's.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T6: runtime");
    if results.of(NAME).next().is_none() {
        section.blocks.push(Block::Skipped("times are not taken in this run".to_owned()));
        return section;
    }
    section.say(format!(
        "The study's sets, the fastest of {REPEATS} alignments that had the machine to themselves. The methods differ in the prior \
         alone, so that the ratio says what vanishing points cost. **whole**: from the photographs' files to the panorama's \
         geometry; decoding, features, line segments and matching are shared and timed once; rendering, the same for all, is left \
         out. **geometry**: cameras, match points, vanishing points, prior and mesh alone. The search for vanishing points is \
         counted only for the methods that heed them; line segments serve GSP too, whose turns of least line distortion they \
         make. Seconds on different machines do not compare; the ratios do."
    ));
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let columns = ["set", "methods", "what", "threads", "VPG s", "GSP s", "ratio"];
    let mut means = Table::new("t6-means", "Means over the sets.", columns);
    let mut each = Table::new("t6-sets", "Every set.", columns);
    for pair in PAIRS {
        let methods = format!("{} / {}", pair.with, pair.without);
        for (total, what) in TOTALS {
            for (_, threads) in THREADS {
                let row = TimingRow { methods: &methods, what, threads };
                for (set, both) in seconds(results, pair, threads, total) {
                    each.push(row.cells(&set, both));
                }
                if let Some(both) = mean_seconds(results, pair, threads, total) {
                    means.push(row.cells("mean", both));
                }
            }
        }
    }
    for paper in SECONDS {
        let methods = format!("VPG / GSP (AANAP {:.2} s)", paper.aanap);
        let row = TimingRow { methods: &methods, what: "whole", threads: "" };
        let both = PairSeconds { with: paper.vpg, without: paper.gsp };
        means.push_paper(row.cells(&format!("paper: {}", paper.sets), both));
    }
    section.blocks.extend([means, stages(results), each].map(Block::Table));
    section
}

/// What a row of seconds is about, beside its set.
#[derive(Debug, Clone, Copy)]
struct TimingRow<'a> {
    methods: &'a str,
    what: &'a str,
    threads: &'a str,
}

impl TimingRow<'_> {
    /// The row's cells for a set.
    fn cells(&self, set: &str, seconds: PairSeconds) -> [String; 7] {
        [
            set.to_owned(),
            self.methods.to_owned(),
            self.what.to_owned(),
            self.threads.to_owned(),
            format!("{:.2}", seconds.with),
            format!("{:.2}", seconds.without),
            format!("{:.3}", seconds.with / seconds.without),
        ]
    }
}

/// Mean seconds per stage with one thread.
fn stages(results: &Results) -> Table {
    let threads = THREADS[0].1;
    let methods = [VPG, GSP_3D, VPG_PUBLISHED, GSP_3D_PUBLISHED];
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
