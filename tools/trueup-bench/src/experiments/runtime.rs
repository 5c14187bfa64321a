//! T6: what vanishing points cost in time. Each run has the machine to itself.

use std::collections::BTreeMap;

use trueup::{Error, Inputs, MatchedPhotographs, Method, Result, Silent, StageContext, Stitcher};

use super::paper_figures::SECONDS;
use crate::methods::{AANAP, AANAP_PUBLISHED, GSP_3D, GSP_3D_PUBLISHED, VPG, VPG_PUBLISHED, method};
use crate::progress::Tracker;
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::{Results, short_name};
use crate::runner::{Runner, thread_pool};
use crate::sets::Catalogue;
use crate::statistics::{mean, share};
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "runtime";

/// The method whose cost is looked at and those it is compared with: as published, which the claims are about, and by
/// default.
const CONTESTS: [Contest; 2] =
    [Contest { ours: VPG_PUBLISHED, gsp: GSP_3D_PUBLISHED }, Contest { ours: VPG, gsp: GSP_3D }];
/// The stages between matches and panorama, and all of them from the photographs' files on.
const TOTALS: [(&str, &str); 2] = [(TOTAL, "whole"), (GEOMETRY, "geometry")];
const TOTAL: &str = "total";
const GEOMETRY: &str = "geometry";
/// The stages of [`GEOMETRY`].
const GEOMETRY_STAGES: [&str; 5] = ["cameras", "match points", VANISHING, "prior", "mesh"];
/// The stage that is run for every method, since a project records the directions, but serves those that heed them
/// alone.
const VANISHING: &str = "vanishing points";
/// VPG is to take at most this multiple of GSP-3D's time; the paper's own is 1.04 on its sets and 1.23 on GSP's.
const MAX_RATIO: f64 = 1.25;
/// Threads; 0 for one per core.
const THREADS: [(usize, &str); 2] = [(1, "one thread"), (0, "a thread per core")];
/// Each run is repeated and the fastest counts: everything else on a machine only adds time.
const REPEATS: usize = 3;
/// Sets of more photographs than this take long enough to be told apart from their first runs.
const MANY_PHOTOGRAPHS: usize = 20;
const REPEATS_OF_LARGE_SETS: usize = 2;

/// VPG and GSP-3D on the same mesh; AANAP is compared with both, as the warp that its authors published and as turns on
/// the published mesh.
#[derive(Debug, Clone, Copy)]
struct Contest {
    ours: &'static str,
    gsp: &'static str,
}

/// Every method that is timed.
const TIMED: [&str; 6] = [VPG_PUBLISHED, GSP_3D_PUBLISHED, AANAP, AANAP_PUBLISHED, VPG, GSP_3D];

/// What two methods take on a set, seconds.
#[derive(Debug, Clone)]
struct PairSeconds {
    set: String,
    ours: f64,
    other: f64,
}

impl PairSeconds {
    fn ratio(&self) -> f64 {
        self.ours / self.other
    }
}

fn variant(method: &str, threads: &str) -> String {
    format!("{method}, {threads}")
}

