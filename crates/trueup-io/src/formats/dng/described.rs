//! What a Digital Negative says of its picture.
//!
//! # Source
//! DNG, chapters 2 to 4: the picture of the sensor is the directory, first or below it, that is no reduced copy and no
//! preview.

use std::io::{Read, Seek};

use super::DNG_VERSION;
use super::color::{Development, Matrix, UnderLight, White, development};
use super::corrections::{GainMap, Levels, gain_maps};
use super::directory::{Directory, first};
use super::mosaic::{MIN_SIDE, Pattern};
use crate::format::{Foreign, HeaderError};

/// Directories below the first that are looked into: files have up to five.
const MOST_BELOW: usize = 16;

/// Tags of TIFF 6.0, and of Digital Negatives (DNG, chapter 4).
mod tag {
    pub(super) const NEW_SUBFILE_TYPE: u16 = 254;
    pub(super) const IMAGE_WIDTH: u16 = 256;
    pub(super) const IMAGE_LENGTH: u16 = 257;
    pub(super) const BITS_PER_SAMPLE: u16 = 258;
    pub(super) const COMPRESSION: u16 = 259;
    pub(super) const PHOTOMETRIC: u16 = 262;
    pub(super) const STRIP_OFFSETS: u16 = 273;
    pub(super) const SAMPLES_PER_PIXEL: u16 = 277;
    pub(super) const ROWS_PER_STRIP: u16 = 278;
    pub(super) const STRIP_BYTE_COUNTS: u16 = 279;
    pub(super) const PLANAR_CONFIGURATION: u16 = 284;
    pub(super) const TILE_WIDTH: u16 = 322;
    pub(super) const TILE_LENGTH: u16 = 323;
    pub(super) const TILE_OFFSETS: u16 = 324;
    pub(super) const TILE_BYTE_COUNTS: u16 = 325;
    pub(super) const SUB_DIRECTORIES: u16 = 330;
    pub(super) const SAMPLE_FORMAT: u16 = 339;
    pub(super) const PATTERN_SIZE: u16 = 33421;
    pub(super) const PATTERN: u16 = 33422;
    pub(super) const LAYOUT: u16 = 50711;
    pub(super) const LINEARIZATION_TABLE: u16 = 50712;
    pub(super) const BLACK_REPEAT: u16 = 50713;
    pub(super) const BLACK: u16 = 50714;
    pub(super) const BLACK_OF_COLUMNS: u16 = 50715;
    pub(super) const BLACK_OF_ROWS: u16 = 50716;
    pub(super) const WHITE: u16 = 50717;
    pub(super) const SCALE: u16 = 50718;
    pub(super) const CROP_ORIGIN: u16 = 50719;
    pub(super) const CROP_SIZE: u16 = 50720;
    pub(super) const COLOR_MATRIX: [u16; 2] = [50721, 50722];
    pub(super) const CALIBRATION: [u16; 2] = [50723, 50724];
    pub(super) const ANALOG_BALANCE: u16 = 50727;
    pub(super) const AS_SHOT_NEUTRAL: u16 = 50728;
    pub(super) const AS_SHOT_WHITE: u16 = 50729;
    pub(super) const BASELINE_EXPOSURE: u16 = 50730;
    pub(super) const LIGHT: [u16; 2] = [50778, 50779];
    pub(super) const ACTIVE_AREA: u16 = 50829;
    pub(super) const FORWARD_MATRIX: [u16; 2] = [50964, 50965];
    pub(super) const CORRECTIONS: [u16; 2] = [51008, 51009];
}

/// Codes of PhotometricInterpretation: a mosaic, and colors of the camera at every pixel.
const MOSAIC: f64 = 32803.0;
const LINEAR: f64 = 34892.0;

/// Codes of Compression.
const PLAIN: f64 = 1.0;
const JPEG: f64 = 7.0;

/// Most stops that BaselineExposure is believed to have.
const MOST_STOPS: f64 = 10.0;

/// What converts a Digital Negative that is not read.
const COMMAND: &str = "darktable-cli photo.dng photo.tif";

macro_rules! foreign {
    ($name:ident, $what:literal) => {
        static $name: Foreign =
            Foreign { what: $what, extensions: &[], has_signature: |_| false, command: COMMAND, is_raw: true };
    };
}

