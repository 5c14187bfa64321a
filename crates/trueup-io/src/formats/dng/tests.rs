//! Files by hand, and two that other programs made of smooth colors seen by a camera whose own colors are far from
//! sRGB's: PiDNG 4 wrote them, the lossless JPEG in one by imagecodecs. LibRaw (rawpy 0.28) develops them to within 0.2
//! and 0.8 levels of the same colors.

use tempfile::TempDir;
use trueup_core::StageContext;
use trueup_core::raster::Photograph;

use crate::color::PhotographColors;
use crate::decode::photograph;
use crate::formats::reading_tests::{difference, file, level_at, read, scanned};
use crate::metadata::header::read_fields;
use crate::source::Sources;

/// The colors of both files, at a pixel as it is stored.
fn smooth(x: usize, y: usize, c: usize) -> f64 {
    let (x, y) = (x as f64, y as f64);
    [40.0 + 1.5 * x, 60.0 + 2.0 * y, 200.0 - x - y][c]
}

const WIDTH: usize = 48;
const HEIGHT: usize = 36;

/// Pixels whose neighbors are mirrored.
const BORDER: usize = 3;

#[test]
fn negatives_of_other_programs_are_developed() {
    let (_folder, source, decoded) = read(file!("lossless.dng"));
    assert_eq!((source.width, source.height, source.orientation), (WIDTH, HEIGHT, 1));
    assert_eq!(source.camera_model.as_deref(), Some("Maker Camera"));
    assert_eq!((decoded.channels(), decoded.sample_bits()), (3, 16));
    let inside = |x: usize, y: usize| (BORDER..WIDTH - BORDER).contains(&x) && (BORDER..HEIGHT - BORDER).contains(&y);
    let off = |picture: &Photograph, place: fn(usize, usize) -> [usize; 2]| {
        difference(picture, |x, y, c| {
            let [column, row] = place(x, y);
            if inside(column, row) { smooth(column, row, c) } else { level_at(picture, x, y, c) }
        })
    };
    let found = off(&decoded, |x, y| [x, y]);
    assert!(found <= 0.5, "{found}");
    // 12 bits, packed; blue in the first row; to be turned clockwise, so that the first column is the last row's
    // mirror.
    let (_folder, source, decoded) = read(file!("packed.dng"));
    assert_eq!((source.width, source.height, source.orientation), (HEIGHT, WIDTH, 6));
    let found = off(&decoded, |x, y| [y, HEIGHT - 1 - x]);
    assert!(found <= 1.0, "{found}");
}

/// Values of a field.
#[derive(Clone)]
enum Values {
    Bytes(Vec<u8>),
    Short(Vec<u16>),
    Long(Vec<u32>),
    /// In ten thousandths.
    Ratio(Vec<i32>),
}

use Values::{Bytes, Long, Ratio, Short};

type Fields = Vec<(u16, Values)>;

/// The bytes of a directory that begins at `at`, values behind it (TIFF 6.0, section 2).
fn directory(mut fields: Fields, at: usize) -> Vec<u8> {
    fields.sort_by_key(|(tag, _)| *tag);
    let mut entries = (fields.len() as u16).to_le_bytes().to_vec();
    let mut behind = Vec::new();
    let start = at + 2 + fields.len() * 12 + 4;
    for (tag, values) in fields {
        let (kind, count, mut bytes): (u16, usize, Vec<u8>) = match values {
            Bytes(values) => (1, values.len(), values),
            Short(values) => (3, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect()),
            Long(values) => (4, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect()),
            Ratio(values) => {
                let pairs = values.iter().flat_map(|value| [*value, 10_000]);
                (10, values.len(), pairs.flat_map(|value| value.to_le_bytes()).collect())
            }
        };
        entries.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        entries.extend((count as u32).to_le_bytes());
        if bytes.len() > 4 {
            entries.extend(((start + behind.len()) as u32).to_le_bytes());
            behind.extend(bytes);
        } else {
            bytes.resize(4, 0);
            entries.extend(bytes);
        }
    }
    entries.extend([0; 4]);
    [entries, behind].concat()
}

const SIDE: usize = 24;
/// Where the sensor's numbers lie.
const START: usize = 8;

