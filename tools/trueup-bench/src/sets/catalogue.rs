//! Which sets the experiments run on.

use std::path::{Path, PathBuf};

use trueup::{Result, StageContext};
use trueup_scenes::SetKind;
use trueup_scenes::cut::find_panoramas;

use super::folders::name_of;
use super::ready::truth_folders;
use super::rendered::{
    EACH_GATE_CLASS, FocalSet, PitchSet, RolledPair, focal_sets, gate_sets, pitch_sets, quick_sets, rendered_sets,
    rolled_pairs,
};
use super::spec::{SetSource, SetSpec, refuse_known};
use super::{from_panorama, photographs};

/// The sets of a run, by what they are for.
#[derive(Debug, Default)]
pub(crate) struct Catalogue {
    /// The study's synthetic sets, 01 to 12.
    pub study: Vec<SetSpec>,
    /// The same cameras in scenes without dominant directions.
    pub twins: Vec<SetSpec>,
    /// Sets with one vertical and horizontals at free angles.
    pub mixed: Vec<SetSpec>,
    /// Sets cut from panoramas, or given with their truth, or of the authors' own data set.
    pub given: Vec<SetSpec>,
    /// Photographs of which nothing is known.
    pub photographs: Vec<SetSpec>,
    /// Many small sets with and without dominant directions. Half of each class is held out: nothing was chosen by
    /// them.
    pub gate: Vec<SetSpec>,
    /// Pairs of which one photograph is turned.
    pub rolled: Vec<RolledPair>,
    /// Sets that differ in how far up the cameras look.
    pub pitch: Vec<PitchSet>,
    /// Sets of the study whose metadata are wrong.
    pub focal: Vec<FocalSet>,
    /// Short names of the study's sets that every photograph in turn is the reference of.
    pub reference_sets: Vec<&'static str>,
    /// Number of seeds of the noise on vanishing directions.
    pub seeds: u64,
}

/// Folders that the user gave.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GivenFolders<'a> {
    /// Panoramas to cut sets from.
    pub panoramas: Option<&'a Path>,
    /// Folders of folders with their `truth.json`.
    pub truth_sets: &'a [PathBuf],
    /// Folders of photographs, or of such folders.
    pub photographs: &'a [PathBuf],
    /// The authors' own data set.
    pub vpg_data: Option<&'a Path>,
}

impl Catalogue {
    /// The sets of the whole study, and what `folders` hold.
    ///
    /// # Errors
    /// Those of reading the folders.
    pub(crate) fn full(folders: &GivenFolders) -> Result<Self> {
        let study = rendered_sets(SetKind::Manhattan, "study", Some(true));
        Ok(Self {
            focal: focal_sets(&study),
            study,
            given: given_sets(folders)?,
            photographs: photographs::sets("photographs", folders.photographs)?,
            rolled: rolled_pairs(),
            twins: rendered_sets(SetKind::Twins, "twins", Some(false)),
            mixed: rendered_sets(SetKind::Mixed, "mixed", None),
            gate: gate_sets(EACH_GATE_CLASS, false),
            pitch: pitch_sets(),
            reference_sets: vec!["03", "05", "08", "11"],
            seeds: 5,
        })
    }

    /// A few small sets that are rendered in seconds.
    pub(crate) fn quick() -> Self {
        const EACH_QUICK_CLASS: usize = 6;
        let study = quick_sets();
        Self {
            focal: focal_sets(&study),
            study,
            gate: gate_sets(EACH_QUICK_CLASS, true),
            reference_sets: vec!["01", "02"],
            seeds: 2,
            ..Self::default()
        }
    }

    /// Every set.
    pub(crate) fn all(&self) -> Vec<&SetSpec> {
        let pitch = self.pitch.iter().map(|one| &one.set);
        let focal = self.focal.iter().map(|one| &one.set);
        let rolled = self.rolled.iter().map(|one| &one.set);
        let plain = [&self.study, &self.twins, &self.mixed, &self.given, &self.photographs, &self.gate];
        plain.into_iter().flatten().chain(pitch).chain(focal).chain(rolled).collect()
    }
}

