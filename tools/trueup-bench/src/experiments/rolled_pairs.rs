//! Figure 1: two photographs, the second turned about its axis.

use trueup::Result;
use trueup_report::charts::{Chart, Series, SeriesMark};

use crate::measure::LD;
use crate::methods::{APAP, GSP_3D_PUBLISHED, SPHP, SPHP_FREE, VPG, VPG_PUBLISHED, method};
use crate::report::document::{Block, Claim, Section, Table, number};
use crate::results::Results;
use crate::sets::Catalogue;
use crate::statistics::spread;
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "rolled-pairs";

/// Those that the paper's figure shows, and what they are compared with.
const COMPARED: [&str; 6] = [SPHP, SPHP_FREE, APAP, GSP_3D_PUBLISHED, VPG_PUBLISHED, VPG];

/// A spread of GDIC over the turns that counts as none, degrees: the rectangle in GDIC errs by as much.
const FLAT_DEG: f64 = 0.5;
/// A spread that counts as a different panorama, degrees.
const DIFFERENT_DEG: f64 = 5.0;

/// Every method at every turn; the first photograph, which stays as it is, is the reference.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for pair in &catalogue.rolled {
        for one in COMPARED.into_iter().filter_map(method) {
            let trial = Trial::new(NAME, &pair.set.name, one.name, &one.overrides());
            trials.push(Trial { reference: Some(0), ..trial });
        }
    }
    Ok(trials)
}

/// A figure of a method by the turn, degrees, of the pairs of one scene.
fn by_turn(results: &Results, scene: &str, method: &str, measure: &str) -> Vec<(f64, f64)> {
    let pairs = results.catalogue.rolled.iter().filter(|pair| pair.scene == scene);
    pairs
        .filter_map(|pair| Some((pair.roll_deg, *results.values(NAME, &pair.set.name, method, measure).first()?)))
        .collect()
}

/// The scenes, each once, in their order.
fn scenes(catalogue: &Catalogue) -> Vec<&'static str> {
    let mut scenes: Vec<&'static str> = catalogue.rolled.iter().map(|pair| pair.scene).collect();
    scenes.dedup();
    scenes
}

/// The widest spread of a method's GDIC over the turns of a scene.
fn widest(results: &Results, method: &str) -> Option<f64> {
    let of_scene = |scene: &&str| {
        let values: Vec<f64> = by_turn(results, scene, method, "gdic_deg").into_iter().map(|(_, gdic)| gdic).collect();
        spread(&values)
    };
    scenes(results.catalogue).iter().filter_map(of_scene).max_by(f64::total_cmp)
}

/// A turn of a photograph changes SPHP's panorama and leaves VPG's as it is.
pub(crate) fn claims(results: &Results) -> Vec<Claim> {
    let [sphp, free, ours, default] = [SPHP, SPHP_FREE, VPG_PUBLISHED, VPG].map(|name| widest(results, name));
    let verdict = sphp.zip(ours).map(|(sphp, ours)| sphp >= DIFFERENT_DEG && ours <= FLAT_DEG);
    vec![Claim {
        id: "rolled-pairs",
        text: "Turning a photograph about its axis gives SPHP another panorama and VPG the same one (figure 1)."
            .to_owned(),
        holds: verdict,
        evidence: format!(
            "Over turns of 0 to 60 degrees GDIC differs by up to {} degrees with `{SPHP}` (another panorama: {DIFFERENT_DEG}), {} \
             with `{SPHP_FREE}`, {} with `{VPG_PUBLISHED}` (the same: {FLAT_DEG}), {} with `{VPG}`.",
            number(sphp, 2),
            number(free, 2),
            number(ours, 2),
            number(default, 2)
        ),
        reason: "",
        brief: format!("a turned photograph moves SPHP by {} deg, VPG by {}", number(sphp, 1), number(ours, 1)),
    }]
}

/// A table and a drawing.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "Figure 1: a turned photograph");
    section.say(
        "Two photographs of a room and of a street from one place; the second was taken with the camera turned about its axis. \
         The first stays as it is and is the reference. GDIC is how far the two are turned against each other in the panorama, \
         beyond what their cameras say.",
    );
    section.blocks.extend(claims(results).into_iter().map(Block::Claim));
    let mut turns: Vec<f64> = results.catalogue.rolled.iter().map(|pair| pair.roll_deg).collect();
    turns.sort_by(f64::total_cmp);
    turns.dedup();
    for (measure, title, id) in [
        ("gdic_deg", "GDIC, degrees", "rolled-gdic"),
        (LD, "LD x 1e-2", "rolled-ld"),
        ("upright_deg", "Deviation from upright, degrees", "rolled-upright"),
    ] {
        let heads = ["scene".to_owned(), "method".to_owned()];
        let columns = heads.into_iter().chain(turns.iter().map(|turn| format!("{turn:.0} deg")));
        let mut table = Table::new(id, &format!("{title}, by the turn of the second photograph."), columns);
        for scene in scenes(results.catalogue) {
            for name in COMPARED {
                let found = by_turn(results, scene, name, measure);
                let at = |turn: &f64| number(found.iter().find(|(known, _)| known == turn).map(|(_, value)| *value), 2);
                table.push([scene.to_owned(), name.to_owned()].into_iter().chain(turns.iter().map(at)));
            }
        }
        section.blocks.push(Block::Table(table));
    }
    for scene in scenes(results.catalogue) {
        let lines =
            COMPARED.map(|name| Series::plain(name, SeriesMark::Line, by_turn(results, scene, name, "gdic_deg")));
        let chart = Chart::new("turn of the second photograph, degrees", "GDIC, degrees", lines.into());
        section.draw(&format!("GDIC of the {scene} by the turn of the second photograph."), chart.svg());
    }
    section
}