/// A file of these numbers, with the sensor's picture below a directory of a small picture.
fn negative(numbers: &[u16], sensor: Fields, main: Fields) -> Vec<u8> {
    let mut bytes = [&b"II*\0"[..], &[0; 4]].concat();
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    let below = bytes.len();
    bytes.extend(directory(sensor, below));
    let first = bytes.len();
    let small: Fields = vec![
        (254, Long(vec![1])),
        (256, Long(vec![16])),
        (257, Long(vec![16])),
        (258, Short(vec![8])),
        (259, Short(vec![1])),
        (262, Short(vec![1])),
        (273, Long(vec![START as u32])),
        (277, Short(vec![1])),
        (278, Long(vec![16])),
        (279, Long(vec![256])),
        (330, Long(vec![below as u32])),
        (50706, Bytes(vec![1, 4, 0, 0])),
    ];
    bytes.extend(directory(with(small, &main), first));
    bytes[4..8].copy_from_slice(&(first as u32).to_le_bytes());
    bytes
}

/// The same fields, but these in place of those of the same tags.
fn with(mut fields: Fields, others: &[(u16, Values)]) -> Fields {
    fields.retain(|(tag, _)| others.iter().all(|(other, _)| other != tag));
    fields.extend(others.iter().cloned());
    fields
}

/// A sensor that is as sRGB (IEC 61966-2-1, section 5.2): from XYZ, in D65, gray being gray.
fn of_srgb() -> Fields {
    let matrix = vec![32_406, -15_372, -4_986, -9_689, 18_758, 415, 557, -2_040, 10_570];
    vec![(50721, Ratio(matrix)), (50778, Short(vec![21])), (50728, Ratio(vec![10_000; 3]))]
}

/// Three colors a pixel, in one strip.
fn linear() -> Fields {
    let bytes = SIDE * SIDE * 3 * 2;
    vec![
        (254, Long(vec![0])),
        (256, Long(vec![SIDE as u32])),
        (257, Long(vec![SIDE as u32])),
        (258, Short(vec![16; 3])),
        (259, Short(vec![1])),
        (262, Short(vec![34_892])),
        (273, Long(vec![START as u32])),
        (277, Short(vec![3])),
        (278, Long(vec![SIDE as u32])),
        (279, Long(vec![bytes as u32])),
    ]
}

/// What a mosaic has otherwise; the same numbers are more rows then.
fn mosaic(pattern: [u8; 4]) -> Fields {
    let others = [
        (258, Short(vec![16])),
        (262, Short(vec![32_803])),
        (277, Short(vec![1])),
        (33421, Short(vec![2, 2])),
        (33422, Bytes(pattern.to_vec())),
    ];
    with(linear(), &others)
}

/// Light that is 0.25 of white at the left and 0.5 at the right, gray.
fn numbers() -> Vec<u16> {
    (0..SIDE * SIDE * 3).map(|at| if at / 3 % SIDE < SIDE / 2 { 16_384 } else { 32_768 }).collect()
}

/// 0.25 and 0.5 by sRGB's curve, in levels of 8 bits (IEC 61966-2-1, equation 9).
const QUARTER: f64 = 136.96;
const HALF: f64 = 187.52;

#[track_caller]
fn check_level(bytes: &[u8], [x, y]: [usize; 2], wanted: [f64; 3]) {
    let (_folder, _, decoded) = read(bytes);
    let found = [0, 1, 2].map(|c| level_at(&decoded, x, y, c));
    assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 0.1), "{found:?}");
}

#[test]
fn a_sub_image_is_never_taken_for_the_photograph() {
    let bytes = negative(&numbers(), linear(), of_srgb());
    let (_folder, source, _) = read(&bytes);
    assert_eq!((source.width, source.height), (SIDE, SIDE), "not the 16 x 16 of the first directory");
    check_level(&bytes, [3, 9], [QUARTER; 3]);
    check_level(&bytes, [20, 9], [HALF; 3]);
    // A preview below the first directory is none either.
    let preview = with(linear(), &[(254, Long(vec![1]))]);
    assert!(refusal(&negative(&numbers(), preview, of_srgb())).contains("without a picture of the sensor"));
}

