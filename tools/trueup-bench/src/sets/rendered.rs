//! The rendered sets of a run, by what they are for.

use trueup_scenes::{LightQuality, Quality, RigOptions, SceneKind, SceneOptions, SetKind};

use super::spec::{Recipe, SetSpec};

/// Two photographs of one scene, the second turned about its axis.
#[derive(Debug, Clone)]
pub(crate) struct RolledPair {
    /// What is photographed.
    pub scene: &'static str,
    /// By how much the second photograph is turned, clockwise, degrees.
    pub roll_deg: f64,
    /// The set.
    pub set: SetSpec,
}

/// A set of the pitch sweep.
#[derive(Debug, Clone)]
pub(crate) struct PitchSet {
    /// Mean elevation of its cameras, degrees.
    pub pitch_deg: f64,
    /// The set.
    pub set: SetSpec,
}

/// A set of the study with metadata that claim a wrong focal length.
#[derive(Debug, Clone)]
pub(crate) struct FocalSet {
    /// Claimed over true focal length.
    pub factor: f64,
    /// Name of the set it is a copy of.
    pub original: String,
    /// The copy.
    pub set: SetSpec,
}

/// A few small sets that are rendered in seconds.
pub(super) fn quick_sets() -> Vec<SetSpec> {
    const SETS: usize = 4;
    let one = |index: usize| {
        let kind = if index.is_multiple_of(2) { SceneKind::Room } else { SceneKind::Street };
        let seed = 300 + index as u64;
        let scene = SceneOptions { kind, seed, light: LightQuality::Fast, ..SceneOptions::default() };
        let rig = RigOptions {
            seed,
            pictures: 6,
            width: 640,
            height: 480,
            pitch_deg: 5.0,
            roll_sd_deg: 6.0,
            ..RigOptions::default()
        };
        let recipe = Recipe { scene, rig, quality: Quality::Preview, second_roll_deg: 0.0 };
        SetSpec::rendered(format!("quick/{:02}", index + 1), Some(true), recipe)
    };
    (0..SETS).map(one).collect()
}

/// The sets of a kind, named `folder/01` and so on.
pub(super) fn rendered_sets(kind: SetKind, folder: &str, manhattan: Option<bool>) -> Vec<SetSpec> {
    (1..=kind.count()).filter_map(|number| SetSpec::catalogue(kind, number, folder, manhattan)).collect()
}

/// Sets of each class for the gate, as many as in the paper.
pub(super) const EACH_GATE_CLASS: usize = 65;
/// Constants of the gate were chosen by sets up to this number; those above are new to it.
const LAST_SEEN: usize = 65;

/// Sets for the gate with dominant directions, and as many without: `each` of a class, half of them (the smaller half)
/// held out. A quick version draws them roughly.
pub(super) fn gate_sets(each: usize, quick: bool) -> Vec<SetSpec> {
    let classes = [(SetKind::GateManhattan, "gate/manhattan", true), (SetKind::GateRandom, "gate/random", false)];
    let of_class = |(kind, folder, manhattan): (SetKind, &str, bool)| -> Vec<SetSpec> {
        let one = |number| {
            let held_out = number > LAST_SEEN;
            if !quick {
                let set = SetSpec::catalogue(kind, number, folder, Some(manhattan))?;
                return Some(SetSpec { held_out, ..set });
            }
            let (scene, rig) = kind.set(number)?;
            let recipe = Recipe { scene, rig, quality: Quality::Preview, second_roll_deg: 0.0 };
            let set = SetSpec::rendered(format!("quick-{folder}-{number:02}"), Some(manhattan), recipe);
            Some(SetSpec { held_out, ..set })
        };
        let (seen, new) = (each.div_ceil(2), each / 2);
        (1..=seen).chain(LAST_SEEN + 1..=LAST_SEEN + new).filter_map(one).collect()
    };
    classes.into_iter().flat_map(of_class).collect()
}

/// A room and a street in two photographs each, the second turned by 0 to 60 degrees: the paper's figure 1.
pub(super) fn rolled_pairs() -> Vec<RolledPair> {
    let mut pairs = Vec::new();
    for (kind, scene, seed) in [(SceneKind::Room, "room", 801), (SceneKind::Street, "street", 802)] {
        for roll_deg in [0.0, 10.0, 20.0, 30.0, 45.0, 60.0] {
            let options = SceneOptions { kind, seed, light: LightQuality::Standard, ..SceneOptions::default() };
            let rig = RigOptions {
                seed,
                pictures: 2,
                width: 800,
                height: 600,
                yaw_step_deg: 26.0,
                pitch_deg: 4.0,
                roll_sd_deg: 0.0,
                translation_fraction: 0.0,
                ..RigOptions::default()
            };
            let recipe = Recipe { scene: options, rig, quality: Quality::Standard, second_roll_deg: roll_deg };
            let set = SetSpec::rendered(format!("rolled/{scene}-{roll_deg:02.0}"), Some(true), recipe);
            pairs.push(RolledPair { scene, roll_deg, set });
        }
    }
    pairs
}

pub(super) fn pitch_sets() -> Vec<PitchSet> {
    let mut sets = Vec::new();
    for pitch_deg in [0.0, 10.0, 20.0, 30.0, 40.0] {
        for (kind, name) in [(SceneKind::Room, "room"), (SceneKind::Street, "street")] {
            for seed in 701..=702 {
                let light = LightQuality::Standard;
                let scene = SceneOptions { kind, seed, light, ..SceneOptions::default() };
                let rig = RigOptions {
                    seed,
                    pictures: 7,
                    width: 800,
                    height: 600,
                    pitch_deg,
                    yaw_step_deg: 22.0,
                    roll_sd_deg: 6.0,
                    ..RigOptions::default()
                };
                let recipe = Recipe { scene, rig, quality: Quality::Standard, second_roll_deg: 0.0 };
                let set = SetSpec::rendered(format!("pitch/{name}-{pitch_deg:02.0}-{seed}"), Some(true), recipe);
                sets.push(PitchSet { pitch_deg, set });
            }
        }
    }
    sets
}

/// Copies of a room, of one with parallax, and of a street, with claims from 0.7 to 1.4 of the truth.
pub(super) fn focal_sets(study: &[SetSpec]) -> Vec<FocalSet> {
    const FACTORS: [f64; 7] = [0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4];
    let originals = [0, 3, 6].into_iter().filter_map(|index| study.get(index));
    let copies = |original: &SetSpec| {
        FACTORS.map(|factor| FocalSet {
            factor,
            original: original.name.clone(),
            set: original.with_focal_claim(factor),
        })
    };
    originals.flat_map(copies).collect()
}
