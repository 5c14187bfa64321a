//! Something flat, photographed by cameras that move along it: a painted wall, the ground from the air, sheets on a
//! scanner.
//!
//! The world is the plane z = 0: x to the right on it, y down, z away from the photographer, whose centers are negative
//! there.

use std::fs;
use std::path::Path;

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::raster::Raster;
use trueup_core::truth::Truth;
use trueup_core::{Error, Result, StageContext};
use trueup_io::decode::photograph;
use trueup_io::source::{SourceOptions, scan};

use crate::cut::to_rgb8;
use crate::dice::Dice;
use crate::noise::{fractal_noise, lattice};
use crate::rig::{PosedCamera, camera_from_world, focal_px};
use crate::set::{jpeg, truth_of, write_truth};

trueup_core::choice! {
    /// How something flat is photographed.
    pub enum FlatSetKind {
        /// A painted wall, walked along with a hand-held camera: six photographs.
        Mural = "mural",
        /// The ground from the air, looking down: three rows of six.
        Drone = "drone",
        /// Sheets on a scanner: two rows of three, at one resolution.
        Scans = "scans",
    }
}

/// How cameras of one kind move.
struct Movement {
    rows: usize,
    columns: usize,
    hfov_deg: f64,
    /// Distance from the plane, metres.
    distance: f64,
    /// Largest change of the distance, relative.
    distance_spread: f64,
    /// Largest tilt to each side, degrees.
    tilt_deg: f64,
    /// Largest roll to each side, degrees.
    roll_deg: f64,
    /// Step from photograph to photograph, in lengths of a photograph.
    step: f64,
    /// Largest error of the aim to each side, in lengths of a photograph.
    aim_spread: f64,
}

impl FlatSetKind {
    fn movement(self) -> Movement {
        match self {
            Self::Mural => Movement {
                rows: 1,
                columns: 6,
                hfov_deg: 62.0,
                distance: 2.0,
                distance_spread: 0.08,
                tilt_deg: 10.0,
                roll_deg: 4.0,
                step: 0.55,
                aim_spread: 0.03,
            },
            Self::Drone => Movement {
                rows: 3,
                columns: 6,
                hfov_deg: 70.0,
                distance: 60.0,
                distance_spread: 0.02,
                tilt_deg: 4.0,
                roll_deg: 2.0,
                step: 0.6,
                aim_spread: 0.02,
            },
            // Straight on, a photograph is a scaled copy, whatever its field of view.
            Self::Scans => Movement {
                rows: 2,
                columns: 3,
                hfov_deg: 50.0,
                distance: 0.3,
                distance_spread: 0.0,
                tilt_deg: 0.0,
                roll_deg: 2.0,
                step: 0.75,
                aim_spread: 0.02,
            },
        }
    }
}

/// The cameras of a set of that kind, by a seed, of photographs of that size in pixels: row after row, from left to
/// right, the middle of all before the origin.
pub fn flat_rig(kind: FlatSetKind, seed: u64, [width, height]: [usize; 2]) -> Vec<PosedCamera> {
    let movement = kind.movement();
    let Movement { rows, columns, distance, .. } = movement;
    let across = distance / focal_px(width, movement.hfov_deg);
    let steps = [width, height].map(|length| length as f64 * across * movement.step);
    let place = |index: usize| {
        let mut dice = Dice::new(seed, index as u64);
        let mut within = |most: f64| dice.range(-most, most);
        let rotation =
            camera_from_world(within(movement.tilt_deg), within(movement.tilt_deg), within(movement.roll_deg));
        let away = distance * (1.0 + within(movement.distance_spread));
        let middle = |count: usize| (count as f64 - 1.0) / 2.0;
        let aim = Vector2::new(
            ((index % columns) as f64 - middle(columns)) * steps[0]
                + within(movement.aim_spread) * width as f64 * across,
            ((index / columns) as f64 - middle(rows)) * steps[1] + within(movement.aim_spread) * height as f64 * across,
        );
        let mut posed = PosedCamera::level([0.0; 3], 0.0, width, height, movement.hfov_deg);
        posed.camera.set_rotation(&rotation);
        // People aim: the optical axis meets the plane where it is meant to.
        let forward = posed.camera.forward();
        let center = aim - forward.xy() * (away / forward.z);
        posed.center = [center.x, center.y, -away];
        posed
    };
    (0..rows * columns).map(place).collect()
}