/// Cameras say in EXIF what their own pictures are in; what is developed here is in sRGB.
#[test]
fn what_is_developed_is_in_srgb_whatever_exif_says() {
    const EXIF_DIRECTORY: u16 = 34_665;
    const COLOR_SPACE: u16 = 0xa001;
    const ADOBE_RGB: u16 = 2;
    let pointing_to = |place: usize| {
        let main = with(of_srgb(), &[(EXIF_DIRECTORY, Long(vec![place as u32]))]);
        negative(&numbers(), linear(), main)
    };
    let end = pointing_to(0).len();
    let exif = directory(vec![(COLOR_SPACE, Short(vec![ADOBE_RGB]))], end);
    let (_folder, source, _) = read(&[pointing_to(end), exif].concat());
    let fields = read_fields(&source.path, &[exif::Tag::ColorSpace]);
    assert_eq!(fields[0].value.get_uint(0), Some(ADOBE_RGB.into()), "it is said");
    assert!(PhotographColors::survey(&[source], &StageContext::default()).is_srgb());
}

#[test]
fn black_white_and_exposure_are_heeded() {
    let gray = [QUARTER; 3];
    // 8192 of black and 40960 of white: 16384 is a quarter.
    let levels = [(50714, Short(vec![8192])), (50717, Long(vec![40_960]))];
    check_level(&negative(&numbers(), with(linear(), &levels), of_srgb()), [3, 9], gray);
    // A stop less and white of half.
    let main = with(of_srgb(), &[(50730, Ratio(vec![-10_000]))]);
    let levels = [(50717, Long(vec![32_768]))];
    check_level(&negative(&numbers(), with(linear(), &levels), main), [3, 9], gray);
    // What the numbers stand for: 7 a quarter, 200 a half.
    let table: Vec<u16> = (0..256).map(|number| if number < 100 { 16_384 } else { 32_768 }).collect();
    let told: Vec<u16> = numbers().iter().map(|number| if *number == 16_384 { 7 } else { 200 }).collect();
    let bytes = negative(&told, with(linear(), &[(50712, Short(table)), (50717, Long(vec![65_535]))]), of_srgb());
    check_level(&bytes, [3, 9], gray);
    check_level(&bytes, [20, 9], [HALF; 3]);
}

#[test]
fn what_is_clipped_is_white() {
    // Gray has half as much red as green; white is where green is clipped.
    let main =
        with(of_srgb(), &[(50728, Ratio(vec![5_000, 10_000, 10_000])), (50727, Ratio(vec![5_000, 10_000, 10_000]))]);
    let mut numbers = numbers();
    for pixel in numbers.as_chunks_mut::<3>().0 {
        *pixel = if pixel[0] == 16_384 { [16_384, 32_768, 32_768] } else { [40_000, 65_535, 65_535] };
    }
    let bytes = negative(&numbers, linear(), main);
    check_level(&bytes, [3, 9], [HALF; 3]);
    check_level(&bytes, [20, 9], [255.0; 3]);
}

#[test]
fn a_mosaic_is_developed_within_what_saw_light() {
    // 24 x 24 numbers, of which the first two columns and three rows saw none; the pattern begins behind them.
    let color = |x: usize, y: usize| [[16_384, 32_768], [32_768, 65_535]][(y + 1) % 2][x % 2];
    let numbers: Vec<u16> = (0..SIDE * SIDE)
        .map(|at| (at % SIDE, at / SIDE))
        .map(|(x, y)| if x < 2 || y < 3 { 0 } else { color(x, y) })
        .collect();
    let area = [(50829, Long(vec![3, 2, 24, 24])), (279, Long(vec![2 * numbers.len() as u32]))];
    let bytes = negative(&numbers, with(mosaic([0, 1, 1, 2]), &area), of_srgb());
    let (_folder, source, decoded) = read(&bytes);
    assert_eq!((source.width, source.height), (22, 21));
    assert!(difference(&decoded, |_, _, c| [QUARTER, HALF, 255.0][c]) < 0.1);
    let crop = [(50719, Short(vec![3, 2])), (50720, Short(vec![17, 18]))];
    let bytes = negative(&numbers, with(with(mosaic([0, 1, 1, 2]), &area), &crop), of_srgb());
    let (_folder, source, decoded) = read(&bytes);
    assert_eq!((source.width, source.height), (17, 18));
    assert!(difference(&decoded, |_, _, c| [QUARTER, HALF, 255.0][c]) < 0.1);
}

