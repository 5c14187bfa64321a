//! Cameras that look up: where the published relative roll and one similarity per photograph fail.

use trueup::Result;
use trueup_report::charts::{Chart, Series, SeriesMark};

use crate::measure::LD;
use crate::methods::{Family, LEVELLED, VPG, VPG_PUBLISHED, method, methods_of};
use crate::published_forms::{OWN_VANISHING_POINTS, PUBLISHED_MESH, RELATIVE_TWIST};
use crate::report::document::{Block, Section, Table, number};
use crate::results::Results;
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::mean;
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "pitch-sweep";

/// The relative roll as the paper words it, its sign mended, on the published mesh and with each photograph's own
/// directions. `vpg-published` itself takes the roll that the common vertical means.
const TWIST: &str = "published mesh, twist as relative roll";

fn variants() -> Vec<(&'static str, Vec<&'static str>)> {
    let of_methods = methods_of(Family::Prior).map(|one| (one.name, one.overrides()));
    let twist = [&PUBLISHED_MESH[..], &RELATIVE_TWIST, &OWN_VANISHING_POINTS].concat();
    of_methods.chain([(TWIST, twist)]).collect()
}

/// Every method with a prior at every pitch.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let each = |set: &SetSpec| -> Vec<Trial> {
        variants().iter().map(|(name, overrides)| Trial::new(NAME, &set.name, name, overrides)).collect()
    };
    Ok(catalogue.pitch.iter().flat_map(|one| each(&one.set)).collect())
}

/// Table and lines.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "Pitch sweep");
    section.say(
        "Rows of seven photographs whose cameras look up by the stated angle, rooms and streets. Two level cameras that look up \
         have a relative rotation with a twist of its own: taken for a roll, as published, it bends the row. One similarity per \
         photograph cannot follow verticals that converge.",
    );
    let mut pitches: Vec<f64> = results.catalogue.pitch.iter().map(|one| one.pitch_deg).collect();
    pitches.sort_by(f64::total_cmp);
    pitches.dedup();
    if pitches.is_empty() {
        section.blocks.push(Block::Skipped("no sets of other pitches in this run".to_owned()));
        return section;
    }
    let sets_at = |pitch: f64| -> Vec<SetSpec> {
        results.catalogue.pitch.iter().filter(|one| one.pitch_deg == pitch).map(|one| one.set.clone()).collect()
    };
    let value = |variant: &str, pitch, measure| mean(&results.values_of_all(NAME, &sets_at(pitch), variant, measure));
    for (measure, id, title) in [
        ("theta_error_deg", "theta-error-deg", "Error of the prior's turn, degrees"),
        ("upright_deg", "upright-deg", "Deviation from upright in the panorama, degrees"),
        ("gdic_deg", "gdic-deg", "GDIC, degrees"),
        (LD, "ld", "LD x 1e-2"),
    ] {
        let columns = std::iter::once("method".to_owned()).chain(pitches.iter().map(|pitch| format!("{pitch:.0} deg")));
        let mut table = Table::new(&format!("pitch-{id}"), &format!("{title}, by pitch."), columns);
        for (name, _) in variants() {
            let cells = pitches.iter().map(|pitch| number(value(name, *pitch, measure), 2));
            table.push(std::iter::once(name.to_owned()).chain(cells));
        }
        section.blocks.push(Block::Table(table));
    }
    let drawn = [VPG, VPG_PUBLISHED, TWIST, LEVELLED];
    let series = drawn.map(|name| {
        let points = pitches.iter().filter_map(|pitch| Some((*pitch, value(name, *pitch, "upright_deg")?)));
        Series::plain(name, SeriesMark::Line, points)
    });
    debug_assert!(drawn.iter().all(|name| *name == TWIST || method(name).is_some()));
    let chart = Chart::new("pitch of the cameras, degrees", "deviation from upright, degrees", series.into());
    section.draw("Deviation from upright as the cameras look up.", chart.svg());
    section
}