/// What is on the plane.
#[derive(Debug, Clone)]
pub enum FlatTexture {
    /// A generated painting: tiles of patchy color, which lie along x and y.
    Painting {
        /// Decides where is what.
        seed: u32,
        /// Width of a tile, metres.
        tile: f64,
    },
    /// A picture in red, green and blue, whose middle is the world's origin.
    Picture {
        /// Its pixels.
        pixels: Raster<u8>,
        /// Pixels to a metre.
        pixels_per_meter: f64,
    },
}

impl FlatTexture {
    /// The color at a place, of 255, as it shows to a pixel of width `footprint`; both in metres.
    fn color(&self, place: Vector2<f64>, footprint: f64) -> [f64; 3] {
        match self {
            Self::Painting { seed, tile } => painted(place / *tile, footprint / tile, *seed),
            Self::Picture { pixels, pixels_per_meter } => {
                let [width, height] = [pixels.width(), pixels.height()].map(|length| length as f64);
                let corner = Vector2::new(width, height) / 2.0;
                interpolated(pixels, place * *pixels_per_meter + corner - Vector2::repeat(0.5))
            }
        }
    }

    /// A painting with about three tiles to a photograph of that kind.
    pub fn painting(kind: FlatSetKind, seed: u32) -> Self {
        let Movement { hfov_deg, distance, .. } = kind.movement();
        Self::Painting { seed, tile: 2.0 * distance * (hfov_deg.to_radians() / 2.0).tan() / 3.0 }
    }

    /// The picture that `input` names, as [`Self::picture`] lays it: whatever trueup reads.
    ///
    /// # Errors
    /// [`Error::Input`] if it is none, or several; as [`photograph`].
    pub fn read(kind: FlatSetKind, input: &str, context: &StageContext) -> Result<Self> {
        let sources = scan(&[input.to_owned()], &SourceOptions::default(), context)?;
        match (sources.photographs.as_slice(), sources.rejected.first()) {
            ([image], _) => Ok(Self::picture(kind, to_rgb8(photograph(image)?)?)),
            ([], Some(rejected)) => Err(rejected.to_error()),
            (several, _) => Err(Error::input(
                input,
                format!("it holds {} pictures, where one is wanted", several.len()),
                "Name the picture itself.",
            )),
        }
    }

    /// A picture that is as wide as all photographs of that kind together.
    pub fn picture(kind: FlatSetKind, pixels: Raster<u8>) -> Self {
        let Movement { hfov_deg, distance, columns, step, .. } = kind.movement();
        let width = 2.0 * distance * (hfov_deg.to_radians() / 2.0).tan() * (1.0 + step * (columns as f64 - 1.0));
        let pixels_per_meter = pixels.width() as f64 / width;
        Self::Picture { pixels, pixels_per_meter }
    }
}

/// Tiles one unit wide and three quarters high.
fn painted(place: Vector2<f64>, footprint: f64, seed: u32) -> [f64; 3] {
    /// Height of a tile.
    const HEIGHT: f64 = 0.75;
    /// Width of the largest patches of color, and of the finest an eighth of an eighth of it.
    const PATCH: f64 = 0.3;
    const OCTAVES: u32 = 7;
    /// How strong each octave is beside the one that is twice as wide.
    const GAIN: f64 = 0.75;
    let tile = [(place.x).floor() as i64, (place.y / HEIGHT).floor() as i64];
    std::array::from_fn(|channel| {
        let seed = seed.wrapping_mul(3).wrapping_add(channel as u32);
        let base = 60.0 + 130.0 * lattice(tile[0], tile[1], channel as i64, seed);
        let patches = fractal_noise(Vector3::new(place.x, place.y, 0.5), PATCH, OCTAVES, GAIN, footprint, seed);
        base + 160.0 * patches
    })
}

/// Bilinear; beyond the picture its border.
fn interpolated(pixels: &Raster<u8>, place: Vector2<f64>) -> [f64; 3] {
    let [columns, rows] = [pixels.width(), pixels.height()];
    let clamped = |at: f64, length: usize| at.clamp(0.0, (length - 1) as f64);
    let (x, y) = (clamped(place.x, columns), clamped(place.y, rows));
    let (left, top) = (x as usize, y as usize);
    let (right, bottom) = ((left + 1).min(columns - 1), (top + 1).min(rows - 1));
    let (u, v) = (x - left as f64, y - top as f64);
    let at = |column: usize, row: usize, channel: usize| f64::from(pixels.row(row)[3 * column + channel]);
    std::array::from_fn(|channel| {
        (at(left, top, channel) * (1.0 - u) + at(right, top, channel) * u) * (1.0 - v)
            + (at(left, bottom, channel) * (1.0 - u) + at(right, bottom, channel) * u) * v
    })
}

