//! `trueup-scenes flat`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use trueup_core::{Result, StageContext};
use trueup_scenes::{FlatSetKind, FlatTexture, flat_rig, write_flat_set};

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// A painted wall, walked along with a hand-held camera: six photographs.
    Mural,
    /// The ground from the air, looking down: three rows of six.
    Drone,
    /// Sheets on a scanner: two rows of three, at one resolution.
    Scans,
}

#[derive(Debug, Args)]
pub(crate) struct FlatArguments {
    /// How the cameras move.
    #[arg(long)]
    kind: Kind,
    /// What is on the plane: a picture; without one, a generated painting.
    #[arg(long)]
    picture: Option<String>,
    /// Seed of the cameras and of the painting.
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Width, pixels.
    #[arg(long, default_value_t = 1000)]
    width: usize,
    /// Height, pixels.
    #[arg(long, default_value_t = 750)]
    height: usize,
    /// Folder to write to.
    #[arg(long)]
    out: PathBuf,
}

impl FlatArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let context = StageContext::default();
        let kind = match self.kind {
            Kind::Mural => FlatSetKind::Mural,
            Kind::Drone => FlatSetKind::Drone,
            Kind::Scans => FlatSetKind::Scans,
        };
        let (source, texture) = match &self.picture {
            Some(picture) => (picture.clone(), FlatTexture::read(kind, picture, &context)?),
            None => (format!("a painting, {}", self.seed), FlatTexture::painting(kind, self.seed)),
        };
        let cameras = flat_rig(kind, u64::from(self.seed), [self.width, self.height]);
        write_flat_set(&self.out, &source, &texture, &cameras, &context)?;
        println!("{}: {} pictures", self.out.display(), cameras.len());
        Ok(())
    }
}