#[test]
fn tiles_are_put_together() {
    // Four tiles of 16 x 16 for 24 x 24 pixels; what is outside of these is absurd.
    let tile = |tile: usize| {
        (0..16 * 16).flat_map(move |at| {
            let (x, y) = (tile % 2 * 16 + at % 16, tile / 2 * 16 + at / 16);
            let is_inside = x < SIDE && y < SIDE;
            [if is_inside { if x < SIDE / 2 { 16_384 } else { 32_768 } } else { 65_535_u16 }; 3]
        })
    };
    let numbers: Vec<u16> = (0..4).flat_map(tile).collect();
    let tile_bytes = 16 * 16 * 3 * 2_u32;
    let tiles = [
        (322, Long(vec![16])),
        (323, Long(vec![16])),
        (324, Long((0..4).map(|tile| START as u32 + tile * tile_bytes).collect())),
        (325, Long(vec![tile_bytes; 4])),
    ];
    let mut fields = with(linear(), &tiles);
    fields.retain(|(tag, _)| ![273, 278, 279].contains(tag));
    let bytes = negative(&numbers, fields, of_srgb());
    let (_folder, _, decoded) = read(&bytes);
    assert!(difference(&decoded, |x, _, _| if x < SIDE / 2 { QUARTER } else { HALF }) < 0.1);
}

/// Why a file is refused, with what to do about it.
fn refusal(bytes: &[u8]) -> String {
    let (_folder, sources): (TempDir, Sources) = scanned(bytes);
    match sources.photographs.first() {
        None => sources.rejected.into_iter().map(|rejected| format!("{} {}", rejected.reason, rejected.hint)).collect(),
        Some(source) => photograph(source).expect_err("refused").to_string(),
    }
}

#[test]
fn what_is_not_developed_names_what_does() {
    let of_sensor = |others: &[(u16, Values)]| negative(&numbers(), with(linear(), others), of_srgb());
    let unknown = [1_u32, 7, 0x0103_0000, 0, 0].iter().flat_map(|number| number.to_be_bytes()).collect();
    let no_matrix: Fields = of_srgb().into_iter().filter(|(tag, _)| *tag != 50721).collect();
    let cases = [
        (of_sensor(&[(259, Short(vec![34_892]))]), "compressed with loss"),
        (of_sensor(&[(259, Short(vec![52_546]))]), "by JPEG XL"),
        (of_sensor(&[(339, Short(vec![3; 3]))]), "of unusual samples"),
        (of_sensor(&[(284, Short(vec![2]))]), "of unusual samples"),
        (of_sensor(&[(51009, Bytes(unknown))]), "corrections that are not known"),
        (negative(&numbers(), mosaic([0, 1, 2, 1]), of_srgb()), "not Bayer's"),
        (negative(&numbers(), with(mosaic([0, 1, 1, 2]), &[(33421, Short(vec![6, 6]))]), of_srgb()), "not Bayer's"),
        (negative(&numbers(), linear(), no_matrix), "does not say what its colors are"),
    ];
    for (bytes, words) in cases {
        let refusal = refusal(&bytes);
        assert!(refusal.contains(words) && refusal.contains("darktable-cli photo.dng photo.tif"), "{words}: {refusal}");
    }
}

#[test]
fn what_contradicts_itself_is_refused() {
    let of_sensor = |others: &[(u16, Values)]| negative(&numbers(), with(linear(), others), of_srgb());
    for others in [
        (50717, Long(vec![0])),
        (50829, Long(vec![0, 0, 25, 24])),
        (50829, Long(vec![20, 0, 4, 24])),
        (50720, Short(vec![25, 24])),
        (278, Long(vec![2])),
        (256, Long(vec![0])),
        (258, Short(vec![16, 8, 16])),
    ] {
        let tag = others.0;
        let refusal = refusal(&of_sensor(&[others]));
        assert!(refusal.contains("contradicts itself"), "{tag}: {refusal}");
    }
    let giant = [256, 257, 278].map(|tag| (tag, Long(vec![u32::MAX / 2])));
    assert!(refusal(&of_sensor(&giant)).contains("megapixels"));
    assert!(refusal(&of_sensor(&[(279, Long(vec![100]))])).contains("cut off"));
    assert!(refusal(&of_sensor(&[(273, Long(vec![u32::MAX]))])).contains("not in the file"));
}

#[test]
fn files_that_are_cut_off_are_refused() {
    let whole = file!("lossless.dng");
    for end in (8..whole.len()).step_by(50) {
        assert!(!refusal(&whole[..end]).is_empty(), "{end}");
    }
}
