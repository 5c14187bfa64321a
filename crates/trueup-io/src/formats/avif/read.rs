//! Photographs in AVIF.
//!
//! What would be allocated is judged first, by the sizes that the file states; the decoder refuses pictures that are
//! larger than that.

use exif::{Field, Tag};
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

use super::av1::{self, Frame};
use super::color::{ChromaPlace, Matrix, Planes, Range, Reading, pixels as colored};
use super::items::Items;
use crate::color::{names_primaries, profile_of_code_points};
use crate::decode::orientation::upright;
use crate::format::{HeaderError, Input, StoredPixels};
use crate::formats::alpha::{Share, straight};
use crate::formats::boxes::{Fields, contents};
use crate::formats::decoded::{check_unchanged, damaged, eight, sixteen};
use crate::metadata::block;
use crate::metadata::exif_fields::ExifFields;

/// What memory is asked for.
const READING: &str = "reading an AVIF file";

/// Bytes a pixel takes in memory while it is decoded, for [`MOST_CODED`] coded ones: three planes of 16 bits in the
/// decoder and out of it, one of alpha; what is handed out, and turned, comes when the decoder is done.
pub(super) const PIXEL_BYTES: usize = (2 * 3 + 1) * size_of::<u16>() * MOST_CODED;

/// Most coded pixels for one that is shown, beside a tile of them: a crop can be as small as it likes, and what is
/// decoded for it as large.
const MOST_CODED: usize = 2;
const TILE_PIXELS: usize = 1 << 20;

/// Properties that are heeded, or that change nothing of the pixels: shape of pixels, depth, what a screen should be
/// capable of.
const HEEDED: [&[u8; 4]; 14] = [
    b"av1C", b"ispe", b"colr", b"irot", b"imir", b"clap", b"auxC", b"a1op", b"lsel", b"a1lx", b"pixi", b"pasp",
    b"clli", b"mdcv",
];

/// The layer that stands for all of them (ISO/IEC 23008-12, section 6.5.11).
const ALL_LAYERS: u64 = 0xffff;

/// What makes an auxiliary picture the opacity of another (AV1 Image File Format, section 4.1).
const ALPHA: [&[u8]; 2] = [b"urn:mpeg:mpegB:cicp:systems:auxiliary:alpha", b"urn:mpeg:hevc:2015:auxid:1"];

/// Why a file is not read.
enum Refusal {
    Damaged(&'static str),
    Unsupported(&'static str),
}

use Refusal::{Damaged, Unsupported};

impl From<Refusal> for HeaderError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Damaged(words) => Self::damaged(words),
            Unsupported(words) => Self::Unsupported(words.to_owned()),
        }
    }
}

impl Refusal {
    fn words(&self) -> &'static str {
        match self {
            Damaged(words) | Unsupported(words) => words,
        }
    }
}

/// A picture that is one item, or is put together from items.
struct Coded {
    width: usize,
    height: usize,
    columns: usize,
    tiles: Vec<u64>,
    tile_size: [usize; 2],
    bits: usize,
    place: ChromaPlace,
    operating_point: u8,
}

/// What a file says of its picture.
struct Described<'a> {
    items: Items<'a>,
    coded: Coded,
    alpha: Option<Coded>,
    is_premultiplied: bool,
    code_points: Option<CodePoints>,
    /// Left, top, width and height of what is shown.
    crop: [usize; 4],
    /// How the crop is to be turned, as an orientation of EXIF.
    orientation: u8,
}

/// Code points of ITU-T H.273.
#[derive(Debug, Clone, Copy)]
struct CodePoints {
    primaries: u16,
    transfer: u16,
    matrix: u16,
    is_full: bool,
}

