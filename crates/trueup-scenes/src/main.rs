//! Makes sets of pictures with exactly known cameras.
#![forbid(unsafe_code)]

mod commands;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use commands::{CutArguments, LevelArguments, SpecsArguments};
use trueup_core::{Error, Result, StageContext};
use trueup_scenes::{
    LightQuality, Quality, RigOptions, Scene, SceneKind, SceneOptions, example_set, rig, study_set, write_set,
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
    /// Renders the study's synthetic sets, each into its own folder.
    Study {
        /// Folder to write to.
        #[arg(long)]
        out: PathBuf,
        /// Only these sets, 1 to 12; all when absent.
        #[arg(long, value_delimiter = ',')]
        sets: Vec<usize>,
    },
    /// Cuts views of known pose out of a panorama.
    Cut(CutArguments),
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
        Command::Study { out, sets } => {
            let numbers = if sets.is_empty() { (1..=12).collect() } else { sets.clone() };
            for number in numbers {
                let (scene, rig) = study_set(number).ok_or_else(|| {
                    Error::input(format!("set {number}"), "there is no such set", "Choose from 1 to 12.")
                })?;
                write(&out.join(format!("{number:02}")), &scene, &rig, Quality::Standard)?;
            }
            Ok(())
        }
    }
}

fn write(out: &std::path::Path, scene: &SceneOptions, options: &RigOptions, quality: Quality) -> Result<()> {
    use trueup_core::options::OptionValue;
    let source = format!("{} {}", scene.kind.display(), scene.seed);
    let scene = Scene::new(scene)?;
    let cameras = rig(options, &scene.viewpoint())?;
    write_set(out, &source, &scene, &cameras, quality, &StageContext::default())?;
    println!("{}: {} pictures", out.display(), cameras.len());
    Ok(())
}