/// The sets cut from panoramas and those inside the given folders, named after theirs.
fn given_sets(folders: &GivenFolders) -> Result<Vec<SetSpec>> {
    let mut sets: Vec<SetSpec> = folders.panoramas.map_or_else(|| Ok(Vec::new()), cut_sets)?;
    sets.extend(
        folders.vpg_data.map_or_else(|| Ok(Vec::new()), |folder| photographs::sets("vpg", &[folder.to_owned()]))?,
    );
    for parent in folders.truth_sets {
        for folder in truth_folders(parent)? {
            let name = format!("given/{}", name_of(&folder));
            refuse_known(&sets, &name, &folder)?;
            sets.push(SetSpec::folder(name, folder));
        }
    }
    Ok(sets)
}

/// The sets of a folder's panoramas.
///
/// # Errors
/// Those of [`find_panoramas`].
fn cut_sets(folder: &Path) -> Result<Vec<SetSpec>> {
    let found = find_panoramas(&[folder.display().to_string()], &StageContext::default())?;
    let each = |path: &Path| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let source = path.to_owned();
        from_panorama::KINDS.map(|(kind, _)| SetSpec {
            name: format!("given/{stem}-{kind}"),
            content: format!("{kind} cut from {stem}"),
            manhattan: None,
            held_out: false,
            source: SetSource::Cut(source.clone(), kind),
        })
    };
    Ok(found.iter().flat_map(|image| each(&image.path)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes a panorama of one middle gray.
    fn write_gray_png(path: &Path, width: u32, height: u32) {
        let file = std::fs::File::create(path).expect("a file");
        let mut writer = png::Encoder::new(file, width, height).write_header().expect("a header");
        writer.write_image_data(&vec![128; (width * height) as usize]).expect("written");
    }

    #[test]
    fn every_set_has_a_name_of_its_own() {
        for catalogue in [Catalogue::full(&GivenFolders::default()).expect("no folders"), Catalogue::quick()] {
            let mut names: Vec<&str> = catalogue.all().iter().map(|set| set.name.as_str()).collect();
            let count = names.len();
            assert!(count > 12, "{count} sets");
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), count);
        }
    }

    #[test]
    fn the_gate_has_as_many_sets_as_in_the_paper() {
        let catalogue = Catalogue::full(&GivenFolders::default()).expect("no folders");
        let manhattan = catalogue.gate.iter().filter(|set| set.manhattan == Some(true)).count();
        assert_eq!((catalogue.study.len(), catalogue.gate.len(), manhattan), (12, 130, 65));
        let held_out = |set: &&SetSpec| set.held_out && set.manhattan == Some(true);
        assert_eq!(catalogue.gate.iter().filter(held_out).count(), 32);
        assert_eq!(Catalogue::quick().gate.iter().filter(held_out).count(), 3);
    }

    #[test]
    fn views_are_counted_as_they_are_cut_and_are_not_cut_again() {
        let folder = tempfile::tempdir().expect("folder");
        let panoramas = folder.path().join("panoramas");
        std::fs::create_dir(&panoramas).expect("folder");
        write_gray_png(&panoramas.join("gray.png"), 256, 128);
        let (data, context) = (folder.path().join("data"), StageContext::default());
        let sets = cut_sets(&panoramas).expect("panoramas");
        assert_eq!(sets.len(), from_panorama::KINDS.len());
        for set in sets {
            let ready = set.prepare(&data, &context).expect("cut");
            assert!(!ready.photographs.is_empty(), "{}", set.name);
            assert_eq!(ready.photographs.len(), set.photograph_count().expect("count"), "{}", set.name);
            // What is there is taken as it is.
            std::fs::remove_file(&ready.photographs[0]).expect("removed");
            let again = set.prepare(&data, &context).expect("there");
            assert_eq!(again.truth, ready.truth);
            assert_ne!(again.fingerprint, ready.fingerprint);
            assert!(!Path::new(&ready.photographs[0]).exists());
        }
    }
}
