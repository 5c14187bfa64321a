//! Makes sets of pictures with exactly known cameras.
#![forbid(unsafe_code)]

mod commands;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use commands::{CutArguments, FlatArguments, LevelArguments, SpecsArguments, StudyArguments};
use trueup_core::{Result, StageContext};
use trueup_scenes::{
    LightQuality, LitScene, Quality, RigOptions, SceneKind, SceneOptions, SetOutput, example_set, rig, write_set,
};

/// Makes photographs with exactly known cameras: rendered, or cut out of panoramas.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Renders one set.
    Render(RenderArguments),
    /// Renders the committed example set.
    Examples {
        /// Folder to write to; the set goes into its own folder there, `room`.
        #[arg(long, default_value = "examples")]
        out: PathBuf,
    },
    /// Renders the study's sets, each into its own folder. What is there already is kept.
    Study(StudyArguments),
    /// Cuts views of known pose out of a panorama.
    Cut(CutArguments),
    /// Photographs something flat by cameras that move along it.
    Flat(FlatArguments),
    /// Measures where the scene's vertical points in panoramas.
    Level(LevelArguments),
    /// Writes specs of views to cut out of panoramas.
    Specs(SpecsArguments),
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    Room,
    Street,
    Nature,
    Boxes,
    TurnedRoom,
    TurnedStreet,
}

/// Options left out keep the library's defaults.
#[derive(Debug, Args)]
struct RenderArguments {
    /// Kind of scene.
    #[arg(long)]
    kind: Option<Kind>,
    /// Seed of scene and cameras.
    #[arg(long)]
    seed: Option<u64>,
    /// Number of pictures.
    #[arg(long)]
    pictures: Option<usize>,
    /// Number of rows.
    #[arg(long)]
    rows: Option<usize>,
    /// Width, pixels.
    #[arg(long)]
    width: Option<usize>,
    /// Height, pixels.
    #[arg(long)]
    height: Option<usize>,
    /// Horizontal field of view, degrees.
    #[arg(long)]
    hfov_deg: Option<f64>,
    /// Turn of the middle of a row, degrees.
    #[arg(long, allow_negative_numbers = true)]
    yaw_deg: Option<f64>,
    /// Turn from picture to picture, degrees.
    #[arg(long, allow_negative_numbers = true)]
    yaw_step_deg: Option<f64>,
    /// Elevation of the middle row, degrees.
    #[arg(long, allow_negative_numbers = true)]
    pitch_deg: Option<f64>,
    /// Standard deviation of the roll, degrees.
    #[arg(long)]
    roll_sd_deg: Option<f64>,
    /// Reach of the camera's wandering as a share of the scene's depth.
    #[arg(long)]
    translation_fraction: Option<f64>,
    /// Standard deviation of the exposure, stops.
    #[arg(long)]
    exposure_sd: Option<f64>,
    /// Stops between the half of the world around the middle of a row, which lies in the sun, and the other half.
    #[arg(long)]
    shade_stops: Option<f64>,
    /// Folder to write to.
    #[arg(long)]
    out: PathBuf,
    /// Small, rough and fast.
    #[arg(long)]
    preview: bool,
}

impl RenderArguments {
    fn options(&self) -> (SceneOptions, RigOptions, Quality) {
        let (mut scene, mut rig) = (SceneOptions::default(), RigOptions::default());
        let mut quality = Quality::Standard;
        if self.preview {
            scene.light = LightQuality::Fast;
            (rig.width, rig.height, quality) = (320, 240, Quality::Preview);
        }
        set(
            &mut scene.kind,
            self.kind.map(|kind| match kind {
                Kind::Room => SceneKind::Room,
                Kind::Street => SceneKind::Street,
                Kind::Nature => SceneKind::Nature,
                Kind::Boxes => SceneKind::Boxes,
                Kind::TurnedRoom => SceneKind::TurnedRoom,
                Kind::TurnedStreet => SceneKind::TurnedStreet,
            }),
        );
        set(&mut scene.seed, self.seed);
        set(&mut rig.seed, self.seed);
        set(&mut rig.pictures, self.pictures);
        set(&mut rig.rows, self.rows);
        set(&mut rig.width, self.width);
        set(&mut rig.height, self.height);
        set(&mut rig.hfov_deg, self.hfov_deg);
        set(&mut rig.yaw_deg, self.yaw_deg);
        set(&mut rig.yaw_step_deg, self.yaw_step_deg);
        set(&mut rig.pitch_deg, self.pitch_deg);
        set(&mut rig.roll_sd_deg, self.roll_sd_deg);
        set(&mut rig.translation_fraction, self.translation_fraction);
        set(&mut rig.exposure_sd, self.exposure_sd);
        set(&mut rig.shade_stops, self.shade_stops);
        (scene, rig, quality)
    }
}

fn set<T>(option: &mut T, given: Option<T>) {
    if let Some(value) = given {
        *option = value;
    }
}

fn main() -> ExitCode {
    match run(&Arguments::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: &Command) -> Result<()> {
    match command {
        Command::Cut(arguments) => arguments.run(),
        Command::Flat(arguments) => arguments.run(),
        Command::Level(arguments) => arguments.run(),
        Command::Specs(arguments) => arguments.run(),
        Command::Render(arguments) => {
            let (scene, rig, quality) = arguments.options();
            write(&arguments.out, &scene, &rig, quality)
        }
        Command::Examples { out } => {
            let (scene, rig) = example_set();
            write(&out.join("room"), &scene, &rig, Quality::Fine)
        }
        Command::Study(arguments) => arguments.run(),
    }
}

fn write(out: &std::path::Path, scene: &SceneOptions, options: &RigOptions, quality: Quality) -> Result<()> {
    use trueup_core::options::OptionValue;
    let source = format!("{} {}", scene.kind.display(), scene.seed);
    let scene = LitScene::new(scene)?;
    let cameras = rig(options, &scene.viewpoint())?;
    let output = SetOutput { quality, depth: false };
    write_set(out, &source, &scene, &cameras, output, &StageContext::default())?;
    println!("{}: {} pictures", out.display(), cameras.len());
    Ok(())
}