fn described(file: &[u8]) -> std::result::Result<Described<'_>, Refusal> {
    let items = Items::of(file).ok_or(Damaged("its list of items cannot be read"))?;
    let coded = coded(&items, items.primary)?;
    let alpha = items.referring_to(items.primary, b"auxl").find(|&item| {
        let kind = items.property(item, b"auxC").and_then(|content| content.get(4..));
        kind.is_some_and(|kind| {
            ALPHA.iter().any(|alpha| kind.strip_prefix(*alpha).is_some_and(|rest| rest.first() == Some(&0)))
        })
    });
    let is_premultiplied = alpha.is_some_and(|alpha| items.referred_by(items.primary, b"prem").contains(&alpha));
    let alpha = alpha.map(|alpha| self::coded(&items, alpha)).transpose()?;
    if alpha.as_ref().is_some_and(|alpha| (alpha.width, alpha.height) != (coded.width, coded.height)) {
        return Err(Unsupported("its opacity is of another size than its colors"));
    }
    let (_, code_points) = colors(&items);
    if code_points.is_some_and(|points| Matrix::of_code_point(points.matrix).is_none()) {
        return Err(Unsupported("its color differences are of a rare kind"));
    }
    let crop = crop(&items, &coded)?;
    let pixels =
        |coded: &Coded| coded.tile_size[0].saturating_mul(coded.tile_size[1]).saturating_mul(coded.tiles.len());
    let most = crop[2].saturating_mul(crop[3]).saturating_mul(MOST_CODED).saturating_add(TILE_PIXELS);
    if std::iter::once(&coded).chain(&alpha).any(|coded| pixels(coded) > most) {
        return Err(Damaged("the picture is a small part of what is coded"));
    }
    let orientation = orientation(&items);
    Ok(Described { items, coded, alpha, is_premultiplied, code_points, crop, orientation })
}

/// How a picture is coded.
///
/// # Source
/// ISO/IEC 23008-12, section 6.6.2.3 (grids); AV1 Codec ISO Media File Format Binding, section 2.3 (av1C).
fn coded(items: &Items<'_>, item: u64) -> std::result::Result<Coded, Refusal> {
    let heeded = |kind: &[u8; 4]| HEEDED.contains(&kind);
    if items.properties(item).any(|(kind, _, is_essential)| is_essential && !heeded(&kind)) {
        return Err(Unsupported("it must not be shown without a property that is not known"));
    }
    match &items.kind(item).ok_or(Damaged("it has no primary picture"))? {
        b"av01" => {
            let [width, height] = size(items, item)?;
            of_tiles(items, [width, height], 1, vec![item])
        }
        b"grid" => {
            let layout = items.bytes(item).ok_or(Damaged("how its tiles lie cannot be read"))?;
            let layout = (|| {
                let mut fields = Fields(&layout);
                fields.number(1)?;
                let number_bytes = if fields.number(1)? & 1 == 0 { 2 } else { 4 };
                let mut count = || Some(fields.number(1)? as usize + 1);
                let (rows, columns) = (count()?, count()?);
                Some((rows, columns, [fields.number(number_bytes)? as usize, fields.number(number_bytes)? as usize]))
            })();
            let (rows, columns, whole) = layout.ok_or(Damaged("how its tiles lie cannot be read"))?;
            let tiles = items.referred_by(item, b"dimg");
            if tiles.len() != rows * columns {
                return Err(Damaged("it has not as many tiles as it says"));
            }
            let tiles = tiles.to_vec();
            let coded = of_tiles(items, whole, columns, tiles)?;
            let [tile_width, tile_height] = coded.tile_size;
            let reaches = |tile: usize, count: usize, whole: usize| {
                tile.saturating_mul(count) >= whole && tile.saturating_mul(count - 1) < whole
            };
            if !reaches(tile_width, columns, whole[0]) || !reaches(tile_height, rows, whole[1]) {
                return Err(Damaged("its tiles do not make up the picture"));
            }
            Ok(coded)
        }
        _ => Err(Unsupported("its picture is neither coded by AV1 nor made of such tiles")),
    }
}