/// Every method with every number of threads on the study's sets.
fn trials(catalogue: &Catalogue) -> Vec<(Trial, usize)> {
    let mut trials = Vec::new();
    for set in &catalogue.study {
        for (threads, words) in THREADS {
            for one in TIMED.into_iter().filter_map(method) {
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
                let timed = pool.install(|| fastest(&Stitcher::new(&options, &context), &photographs, &inputs, trial));
                matched = Some((&trial.set, *threads, photographs));
                let row = match timed {
                    Ok(measures) => Row { key, measures, note: String::new() },
                    Err(error @ (Error::Cancelled | Error::Options(_))) => return Err(error),
                    Err(error) => {
                        let refused = matches!(error, Error::NotApplicable { .. });
                        let what = if refused { "refused" } else { "failed" };
                        Row { key, measures: BTreeMap::from([(what.to_owned(), 1.0)]), note: error.to_string() }
                    }
                };
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

/// Seconds per stage and in all of the fastest of some alignments; those of matching, which all methods share,
/// included.
fn fastest(
    stitcher: &Stitcher,
    photographs: &MatchedPhotographs,
    inputs: &Inputs,
    trial: &Trial,
) -> Result<BTreeMap<String, f64>> {
    let mut best: Option<BTreeMap<String, f64>> = None;
    let heeds_directions =
        matches!(trial.options()?.align.stitch.method, Method::Vpg | Method::VpgPublished | Method::VpgLiteral);
    let many = inputs.photographs.len() > MANY_PHOTOGRAPHS;
    for _ in 0..if many { REPEATS_OF_LARGE_SETS } else { REPEATS } {
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

/// Seconds of two methods on every set that both do.
fn seconds(results: &Results, ours: &str, other: &str, threads: &str, total: &str) -> Vec<PairSeconds> {
    let of_set = |set: &crate::sets::SetSpec| {
        let value = |method| results.values(NAME, &set.name, &variant(method, threads), total).first().copied();
        Some(PairSeconds { set: short_name(&set.name).to_owned(), ours: value(ours)?, other: value(other)? })
    };
    results.catalogue.study.iter().filter_map(of_set).collect()
}

/// Means over the sets of [`seconds`].
fn mean_seconds(pairs: &[PairSeconds]) -> Option<PairSeconds> {
    let mean_of = |side: fn(&PairSeconds) -> f64| mean(&pairs.iter().map(side).collect::<Vec<_>>());
    Some(PairSeconds { set: "mean".to_owned(), ours: mean_of(|both| both.ours)?, other: mean_of(|both| both.other)? })
}

/// VPG costs little more than GSP and less than AANAP, on each set.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let (_, threads) = THREADS[0];
    let gsp = seconds(results, VPG_PUBLISHED, GSP_3D_PUBLISHED, threads, TOTAL);
    let within = gsp.iter().filter(|both| both.ratio() <= MAX_RATIO).count();
    let largest = gsp.iter().max_by(|one, other| one.ratio().total_cmp(&other.ratio()));
    let mean_ratio = mean_seconds(&gsp).map(|both| both.ratio());
    let aanap = seconds(results, AANAP, VPG_PUBLISHED, threads, TOTAL);
    let slower = aanap.iter().filter(|both| both.ratio() > 1.0).count();
    let times = mean_seconds(&aanap).map(|both| both.ratio());
    let turns =
        mean_seconds(&seconds(results, AANAP_PUBLISHED, VPG_PUBLISHED, threads, TOTAL)).map(|both| both.ratio());
    vec![
        Claim {
            id: "runtime-gsp",
            text: format!("VPG takes at most {MAX_RATIO} times as long as GSP-3D, on every set."),
            holds: (!gsp.is_empty()).then_some(within == gsp.len()),
            evidence: format!(
                "From the files to the geometry with one thread, as published: {} times in the mean, at most {} (set {}); within \
                 {MAX_RATIO} on {}.",
                number(mean_ratio, 3),
                number(largest.map(PairSeconds::ratio), 3),
                largest.map_or("-", |both| both.set.as_str()),
                share(within, gsp.len())
            ),
            reason: "",
            brief: format!("VPG {} times GSP-3D", number(mean_ratio, 2)),
        },
        Claim {
            id: "runtime-aanap",
            text: "AANAP takes longer than VPG, on every set.".to_owned(),
            holds: (!aanap.is_empty()).then_some(slower == aanap.len()),
            evidence: format!(
                "From the files to the geometry with one thread: {} times in the mean (the paper's: 2.29 and 1.85), longer on \
                 {} sets that AANAP places. AANAP's turns on the published mesh (`{AANAP_PUBLISHED}`) take {} times as long.",
                number(times, 3),
                share(slower, aanap.len()),
                number(turns, 3)
            ),
            reason: "Decoding, features and matching are the same for both and most of the time; the paper timed a \
                     reimplementation of its own.",
            brief: format!("AANAP {} times VPG", number(times, 2)),
        },
    ]
}

/// Ratios beside the paper's.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T6: runtime");
    if results.of(NAME).next().is_none() {
        section.blocks.push(Block::Skipped("times are not taken in this run".to_owned()));
        return section;
    }
    section.say(format!(
        "The study's sets, the fastest of {REPEATS} alignments that had the machine to themselves ({REPEATS_OF_LARGE_SETS} for \
         sets of more than {MANY_PHOTOGRAPHS} photographs), one after the other. VPG and GSP differ in the prior alone, so that \
         the ratio says what vanishing points cost. **whole**: from the photographs' files to the panorama's geometry; decoding, \
         features, line segments and matching are shared and timed once; rendering, the same for all, is left out. \
         **geometry**: cameras, match points, vanishing points, prior and mesh alone. The search for vanishing points is \
         counted only for the methods that heed them; line segments serve GSP too, whose turns of least line distortion they \
         make. Seconds on different machines do not compare; the ratios do."
    ));
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let columns = ["set", "methods", "what", "threads", "first s", "second s", "ratio"];
    let mut means = Table::new("t6-means", "Means over the sets that both methods do.", columns);
    let mut each = Table::new("t6-sets", "Every set.", columns);
    let pairs = CONTESTS
        .iter()
        .flat_map(|contest| [(contest.ours, contest.gsp), (AANAP, contest.ours), (AANAP_PUBLISHED, contest.ours)]);
    for (ours, other) in pairs {
        let methods = format!("{ours} / {other}");
        for (total, what) in TOTALS {
            for (_, threads) in THREADS {
                let row = TimingRow { methods: &methods, what, threads };
                let of_sets = seconds(results, ours, other, threads, total);
                if total == TOTAL {
                    of_sets.iter().for_each(|both| each.push(row.cells(both)));
                }
                if let Some(both) = mean_seconds(&of_sets) {
                    means.push(row.cells(&both));
                }
            }
        }
    }
    for paper in SECONDS {
        for (methods, ours, other) in [("VPG / GSP", paper.vpg, paper.gsp), ("AANAP / VPG", paper.aanap, paper.vpg)] {
            let row = TimingRow { methods, what: "whole", threads: "" };
            means.push_paper(row.cells(&PairSeconds { set: format!("paper: {}", paper.sets), ours, other }));
        }
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
    fn cells(&self, both: &PairSeconds) -> [String; 7] {
        [
            both.set.clone(),
            self.methods.to_owned(),
            self.what.to_owned(),
            self.threads.to_owned(),
            format!("{:.2}", both.ours),
            format!("{:.2}", both.other),
            format!("{:.3}", both.ratio()),
        ]
    }
}

/// Mean seconds per stage with one thread.
fn stages(results: &Results) -> Table {
    let threads = THREADS[0].1;
    let columns = std::iter::once("stage").chain(TIMED);
    let mut table = Table::new("t6-stages", "Mean seconds per stage, one thread.", columns);
    let mut names: Vec<&String> = results.of(NAME).flat_map(|row| row.measures.keys()).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let cells = TIMED.map(|method| {
            let seconds = results.values_of_all(NAME, &results.catalogue.study, &variant(method, threads), name);
            number(mean(&seconds), 3)
        });
        table.push(std::iter::once(name.clone()).chain(cells));
    }
    table
}
