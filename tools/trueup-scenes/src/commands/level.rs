//! `trueup-scenes level`.

use clap::Args;
use serde::Serialize;
use trueup_core::truth::Level;
use trueup_core::{Error, Result, StageContext};
use trueup_scenes::cut::{LevelOptions, Panorama360, find_panoramas, measure_level};

use super::words::describe;

/// When a measured vertical is believed. Options left out keep the library's defaults.
#[derive(Debug, Args)]
pub(crate) struct Trust {
    /// Largest angle between the verticals of two halves of the views, degrees.
    #[arg(long)]
    max_halves_deg: Option<f64>,
    /// Largest standard error of the vertical, degrees.
    #[arg(long)]
    max_standard_error_deg: Option<f64>,
}

impl Trust {
    pub(crate) fn options(&self) -> LevelOptions {
        let defaults = LevelOptions::default();
        LevelOptions {
            max_halves_deg: self.max_halves_deg.unwrap_or(defaults.max_halves_deg),
            max_standard_error_deg: self.max_standard_error_deg.unwrap_or(defaults.max_standard_error_deg),
            ..defaults
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct LevelArguments {
    /// Equirectangular panoramas of 360 x 180 degrees: files, folders, patterns.
    #[arg(required = true)]
    panoramas: Vec<String>,
    /// Prints an array with an object a panorama.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    trust: Trust,
}

/// A row of the answer.
#[derive(Debug, Serialize)]
struct Row {
    panorama: String,
    tilt_deg: f64,
    #[serde(flatten)]
    level: Level,
}

impl LevelArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let context = StageContext::default();
        let mut rows = Vec::new();
        for image in find_panoramas(&self.panoramas, &context)? {
            let panorama = Panorama360::decode(&image)?;
            let level = measure_level(&panorama, &self.trust.options(), &context)?;
            if !self.json {
                println!("{}: {}", panorama.name(), describe(&level));
            }
            rows.push(Row { panorama: panorama.name().to_owned(), tilt_deg: level.tilt_deg(), level });
        }
        if self.json {
            let text = serde_json::to_string_pretty(&rows)
                .map_err(|error| Error::input("the answer", error, "Leave --json out."))?;
            println!("{text}");
        }
        Ok(())
    }
}
