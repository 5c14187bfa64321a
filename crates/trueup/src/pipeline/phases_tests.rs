//! Every option is changed in turn: exactly its phase and the later ones run again.

use std::path::{Path, PathBuf};

use trueup_core::options::OptionDescription;

use super::*;
use crate::options::Phase;
use crate::test_room::ROOM;

/// Enough to find overlaps and lines, and little to wait for.
const WORKING_PIXELS: &str = "working.pixels=60000";

fn photographs() -> Vec<String> {
    let room = Path::new(ROOM);
    ["02.jpg", "03.jpg"].map(|name| room.join(name).display().to_string()).to_vec()
}

fn quick() -> StitchOptions {
    let mut options = StitchOptions::default();
    options.set(WORKING_PIXELS).expect("an option");
    options
}

/// Some other value of an option that is allowed.
fn changed(base: &StitchOptions, row: &OptionDescription, folder: &Path) -> StitchOptions {
    let number = row.default.parse::<f64>().unwrap_or(f64::NAN);
    let numbers = [1.5 * number, 0.5 * number, number + 1.0, number - 1.0].map(|value| value.to_string());
    let choices = row.choices.iter().map(|choice| choice.name.to_owned());
    let words = ["true", "false", "3GB", "black"].map(str::to_owned);
    let candidates = numbers.into_iter().chain(choices).chain(words).chain([folder.display().to_string()]);
    let assign = |value: String| {
        let mut options = base.clone();
        options.set(&format!("{}={value}", row.name)).ok()?;
        (options.validate().is_ok() && options != *base).then_some(options)
    };
    candidates.filter_map(assign).next().unwrap_or_else(|| panic!("{}: no other value found", row.name))
}

/// How many results of each kind were found and made while the photographs were aligned by `options`.
fn uses(options: &StitchOptions, folder: &Path) -> impl Fn(&str) -> [usize; 2] + use<> {
    let cache = PhotographCache::open(folder, 1e9).expect("a folder");
    let context = StageContext::default();
    let stitcher = Stitcher::new(options, &context).with_cache(Some(&cache));
    // An option may keep the photographs from being joined; what was looked for is counted all the same.
    drop(stitcher.align(&Inputs::new(photographs())));
    let uses = cache.uses();
    move |kind| uses.get(kind).map_or([0, 0], |kind| [kind.found, kind.made])
}

#[test]
fn changing_an_option_runs_exactly_its_phase_and_the_later_ones_again() {
    let desk = tempfile::tempdir().expect("a folder");
    let folder: PathBuf = desk.path().join("cache");
    let base = quick();
    let first = uses(&base, &folder);
    assert_eq!([first("measured"), first("pair"), first("geometry")], [[0, 2], [0, 1], [0, 1]]);
    let tables = StitchOptions::tables();
    let mut counted = [0; 6];
    for row in StitchOptions::describe() {
        let (table, _) = row.name.split_once('.').expect("table.option");
        let (_, phase) = tables.iter().find(|(name, _)| *name == table).expect("a table of a phase");
        let again = uses(&changed(&base, &row, desk.path()), &folder);
        // What is told of a lens takes part in matching, too.
        let tells_of_lenses = ["cameras.lens", "cameras.fov"].contains(&row.name.as_str());
        let first = if tells_of_lenses { &Some(Phase::Match) } else { phase };
        let runs = |of: Phase| first.is_some_and(|first| first <= of);
        let kinds = [("measured", Phase::Measure, 2), ("pair", Phase::Match, 1), ("geometry", Phase::Align, 1)];
        for (kind, of, count) in kinds {
            let [found, made] = again(kind);
            let wrong = format!("{}: {found} of kind {kind} found, {made} made", row.name);
            match runs(of) {
                // Where the photographs are not joined any more, there is no geometry to be looked for.
                true => assert!(found == 0 && (made == count || (made == 0 && kind == "geometry")), "{wrong}"),
                false => assert_eq!([found, made], [count, 0], "{wrong}"),
            }
        }
        counted[phase.map_or(5, |phase| phase as usize)] += 1;
    }
    assert!(counted.iter().all(|&count| count > 0), "options of every phase: {counted:?}");
}

/// What a later phase decides alone makes nothing again of what is costly before it, or beside it.
#[test]
fn another_frame_or_another_light_makes_again_what_it_changes_alone() {
    let desk = tempfile::tempdir().expect("a folder");
    let folder: PathBuf = desk.path().join("cache");
    let made = |assignment: &str| {
        let mut options = quick();
        options.set(assignment).expect("an option");
        let uses = uses(&options, &folder);
        ["stacks", "geometry", "parallax", "light"].map(|kind| uses(kind)[1])
    };
    assert_eq!(made("canvas.crop=auto"), [1; 4], "the first time");
    assert_eq!(made("canvas.crop=none"), [0; 4]);
    assert_eq!(made("projection.kind=cylindrical"), [0; 4]);
    assert_eq!(made("exposure.model=gain"), [0, 0, 0, 1]);
    assert_eq!(made("projection.max_parallax_deg=1"), [0, 0, 1, 0]);
}
