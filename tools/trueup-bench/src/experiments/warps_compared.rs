//! T1: warps without a prior beside those with one, on sets reduced to what the warps can do.

use trueup::Result;

use super::grid::{GridRow, table};
use super::paper_figures::WARPS;
use crate::measure::LD;
use crate::methods::{APAP, ComparedMethod, Family, SPHP, SPHP_FREE, VPG, VPG_PUBLISHED, methods_of};
use crate::report::document::{Block, Claim, Section, number};
use crate::results::{Results, short_name};
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::mean;
use crate::statistics::share;
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "warps";

/// The paper reduced its sets to 3 to 9 photographs for these methods.
const LARGEST: usize = 9;
const SMALLEST: usize = 3;
/// GDIC counts as far worse from this multiple of VPG's; among the paper's single sets the least is 3.3.
const FAR_WORSE: f64 = 3.0;
/// The methods that the claim is about.
const CLAIMED: [&str; 3] = [APAP, SPHP, SPHP_FREE];

/// The sets that the paper reduced.
fn sets(catalogue: &Catalogue) -> Vec<SetSpec> {
    catalogue.study.iter().filter(|set| ("04"..="09").contains(&short_name(&set.name))).cloned().collect()
}

/// The methods without a prior.
fn warps() -> impl Iterator<Item = &'static ComparedMethod> {
    methods_of(Family::Warp).chain(methods_of(Family::WideWarp))
}

/// The methods of the tables.
fn methods() -> impl Iterator<Item = &'static ComparedMethod> {
    methods_of(Family::Prior).chain(warps())
}

/// Whether a method is run on every size of a set, not only the largest: the warps, and what they are compared with.
fn on_every_size(one: &ComparedMethod) -> bool {
    one.family != Family::Prior || [VPG, VPG_PUBLISHED].contains(&one.name)
}

/// Every method on the photographs around the middle one of each set.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for set in sets(catalogue) {
        let largest = set.photograph_count()?.min(LARGEST);
        for one in methods() {
            let smallest = if on_every_size(one) { SMALLEST.min(largest) } else { largest };
            for photographs in smallest..=largest {
                let trial = Trial::new(NAME, &set.name, one.name, &one.overrides());
                trials.push(Trial { photograph_count: Some(photographs), central: true, ..trial });
            }
        }
    }
    Ok(trials)
}

/// The result of a method on so many photographs of a set.
fn row<'a>(results: &'a Results, set: &SetSpec, method: &str, photographs: usize) -> Option<&'a Row> {
    results.of(NAME).find(|row| {
        row.key.set == set.name && row.key.variant == method && row.key.photograph_count == Some(photographs)
    })
}

/// The sizes that were tried, the largest first.
fn sizes(results: &Results, set: &SetSpec, method: &str) -> Vec<usize> {
    let rows = results.of(NAME).filter(|row| row.key.set == set.name && row.key.variant == method);
    let mut sizes: Vec<usize> = rows.filter_map(|row| row.key.photograph_count).collect();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

/// The result on the largest number of photographs that the method makes a panorama of.
fn largest<'a>(results: &'a Results, set: &SetSpec, method: &str) -> Option<(usize, &'a Row)> {
    sizes(results, set, method).into_iter().find_map(|photographs| {
        let row = row(results, set, method, photographs)?;
        row.measure("gdic_deg").map(|_| (photographs, row))
    })
}

/// A figure of a warp and of VPG on the same photographs of a set.
#[derive(Debug, Clone, PartialEq)]
struct Pair {
    set: String,
    warp: f64,
    vpg: f64,
}

/// The largest number of photographs of a set of which every warp that the claims are about makes a panorama.
fn placed_by_all(results: &Results, set: &SetSpec) -> Option<usize> {
    let places = |name: &&str, photographs| {
        row(results, set, name, photographs).is_some_and(|row| row.measure("gdic_deg").is_some())
    };
    let all = |photographs: &usize| CLAIMED.iter().all(|name| places(name, *photographs));
    sizes(results, set, CLAIMED[0]).into_iter().find(all)
}

/// A figure of a warp and of VPG on the same photographs, as many as all warps place, for every set where there are
/// any.
fn same_photographs(results: &Results, warp: &str, ours: &str, measure: &str) -> Vec<Pair> {
    let of_set = |set: &SetSpec| {
        let photographs = placed_by_all(results, set)?;
        Some(Pair {
            set: short_name(&set.name).to_owned(),
            warp: row(results, set, warp, photographs)?.measure(measure)?,
            vpg: row(results, set, ours, photographs)?.measure(measure)?,
        })
    };
    sets(results.catalogue).iter().filter_map(of_set).collect()
}

