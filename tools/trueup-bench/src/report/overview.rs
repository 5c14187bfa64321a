//! The sections that say what the report is about.

use super::document::{Block, Claim, Section, Table};
use crate::arguments::PaperArguments;
use crate::build_stamp::BuildStamp;
use crate::results::Results;
use crate::sets::Catalogue;

/// How a report was made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunDescription<'a> {
    /// The build that made it, and every result in it.
    pub stamp: &'a BuildStamp,
    /// What was typed.
    pub arguments: &'a PaperArguments,
    /// Sets worked on at a time.
    pub jobs: usize,
    /// Threads of each.
    pub threads: usize,
    /// Wall time, minutes, since it was started or last went on.
    pub minutes: f64,
    /// Results that an earlier, stopped run of the same build had stored.
    pub resumed: usize,
}

/// What it is, and the claims at a glance.
pub(crate) fn summary(claims: &[Claim], made: &RunDescription) -> Section {
    let mut section = Section::new("summary", "Summary");
    let holding = claims.iter().filter(|claim| claim.holds == Some(true)).count();
    section.say(format!("Made by one build: {}. {holding} of {} claims hold.", made.stamp.in_words(), claims.len()));
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
        "**LD**, local distortion, x 1e-2: how unevenly the cells of a photograph's grid are stretched that lie wholly where nothing \
         overlaps, the mean per photograph, the worst photograph of a set (equations 12 and 13). It grows with the size of the cells: \
         a method with finer cells has a lower LD for the same shape. Photographs whose cameras are not known are judged by the \
         centers of their cells.",
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
pub(crate) fn how_it_was_made(results: &Results, made: &RunDescription) -> Section {
    let mut section = Section::new("made", "How it was made, and what is missing");
    let RunDescription { jobs, threads, minutes, resumed, .. } = made;
    let parts = parts(made.arguments);
    let resumed = match resumed {
        0 => String::new(),
        count => format!(" It went on from {count} results of a stopped run of the same build."),
    };
    section.say(format!(
        "`trueup-bench paper --out DIR`{parts}, built from {}: {} results in {minutes:.0} minutes, {jobs} sets at a time with \
         {threads} threads each.{resumed} Every single result is in `rows.csv` beside this report, every table in a CSV file of \
         its own. The same sets, options and seeds give the same figures for any number of threads; times alone do not come \
         back.",
        made.stamp.in_words(),
        results.rows.len()
    ));
    section.say(
        "The commit and whether sources differed from it are found when the program is built, not when it runs. Built outside of \
         a checkout, a hash of all sources stands for the commit. Results of another build are refused.",
    );
    section.blocks.push(Block::List(
        [
            "The user study cannot be repeated by a machine; `trueup compare` makes its pages and its statistics, and `upright` \
             is what it comes down to.",
            "The paper's own sets are shown only if somebody has them (`--vpg-data DIR`).",
        ]
        .map(str::to_owned)
        .into(),
    ));
    section
}

/// The options that decide which data the report is of; folders are named by what they are, wherever they lie.
fn parts(arguments: &PaperArguments) -> String {
    let given = [
        (arguments.panoramas.is_some(), "--panoramas"),
        (!arguments.truth_sets.is_empty(), "--truth-sets"),
        (!arguments.photographs.is_empty(), "--photographs"),
        (arguments.vpg_data.is_some(), "--vpg-data"),
    ];
    let mut words: Vec<String> =
        given.iter().filter(|(given, _)| *given).map(|(_, option)| format!("`{option} DIR`")).collect();
    if !arguments.only.is_empty() {
        words.push(format!("`--only {}`", arguments.only.join(",")));
    }
    if arguments.quick {
        words.push("`--quick`".to_owned());
    }
    if words.is_empty() { String::new() } else { format!(" with {}", words.join(", ")) }
}