foreign!(OF_LOSS, "a Digital Negative (DNG) compressed with loss, by JPEG XL or otherwise than by lossless JPEG");
foreign!(OF_OTHER_MOSAIC, "a Digital Negative (DNG) of a mosaic that is not Bayer's");
foreign!(OF_OTHER_SAMPLES, "a Digital Negative (DNG) of unusual samples");
foreign!(OF_NO_COLOR, "a Digital Negative (DNG) that does not say what its colors are");
foreign!(OF_OTHER_CORRECTIONS, "a Digital Negative (DNG) with corrections that are not known");
foreign!(OF_NO_SENSOR, "a Digital Negative (DNG) without a picture of the sensor");

/// The picture of the sensor.
#[derive(Debug)]
pub(super) struct Described {
    /// Rows of samples, those outside of the active area with them.
    pub(super) height: usize,
    pub(super) samples_per_pixel: usize,
    pub(super) bits: usize,
    pub(super) is_jpeg: bool,
    pub(super) is_little: bool,
    pub(super) blocks: Blocks,
    /// Left, top, width and height of what saw light.
    pub(super) active: [usize; 4],
    /// Left, top, width and height within that of what is shown.
    pub(super) crop: [usize; 4],
    /// `None` of three colors a pixel.
    pub(super) pattern: Option<Pattern>,
    pub(super) levels: Levels,
    pub(super) gain_maps: Vec<GainMap>,
    pub(super) development: Development,
    /// What linear light is multiplied by.
    pub(super) exposure: f64,
}

/// Where the samples lie.
#[derive(Debug, PartialEq)]
pub(super) struct Blocks {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Blocks side by side.
    pub(super) across: usize,
    /// Whether those at the border are as large as the others.
    pub(super) are_padded: bool,
    /// Offset and bytes of each.
    pub(super) places: Vec<[u64; 2]>,
}

/// What a file says.
pub(super) fn described(input: &mut (impl Read + Seek)) -> Result<Described, HeaderError> {
    let damaged = || HeaderError::damaged("its directory of the sensor's picture contradicts itself");
    let place = first(input).ok_or_else(damaged)?;
    let main = Directory::read(input, place).filter(|main| main.has(DNG_VERSION)).ok_or_else(damaged)?;
    let below = main.below(input, tag::SUB_DIRECTORIES, MOST_BELOW);
    let sensor = std::iter::once(&main).chain(&below).find(|directory| {
        let kind = directory.value(input, tag::NEW_SUBFILE_TYPE).unwrap_or(0.0);
        let meaning = directory.value(input, tag::PHOTOMETRIC);
        kind == 0.0 && [MOSAIC, LINEAR].contains(&meaning.unwrap_or(0.0))
    });
    let sensor = sensor.ok_or(HeaderError::Foreign(&OF_NO_SENSOR))?;
    let mut fields = Fields { input, directory: sensor };

    let is_mosaic = fields.one(tag::PHOTOMETRIC) == Some(MOSAIC);
    let (width, height) = (fields.count(tag::IMAGE_WIDTH), fields.count(tag::IMAGE_LENGTH));
    let (Some(width), Some(height)) = (width, height) else { return Err(damaged()) };
    let samples_per_pixel = fields.count(tag::SAMPLES_PER_PIXEL).unwrap_or(1);
    if samples_per_pixel != if is_mosaic { 1 } else { 3 } || fields.one(tag::PLANAR_CONFIGURATION).unwrap_or(1.0) != 1.0
    {
        return Err(HeaderError::Foreign(&OF_OTHER_SAMPLES));
    }
    let is_jpeg = match fields.one(tag::COMPRESSION).unwrap_or(PLAIN) {
        PLAIN => false,
        JPEG => true,
        _ => return Err(HeaderError::Foreign(&OF_LOSS)),
    };
    let bits = fields.all(tag::BITS_PER_SAMPLE);
    let bits = match bits[..] {
        [first, ..] if bits.iter().all(|bits| *bits == first) => first as usize,
        _ => return Err(damaged()),
    };
    let is_whole = fields.all(tag::SAMPLE_FORMAT).iter().all(|format| *format == 1.0);
    let is_square = fields.all(tag::SCALE).windows(2).all(|scales| scales[0] == scales[1]);
    if !(8..=16).contains(&bits) || !is_whole || !is_square {
        return Err(HeaderError::Foreign(&OF_OTHER_SAMPLES));
    }
    let pattern = if is_mosaic { Some(fields.pattern()?) } else { None };
    let blocks = fields.blocks(width, height).ok_or_else(damaged)?;
    let active = fields.active(width, height).ok_or_else(damaged)?;
    let crop = fields.crop([active[2], active[3]]).ok_or_else(damaged)?;
    let levels = fields.levels(samples_per_pixel, bits, active).ok_or_else(damaged)?;
    let mut maps = Vec::new();
    for tag in tag::CORRECTIONS {
        let list = fields.directory.bytes(fields.input, tag, MOST_CORRECTION_BYTES);
        if list.is_none() && fields.directory.has(tag) {
            return Err(damaged());
        }
        let list = list.unwrap_or_default();
        maps.extend(gain_maps(&list).ok_or(HeaderError::Foreign(&OF_OTHER_CORRECTIONS))?);
    }
    let mut fields = Fields { input: fields.input, directory: &main };
    let development = fields.development().ok_or(HeaderError::Foreign(&OF_NO_COLOR))?;
    let stops = fields.one(tag::BASELINE_EXPOSURE).filter(|stops| stops.abs() <= MOST_STOPS).unwrap_or(0.0);
    Ok(Described {
        height,
        samples_per_pixel,
        bits,
        is_jpeg,
        is_little: sensor.is_little(),
        blocks,
        active,
        crop,
        pattern,
        levels,
        gain_maps: maps,
        development,
        exposure: stops.exp2(),
    })
}

