//! T7: whether a method's freedom buys alignment, and what it costs in direction.

use trueup::Result;

use crate::methods::{Family, Method, methods_of};
use crate::report::document::{Block, Section, Table, number};
use crate::results::Results;
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::mean;
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "alignment";

/// Larger sets are left out: their pixels take minutes to compare and say the same.
const MAX_PICTURES: usize = 16;

/// Every method on the study's sets of moderate size and on the given ones, with their pixels compared.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for set in catalogue.study.iter().chain(&catalogue.given) {
        if set.pictures()? <= MAX_PICTURES {
            let of_method = |one: &Method| Trial::new(NAME, &set.name, one.name, one.overrides);
            trials.extend(methods().map(|one| Trial { pixels: true, ..of_method(one) }));
        }
    }
    Ok(trials)
}

/// The methods of the tables: each prior, and what bends the mesh further.
fn methods() -> impl Iterator<Item = &'static Method> {
    methods_of(Family::Prior)
}

/// A table per family of sets.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T7: alignment against direction");
    section.say(
        "The paper adds dual-feature warping (DFW) or content-preserving warping (GCPW) to VPG and finds the alignment error fall \
         while GDIC stays. Neither exists here yet; the table shows every method that does. **NCC MSE**: mean square of one minus \
         the normalised cross-correlation of 3 x 3 windows where photographs overlap on the panorama. **grey MSE**: mean square \
         difference of grey values, 0 to 255, after evening out the exposures. **matches**: root mean square distance of matched \
         points, source pixels.",
    );
    let caption = format!("Means over the study's sets of at most {MAX_PICTURES} photographs.");
    section.blocks.push(Block::Table(table(results, &results.catalogue.study, "t7-alignment", &caption)));
    if !results.catalogue.given.is_empty() {
        let caption = format!("Means over the given sets of at most {MAX_PICTURES} photographs.");
        section.blocks.push(Block::Table(table(results, &results.catalogue.given, "t7-given", &caption)));
    }
    section
}

fn table(results: &Results, sets: &[SetSpec], id: &str, caption: &str) -> Table {
    let columns = ["method", "NCC MSE", "grey MSE", "PSNR dB", "SSIM", "matches px", "GDIC deg", "LD x 1e-2", "folds"];
    let mut table = Table::new(id, caption, columns);
    for one in methods() {
        let value = |measure| mean(&results.values_of_all(NAME, sets, one.name, measure));
        table.push([
            one.name.to_owned(),
            number(value("ncc_mse"), 4),
            number(value("intensity_mse"), 1),
            number(value("psnr_db"), 2),
            number(value("ssim"), 4),
            number(value("match_rms_px"), 3),
            number(value("gdic_deg"), 2),
            number(value("ld"), 2),
            number(value("folds"), 1),
        ]);
    }
    table
}