/// The photograph of what is on the plane. Colors are averaged as they are encoded.
pub fn flat_picture(texture: &FlatTexture, posed: &PosedCamera) -> Raster<u8> {
    /// Samples along the side of a pixel.
    const SAMPLES: usize = 3;
    let world_from_camera = posed.camera.rotation().transpose();
    let center = Vector3::from(posed.center);
    let footprint = -posed.center[2] / posed.camera.focal_px / SAMPLES as f64;
    let mut picture = Raster::new(posed.width, posed.height, 3);
    picture.data_mut().par_chunks_exact_mut(3 * posed.width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let mut sum = [0.0; 3];
            for sample in 0..SAMPLES * SAMPLES {
                let within = |index: usize| (index as f64 + 0.5) / SAMPLES as f64;
                let at = Vector2::new(x as f64 + within(sample % SAMPLES), y as f64 + within(sample / SAMPLES));
                let ray = world_from_camera * posed.camera.bearing(at);
                let place = center - ray * (center.z / ray.z);
                let color = texture.color(place.xy(), footprint);
                sum = std::array::from_fn(|channel| sum[channel] + color[channel]);
            }
            // The conversion saturates.
            *pixel = sum.map(|value| (value / (SAMPLES * SAMPLES) as f64 + 0.5) as u8);
        }
    });
    picture
}

/// Writes the photographs of a flat set into a folder, which is made if need be: `00.jpg`, `01.jpg`, ..., and last
/// `truth.json`, so that a folder with it is complete.
///
/// # Errors
/// [`Error::Io`] if a file cannot be written, [`Error::Limits`] for a picture too large for JPEG, [`Error::Cancelled`]
/// between pictures.
pub fn write_flat_set(
    directory: &Path,
    source: &str,
    texture: &FlatTexture,
    cameras: &[PosedCamera],
    context: &StageContext,
) -> Result<Truth> {
    fs::create_dir_all(directory).map_err(|error| Error::io("making the folder", directory, error))?;
    let mut truth = Truth { source: source.to_owned(), images: Vec::with_capacity(cameras.len()), level: None };
    for (index, posed) in cameras.iter().enumerate() {
        context.check_cancelled()?;
        let file = format!("{index:02}.jpg");
        let path = directory.join(&file);
        fs::write(&path, jpeg(&flat_picture(texture, posed))?).map_err(|error| Error::io("writing", &path, error))?;
        truth.images.push(truth_of(posed, file));
    }
    write_truth(directory, &truth)?;
    Ok(truth)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of four quadrants, seen straight on from the distance at which its pixels are the photograph's.
    #[test]
    fn straight_on_a_picture_is_photographed_as_it_is() {
        let mut pixels = Raster::new(40, 30, 3);
        for (k, pixel) in pixels.data_mut().as_chunks_mut::<3>().0.iter_mut().enumerate() {
            *pixel = [if k % 40 < 20 { 50 } else { 200 }, if k / 40 < 15 { 20 } else { 120 }, 9];
        }
        let mut posed = PosedCamera::level([0.0, 0.0, -2.0], 0.0, 40, 30, 60.0);
        let texture = FlatTexture::Picture { pixels: pixels.clone(), pixels_per_meter: posed.camera.focal_px / 2.0 };
        assert_eq!(flat_picture(&texture, &posed).row(3)[3..30], pixels.row(3)[3..30]);
        // Moved by a quarter of the picture's width to the right, its left half is seen in the first quarter only.
        posed.center[0] = 10.0 / (posed.camera.focal_px / 2.0);
        let moved = flat_picture(&texture, &posed);
        let first = |column: usize| moved.row(5)[3 * column];
        assert_eq!([first(8), first(11)], [50, 200]);
    }

    #[test]
    fn cameras_are_where_their_kind_says() {
        for kind in [FlatSetKind::Mural, FlatSetKind::Drone, FlatSetKind::Scans] {
            let cameras = flat_rig(kind, 3, [400, 300]);
            let Movement { rows, columns, distance, tilt_deg, .. } = kind.movement();
            assert_eq!(cameras.len(), rows * columns);
            // Two tilts of at most so much come to the root of two times it.
            let steepest = cameras.iter().map(|one| one.camera.forward().z.acos().to_degrees()).fold(0.0, f64::max);
            assert!(steepest <= 1.42 * tilt_deg + 1e-5, "{steepest}");
            assert!(cameras.iter().all(|one| (one.center[2] / distance + 1.0).abs() <= 0.081));
            assert_eq!(cameras, flat_rig(kind, 3, [400, 300]));
        }
    }
}
