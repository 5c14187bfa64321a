//! T4: every photograph in turn as the reference.

use trueup::Result;
use trueup_report::charts::{Chart, Series, SeriesMark};

use crate::methods::{Family, GSP_2D_PUBLISHED, GSP_3D_PUBLISHED, VPG, VPG_PUBLISHED, methods_of};
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::{Results, short_name};
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::{mean, share, spread};
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "reference-choice";

/// A spread of GDIC that counts as flat, degrees: a fifth of what the rectangle in GDIC costs by itself.
const FLAT_DEG: f64 = 0.1;
/// A spread that counts as severe, degrees.
const AFFECTED_DEG: f64 = 1.0;
/// On how many sets of how many GSP-2D is to be affected; in the paper on all.
const AFFECTED_SETS: (usize, usize) = (3, 4);

fn sets(catalogue: &Catalogue) -> impl Iterator<Item = &SetSpec> {
    catalogue.study.iter().filter(|set| catalogue.reference_sets.contains(&short_name(&set.name)))
}

/// Every method with a prior with every reference.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for set in sets(catalogue) {
        for reference in 0..set.photograph_count()? {
            for one in methods_of(Family::Prior) {
                let trial = Trial::new(NAME, &set.name, one.name, &one.overrides());
                trials.push(Trial { reference: Some(reference), ..trial });
            }
        }
    }
    Ok(trials)
}

/// GDIC by reference, in their order.
fn by_reference(results: &Results, set: &SetSpec, method: &str) -> Vec<(f64, f64)> {
    results
        .of(NAME)
        .filter(|row| row.key.set == set.name && row.key.variant == method)
        .filter_map(|row| Some((row.key.reference? as f64 + 1.0, row.measure("gdic_deg")?)))
        .collect()
}

fn values(results: &Results, set: &SetSpec, method: &str) -> Vec<f64> {
    by_reference(results, set, method).into_iter().map(|(_, value)| value).collect()
}

/// VPG does not depend on the reference; GSP-2D does; GSP-3D is higher. All as published.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let of_sets: Vec<&SetSpec> = sets(results.catalogue).collect();
    let spreads =
        |method| -> Vec<f64> { of_sets.iter().filter_map(|set| spread(&values(results, set, method))).collect() };
    let widest = |method| spreads(method).into_iter().max_by(f64::total_cmp);
    let means: Vec<(f64, f64)> = of_sets
        .iter()
        .filter_map(|set| mean(&values(results, set, VPG_PUBLISHED)).zip(mean(&values(results, set, GSP_3D_PUBLISHED))))
        .collect();
    let higher = means.iter().filter(|(ours, other)| other > ours).count();
    let two = spreads(GSP_2D_PUBLISHED);
    let affected = two.iter().filter(|spread| **spread > AFFECTED_DEG).count();
    let each: Vec<String> = two.iter().map(|spread| format!("{spread:.2}")).collect();
    vec![
        Claim {
            id: "reference-vpg",
            text: "The panorama's directions do not depend on the choice of the reference.".to_owned(),
            holds: widest(VPG_PUBLISHED).map(|widest| widest <= FLAT_DEG),
            evidence: format!(
                "Over all references of a set, GDIC of `{VPG_PUBLISHED}` differs by at most {} degrees, that of `{VPG}` by at \
                 most {} ({FLAT_DEG} counts as flat).",
                number(widest(VPG_PUBLISHED), 3),
                number(widest(VPG), 3)
            ),
            reason: "",
            brief: format!("spread over references {} deg", number(widest(VPG_PUBLISHED), 3)),
        },
        Claim {
            id: "reference-gsp",
            text: "Those of GSP-2D are severely affected, and GSP-3D is more inconsistent than VPG.".to_owned(),
            holds: (!two.is_empty())
                .then_some(affected * AFFECTED_SETS.1 >= two.len() * AFFECTED_SETS.0 && higher == means.len()),
            evidence: format!(
                "GDIC of `{GSP_2D_PUBLISHED}` differs by {} degrees on the {} sets, by more than {AFFECTED_DEG} on {affected} \
                 (wanted: {} of {}); GSP-3D's by up to {}; the mean over the references is higher with GSP-3D than with VPG on \
                 {higher} of {} sets.",
                each.join(", "),
                two.len(),
                AFFECTED_SETS.0,
                AFFECTED_SETS.1,
                number(widest(GSP_3D_PUBLISHED), 3),
                means.len()
            ),
            reason: "A photograph stands as it was taken where 0 lies in the range of the turns of its overlap's grid edges, \
                     which is 17 to 22 degrees wide in the median on these sets: wider than neighbors' rolls differ. So on 05, \
                     08 and 11 all photographs stand so whatever the reference, which alone takes a turn of its own.",
            brief: format!("GSP-2D above {AFFECTED_DEG} deg on {}", share(affected, two.len())),
        },
    ]
}

/// A table and a drawing per set.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T4: choice of the reference");
    section.say(
        "Every photograph in turn is the reference of the stitch, while GDIC is measured against one fixed photograph. The paper \
         shows VPG flat, GSP-2D varying, GSP-3D flat but higher.",
    );
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let columns = ["set", "method", "mean GDIC deg", "smallest", "largest", "spread"];
    let mut table = Table::new("t4-reference", "GDIC over all references of a set, degrees.", columns);
    for set in sets(results.catalogue) {
        for one in methods_of(Family::Prior) {
            let values = values(results, set, one.name);
            table.push([
                short_name(&set.name).to_owned(),
                one.name.to_owned(),
                number(mean(&values), 3),
                number(values.iter().copied().min_by(f64::total_cmp), 3),
                number(values.iter().copied().max_by(f64::total_cmp), 3),
                number(spread(&values), 3),
            ]);
        }
    }
    section.blocks.push(Block::Table(table));
    for set in sets(results.catalogue) {
        let lines = methods_of(Family::Prior)
            .map(|one| Series::plain(one.name, SeriesMark::Line, by_reference(results, set, one.name)));
        let chart = Chart::new("reference photograph", "GDIC, degrees", lines.collect());
        section.draw(&format!("Set {}: GDIC for every reference.", short_name(&set.name)), chart.svg());
    }
    section
}
