//! What is compared: names and the options that make them.

use trueup::{Method, StitchOptions};
use trueup_align::projection::Projection;
use trueup_compose::layout::Crop;
use trueup_core::options::OptionValue;
use trueup_core::{Error, Result};

/// The option that chooses a method.
const METHOD: &str = "stitch.method";

/// One panorama to be made: a name, and departures from the options that all have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ComparisonEntry {
    /// Its name, unlike all others.
    pub name: String,
    /// What it is, in one sentence.
    pub meaning: String,
    /// Departures, each `table.option=value`.
    pub overrides: Vec<String>,
}

impl ComparisonEntry {
    /// Every method that exists, in the order of `stitch.method`.
    pub fn methods() -> Vec<Self> {
        let of_method = |name: &str, meaning: &str| Self {
            name: name.to_owned(),
            meaning: meaning.to_owned(),
            overrides: vec![format!("{METHOD}={name}")],
        };
        Method::described_choices().iter().map(|choice| of_method(choice.name, &choice.meaning)).collect()
    }

    /// The method of this name.
    ///
    /// # Errors
    /// [`Error::Input`] if there is none.
    pub fn method(name: &str) -> Result<Self> {
        Self::methods().into_iter().find(|entry| entry.name == name).ok_or_else(|| {
            let known = Method::choices().join(", ");
            let reason = format!("there is no such method; there are {known}");
            Error::input(name, reason, "Choose one of them.")
        })
    }

    /// Reads `NAME: table.option=value, table.option=value`.
    ///
    /// # Errors
    /// [`Error::Input`] if the name or the options are missing. Whether there are such options is found by
    /// [`Self::options`].
    pub fn parse(text: &str) -> Result<Self> {
        let wrong = |reason: &str| Error::input(text, reason, "Write NAME: table.option=value, table.option=value.");
        let (name, overrides) = text.split_once(':').ok_or_else(|| wrong("there is no \":\" after a name"))?;
        let name = name.trim();
        let overrides: Vec<String> =
            overrides.split(',').map(|one| one.trim().to_owned()).filter(|one| !one.is_empty()).collect();
        if name.is_empty() {
            return Err(wrong("there is no name before the \":\""));
        }
        if overrides.is_empty() {
            return Err(wrong("there are no options after the \":\""));
        }
        let meaning = format!("The common options with {}.", overrides.join(", "));
        Ok(Self { name: name.to_owned(), meaning, overrides })
    }

    /// The common options with this entry's departures.
    ///
    /// Shapes are compared: with `projection.kind` at its default, the panorama is the mesh that was solved, unless the
    /// entry itself says `projection.kind=auto`. A view chosen for the scene would show the cameras, which all entries
    /// have alike. With `canvas.crop` at its default, all of the shape is shown, likewise.
    ///
    /// # Errors
    /// [`Error::Input`] for a departure that cannot be, or that changes how photographs are measured and matched, which
    /// all entries share; [`Error::Options`] for values out of range.
    pub fn options(&self, common: &StitchOptions) -> Result<StitchOptions> {
        let mut options = common.clone();
        if options.arrange.projection.kind == Projection::Auto {
            options.arrange.projection.kind = Projection::Mesh;
        }
        if options.arrange.canvas.crop == Crop::Auto {
            options.arrange.canvas.crop = Crop::None;
        }
        for assignment in &self.overrides {
            options.set(assignment)?;
            if !options.matches_alike(common) {
                return Err(Error::input(
                    assignment,
                    format!("\"{}\" cannot depart in it: all that is compared shares features and matches", self.name),
                    "Set it for all with --set.",
                ));
            }
        }
        options.validate()?;
        Ok(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_an_entry_with_valid_options_and_a_meaning() {
        let common = StitchOptions::default();
        let methods = ComparisonEntry::methods();
        assert_eq!(methods.iter().map(|entry| entry.name.as_str()).collect::<Vec<_>>(), Method::choices());
        for entry in methods {
            let options = entry.options(&common).expect("valid");
            assert_eq!(options.align.stitch.method.display(), entry.name);
            assert!(!entry.meaning.is_empty(), "{} has no meaning", entry.name);
            assert_eq!(ComparisonEntry::method(&entry.name).expect("known"), entry);
        }
        assert!(ComparisonEntry::method("magic").expect_err("no such method").to_string().contains("no such method"));
    }

    #[test]
    fn an_entry_is_a_name_and_options() {
        let entry = ComparisonEntry::parse(" thin mesh : mesh.cell_px=20, mesh.subdivision=1").expect("well formed");
        assert_eq!(entry.name, "thin mesh");
        assert_eq!(entry.overrides, ["mesh.cell_px=20", "mesh.subdivision=1"]);
        let options = entry.options(&StitchOptions::default()).expect("valid");
        assert_eq!((options.align.mesh.cell_px, options.align.mesh.subdivision), (20.0, 1));
        for (text, reason) in
            [("mesh.cell_px=20", "no \":\""), (": mesh.cell_px=20", "no name"), ("thin:", "no options")]
        {
            assert!(ComparisonEntry::parse(text).expect_err("must fail").to_string().contains(reason), "{text}");
        }
    }

    #[test]
    fn what_all_share_cannot_depart() {
        let common = StitchOptions::default();
        for shared in
            ["matching.max_distance_ratio=0.5", "features.peak_threshold=1", "working.pixels=100000", "random.seed=3"]
        {
            let entry = ComparisonEntry::parse(&format!("other: {shared}")).expect("well formed");
            assert!(entry.options(&common).expect_err("shared").to_string().contains("shares features"), "{shared}");
        }
        assert!(ComparisonEntry::parse("x: mesh.cell=3").expect("well formed").options(&common).is_err());
        assert!(ComparisonEntry::parse("x: mesh.cell_px=-3").expect("well formed").options(&common).is_err());
    }
}
