//! `trueup-scenes specs`.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use clap::Args;
use trueup_core::{Error, Result, StageContext};
use trueup_scenes::cut::{Panorama360, SpecKind, SpecOptions, find_panoramas, make_spec, measure_level};

use super::level::Trust;
use super::words::describe;

/// Options left out keep the library's defaults.
#[derive(Debug, Args)]
pub(crate) struct SpecsArguments {
    /// Equirectangular panoramas of 360 x 180 degrees: files, folders, patterns.
    #[arg(required = true)]
    panoramas: Vec<String>,
    /// Folder to write to: NAME-KIND.json.
    #[arg(long)]
    out: PathBuf,
    /// Seed of every random choice.
    #[arg(long)]
    seed: Option<u64>,
    /// Kinds of sets: row, tilt, grid, full, few; few2, few3, ...; pitch0, pitch10, ...; pitch for a sweep of these.
    #[arg(long, value_delimiter = ',', default_values_t = ["row", "tilt", "grid", "full", "few"].map(str::to_owned))]
    kinds: Vec<String>,
    /// Where the views look in the panoramas, degrees.
    #[arg(long, allow_negative_numbers = true)]
    yaw: Option<f64>,
    #[command(flatten)]
    trust: Trust,
}

impl SpecsArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let context = StageContext::default();
        let defaults = SpecOptions::default();
        let options = SpecOptions {
            seed: self.seed.unwrap_or(defaults.seed),
            yaw_deg: self.yaw.unwrap_or(defaults.yaw_deg),
            ..defaults
        };
        let kinds = self.kinds.iter().map(|word| SpecKind::of_word(word)).collect::<Result<Vec<_>>>()?.concat();
        let images = find_panoramas(&self.panoramas, &context)?;
        fs::create_dir_all(&self.out).map_err(|error| Error::io("making the folder", &self.out, error))?;
        let mut written = BTreeSet::new();
        for image in images {
            let panorama = Panorama360::decode(&image)?;
            let level = measure_level(&panorama, &self.trust.options(), &context)?;
            for &kind in &kinds {
                let spec = make_spec(&panorama, kind, &level, &options)?;
                let file = format!("{}-{kind}.json", spec.pano.as_deref().unwrap_or_default());
                if !written.insert(file.clone()) {
                    let reason = format!("{file} is already written for another panorama or a kind given twice");
                    return Err(Error::input(panorama.name(), reason, "Give each panorama a name of its own."));
                }
                spec.write(&self.out.join(file))?;
            }
            println!("{}: {} specs; level {}", panorama.name(), kinds.len(), describe(&level));
        }
        Ok(())
    }
}