fn of_tiles(
    items: &Items<'_>,
    [width, height]: [usize; 2],
    columns: usize,
    tiles: Vec<u64>,
) -> std::result::Result<Coded, Refusal> {
    let form = |tile: u64| -> std::result::Result<_, Refusal> {
        if items.kind(tile) != Some(*b"av01") {
            return Err(Unsupported("its tiles are not coded by AV1"));
        }
        let form = items.property(tile, b"av1C").ok_or(Damaged("nothing is said of how it is coded"))?;
        let form = *form.get(2).ok_or(Damaged("what is said of how it is coded is cut off"))?;
        Ok((size(items, tile)?, form))
    };
    let first = *tiles.first().ok_or(Damaged("it has no tiles"))?;
    let (tile_size, form_of_first) = form(first)?;
    for &tile in &tiles {
        if form(tile)? != (tile_size, form_of_first) {
            return Err(Damaged("its tiles differ"));
        }
    }
    if width == 0 || height == 0 || tile_size.contains(&0) {
        return Err(Damaged("it has no pixels"));
    }
    let layer = items.property(first, b"lsel").and_then(|content| Fields(content).number(2));
    if layer.is_some_and(|layer| layer != ALL_LAYERS) {
        return Err(Unsupported("it is one of several layers"));
    }
    let operating_point = items.property(first, b"a1op").and_then(|content| content.first()).copied().unwrap_or(0);
    Ok(Coded {
        width,
        height,
        columns,
        tiles,
        tile_size,
        bits: match form_of_first >> 5 & 3 {
            0 => 8,
            2 => 10,
            3 => 12,
            _ => return Err(Damaged("12 bits that are not many")),
        },
        // 1 is between two rows, 2 on the first pixel; both are at the left.
        place: match form_of_first & 3 {
            1 => ChromaPlace::Left,
            2 => ChromaPlace::First,
            _ => ChromaPlace::Middle,
        },
        operating_point,
    })
}

fn size(items: &Items<'_>, item: u64) -> std::result::Result<[usize; 2], Refusal> {
    let content = items.property(item, b"ispe").ok_or(Damaged("it does not say how large it is"))?;
    let mut fields = Fields(content);
    let mut size = || {
        fields.number(4)?;
        Some([fields.number(4)? as usize, fields.number(4)? as usize])
    };
    size().ok_or(Damaged("how large it is was cut off"))
}

/// The profile, and the code points, of which the primary picture says both or one or none.
///
/// # Source
/// ISO/IEC 14496-12, section 12.1.5.
fn colors(items: &Items<'_>) -> (Option<Vec<u8>>, Option<CodePoints>) {
    let (mut icc, mut code_points) = (None, None);
    for (_, content, _) in items.properties(items.primary).filter(|(kind, ..)| kind == b"colr") {
        let Some((kind, rest)) = content.split_at_checked(4) else { continue };
        match kind {
            b"prof" | b"rICC" => icc = icc.or_else(|| Some(rest.to_vec())),
            b"nclx" => code_points = code_points.or_else(|| of_numbers(rest)),
            _ => {}
        }
    }
    (icc, code_points)
}

fn of_numbers(content: &[u8]) -> Option<CodePoints> {
    let mut fields = Fields(content);
    let mut number = || Some(fields.number(2)? as u16);
    let (primaries, transfer, matrix) = (number()?, number()?, number()?);
    Some(CodePoints { primaries, transfer, matrix, is_full: fields.number(1)? & 0x80 != 0 })
}

/// Left, top, width and height of what is shown of a picture.
///
/// # Source
/// ISO/IEC 14496-12, section 12.1.4.2: width and height, and how far the middle lies from that of the whole, as
/// fractions.
fn crop(items: &Items<'_>, coded: &Coded) -> std::result::Result<[usize; 4], Refusal> {
    let Some(content) = items.property(items.primary, b"clap") else { return Ok([0, 0, coded.width, coded.height]) };
    let mut fields = Fields(content);
    let mut fraction = || Some([fields.number(4)? as u32, fields.number(4)? as u32]);
    let fractions = [fraction(), fraction(), fraction(), fraction()];
    let [Some(width), Some(height), Some(right), Some(down)] = fractions else {
        return Err(Damaged("what is shown of it is cut off"));
    };
    let side = |extent: [u32; 2], offset: [u32; 2], whole: usize| {
        let size = f64::from(extent[0]) / f64::from(extent[1]);
        let start = (whole as f64 - size) / 2.0 + f64::from(offset[0] as i32) / f64::from(offset[1]);
        let is_inside = size >= 1.0 && start >= 0.0 && start + size <= whole as f64;
        (is_inside && size.fract() == 0.0 && start.fract() == 0.0).then_some((start as usize, size as usize))
    };
    let refused = Unsupported("what is shown of it ends between pixels, or outside of it");
    match (side(width, right, coded.width), side(height, down, coded.height)) {
        (Some((left, width)), Some((top, height))) => Ok([left, top, width, height]),
        _ => Err(refused),
    }
}