/// Mean figures of a warp and of VPG on the same photographs.
#[derive(Debug, Clone, Copy)]
struct Means {
    warp: f64,
    vpg: f64,
    sets: usize,
}

fn means(pairs: &[Pair]) -> Option<Means> {
    let of = |side: fn(&Pair) -> f64| mean(&pairs.iter().map(side).collect::<Vec<f64>>());
    Some(Means { warp: of(|pair| pair.warp)?, vpg: of(|pair| pair.vpg)?, sets: pairs.len() })
}

/// Warps of single homographies turn and distort the photographs more.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    vec![claim_direction(results), claim_distortion(results)]
}

/// They turn the photographs far more wrongly.
fn claim_direction(results: &Results) -> Claim {
    let of = |name: &&'static str| Some((*name, means(&same_photographs(results, name, VPG_PUBLISHED, "gdic_deg"))?));
    let found: Vec<(&str, Means)> = CLAIMED.iter().filter_map(of).collect();
    let list: Vec<String> = found
        .iter()
        .map(|(name, both)| format!("`{name}` {:.2} against {:.2} degrees ({} sets)", both.warp, both.vpg, both.sets))
        .collect();
    let brief = found.iter().map(|(name, both)| format!("{name} {:.1} against {:.1} deg", both.warp, both.vpg));
    Claim {
        id: "warps-direction",
        text: "Warps of homographies (APAP, SPHP) turn the photographs far more wrongly than VPG turns the same ones."
            .to_owned(),
        holds: (!found.is_empty()).then(|| found.iter().all(|(_, both)| both.warp >= FAR_WORSE * both.vpg)),
        evidence: format!(
            "Mean GDIC as published, on the most photographs of each set that all of them place: {}; far worse means {FAR_WORSE} times.",
            if list.is_empty() { "no warp was run".to_owned() } else { list.join(", ") }
        ),
        reason: "",
        brief: brief.collect::<Vec<_>>().join(", "),
    }
}

/// VPG distorts less on every set, as in the paper.
fn claim_distortion(results: &Results) -> Claim {
    let pairs: Vec<(&str, Vec<Pair>)> =
        CLAIMED.iter().map(|name| (*name, same_photographs(results, name, VPG_PUBLISHED, LD))).collect();
    let all: Vec<&Pair> = pairs.iter().flat_map(|(_, pairs)| pairs).collect();
    let lower = all.iter().filter(|pair| pair.vpg < pair.warp).count();
    let of_warp = |(name, pairs): &(&str, Vec<Pair>)| {
        let both = means(pairs)?;
        let worse: Vec<&str> =
            pairs.iter().filter(|pair| pair.vpg >= pair.warp).map(|pair| pair.set.as_str()).collect();
        let except = if worse.is_empty() { String::new() } else { format!(", more on {}", worse.join(" and ")) };
        Some(format!("against `{name}` {:.2} and {:.2} in the mean{except}", both.vpg, both.warp))
    };
    let list: Vec<String> = pairs.iter().filter_map(of_warp).collect();
    Claim {
        id: "warps-distortion",
        text: "VPG distorts the photographs less than each warp of homographies (APAP, SPHP), on every set.".to_owned(),
        holds: (!all.is_empty()).then_some(lower == all.len()),
        evidence: format!(
            "LD x 1e-2 as published, on the most photographs of each set that all of them place, lower in {}: {}.",
            share(lower, all.len()),
            list.join("; ")
        ),
        reason: "It is the mesh, not the prior: GSP's rows on the mesh as published have it in common, the default mesh has it \
                 not. LD is that of a set's worst photograph, and the warps are judged on the few photographs that they can \
                 place.",
        brief: format!("LD lower in {}", share(lower, all.len())),
    }
}

/// The tables, and what the warps refused.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T1: warps of homographies");
    let sets = sets(results.catalogue);
    section.say(format!(
        "Sets 04 to 09, reduced to the {LARGEST} photographs around the middle one, which is the reference: one homography \
         cannot show a wide field of view. What a method cannot do is tried with fewer, down to {SMALLEST}; the number stands in \
         brackets behind a figure where it is smaller, and n/a where none will do. The rows of VPG and GSP are for all of the \
         reduced set."
    ));
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    for (measure, id, title) in [(LD, "ld", "LD x 1e-2"), ("gdic_deg", "gdic-deg", "GDIC, degrees")] {
        let mut rows: Vec<GridRow> = methods().map(|one| grid_row(results, &sets, one, measure)).collect();
        rows.extend(WARPS.iter().map(|row| match measure {
            LD => GridRow::paper(row.method, &row.ld),
            _ => GridRow::paper(row.method, &row.gdic_deg),
        }));
        section.blocks.push(Block::Table(table(&format!("t1-{id}"), &format!("T1: {title}."), &sets, &rows)));
    }
    let refused = refusals(results, &sets);
    if !refused.is_empty() {
        section.say("Why methods were given fewer photographs, or none:");
        section.blocks.push(Block::List(refused));
    }
    section
}

