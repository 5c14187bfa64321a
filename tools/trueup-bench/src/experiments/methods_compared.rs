//! T2: local distortion and direction inconsistency of every method on whole sets, and the prior's error without a
//! mesh.

use trueup::Result;
use trueup_report::charts::{Chart, Series, SeriesMark};

use super::grid::{GridRow, id_of, table};
use super::paper_figures::NATURAL;
use crate::measure::LD;
use crate::methods::{
    AANAP_PUBLISHED, ComparedMethod, Family, GSP_2D, GSP_2D_PUBLISHED, GSP_3D, GSP_3D_PUBLISHED, METHODS, VIEW, VPG,
    VPG_PUBLISHED, methods_of,
};
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::{Results, short_name};
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::{mean, median};
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "methods";

/// LD counts as comparable within this factor; the paper's own means differ by 1.1.
const COMPARABLE: f64 = 1.2;
/// In the paper VPG has the least GDIC on 11 of 12 sets.
const PAPER_BEST: (usize, usize) = (11, 12);

/// A VPG and the methods it is compared with on the same mesh.
struct Contest {
    best_id: &'static str,
    distortion_id: &'static str,
    mesh: &'static str,
    ours: &'static str,
    others: &'static [&'static str],
}

const CONTESTS: [Contest; 2] = [
    Contest {
        best_id: "methods-direction",
        distortion_id: "methods-distortion",
        mesh: "the mesh as published",
        ours: VPG_PUBLISHED,
        others: &[GSP_2D_PUBLISHED, GSP_3D_PUBLISHED, AANAP_PUBLISHED],
    },
    Contest {
        best_id: "default-direction",
        distortion_id: "default-distortion",
        mesh: "the default mesh",
        ours: VPG,
        others: &[GSP_2D, GSP_3D, AANAP_PUBLISHED],
    },
];

/// Every method with a prior on every set of the study and every given one.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let sets = catalogue.study.iter().chain(&catalogue.given);
    let of_set = |set: &SetSpec| {
        methods().map(|one| Trial::new(NAME, &set.name, one.name, &one.overrides())).collect::<Vec<_>>()
    };
    Ok(sets.flat_map(of_set).collect())
}

/// The methods of the tables.
fn methods() -> impl Iterator<Item = &'static ComparedMethod> + Clone {
    methods_of(Family::Prior).chain(methods_of(Family::Reading)).chain(methods_of(Family::WideWarp))
}

/// A figure of one method and of another on each set, where both have it.
fn pairs(results: &Results, sets: &[SetSpec], ours: &str, other: &str, measure: &str) -> Vec<(f64, f64)> {
    let of_set = |set: &SetSpec| {
        let value = |method| results.values(NAME, &set.name, method, measure).first().copied();
        Some((value(ours)?, value(other)?))
    };
    sets.iter().filter_map(of_set).collect()
}

impl Contest {
    /// On how many sets VPG has the least GDIC, and of how many.
    fn best(&self, results: &Results, sets: &[SetSpec]) -> (usize, usize) {
        let value = |set: &SetSpec, method| results.values(NAME, &set.name, method, "gdic_deg").first().copied();
        let won = |set: &SetSpec| {
            let ours = value(set, self.ours)?;
            let others: Vec<f64> = self.others.iter().filter_map(|other| value(set, other)).collect();
            (!others.is_empty()).then(|| others.iter().all(|other| ours < *other))
        };
        let won: Vec<bool> = sets.iter().filter_map(won).collect();
        (won.iter().filter(|won| **won).count(), won.len())
    }

    /// VPG has the least GDIC on nearly all sets.
    fn claim_best(&self, results: &Results, sets: &[SetSpec]) -> Claim {
        let (best, of) = self.best(results, sets);
        let against = self.others.iter().map(|other| {
            let pairs = pairs(results, sets, self.ours, other, "gdic_deg");
            let wins = pairs.iter().filter(|(ours, other)| ours < other).count();
            format!("better than `{other}` on {wins} of {}", pairs.len())
        });
        let against: Vec<String> = against.collect();
        Claim {
            id: self.best_id,
            reason: "",
            text: format!(
                "On {}, VPG has the least direction inconsistency on at least {} of {} sets, as in the paper.",
                self.mesh, PAPER_BEST.0, PAPER_BEST.1
            ),
            holds: (of > 0).then_some(best * PAPER_BEST.1 >= of * PAPER_BEST.0),
            evidence: format!("Best on {best} of {of}: {}.", against.join(", ")),
            brief: format!("{} best on {best} of {of}", self.ours),
        }
    }

    /// LD is comparable with that of every other method, on the sets that both do.
    fn claim_distortion(&self, results: &Results, sets: &[SetSpec]) -> Claim {
        let compared = |other: &&'static str| {
            let (ours, theirs): (Vec<f64>, Vec<f64>) = pairs(results, sets, self.ours, other, LD).into_iter().unzip();
            Some((*other, mean(&ours)?, mean(&theirs)?, ours.len()))
        };
        let found: Vec<_> = self.others.iter().filter_map(compared).collect();
        let list: Vec<String> = found
            .iter()
            .map(|(other, ours, theirs, sets)| format!("{ours:.2} against {theirs:.2} of `{other}` ({sets} sets)"))
            .collect();
        Claim {
            id: self.distortion_id,
            reason: "",
            text: format!(
                "On {}, VPG does not pay for its directions with more local distortion than GSP or AANAP.",
                self.mesh
            ),
            holds: (!found.is_empty()).then(|| found.iter().all(|(_, ours, theirs, _)| *ours <= theirs * COMPARABLE)),
            evidence: format!(
                "Mean LD x 1e-2 of `{}` {}; up to {COMPARABLE} times counts as no more.",
                self.ours,
                list.join(", ")
            ),
            brief: format!("LD {}", list.join(", ").replace('`', "")),
        }
    }
}

