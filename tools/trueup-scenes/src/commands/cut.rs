//! `trueup-scenes cut`.

use std::path::PathBuf;

use clap::Args;
use trueup_core::{Result, StageContext};
use trueup_scenes::cut::{CutSpec, Panorama360, cut_set, measure_level};

use super::level::Trust;
use super::words::{describe, print_findings};

#[derive(Debug, Args)]
pub(crate) struct CutArguments {
    /// Equirectangular panorama of 360 x 180 degrees: JPEG, PNG, TIFF or WebP.
    panorama: String,
    /// Which views to cut; see docs/cut.md. Without `down` in it the vertical is measured.
    #[arg(long)]
    spec: PathBuf,
    /// Folder to write to.
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    trust: Trust,
}

impl CutArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let context = StageContext::default();
        let mut spec = CutSpec::read(&self.spec)?;
        let panorama = Panorama360::read(&self.panorama, &context)?;
        if spec.down.is_none() {
            spec.set_level(measure_level(&panorama, &self.trust.options(), &context)?);
        }
        let truth = cut_set(&panorama, &spec, &self.out, &context)?;
        print_findings(&context);
        println!("{}: {} pictures", self.out.display(), truth.images.len());
        if let Some(level) = &truth.level {
            println!("level {}", describe(level));
        }
        Ok(())
    }
}