/// A method's figures on the largest number of photographs each.
fn grid_row(results: &Results, sets: &[SetSpec], one: &ComparedMethod, measure: &str) -> GridRow {
    let mut values = Vec::new();
    let cells = sets.iter().map(|set| {
        let most = sizes(results, set, one.name).into_iter().max();
        match largest(results, set, one.name) {
            None if most.is_some() => "n/a".to_owned(),
            None => number(None, 2),
            Some((photographs, row)) => {
                values.extend(row.measure(measure));
                let figure = number(row.measure(measure), 2);
                if Some(photographs) == most { figure } else { format!("{figure} ({photographs})") }
            }
        }
    });
    let cells = cells.collect();
    GridRow::stated(one.name, cells, mean(&values))
}

/// Per warp and set the reason why one photograph more is not done.
fn refusals(results: &Results, sets: &[SetSpec]) -> Vec<String> {
    let mut points = Vec::new();
    for one in warps() {
        for set in sets {
            let done = largest(results, set, one.name).map(|(photographs, _)| photographs);
            let next = sizes(results, set, one.name).into_iter().rfind(|size| done.is_none_or(|done| *size > done));
            let Some(row) = next.and_then(|size| row(results, set, one.name, size)) else { continue };
            let (name, size) = (short_name(&set.name), row.key.photograph_count.unwrap_or(0));
            points.push(format!("`{}` on {size} photographs of {name}: {}", one.name, row.note));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::methods::method;
    use crate::sets::GivenFolders;

    fn result(variant: &str, photographs: usize, measure: &str, value: f64) -> Row {
        let trial = Trial { photograph_count: Some(photographs), ..Trial::new(NAME, "study/05", variant, &[]) };
        let note = if measure == "refused" { "too wide".to_owned() } else { String::new() };
        Row { key: trial.key("set", "1"), measures: BTreeMap::from([(measure.to_owned(), value)]), note }
    }

    #[test]
    fn the_largest_reduction_counts_and_refusals_are_stated() {
        let catalogue = Catalogue::full(&GivenFolders::default()).expect("no folders");
        let rows = vec![
            result("homography", 5, "refused", 1.0),
            result("homography", 3, "gdic_deg", 6.0),
            result("homography", 4, "gdic_deg", 8.0),
            result(VPG_PUBLISHED, 4, "gdic_deg", 1.0),
            result(VPG_PUBLISHED, 5, "gdic_deg", 2.0),
            result("apap", 5, "refused", 1.0),
            result("quasi-homography", 5, "refused", 1.0),
            result("apap", 4, "gdic_deg", 9.0),
            result("apap", 3, "gdic_deg", 7.0),
            result("sphp", 4, "gdic_deg", 8.0),
            result("sphp", 3, "gdic_deg", 5.0),
            result("sphp-free", 4, "refused", 1.0),
            result("sphp-free", 3, "gdic_deg", 6.0),
            result(VPG_PUBLISHED, 3, "gdic_deg", 0.5),
        ];
        let results = Results { catalogue: &catalogue, rows };
        let set = &catalogue.study[4];
        assert_eq!(largest(&results, set, "homography").map(|(photographs, _)| photographs), Some(4));
        // All three warps place three photographs, two of them four.
        assert_eq!(placed_by_all(&results, set), Some(3));
        let pair = Pair { set: "05".to_owned(), warp: 7.0, vpg: 0.5 };
        assert_eq!(same_photographs(&results, "apap", VPG_PUBLISHED, "gdic_deg"), [pair]);
        let expected = [
            "`homography` on 5 photographs of 05: too wide",
            "`quasi-homography` on 5 photographs of 05: too wide",
            "`apap` on 5 photographs of 05: too wide",
            "`sphp-free` on 4 photographs of 05: too wide",
        ];
        assert_eq!(refusals(&results, std::slice::from_ref(set)), expected);
        let one = method("quasi-homography").expect("a method");
        let none = table("t", "", std::slice::from_ref(set), &[grid_row(&results, std::slice::from_ref(set), one, LD)]);
        assert_eq!(none.rows[0].cells, ["quasi-homography", "n/a", "-"]);
        let held: Vec<Option<bool>> = claims(&results).iter().map(|claim| claim.holds).collect();
        assert_eq!(held, [Some(true), None]);
    }
}