/// Most bytes of a list of corrections: gain maps have some thousand numbers for each of four colors.
const MOST_CORRECTION_BYTES: usize = 16 << 20;

/// The fields of one directory.
struct Fields<'a, R> {
    input: &'a mut R,
    directory: &'a Directory,
}

impl<R: Read + Seek> Fields<'_, R> {
    /// All values; none if there is no such field.
    fn all(&mut self, tag: u16) -> Vec<f64> {
        self.directory.values(self.input, tag).unwrap_or_default()
    }

    fn one(&mut self, tag: u16) -> Option<f64> {
        self.directory.value(self.input, tag)
    }

    /// A number of things, of which there are some.
    fn count(&mut self, tag: u16) -> Option<usize> {
        self.one(tag).filter(|&count| count >= 1.0 && count.is_finite()).map(|count| count as usize)
    }

    fn pattern(&mut self) -> Result<Pattern, HeaderError> {
        let is_in_rows = self.one(tag::LAYOUT).unwrap_or(1.0) == 1.0;
        let colors: Vec<usize> = self.all(tag::PATTERN).into_iter().map(|color| color as usize).collect();
        match <[usize; 4]>::try_from(colors).map(Pattern) {
            Ok(pattern) if is_in_rows && self.all(tag::PATTERN_SIZE) == [2.0, 2.0] && pattern.is_bayer() => Ok(pattern),
            _ => Err(HeaderError::Foreign(&OF_OTHER_MOSAIC)),
        }
    }

    fn blocks(&mut self, width: usize, height: usize) -> Option<Blocks> {
        let are_padded = self.directory.has(tag::TILE_OFFSETS);
        let (block_width, block_height, offsets, lengths) = match are_padded {
            true => (
                self.count(tag::TILE_WIDTH)?,
                self.count(tag::TILE_LENGTH)?,
                self.all(tag::TILE_OFFSETS),
                self.all(tag::TILE_BYTE_COUNTS),
            ),
            false => (
                width,
                self.count(tag::ROWS_PER_STRIP).map_or(height, |rows| rows.min(height)),
                self.all(tag::STRIP_OFFSETS),
                self.all(tag::STRIP_BYTE_COUNTS),
            ),
        };
        // A tile can be larger than a small picture, but not by more than what tiles are wide.
        const MOST_TILE_SIDE: usize = 8192;
        if block_width > width.max(MOST_TILE_SIDE) || block_height > height.max(MOST_TILE_SIDE) {
            return None;
        }
        let across = width.div_ceil(block_width);
        let count = across.checked_mul(height.div_ceil(block_height))?;
        if offsets.len() != count || lengths.len() != count {
            return None;
        }
        let places = offsets.into_iter().zip(lengths).map(|(offset, length)| [offset as u64, length as u64]).collect();
        Some(Blocks { width: block_width, height: block_height, across, are_padded, places })
    }

    /// Left, top, width and height; the field has top, left, bottom and right.
    fn active(&mut self, width: usize, height: usize) -> Option<[usize; 4]> {
        let area = self.all(tag::ACTIVE_AREA);
        let [top, left, bottom, right] = match area[..] {
            [] => [0, 0, height, width],
            [top, left, bottom, right] => [top, left, bottom, right].map(|side| side as usize),
            _ => return None,
        };
        let is_inside = top < bottom && bottom <= height && left < right && right <= width;
        let area = [left, top, right.checked_sub(left)?, bottom.checked_sub(top)?];
        (is_inside && area[2] >= MIN_SIDE && area[3] >= MIN_SIDE).then_some(area)
    }

    fn crop(&mut self, [width, height]: [usize; 2]) -> Option<[usize; 4]> {
        let (origin, size) = (self.all(tag::CROP_ORIGIN), self.all(tag::CROP_SIZE));
        let side = |place: usize, whole: usize| {
            let start = origin.get(place).copied().unwrap_or(0.0).round();
            let length = size.get(place).copied().unwrap_or(whole as f64 - start).round();
            let is_inside = start >= 0.0 && length >= 1.0 && start + length <= whole as f64;
            is_inside.then_some((start as usize, length as usize))
        };
        let ((left, width), (top, height)) = (side(0, width)?, side(1, height)?);
        Some([left, top, width, height])
    }

    fn levels(&mut self, samples: usize, bits: usize, active: [usize; 4]) -> Option<Levels> {
        let repeat = match self.all(tag::BLACK_REPEAT)[..] {
            [rows, columns] if rows >= 1.0 && columns >= 1.0 => [columns as usize, rows as usize],
            _ => [1, 1],
        };
        let mut black = self.all(tag::BLACK);
        let count = repeat[0].checked_mul(repeat[1])?.checked_mul(samples)?;
        match black.len() {
            0 => black = vec![0.0; count],
            // Some writers tell one for all.
            1 => black = vec![black[0]; count],
            found if found == count => {}
            _ => return None,
        }
        let white = self.all(tag::WHITE);
        let most = f64::from((1_u32 << bits) - 1);
        let white = (0..samples).map(|sample| white.get(sample).or(white.first()).copied().unwrap_or(most)).collect();
        let of_columns = self.all(tag::BLACK_OF_COLUMNS);
        let of_rows = self.all(tag::BLACK_OF_ROWS);
        let is_one_each = |deltas: &[f64], count: usize| deltas.is_empty() || deltas.len() == count;
        if !is_one_each(&of_columns, active[2]) || !is_one_each(&of_rows, active[3]) {
            return None;
        }
        let table = self.all(tag::LINEARIZATION_TABLE).into_iter().map(|value| value as u16).collect();
        Levels { table, repeat, black, of_columns, of_rows, white }.sane()
    }

    fn three(&mut self, tag: u16) -> Option<[f64; 3]> {
        self.all(tag).try_into().ok()
    }

    fn matrix(&mut self, tag: u16) -> Option<Matrix> {
        let values: [f64; 9] = self.all(tag).try_into().ok()?;
        Some(std::array::from_fn(|row| std::array::from_fn(|column| values[3 * row + column])))
    }

    fn development(&mut self) -> Option<Development> {
        let mut lights = Vec::new();
        for number in 0..2 {
            let Some(camera_from_xyz) = self.matrix(tag::COLOR_MATRIX[number]) else { continue };
            lights.push(UnderLight {
                light: self.one(tag::LIGHT[number]).map_or(0, |light| light as u16),
                camera_from_xyz,
                calibration: self.matrix(tag::CALIBRATION[number]),
                xyz_from_balanced: self.matrix(tag::FORWARD_MATRIX[number]),
            });
        }
        let neutral = self.three(tag::AS_SHOT_NEUTRAL).map(White::Neutral);
        let place = || <[f64; 2]>::try_from(self.directory.values(self.input, tag::AS_SHOT_WHITE)?).ok();
        let mut place = place;
        let white = neutral.or_else(|| place().map(White::Place));
        let analog = self.three(tag::ANALOG_BALANCE);
        development(&lights, analog, white)
    }
}