/// How a picture is to be turned, and then mirrored, as an orientation of EXIF.
///
/// # Source
/// ISO/IEC 23008-12, sections 6.5.10 (irot: quarter turns anticlockwise) and 6.5.12 (imir: 0 exchanges top and bottom,
/// 1 left and right); EXIF 3.0, section 4.6.5.1.
fn orientation(items: &Items<'_>) -> u8 {
    let first = |kind| items.property(items.primary, kind).and_then(|content| content.first()).copied();
    let turns = usize::from(first(b"irot").unwrap_or(0) & 3);
    match first(b"imir").map(|mirror| mirror & 1) {
        None => [1, 8, 3, 6][turns],
        Some(0) => [4, 5, 2, 7][turns],
        Some(_) => [2, 7, 4, 5][turns],
    }
}

impl Described<'_> {
    fn shown_size(&self) -> [usize; 2] {
        let [_, _, width, height] = self.crop;
        if self.orientation >= 5 { [height, width] } else { [width, height] }
    }

    /// The block of EXIF, from its byte order mark on.
    fn exif(&self) -> Option<Vec<u8>> {
        let items = &self.items;
        let item = items.referring_to(items.primary, b"cdsc").find(|&item| items.kind(item) == Some(*b"Exif"))?;
        let block = items.bytes(item)?;
        // Where the mark is, counted from behind this number (ISO/IEC 23008-12, annex A.2.1).
        let mut fields = Fields(&block);
        let start = usize::try_from(fields.number(4)?).ok()?;
        Some(fields.0.get(start..)?.to_vec())
    }
}

pub(super) fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let bytes = contents(input, READING).map_err(HeaderError::damaged)?;
    let described = described(&bytes)?;
    let [width, height] = described.shown_size();
    let bits = described.coded.bits as u16;
    Ok(StoredPixels { width, height, bits, is_float: false })
}

/// The profile; or one made of what the file says of its primaries and its curve in numbers.
pub(super) fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let bytes = contents(input, READING).ok()?;
    let (icc, code_points) = colors(&Items::of(&bytes)?);
    icc.or_else(|| code_points.and_then(|points| profile_of_code_points(points.primaries, points.transfer)))
}

/// The pixels are turned upright as the file itself says, which outranks the orientation of EXIF; so do the numbers of
/// its colors.
pub(super) fn exif(input: &mut Input) -> Option<ExifFields> {
    let bytes = contents(input, READING).ok()?;
    let described = described(&bytes).ok()?;
    let fields = ExifFields::from_exif(&block::parsed(described.exif()?)?).turned_already();
    let says_colors = described.code_points.is_some_and(|points| names_primaries(points.primaries));
    Some(if says_colors { fields.without_color_space() } else { fields })
}

pub(super) fn whole_fields(input: &mut Input, wanted: &[Tag]) -> Option<Vec<Field>> {
    let bytes = contents(input, READING).ok()?;
    Some(block::fields_of(&block::parsed(described(&bytes).ok()?.exif()?)?, wanted))
}

pub(super) fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let bytes = contents(&mut input, READING).map_err(|error| Error::io("reading", &source.path, error))?;
    let described = described(&bytes).map_err(|refusal| damaged(source, refusal.words()))?;
    let [width, height] = described.shown_size();
    check_unchanged(source, width, height)?;
    let failed = |words: String| damaged(source, words);
    let color = decoded(&described.items, &described.coded).map_err(failed)?;
    let alpha = described.alpha.as_ref().map(|alpha| decoded(&described.items, alpha)).transpose().map_err(failed)?;
    let matrix = described.code_points.map_or(color.matrix, |points| points.matrix);
    let reading = Reading {
        matrix: Matrix::of_code_point(matrix)
            .ok_or_else(|| damaged(source, "its color differences are of a rare kind"))?,
        range: Range {
            bits: described.coded.bits,
            is_full: described.code_points.map_or(color.range.is_full, |points| points.is_full),
        },
        place: described.coded.place,
    };
    if reading.matrix == Matrix::Identity && color.planes.sampling.is_some_and(|sampling| sampling.x > 1) {
        return Err(damaged(source, "its colors are no differences, and stored at reduced resolution"));
    }
    match described.coded.bits {
        8 => {
            let (channels, samples) = shown::<u8>(&described, &color, alpha.as_ref(), reading)?;
            eight(width, height, channels, samples)
        }
        _ => {
            let (channels, samples) = shown::<u16>(&described, &color, alpha.as_ref(), reading)?;
            sixteen(width, height, channels, samples)
        }
    }
}

