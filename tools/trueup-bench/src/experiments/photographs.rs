//! Photographs of which nothing is known: the paper's table 4, on the data set of GSP.

use trueup::Result;

use super::paper_figures::{GALLERY, THRESHOLD};
use crate::methods::{GSP_3D_PUBLISHED, VPG, VPG_PUBLISHED, method};
use crate::report::document::{Block, Section, Table, number};
use crate::results::{Results, short_name};
use crate::sets::Catalogue;
use crate::trial::{Row, Trial};

/// The experiment's name.
pub(crate) const NAME: &str = "photographs";

const COMPARED: [&str; 3] = [VPG_PUBLISHED, VPG, GSP_3D_PUBLISHED];

/// VPG as published and by default, and what the published form falls back to, on every set.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let sets = catalogue.photographs.iter();
    let each = |set: &crate::sets::SetSpec| {
        COMPARED
            .into_iter()
            .filter_map(method)
            .map(|one| Trial::new(NAME, &set.name, one.name, &one.overrides()))
            .collect()
    };
    Ok(sets.flat_map(|set| -> Vec<Trial> { each(set) }).collect())
}

/// Tables beside the paper's.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "Table 4: photographs of the GSP data set");
    section.say(format!(
        "Sets of photographs with unknown cameras. The paper believes their vanishing points up to a divergence of {THRESHOLD:.2} \
         and shows twelve panoramas. **lean**: mean lean by the lines of all photographs, over those for which it is \
         certain; **estimated GDIC**: from the same lines. What the photographs are and how many were used is stated, since a \
         set of the same name may be another selection."
    ));
    let sets = &results.catalogue.photographs;
    if sets.is_empty() {
        section.blocks.push(Block::Skipped("no photographs given (`--photographs DIR`)".to_owned()));
        return section;
    }
    let columns = [
        "set",
        "method",
        "used/given",
        "divergence",
        "guided",
        "lean deg",
        "certain",
        "estimated GDIC deg",
        "LD x 1e-2",
        "matches px",
        "folds",
    ];
    let mut table = Table::new("photographs", "Every set.", columns);
    for set in sets {
        for name in COMPARED {
            let row = results.of(NAME).find(|row| row.key.set == set.name && row.key.variant == name);
            if let Some(row) = row {
                table.push(cells(short_name(&set.name), name, row));
            }
        }
    }
    section.blocks.push(Block::Table(table));
    let mut gallery = Table::new(
        "photographs-paper",
        "The paper's table 4, whose panoramas are lettered and not named.",
        ["set", "photographs", "divergence"],
    );
    for one in GALLERY {
        gallery.push_paper([format!("({})", one.letter), one.photographs.to_string(), number(Some(one.divergence), 4)]);
    }
    section.blocks.push(Block::Table(gallery));
    section
}

fn cells(set: &str, method: &str, row: &Row) -> Vec<String> {
    let count = |measure| number(row.measure(measure), 0);
    let guided = match (row.measure("guided"), row.measure("accepted")) {
        (Some(guided), Some(accepted)) if method != GSP_3D_PUBLISHED => match (guided > 0.0, accepted > 0.0) {
            (_, true) => "yes",
            (true, false) => "vertical only",
            (false, false) => "no",
        },
        _ => "-",
    };
    vec![
        set.to_owned(),
        method.to_owned(),
        format!("{}/{}", count("used"), count("given")),
        number(row.measure("divergence"), 4),
        guided.to_owned(),
        number(row.measure("lean_deg"), 2),
        count("certain"),
        number(row.measure("estimated_gdic_deg"), 2),
        number(row.measure("ld"), 2),
        number(row.measure("match_rms_px"), 2),
        count("folds"),
    ]
}
