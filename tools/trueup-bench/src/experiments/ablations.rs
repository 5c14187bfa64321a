//! What each part of the prior contributes, on clean and on noisy vanishing points.

use trueup::Result;

use crate::published_forms::{DIVERGENCE_GATE, OWN_VANISHING_POINTS, RELATIVE_TWIST, VPG_AS_PUBLISHED};
use crate::report::document::{Block, Section, Table, number};
use crate::results::Results;
use crate::sets::Catalogue;
use crate::statistics::mean;
use crate::trial::Trial;

/// The experiment's name.
pub(crate) const NAME: &str = "ablations";

/// One change.
struct Ablation {
    name: &'static str,
    overrides: &'static [&'static str],
}

/// What can be changed of either form: of the published one, only what the paper leaves to be chosen.
fn ablations(base: &str) -> impl Iterator<Item = &'static Ablation> {
    let free = base == DEFAULT;
    OF_BOTH.iter().chain(FREE.iter().filter(move |_| free))
}

/// What the published form fixes.
const FREE: [Ablation; 5] = [
    Ablation { name: "beta: twist of the relative rotation, as published", overrides: &RELATIVE_TWIST },
    Ablation { name: "gate: divergence alone", overrides: &DIVERGENCE_GATE },
    Ablation { name: "vanishing points: no guided search", overrides: &["similarity.guided_redetection=false"] },
    Ablation { name: "vanishing points: no joint refinement", overrides: &["similarity.joint_refinement=false"] },
    Ablation { name: "vanishing points: each photograph by itself", overrides: &OWN_VANISHING_POINTS },
];

const OF_BOTH: [Ablation; 11] = [
    Ablation { name: "nothing changed", overrides: &[] },
    Ablation { name: "lambda 0 (no relative rolls)", overrides: &["similarity.relative_weight=0"] },
    Ablation { name: "lambda 1", overrides: &["similarity.relative_weight=1"] },
    Ablation { name: "lambda 100", overrides: &["similarity.relative_weight=100"] },
    Ablation { name: "lambda 1e6 (relative rolls alone)", overrides: &["similarity.relative_weight=1e6"] },
    Ablation { name: "tau 0.06 (9.9 deg)", overrides: &["similarity.rejection=0.06"] },
    Ablation { name: "tau 0.12 (14.1 deg)", overrides: &["similarity.rejection=0.12"] },
    Ablation { name: "tau 0.48 (28.4 deg)", overrides: &["similarity.rejection=0.48"] },
    Ablation { name: "tau infinite (no rejection)", overrides: &["similarity.rejection=1e9"] },
    Ablation { name: "no path voting", overrides: &["similarity.path_voting=false"] },
    Ablation { name: "vanishing points: a third of the draws", overrides: &["vanishing.draws=35"] },
];

/// What the changes are made to.
const BASES: [(&str, &[&str]); 2] = [(DEFAULT, &[]), ("published", &VPG_AS_PUBLISHED)];
const DEFAULT: &str = "default";
/// Larger sets are left out: the same changes on many more photographs take most of the time and say the same.
const MAX_PHOTOGRAPHS: usize = 20;

const NOISE_SHARES: [f64; 2] = [0.0, 0.1];
/// Seeds under noise.
const SEEDS: u64 = 2;

fn variant(base: &str, ablation: &Ablation, share: f64) -> String {
    format!("{base}: {}, {:.0} %", ablation.name, 100.0 * share)
}

/// Every change to both forms, without noise and with a little.
pub(crate) fn trials(catalogue: &Catalogue) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for set in &catalogue.study {
        if set.photograph_count()? > MAX_PHOTOGRAPHS {
            continue;
        }
        for (base, base_overrides) in BASES {
            for ablation in ablations(base) {
                for share in NOISE_SHARES {
                    let overrides = [base_overrides, ablation.overrides].concat();
                    let seeds = if share > 0.0 { SEEDS.min(catalogue.seeds) } else { 1 };
                    for seed in 0..seeds {
                        let trial = Trial::new(NAME, &set.name, &variant(base, ablation, share), &overrides);
                        trials.push(Trial { seed, random_directions: share, ..trial });
                    }
                }
            }
        }
    }
    Ok(trials)
}

/// A table per form.
pub(crate) fn section(results: &Results) -> Section {
    let mut section = Section::new(NAME, "Ablations");
    section.say(
        "One part changed at a time, on the study's sets of at most twenty photographs, without noise and with every tenth vanishing \
         direction replaced. The \
         default finds and refines the directions of all photographs together, which hides much of what the paper's parts do; the \
         published form takes each photograph's own and keeps one similarity per photograph.",
    );
    for (base, _) in BASES {
        let caption =
            format!("Changes to the {base} form. Means over the study's sets; worst: the worst photograph of any set.");
        let columns = [
            "change",
            "theta error deg",
            "worst deg",
            "GDIC deg",
            "guided %",
            "theta error deg, 10 % noise",
            "worst deg, 10 % noise",
            "GDIC deg, 10 % noise",
            "guided %, 10 % noise",
        ];
        let mut table = Table::new(&format!("ablations-{base}"), &caption, columns);
        for ablation in ablations(base) {
            let mut cells = vec![ablation.name.to_owned()];
            for share in NOISE_SHARES {
                let values = |measure| {
                    results.values_of_all(NAME, &results.catalogue.study, &variant(base, ablation, share), measure)
                };
                let worst = values("theta_error_max_deg").into_iter().max_by(f64::total_cmp);
                cells.push(number(mean(&values("theta_error_deg")), 3));
                cells.push(number(worst, 2));
                cells.push(number(mean(&values("gdic_deg")), 3));
                cells.push(number(mean(&values("guided")).map(|share| 100.0 * share), 0));
            }
            table.push(cells);
        }
        section.blocks.push(Block::Table(table));
    }
    section
}