/// What is shown, upright, with straight colors: how many samples a pixel has, and all of them.
fn shown<S: Share + Default + Send + Sync>(
    described: &Described<'_>,
    color: &Decoded,
    alpha: Option<&Decoded>,
    reading: Reading,
) -> Result<(usize, Vec<S>)> {
    let alpha = alpha.map(|alpha| (&alpha.planes, alpha.range));
    let colors = if color.planes.sampling.is_some() { 3 } else { 1 };
    let mut channels = colors + usize::from(alpha.is_some());
    let mut samples = straight(colored(&color.planes, reading, alpha), channels, described.is_premultiplied);
    if channels == 2 {
        // What turns pictures has gray, RGB and RGBA.
        samples = samples.as_chunks::<2>().0.iter().flat_map(|&[gray, alpha]| [gray, gray, gray, alpha]).collect();
        channels = 4;
    }
    let [left, top, width, height] = described.crop;
    let row_samples = color.planes.width * channels;
    if (width, height) != (color.planes.width, color.planes.height) {
        let rows = samples.chunks_exact(row_samples).skip(top).take(height);
        samples = rows.flat_map(|row| &row[left * channels..(left + width) * channels]).copied().collect();
    }
    let upright = upright(Raster::from_data(width, height, channels, samples)?, described.orientation);
    Ok((channels, upright.into_data()))
}

/// A picture put together from its tiles.
struct Decoded {
    planes: Planes,
    range: Range,
    matrix: u16,
}

fn decoded(items: &Items<'_>, coded: &Coded) -> std::result::Result<Decoded, String> {
    let mut whole: Option<Decoded> = None;
    for (number, &tile) in coded.tiles.iter().enumerate() {
        let data = items.bytes(tile).ok_or("a part of it is not in the file")?;
        let frame = av1::decode(data, coded.tile_size, coded.operating_point)?;
        if frame.bits() != coded.bits {
            return Err(format!("{} bits are stated, {} coded", coded.bits, frame.bits()));
        }
        let whole = whole.get_or_insert_with(|| empty(coded, &frame));
        if frame.sampling() != whole.planes.sampling {
            return Err("its tiles differ".to_owned());
        }
        let [column, row] = [number % coded.columns, number / coded.columns];
        place(&frame, [column * coded.tile_size[0], row * coded.tile_size[1]], &mut whole.planes)?;
    }
    whole.ok_or_else(|| "it has no tiles".to_owned())
}

/// A picture before its tiles are there.
fn empty(coded: &Coded, frame: &Frame) -> Decoded {
    let sampling = frame.sampling();
    let planes = Planes { width: coded.width, height: coded.height, sampling, samples: Vec::new() };
    let count = if sampling.is_some() { 3 } else { 1 };
    let samples = (0..count).map(|plane| vec![0; planes.size(plane).iter().product()]).collect();
    Decoded {
        planes: Planes { samples, ..planes },
        range: Range { bits: frame.bits(), is_full: frame.is_full_range() },
        matrix: frame.matrix(),
    }
}

/// Puts a tile in its place, of which what is outside of the picture is left out.
fn place(frame: &Frame, [x, y]: [usize; 2], planes: &mut Planes) -> std::result::Result<(), String> {
    let shares = planes.sampling.map_or([1, 1], |sampling| [sampling.x, sampling.y]);
    if x % shares[0] != 0 || y % shares[1] != 0 {
        return Err("its tiles share color differences".to_owned());
    }
    for plane in 0..planes.samples.len() {
        let [width, height] = planes.size(plane);
        let [left, top] = if plane == 0 { [x, y] } else { [x / shares[0], y / shares[1]] };
        let samples = &mut planes.samples[plane];
        frame.rows(plane, |row, values| {
            let row = top + row;
            if row < height && left < width {
                samples[row * width + left..(row + 1) * width].iter_mut().zip(values).for_each(|(to, from)| *to = from);
            }
        });
    }
    Ok(())
}
