use super::posterior::{EstimatedRoll, RollsInput, estimated_rolls};
use super::synthetic::{Sweep, SyntheticScene, World};
use super::tests::with_lines;
use super::*;

fn rolls(scene: &SyntheticScene, method: PriorMethod) -> Option<Vec<Option<EstimatedRoll>>> {
    let vanishing = crate::vanishing::VanishingOptions::default();
    let input = PriorInput { method, ..scene.input(&vanishing) };
    let prior = run(&input, &SimilarityOptions::default(), &StageContext::default()).expect("a well-formed scene");
    estimated_rolls(&RollsInput {
        cameras: &scene.cameras,
        edges: &scene.edges,
        lines: &scene.lines,
        frames: &scene.frames,
        prior: &prior,
    })
}

fn scene(seed: u64) -> SyntheticScene {
    let world = World::Manhattan { noise_deg: 1.0, bad_share: 0.0 };
    with_lines(SyntheticScene::new(Sweep::default(), world, 0.0, seed), 20, 0.5)
}

/// Of the true rolls 95 % are to lie within the intervals, which in the mean are no wider than a lean that is seen.
/// With lines that guided and with lines that did not.
#[test]
fn true_rolls_lie_within_the_intervals_as_often_as_these_say() {
    for method in [PriorMethod::VanishingPoints, PriorMethod::Straightening] {
        let (mut holding, mut stated, mut widths) = (0_u32, 0_u32, 0.0);
        for seed in 0..96 {
            let scene = scene(seed);
            let found = rolls(&scene, method).expect("vertical lines in every photograph");
            for (roll, truth) in found.iter().zip(&scene.roll) {
                let roll = roll.expect("level photographs");
                assert!(roll.standard_error < roll.within, "{roll:?}");
                widths += roll.within.to_degrees();
                holding += u32::from(wrap_angle(roll.roll - truth).abs() <= roll.within);
                stated += 1;
            }
        }
        assert!(widths / f64::from(stated) < 1.0, "{method:?}: {widths} degrees of {stated}");
        let share = f64::from(holding) / f64::from(stated);
        assert!((0.9..=1.0).contains(&share) && stated >= 100, "{method:?}: {holding} of {stated}");
    }
}

/// A line that is found twice tells no more than once: were its pieces independent, intervals would shrink to 0.71.
#[test]
fn pieces_of_a_line_are_one_line() {
    let once = scene(3);
    let mut twice = once.clone();
    for lines in &mut twice.lines {
        lines.extend_from_within(..);
    }
    let [once, twice] = [once, twice].map(|scene| rolls(&scene, PriorMethod::VanishingPoints).expect("vertical lines"));
    for (once, twice) in once.into_iter().flatten().zip(twice.into_iter().flatten()) {
        assert!((once.within - twice.within).abs() < 0.05 * once.within, "{once:?} {twice:?}");
    }
}

#[test]
fn one_photograph_with_lines_tells_nothing() {
    let mut scene = scene(5);
    for lines in &mut scene.lines[1..] {
        lines.clear();
    }
    assert_eq!(rolls(&scene, PriorMethod::Straightening), None);
}

/// Two photographs cannot tell a slope, which tilts them by about a degree; what they state holds it all the same.
#[test]
fn what_a_slope_may_tilt_a_pair_by_is_stated() {
    let world = World::Manhattan { noise_deg: 0.5, bad_share: 0.0 };
    let level = with_lines(SyntheticScene::new(Sweep { count: 2, ..Sweep::default() }, world, 0.0, 13), 20, 0.5);
    let widest = |scene: &SyntheticScene| {
        let found = rolls(scene, PriorMethod::VanishingPoints).expect("vertical lines in both photographs");
        found.iter().flatten().map(|roll| roll.within.to_degrees()).fold(0.0, f64::max)
    };
    let sloping = level.on_a_slope(2.5);
    let found = rolls(&sloping, PriorMethod::VanishingPoints).expect("vertical lines in both photographs");
    for (roll, truth) in found.iter().flatten().zip(&sloping.roll) {
        assert!(wrap_angle(roll.roll - truth).abs() <= roll.within, "{roll:?}, true {truth}");
    }
    assert!(widest(&level) < widest(&sloping), "{} {}", widest(&level), widest(&sloping));
}
