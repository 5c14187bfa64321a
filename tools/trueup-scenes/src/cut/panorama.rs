//! The panorama: read, checked, interpolated.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use trueup_core::interpolation::cubic_convolution_taps;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result, StageContext};
use trueup_io::decode::photograph;
use trueup_io::source::{SourceOptions, scan};

/// Samples of a pixel in memory.
const CHANNELS: usize = 3;

/// A panorama of 360 x 180 degrees, equirectangular, 8-bit RGB.
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama360 {
    name: String,
    picture: Raster<u8>,
}

/// The panoramas that paths, folders and patterns name, with their sizes; none is decoded yet.
///
/// # Errors
/// [`Error::Input`] about the first that cannot be used: missing, not a picture, larger than
/// [`SourceOptions::max_megapixels`], a folder without pictures, a picture that is not twice as wide as high.
pub fn find_panoramas(inputs: &[String], context: &StageContext) -> Result<Vec<SourceImage>> {
    let sources = scan(inputs, &SourceOptions::default(), context)?;
    if let Some(rejected) = sources.rejected.first() {
        return Err(rejected.to_error());
    }
    for image in &sources.photographs {
        check_shape(&image.path.display().to_string(), image.width, image.height)?;
    }
    Ok(sources.photographs)
}

impl Panorama360 {
    /// Reads the panorama that `input` names: JPEG, PNG, TIFF or WebP. Its size is judged before memory is taken.
    ///
    /// # Errors
    /// As [`find_panoramas`] and [`photograph`]; [`Error::Input`] if `input` is a folder or pattern of several
    /// pictures.
    pub fn read(input: &str, context: &StageContext) -> Result<Self> {
        let images = find_panoramas(&[input.to_owned()], context)?;
        match images.as_slice() {
            [image] => Self::decode(image),
            _ => Err(Error::input(
                input,
                format!("it holds {} pictures, where one panorama is wanted", images.len()),
                "Name the panorama itself.",
            )),
        }
    }

    /// Decodes a panorama that [`find_panoramas`] found.
    ///
    /// # Errors
    /// As [`photograph`] and [`new`](Self::new).
    pub fn decode(image: &SourceImage) -> Result<Self> {
        let name =
            image.path.file_name().map_or_else(|| image.name.clone(), |name| name.to_string_lossy().into_owned());
        Self::new(&name, photograph(image)?)
    }

    /// A panorama in memory. `name` is its file name. Sixteen bits are rounded to eight, which is what views are
    /// written with; transparent parts count as black.
    ///
    /// # Errors
    /// [`Error::Input`] if it is not twice as wide as high, within one pixel.
    pub fn new(name: &str, photograph: Photograph) -> Result<Self> {
        check_shape(name, photograph.width(), photograph.height())?;
        Ok(Self { name: name.to_owned(), picture: to_rgb8(photograph)? })
    }

    /// The panorama's file name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.picture.width()
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.picture.height()
    }

    /// Pixels a radian along the equator: the focal length at which the middle of a view has the panorama's resolution.
    pub fn pixels_per_radian(&self) -> f64 {
        self.width() as f64 / TAU
    }

    /// Red, green and blue (encoded, 0 to 255 but for the interpolation's overshoot) in a direction of the panorama's
    /// frame, of any length: bicubic, across the back and across the poles.
    pub(super) fn color(&self, direction: &Vector3<f64>) -> [f32; 3] {
        let longitude = direction.x.atan2(direction.z);
        let latitude = direction.y.atan2(direction.x.hypot(direction.z));
        // Places of samples, whose centers are half a pixel from the corner.
        let x = (longitude / TAU + 0.5) * self.width() as f64 - 0.5;
        let y = (latitude / PI + 0.5) * self.height() as f64 - 0.5;
        let (column, row) = (x.floor(), y.floor());
        let across = cubic_convolution_taps((x - column) as f32);
        let down = cubic_convolution_taps((y - row) as f32);
        let (column, row) = (column as i64, row as i64);
        let mut color = [0.0_f32; CHANNELS];
        for (offset, weight) in (-1..=2).zip(down) {
            let pixels = self.four_pixels(column - 1, row + offset);
            for channel in 0..CHANNELS {
                let value: f32 = (0..4).map(|tap| across[tap] * f32::from(pixels[tap][channel])).sum();
                color[channel] += weight * value;
            }
        }
        color
    }

    /// Four neighbors from (column, row) to the right. Beyond a pole the opposite meridian comes back.
    #[inline]
    fn four_pixels(&self, column: i64, row: i64) -> [[u8; CHANNELS]; 4] {
        let (width, height) = (self.width() as i64, self.height() as i64);
        let (column, row) = match row {
            _ if row < 0 => (column + width / 2, -1 - row),
            _ if row >= height => (column + width / 2, 2 * height - 1 - row),
            _ => (column, row),
        };
        let (pixels, _) = self.picture.row(row.clamp(0, height - 1) as usize).as_chunks::<CHANNELS>();
        let together = usize::try_from(column).ok().and_then(|first| pixels.get(first..first + 4));
        match together {
            Some(&[a, b, c, d]) => [a, b, c, d],
            _ => std::array::from_fn(|tap| pixels[(column + tap as i64).rem_euclid(width) as usize]),
        }
    }
}

fn check_shape(subject: &str, width: usize, height: usize) -> Result<()> {
    if width > 0 && width.abs_diff(2 * height) <= 1 {
        return Ok(());
    }
    Err(Error::input(
        subject,
        format!(
            "it has {width} x {height} px and is no panorama of 360 x 180 degrees, which is twice as wide as high \
             (here {width} x {})",
            width.div_ceil(2)
        ),
        "Give a full equirectangular panorama; a partial one can be padded to 2:1 with black.",
    ))
}

/// The photograph as 8-bit red, green and blue.
pub(crate) fn to_rgb8(photograph: Photograph) -> Result<Raster<u8>> {
    let eight = match photograph {
        Photograph::Eight(raster) => raster,
        Photograph::Sixteen(raster) => {
            // 65535 / 257 = 255.
            let data = raster.data().iter().map(|&sample| ((u32::from(sample) + 128) / 257) as u8).collect();
            Raster::from_data(raster.width(), raster.height(), raster.channels(), data)?
        }
    };
    let (width, height) = (eight.width(), eight.height());
    let data = match eight.channels() {
        CHANNELS => return Ok(eight),
        1 => eight.data().iter().flat_map(|&gray| [gray; CHANNELS]).collect(),
        _ => eight.data().as_chunks::<4>().0.iter().flat_map(|&rgba| over_black(rgba)).collect(),
    };
    Raster::from_data(width, height, CHANNELS, data)
}

fn over_black([red, green, blue, alpha]: [u8; 4]) -> [u8; CHANNELS] {
    [red, green, blue].map(|value| ((u32::from(value) * u32::from(alpha) + 127) / 255) as u8)
}
