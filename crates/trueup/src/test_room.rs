//! The example photographs for tests, and what comes of them in bytes.

use std::cell::Cell;

use trueup_core::StageContext;
use trueup_core::raster::{Photograph, Raster, RowSource};
use trueup_io::decode;
use trueup_io::source::{InMemory, SourceOptions, scan};

use crate::inputs::Inputs;

/// The folder of the five photographs of a room.
pub(crate) const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");

/// The room's photographs in memory under the names of their files, each as `changed` makes it.
pub(crate) fn room_in_memory(changed: impl Fn(Photograph) -> Photograph) -> Inputs {
    let scanned = scan(&[ROOM.to_owned()], &SourceOptions::default(), &StageContext::default());
    let files = scanned.expect("the room").photographs;
    let mut in_memory = InMemory::default();
    for file in &files {
        in_memory.insert(&file.name, changed(decode::photograph(file).expect("decoded")));
    }
    Inputs { in_memory, ..Inputs::new(files.iter().map(|file| file.name.clone())) }
}

/// Features of which noise and what sharpening makes of it leave too few for the last photograph of
/// [`room_with_a_blurred_photograph`]: 4 to 7 of its matches agree at the first look. In the room there is little that
/// is fine, so that there would be room in the usual 4000.
pub(crate) const TOO_FEW_FEATURES: &str = "features.max_points=800";

/// The room's photographs in memory, the last one blurred, noisy and then sharpened, as by a telephone that was shaken.
pub(crate) fn room_with_a_blurred_photograph() -> Inputs {
    /// Sides of the squares over which it is blurred, one after the other, in pixels of 1200.
    const BLUR_PX: [usize; 2] = [25, 13];
    /// The noise is even between this and its negative.
    const NOISE: f32 = 25.0;
    /// How much of what sets samples apart from their neighbors is added.
    const SHARPENED: f32 = 3.0;
    let blurred = |photograph: Photograph| {
        let Photograph::Eight(raster) = photograph else { panic!("8 bits") };
        let (width, height, channels) = (raster.width(), raster.height(), raster.channels());
        let samples = raster.data().iter().map(|&sample| f32::from(sample)).collect();
        let mut picture = Raster::from_data(width, height, channels, samples).expect("as many samples");
        for side in BLUR_PX {
            picture = averaged(&picture, side);
        }
        for (index, pixel) in picture.data_mut().chunks_mut(channels).enumerate() {
            let mixed = (index as u32 ^ (index as u32 >> 15)).wrapping_mul(0x2c1b_3c6d);
            let mixed = (mixed ^ (mixed >> 12)).wrapping_mul(0x297a_2d39);
            let noise = NOISE * ((mixed ^ (mixed >> 15)) as f32 / (u32::MAX / 2) as f32 - 1.0);
            pixel.iter_mut().for_each(|sample| *sample += noise);
        }
        let smooth = averaged(&picture, 3);
        let sharpened = picture.data().iter().zip(smooth.data()).map(|(one, mean)| one + SHARPENED * (one - mean));
        // The cast saturates.
        let samples = sharpened.map(|sample| sample.round() as u8).collect();
        Photograph::Eight(Raster::from_data(width, height, channels, samples).expect("as many samples"))
    };
    let (seen, last) = (Cell::new(0), 4);
    room_in_memory(|photograph| if seen.replace(seen.get() + 1) == last { blurred(photograph) } else { photograph })
}

/// The means of squares of so many samples a side, those at the border of what of them is there.
fn averaged(picture: &Raster<f32>, side: usize) -> Raster<f32> {
    let (width, height, channels) = (picture.width(), picture.height(), picture.channels());
    let around = |at: usize, length: usize| at.saturating_sub(side / 2)..(at + side / 2 + 1).min(length);
    let (mut rows, mut means) = (Raster::new(width, height, channels), Raster::new(width, height, channels));
    for y in 0..height {
        for x in 0..width {
            let near = around(x, width);
            for channel in 0..channels {
                let sum: f32 = near.clone().map(|x| picture.pixel(x, y)[channel]).sum();
                rows.pixel_mut(x, y)[channel] = sum / near.len() as f32;
            }
        }
    }
    for y in 0..height {
        let near = around(y, height);
        for x in 0..width {
            for channel in 0..channels {
                let sum: f32 = near.clone().map(|y| rows.pixel(x, y)[channel]).sum();
                means.pixel_mut(x, y)[channel] = sum / near.len() as f32;
            }
        }
    }
    means
}

/// The samples of a panorama, four channels of 8 bits.
pub(crate) fn samples_of(panorama: &dyn RowSource) -> Vec<u8> {
    let mut samples = vec![0; panorama.width() * panorama.height() * 4];
    for (y, row) in samples.chunks_exact_mut(panorama.width() * 4).enumerate() {
        panorama.rgba8_row(y, row).expect("a row");
    }
    samples
}
