//! T7: whether a method's freedom buys alignment, and what it costs in direction.

use super::methods_compared;
use crate::methods::METHODS;
use crate::report::document::{Block, Section, Table, number};
use crate::results::Results;
use crate::sets::SetSpec;
use crate::statistics::mean;

/// The experiment's name.
pub(crate) const NAME: &str = "alignment";

/// A table from the figures of the comparison of methods.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T7: alignment against direction");
    section.say(
        "The paper adds dual-feature warping (DFW) or content-preserving warping (GCPW) to VPG and finds the alignment error fall \
         while GDIC stays. Neither exists here yet; the table shows every method that does. `align` is the distance between the \
         two places of one point, in source pixels; it is known where all photographs were taken from one place.",
    );
    table(results, &results.catalogue.study, "t7-alignment", "Means over the study's sets.", &mut section);
    if !results.catalogue.given.is_empty() {
        table(results, &results.catalogue.given, "t7-given", "Means over the given sets.", &mut section);
    }
    section
}

fn table(results: &Results, sets: &[SetSpec], id: &str, caption: &str, section: &mut Section) {
    let mut table = Table::new(id, caption, ["method", "align px", "GDIC deg", "LD x 1e-2", "folds"]);
    for one in METHODS {
        let value = |measure| {
            mean(&results.values_of_all(methods_compared::NAME, sets, one.name, measure))
        };
        table.push([
            one.name.to_owned(),
            number(value("align_px"), 3),
            number(value("gdic_deg"), 2),
            number(value("ld"), 2),
            number(value("folds"), 1),
        ]);
    }
    section.blocks.push(Block::Table(table));
}
