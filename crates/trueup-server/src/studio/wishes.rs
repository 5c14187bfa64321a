//! What a person wishes of a panorama: options that the page offers, photographs left out, masks painted.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use serde::Serialize;
use trueup::{MaskFile, MaskKind, OptionDescription, StitchOptions, Tier};

use super::listed::Listed;

/// Masks of one photograph. The page shows the last of a kind, and paints on that; those of a project that was opened
/// may be more, which count together.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct PaintedMasks {
    /// What is black in it is ignored.
    pub used: Vec<PathBuf>,
    /// What is white in it is kept.
    pub kept: Vec<PathBuf>,
}

impl PaintedMasks {
    /// Those of a kind.
    pub(crate) fn of(&self, kind: MaskKind) -> &[PathBuf] {
        match kind {
            MaskKind::Use => &self.used,
            MaskKind::Keep => &self.kept,
        }
    }

    /// One more of its kind.
    pub(crate) fn add(&mut self, kind: MaskKind, file: PathBuf) {
        self.all_of(kind).push(file);
    }

    /// Puts `file` in the place of the last of its kind; without, takes that away.
    pub(crate) fn paint(&mut self, kind: MaskKind, file: Option<PathBuf>) {
        let masks = self.all_of(kind);
        masks.pop();
        masks.extend(file);
    }

    fn all_of(&mut self, kind: MaskKind) -> &mut Vec<PathBuf> {
        match kind {
            MaskKind::Use => &mut self.used,
            MaskKind::Keep => &mut self.kept,
        }
    }
}

/// All that a person can wish, to be undone as one. Photographs go by their numbers in the session.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Wishes {
    /// Options by their names, `table.option`, as one writes them.
    pub options: BTreeMap<String, String>,
    /// Photographs that are not to be stitched.
    pub left_out: BTreeSet<usize>,
    /// By photograph.
    pub masks: BTreeMap<usize, PaintedMasks>,
}

impl Wishes {
    /// `base` with the options wished for.
    ///
    /// # Errors
    /// If one cannot be, or they do not go together.
    pub(crate) fn options(&self, base: &StitchOptions) -> trueup::Result<StitchOptions> {
        let mut options = base.clone();
        for (name, value) in &self.options {
            options.set(&format!("{name}={value}"))?;
        }
        options.validate()?;
        Ok(options)
    }

    /// Whether the same photographs with the same masks are wished for.
    pub(crate) fn same_photographs(&self, other: &Self) -> bool {
        self.left_out == other.left_out && self.masks == other.masks
    }

    /// The masks, for the library.
    pub(crate) fn mask_files(&self, photographs: &[Listed]) -> Vec<MaskFile> {
        let files =
            self.masks.iter().filter(|(number, _)| !self.left_out.contains(number)).flat_map(|(&number, painted)| {
                let photograph = photographs.get(number).map(|listed| listed.path.display().to_string());
                let of_kind = |kind| painted.of(kind).iter().map(move |file| (file.clone(), kind));
                let both = of_kind(MaskKind::Use).chain(of_kind(MaskKind::Keep));
                both.filter_map(move |(file, kind)| Some(MaskFile { photograph: photograph.clone()?, file, kind }))
            });
        files.collect()
    }
}

/// An option as the page offers it.
#[derive(Debug, Serialize)]
pub(crate) struct Offered {
    #[serde(flatten)]
    pub description: OptionDescription,
    /// The phase of the work that heeds it.
    pub phase: trueup::Phase,
}

/// The options that the page offers: those that people have a reason to change for a panorama of their own, but none of
/// how much of the machine is taken, or where files lie.
pub(crate) fn offered() -> Vec<Offered> {
    let phases: BTreeMap<&str, trueup::Phase> =
        StitchOptions::tables().into_iter().filter_map(|(table, phase)| Some((table, phase?))).collect();
    let basic = StitchOptions::describe().into_iter().filter(|option| option.tier == Tier::Basic);
    let of_a_phase = basic.filter_map(|description| {
        let phase = *phases.get(description.name.split('.').next()?)?;
        Some(Offered { description, phase })
    });
    of_a_phase.collect()
}

/// Whether the page offers an option of this name.
pub(crate) fn is_offered(name: &str) -> bool {
    offered().iter().any(|option| option.description.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_the_machine_is_offered() {
        assert!(is_offered("projection.yaw") && is_offered("stitch.method") && is_offered("canvas.crop"));
        for name in ["resources.scratch", "resources.memory", "resources.cache_bytes", "none.such", "projection"] {
            assert!(!is_offered(name), "{name}");
        }
    }

    #[test]
    fn wishes_are_laid_over_what_was_there() {
        let mut wishes = Wishes::default();
        let mut base = StitchOptions::default();
        base.set("canvas.crop=auto").expect("an option");
        wishes.options.insert("projection.yaw".to_owned(), "-12.5".to_owned());
        let options = wishes.options(&base).expect("options");
        assert_eq!(options.arrange.projection.yaw, -12.5);
        assert_eq!(options.arrange.canvas.crop, base.arrange.canvas.crop);
        for (name, value) in [("projection.yaw", "1000"), ("projection.yaw", "north"), ("canvas.crop", "x=1")] {
            wishes.options.insert(name.to_owned(), value.to_owned());
            assert!(wishes.options(&base).is_err(), "{name}={value}");
        }
    }
}
