//! Which sets the experiments run on.

use std::path::{Path, PathBuf};

use trueup::{Error, Result};
use trueup_scenes::{LightQuality, Quality, RigOptions, SceneKind, SceneOptions, study_set};

use super::{Recipe, SetSpec, from_panorama, truth_folders};

/// The sets of a run, by what they are for.
#[derive(Debug, Default)]
pub(crate) struct Catalogue {
    /// The study's synthetic sets, 01 to 12.
    pub study: Vec<SetSpec>,
    /// Sets cut from panoramas, or given with their truth.
    pub given: Vec<SetSpec>,
    /// Many small sets with and without dominant directions.
    pub gate: Vec<SetSpec>,
    /// Sets that differ in how far up the cameras look.
    pub pitch: Vec<PitchSet>,
    /// Sets of the study whose metadata are wrong.
    pub focal: Vec<FocalSet>,
    /// Short names of the study's sets that every picture in turn is the reference of.
    pub reference_sets: Vec<&'static str>,
    /// Number of seeds of the noise on vanishing directions.
    pub seeds: u64,
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

/// Sets of the gate experiment with dominant directions, and as many without: 130 in all, as in the paper.
const GATE_SETS: usize = 65;

impl Catalogue {
    /// The sets of the whole study; `panoramas` is a folder of panoramas to cut sets from, `truth_sets` are folders that
    /// hold given ones.
    ///
    /// # Errors
    /// Those of reading the folders.
    pub(crate) fn full(panoramas: Option<&Path>, truth_sets: &[PathBuf]) -> Result<Self> {
        let study = (1..=12).filter_map(|number| {
            let (scene, rig) = study_set(number)?;
            let recipe = Recipe { scene, rig, quality: Quality::Standard };
            Some(SetSpec::rendered(format!("study/{number:02}"), true, recipe))
        });
        let study: Vec<SetSpec> = study.collect();
        Ok(Self {
            focal: focal_sets(&study),
            study,
            given: given_sets(panoramas, truth_sets)?,
            gate: (0..GATE_SETS).flat_map(|index| [gate_set(true, index), gate_set(false, index)]).collect(),
            pitch: pitch_sets(),
            reference_sets: vec!["03", "05", "08", "11"],
            seeds: 10,
        })
    }

    /// A few small sets that are rendered in seconds.
    pub(crate) fn quick() -> Self {
        const SETS: usize = 4;
        const EACH_GATE_CLASS: usize = 6;
        let study = (0..SETS).map(|index| {
            let kind = if index % 2 == 0 { SceneKind::Room } else { SceneKind::Street };
            let mut recipe = small(kind, 300 + index as u64, 7);
            recipe.rig.pitch_deg = 5.0;
            SetSpec::rendered(format!("quick/{:02}", index + 1), true, recipe)
        });
        Self {
            study: study.collect(),
            gate: (0..EACH_GATE_CLASS).flat_map(|index| [gate_set(true, index), gate_set(false, index)]).collect(),
            reference_sets: vec!["01", "02"],
            seeds: 3,
            ..Self::default()
        }
    }

    /// Every set.
    pub(crate) fn all(&self) -> Vec<&SetSpec> {
        let pitch = self.pitch.iter().map(|one| &one.set);
        let focal = self.focal.iter().map(|one| &one.set);
        self.study.iter().chain(&self.given).chain(&self.gate).chain(pitch).chain(focal).collect()
    }
}

fn gate_set(manhattan: bool, index: usize) -> SetSpec {
    let kind = match (manhattan, index % 2) {
        (true, 0) => SceneKind::Room,
        (true, _) => SceneKind::Street,
        (false, _) => SceneKind::Nature,
    };
    let class = if manhattan { "manhattan" } else { "other" };
    SetSpec::rendered(format!("gate/{class}-{index:02}"), manhattan, small(kind, 500 + index as u64, 6))
}

fn small(kind: SceneKind, seed: u64, pictures: usize) -> Recipe {
    let scene = SceneOptions { kind, seed, light: LightQuality::Fast };
    let rig = RigOptions { seed, pictures, width: 480, height: 360, roll_sd_deg: 6.0, ..RigOptions::default() };
    Recipe { scene, rig, quality: Quality::Preview }
}

fn pitch_sets() -> Vec<PitchSet> {
    let mut sets = Vec::new();
    for pitch_deg in [0.0, 10.0, 20.0, 30.0, 40.0] {
        for (kind, name) in [(SceneKind::Room, "room"), (SceneKind::Street, "street")] {
            for seed in 701..=702 {
                let scene = SceneOptions { kind, seed, ..SceneOptions::default() };
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
                let recipe = Recipe { scene, rig, quality: Quality::Standard };
                let set = SetSpec::rendered(format!("pitch/{name}-{pitch_deg:02.0}-{seed}"), true, recipe);
                sets.push(PitchSet { pitch_deg, set });
            }
        }
    }
    sets
}

/// Copies of a room, of one with parallax, and of a street, with claims from 0.7 to 1.4 of the truth.
fn focal_sets(study: &[SetSpec]) -> Vec<FocalSet> {
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

/// The sets cut from panoramas and those inside the given folders, named after theirs.
fn given_sets(panoramas: Option<&Path>, parents: &[PathBuf]) -> Result<Vec<SetSpec>> {
    let mut sets: Vec<SetSpec> = panoramas.map_or_else(|| Ok(Vec::new()), from_panorama::sets)?;
    for parent in parents {
        for folder in truth_folders(parent)? {
            let name = format!("given/{}", name_of(&folder));
            if sets.iter().any(|known| known.name == name) {
                let hint = "Give the folders of sets names of their own.";
                return Err(Error::input(folder.display(), "there are two sets of this name", hint));
            }
            sets.push(SetSpec::folder(name, folder));
        }
    }
    Ok(sets)
}

fn name_of(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_has_a_name_of_its_own() {
        for catalogue in [Catalogue::full(None, &[]).expect("no folders"), Catalogue::quick()] {
            let mut names: Vec<&str> = catalogue.all().iter().map(|set| set.name.as_str()).collect();
            let count = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), count);
        }
    }

    #[test]
    fn the_gate_has_as_many_sets_as_in_the_paper() {
        let catalogue = Catalogue::full(None, &[]).expect("no folders");
        let manhattan = catalogue.gate.iter().filter(|set| set.manhattan == Some(true)).count();
        assert_eq!((catalogue.study.len(), catalogue.gate.len(), manhattan), (12, 130, 65));
    }
}