/// GDIC is lowest with vanishing points; LD is comparable.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let sets = &results.catalogue.study;
    CONTESTS
        .iter()
        .flat_map(|contest| [contest.claim_best(results, sets), contest.claim_distortion(results, sets)])
        .collect()
}

/// The tables.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T2: methods compared");
    let sets = &results.catalogue.study;
    section.blocks.push(Block::Table(list_of_methods()));
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    for (measure, id, title) in [(LD, "ld", "LD x 1e-2"), ("gdic_deg", "gdic-deg", "GDIC, degrees")] {
        let mut rows = ours(results, sets, measure);
        rows.extend(NATURAL.iter().map(|row| match measure {
            LD => GridRow::paper(row.method, &row.ld),
            _ => GridRow::paper(row.method, &row.gdic_deg),
        }));
        let caption = format!("T2: {title}.");
        section.blocks.push(Block::Table(table(&format!("t2-{id}"), &caption, sets, &rows)));
    }
    let refused = refusals(results, sets);
    if !refused.is_empty() {
        section.say("What was refused (n/a above), and why:");
        section.blocks.push(Block::List(refused));
    }
    section.draw("Direction inconsistency of every method on the study's sets.", gdic_chart(results, sets));
    section.say(
        "GDIC contains the deviation of the smallest rectangle around a perspective grid, half a degree or so even for a \
         perfectly turned photograph. The table below is free of it: the error of the turn that the prior wants, before any mesh, \
         and how far what stands vertical in the photographs deviates from the panorama's vertical.",
    );
    for (measure, title) in [
        (
            "theta_error_deg",
            "Error of the prior's turn relative to the reference (theta error), degrees, mean over the photographs",
        ),
        ("upright_deg", "Deviation from upright in the panorama, degrees, mean over the photographs"),
        (
            "align_px",
            "Alignment: distance in source pixels between the two places of one point, where all photographs were taken from one place",
        ),
    ] {
        let caption = format!("{title}.");
        let rows = ours(results, sets, measure);
        section.blocks.push(Block::Table(table(&id_of(measure), &caption, sets, &rows)));
    }
    given_tables(results, &mut section);
    section
}

/// The sets that a method refused.
fn refusals(results: &Results, sets: &[SetSpec]) -> Vec<String> {
    let of_study = |row: &&Row| row.measure("refused").is_some() && sets.iter().any(|set| set.name == row.key.set);
    let rows = results.of(NAME).filter(of_study);
    rows.map(|row| format!("`{}` on {}: {}", row.key.variant, short_name(&row.key.set), row.note)).collect()
}

fn list_of_methods() -> Table {
    let mut list = Table::new(
        "methods",
        &format!(
            "The methods that exist, and the options that make them. All are seen on the mesh that they solved (`{VIEW}`)."
        ),
        ["method", "what it is", "stands beside the paper's", "options"],
    );
    for one in &METHODS {
        let options: Vec<String> = one.overrides().iter().map(|option| format!("`{option}`")).collect();
        list.push([one.name, one.meaning, one.paper.unwrap_or("none"), &options.join(" ")]);
    }
    list
}

fn ours(results: &Results, sets: &[SetSpec], measure: &str) -> Vec<GridRow> {
    methods().map(|one| GridRow::measured(results, NAME, sets, one.name, measure)).collect()
}

fn gdic_chart(results: &Results, sets: &[SetSpec]) -> String {
    let series = methods().map(|one| {
        let points = sets.iter().enumerate().filter_map(|(index, set)| {
            Some((index as f64, *results.values(NAME, &set.name, one.name, "gdic_deg").first()?))
        });
        Series::plain(one.name, SeriesMark::Bars, points)
    });
    Chart::new("set", "GDIC, degrees", series.collect())
        .with_categories(sets.iter().map(|set| short_name(&set.name)))
        .svg()
}

/// The given sets: medians, and a row per set for the default method.
fn given_tables(results: &Results, section: &mut Section) {
    let sets = &results.catalogue.given;
    if sets.is_empty() {
        section.blocks.push(Block::Skipped(
            "sets cut from panoramas: no data given (`--panoramas DIR` or `--truth-sets DIR`)".to_owned(),
        ));
        return;
    }
    let measures = [LD, "gdic_deg", "theta_error_deg", "upright_deg", "align_px"];
    let caption = format!("Medians over {} given sets.", sets.len());
    let mut medians = Table::new(
        "given-medians",
        &caption,
        ["method", "LD x 1e-2", "GDIC deg", "theta error deg", "upright deg", "align px"],
    );
    for one in methods() {
        let values = measures.map(|measure| number(median(&results.values_of_all(NAME, sets, one.name, measure)), 2));
        medians.push(std::iter::once(one.name.to_owned()).chain(values));
    }
    section.blocks.push(Block::Table(medians));
    let gdic = ours(results, sets, "gdic_deg");
    section.blocks.push(Block::Table(table("given-gdic", "GDIC on the given sets, degrees.", sets, &gdic)));
    for contest in CONTESTS {
        section.blocks.push(Block::Claim(contest.claim_best(results, sets)));
    }
}
