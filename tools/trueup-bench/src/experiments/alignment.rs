//! T7: whether a method's freedom buys alignment, and what it costs in direction.

use trueup::Result;

use super::grid::{self, GridRow};
use crate::measure::LD;
use crate::methods::{
    ComparedMethod, Family, GSP_3D, GSP_3D_PUBLISHED, VPG, VPG_LINES_PUBLISHED, VPG_PIXELS_PUBLISHED, VPG_PUBLISHED,
    method, methods_of,
};
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::Results;
use crate::sets::{Catalogue, SetSpec};
use crate::statistics::mean;
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "alignment";

/// Larger sets are left out: their pixels take minutes to compare and say the same.
const MAX_PHOTOGRAPHS: usize = 16;

/// Every method on the study's sets of moderate size, with their pixels compared.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for set in &catalogue.study {
        if set.photograph_count()? <= MAX_PHOTOGRAPHS {
            let of_method = |one: &ComparedMethod| Trial::new(NAME, &set.name, one.name, &one.overrides());
            trials.extend(methods().map(|one| Trial { pixels: true, ..of_method(one) }));
        }
    }
    Ok(trials)
}

/// The methods of the table: as published and by default, each with what bends the mesh further.
fn methods() -> impl Iterator<Item = &'static ComparedMethod> {
    let plain = [VPG_PUBLISHED, GSP_3D_PUBLISHED, VPG, GSP_3D].into_iter().filter_map(method);
    plain.chain(methods_of(Family::Alignment))
}

/// GDIC that alignment may cost, degrees: less than the rectangle in GDIC errs by itself.
const MAX_COST_DEG: f64 = 0.2;
/// Share by which alignment is to lower the error; the paper shows one set, where it falls by more.
const LOWERED_BY: f64 = 0.15;

/// What aligns further lowers the error and leaves the direction alone: claimed of the published forms.
const CLAIMED: [(&str, &str); 2] =
    [("alignment-lines", VPG_LINES_PUBLISHED), ("alignment-pixels", VPG_PIXELS_PUBLISHED)];

/// What aligns further lowers the error and leaves the direction alone.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let sets = &results.catalogue.study;
    let value = |name, measure| mean(&results.values_of_all(NAME, sets, name, measure));
    let of_method = |(id, name): (&'static str, &'static str)| {
        let error = value(name, "ncc_mse").zip(value(VPG_PUBLISHED, "ncc_mse"));
        let gdic = value(name, "gdic_deg").zip(value(VPG_PUBLISHED, "gdic_deg"));
        let verdict = error.zip(gdic).map(|((error, before), (gdic, own))| {
            error <= (1.0 - LOWERED_BY) * before && (gdic - own).abs() <= MAX_COST_DEG
        });
        let lower = error.map(|(error, before)| 100.0 * (1.0 - error / before));
        let (error, before) = error.unzip();
        let (gdic, own) = gdic.unzip();
        Claim {
            id,
            text: format!(
                "`{name}` aligns better than VPG alone, by {:.0} % or more, and turns the photographs alike.",
                100.0 * LOWERED_BY
            ),
            holds: verdict,
            evidence: format!(
                "Mean NCC MSE {} against {}, {} % lower; GDIC {} against {} degrees (alike means within {MAX_COST_DEG}).",
                number(error, 4),
                number(before, 4),
                number(lower, 1),
                number(gdic, 2),
                number(own, 2)
            ),
            reason: "Part of the measure cannot be lowered: sets without parallax, whose overlaps meet already, keep 0.2 to 0.3 of it by noise \
                     and resampling (tables below).",
            brief: format!("{name} NCC MSE {} % lower", number(lower, 0)),
        }
    };
    CLAIMED.map(of_method).into()
}

/// The table.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "T7: alignment against direction");
    section.say(
        "The paper adds dual-feature warping (DFW) or content-preserving warping (GCPW) to VPG and finds the alignment error fall \
         while GDIC stays. The list of methods above says which row stands beside which of them. **NCC MSE**: mean square of one minus \
         the normalized cross-correlation of 3 x 3 windows where photographs overlap on the panorama. **gray MSE**: mean square \
         difference of gray values, 0 to 255, after evening out the exposures. **matches**: root mean square distance of matched \
         points, source pixels.",
    );
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    section.say(
        "Published forms leave outlines free (`mesh.outline_weight=0`), as DFW and GCPW do; by default they are held, so that \
         a panorama keeps its borders. Nor do they hold long lines straight (`line_alignment.straightness=0`): GCPW does not, and \
         on one similarity for each photograph that turns photographs even where nothing is to be aligned.",
    );
    section.blocks.push(Block::Table(table(results, &results.catalogue.study)));
    let compared: Vec<SetSpec> =
        results.catalogue.study.iter().filter(|set| is_compared(results, set)).cloned().collect();
    for (id, caption, measure) in [
        ("t7-ncc-mse", "NCC MSE by set; 05 and 11 show no parallax.", "ncc_mse"),
        ("t7-gdic-deg", "GDIC by set, degrees.", "gdic_deg"),
    ] {
        let rows: Vec<GridRow> =
            methods().map(|one| GridRow::measured(results, NAME, &compared, one.name, measure)).collect();
        section.blocks.push(Block::Table(grid::table(id, caption, &compared, &rows)));
    }
    section
}

/// Whether the experiment has figures of a set.
fn is_compared(results: &Results, set: &SetSpec) -> bool {
    !results.values(NAME, &set.name, VPG_PUBLISHED, "ncc_mse").is_empty()
}

fn table(results: &Results, sets: &[SetSpec]) -> Table {
    let caption = format!("Means over the study's sets of at most {MAX_PHOTOGRAPHS} photographs.");
    let columns = ["method", "NCC MSE", "gray MSE", "PSNR dB", "SSIM", "matches px", "GDIC deg", "LD x 1e-2", "folds"];
    let mut table = Table::new("t7-alignment", &caption, columns);
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
            number(value(LD), 2),
            number(value("folds"), 1),
        ]);
    }
    table
}
