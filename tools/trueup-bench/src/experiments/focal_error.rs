//! Metadata that lie about the focal length.

use trueup::Result;
use trueup_report::charts::{Chart, Series, SeriesMark};

use crate::report::document::{Block, Section, Table, number};
use crate::results::{Results, short_name};
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::mean;
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "focal-error";

const VARIANTS: [(&str, &[&str]); 2] =
    [("default", &[]), ("metadata trusted to 0.1 %", &["cameras.known_focal_sd=0.001"])];

/// Every variant on every set of the sweep.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let each = |set: &SetSpec| VARIANTS.map(|(name, overrides)| Trial::new(NAME, &set.name, name, overrides));
    Ok(catalogue.focal.iter().flat_map(|one| each(&one.set)).collect())
}

/// Tables and lines.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "Focal error");
    let mut factors: Vec<f64> = results.catalogue.focal.iter().map(|one| one.factor).collect();
    factors.sort_by(f64::total_cmp);
    factors.dedup();
    if factors.is_empty() {
        section.blocks.push(Block::Skipped("no sets with wrong metadata in this run".to_owned()));
        return section;
    }
    let of = |factor: f64| -> Vec<SetSpec> {
        results.catalogue.focal.iter().filter(|one| one.factor == factor).map(|one| one.set.clone()).collect()
    };
    let mut originals: Vec<&str> = results.catalogue.focal.iter().map(|one| short_name(&one.original)).collect();
    originals.dedup();
    originals.sort_unstable();
    originals.dedup();
    section.say(format!(
        "The photographs of sets {} with metadata that claim a focal length wrong by a factor. By default a claim is a hint that \
         the matches overrule; trusted to 0.1 % it holds against them.",
        originals.join(", ")
    ));
    let value =
        |variant: &str, factor: f64, measure: &str| mean(&results.values_of_all(NAME, &of(factor), variant, measure));
    let columns = ["claimed / true", "variant", "theta error deg", "upright deg", "GDIC deg", "divergence", "guided %"];
    let mut table = Table::new("focal-error", "Means over the sets.", columns);
    for factor in &factors {
        for (variant, _) in VARIANTS {
            let figure = |measure| value(variant, *factor, measure);
            table.push([
                format!("{factor:.2}"),
                variant.to_owned(),
                number(figure("theta_error_deg"), 3),
                number(figure("upright_deg"), 3),
                number(figure("gdic_deg"), 3),
                number(figure("divergence"), 4),
                number(figure("guided").map(|share| 100.0 * share), 0),
            ]);
        }
    }
    section.blocks.push(Block::Table(table));
    let series = VARIANTS.map(|(variant, _)| {
        let points = factors.iter().filter_map(|factor| Some((*factor, value(variant, *factor, "theta_error_deg")?)));
        Series::plain(variant, SeriesMark::Line, points)
    });
    let chart = Chart::new("claimed / true focal length", "theta error, degrees", series.into());
    section.draw("Error of the prior's turn when metadata lie.", chart.svg());
    section
}
