//! The sections that say what the report is about.

use super::document::{Block, Claim, Section, Table};
use crate::results::Results;
use crate::sets::Catalogue;

/// What it is, and the claims at a glance.
pub(crate) fn summary(claims: &[Claim]) -> Section {
    let mut section = Section::new("summary", "Summary");
    section.say(
        "A panorama of several photographs looks natural when what is vertical in the world stands vertical in it. The paper \
         guides the rotation of every photograph by its vanishing points, with a robust scheme against wrong ones and a gate for \
         scenes that have none. This report repeats its experiments on sets whose cameras are exactly known, beside the paper's own \
         figures (shaded, in italics), and adds some of our own. The paper's photographs are not public: sets of the same number \
         differ, so that tendencies compare and single figures do not.",
    );
    section.blocks.extend(claims.iter().cloned().map(Block::Claim));
    section
}

/// What each figure means.
pub(crate) fn measures() -> Section {
    let mut section = Section::new("measures", "What is measured");
    let points = [
        "**GDIC**, global direction inconsistency, degrees: how differently the photographs are turned in the panorama from what \
         their true cameras say, relative to one photograph; the mean over the others. The turn of a photograph is that of the \
         smallest rectangle around its grid, which costs half a degree or so by itself (the paper's equation 14).",
        "**theta error**, degrees: the same for the turns that the prior wants, before any mesh and without the rectangle. \
         It shows the prior alone.",
        "**upright**, degrees: the angle between what stands vertical in the middle of a photograph and the panorama's vertical; \
         the mean over the photographs. Unlike GDIC it is absolute: a panorama that leans as a whole is not upright.",
        "**LD**, local distortion, x 1e-2: how unevenly the cells of a photograph's grid are stretched where nothing overlaps, the \
         mean per photograph, the worst photograph of a set (equations 12 and 13). It grows with the size of the cells: a method \
         with finer cells has a lower LD for the same shape.",
        "**align**, source pixels: root mean square distance in the panorama between the two places of one point of the scene; known \
         where all photographs were taken from one place.",
        "**divergence**: how badly the photographs' vanishing points fit one Manhattan world (equation 15); 0 is perfect.",
        "**guided**: the share of runs in which the gate believed the vanishing points.",
    ];
    section.blocks.push(Block::List(points.map(str::to_owned).into()));
    section
}

/// What was stitched.
pub(crate) fn sets(catalogue: &Catalogue) -> Section {
    let mut section = Section::new("sets", "The sets");
    section.say(
        "Rendered rooms, streets and open country with exactly known cameras: hand-held rows, grids and full turns with roll, \
         wandering, noise and changing exposure.",
    );
    let mut table = Table::new("sets", "The study's sets.", ["set", "content"]);
    for set in &catalogue.study {
        table.push([&set.name, &set.content]);
    }
    section.blocks.push(Block::Table(table));
    let manhattan = catalogue.gate.iter().filter(|set| set.manhattan == Some(true)).count();
    section.say(format!(
        "Beside them {manhattan} small sets with dominant directions and {} without for the gate, {} for the pitch sweep, and {} \
         given with their truth.",
        catalogue.gate.len() - manhattan,
        catalogue.pitch.len(),
        catalogue.given.len()
    ));
    section
}

/// The command, and what is not here.
pub(crate) fn how_it_was_made(results: &Results, version: &str, jobs: usize, threads: usize) -> Section {
    let mut section = Section::new("made", "How it was made, and what is missing");
    section.say(format!(
        "`trueup-bench paper --out DIR`, version {version}: {} runs, {jobs} sets at a time with {threads} threads each. Every \
         single result is in `rows.csv`, every table in a CSV file of its own. The same sets, options and seeds give the same \
         figures for any number of threads.",
        results.rows.len()
    ));
    section.blocks.push(Block::List(
        [
            "Methods of the paper without a row of ours beside their figures do not exist here yet.",
            "T8, the user study, cannot be repeated by a machine; `upright` is what it comes down to.",
        ]
        .map(str::to_owned)
        .into(),
    ));
    section
}
