//! What the format of a destination can hold, checked before anything is written.

use std::path::Path;

use trueup_core::{Error, Result};

use super::background::Background;
use super::options::{Alpha, Depth, OutputOptions};
use super::samples::RGBA;
use crate::format::{SideLimit, Transparency, Writing};
use crate::formats;

/// How to write what the extension of `path` names; refuses a format that has not the depth or the background asked
/// for.
pub(super) fn writing_to(path: &Path, options: &OutputOptions) -> Result<&'static Writing> {
    let writing = formats::writing_of(path).ok_or_else(|| {
        let what = match path.extension() {
            Some(extension) => format!("writing {} as .{}", path.display(), extension.to_string_lossy()),
            None => format!("writing {} without an extension", path.display()),
        };
        Error::Unsupported { what, hint: format!("End the name in {}.", formats::written_extensions()) }
    })?;
    check_depth(path, writing, options)?;
    check_background(path, writing, options)?;
    Ok(writing)
}

/// Refuses a format that has not the depth asked for.
fn check_depth(path: &Path, writing: &Writing, options: &OutputOptions) -> Result<()> {
    let what = match options.depth {
        Depth::Auto | Depth::Eight => "8 bits a sample",
        Depth::Sixteen => "16 bits a sample",
        Depth::Float => "floating point samples",
    };
    if options.depth == Depth::Auto || writing.depths.contains(&options.depth) {
        return Ok(());
    }
    let others = formats::extensions(|other| other.depths.contains(&options.depth));
    Err(Error::Unsupported {
        what: format!("writing {} with {what}", path.display()),
        hint: format!("End the name in {others}, or leave output.depth at auto."),
    })
}

/// Refuses a background that is to be transparent where nothing can be.
fn check_background(path: &Path, writing: &Writing, options: &OutputOptions) -> Result<()> {
    if options.background != Background::Transparent {
        return Ok(());
    }
    let otherwise = "or leave the background at auto, or choose a color.";
    let hint = match writing.transparency {
        Transparency::Never => {
            let others = formats::extensions(|other| matches!(other.transparency, Transparency::Always));
            format!("End the name in {others}, {otherwise}")
        }
        Transparency::With { has, advice, .. } if !has(options) => format!("{advice}, {otherwise}"),
        _ if options.alpha == Alpha::Drop => "Leave output.alpha at auto.".to_owned(),
        Transparency::Always | Transparency::With { .. } => return Ok(()),
    };
    Err(Error::Unsupported { what: format!("writing {} with a transparent background", path.display()), hint })
}

/// Refuses what a format cannot hold.
pub(super) fn check_sides(path: &Path, limit: SideLimit, width: usize, height: usize) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::input(path.display(), "the panorama is empty", "There is nothing to write."));
    }
    // Rows and tiles are held in the widest samples, 32-bit floating point numbers.
    let bytes = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(RGBA * size_of::<f32>()));
    if width.max(height) > limit.largest || bytes.is_none() {
        return Err(Error::Limits {
            subject: path.display().to_string(),
            needed: format!("{width} x {height} px"),
            allowed: format!("{} px per side", limit.largest),
            hint: limit.advice.to_owned(),
        });
    }
    Ok(())
}

impl OutputOptions {
    /// These options with the depth decided: [`Depth::Auto`] becomes 16 where `photograph_bits`, the most bits a sample
    /// of the photographs has, is above 8 and the format of `path` can hold it, else 8; and floating point where the
    /// format has nothing else.
    pub fn with_depth_for(&self, path: &Path, photograph_bits: u16) -> Self {
        let depths = formats::writing_of(path).map_or(&[][..], |writing| writing.depths);
        let depth = match self.depth {
            Depth::Auto if depths == [Depth::Float] => Depth::Float,
            Depth::Auto if photograph_bits > 8 && depths.contains(&Depth::Sixteen) => Depth::Sixteen,
            Depth::Auto => Depth::Eight,
            chosen => chosen,
        };
        Self { depth, ..self.clone() }
    }

    /// Whether what is written to `path` keeps what is brighter than white: floating point samples do.
    pub fn keeps_light(&self, path: &Path) -> bool {
        self.with_depth_for(path, u8::BITS as u16).depth == Depth::Float
    }
}
