//! Files that avifenc 0.11 made of [`level`].
//!
//! What avifdec of the same version made of those with loss lies beside them, as PNG. `turned.avif` has properties that
//! turn and mirror it, and an orientation in EXIF that says something else.

use trueup_core::StageContext;

use crate::color::PhotographColors;
use crate::formats::reading_tests::{
    HEIGHT, WIDTH, check_cut_off, difference, file, level, level_at, opacity, read, scanned,
};
use crate::metadata::header::{open, read_fields};

/// The file, samples of a pixel, bits, and most levels of difference.
#[test]
fn pictures_without_loss_are_what_they_were_made_of() {
    let cases: [(&[u8], usize, u16, f64); 5] = [
        (file!("lossless.avif"), 3, 8, 0.0),
        (file!("ycgco.avif"), 3, 8, 2.0),
        (file!("deep10.avif"), 3, 16, 0.5),
        (file!("deep12.avif"), 3, 16, 0.1),
        (file!("gray.avif"), 1, 8, 1.0),
    ];
    for (number, (bytes, channels, bits, most)) in cases.into_iter().enumerate() {
        let (_folder, source, decoded) = read(bytes);
        assert_eq!((source.width, source.height), (WIDTH, HEIGHT), "{number}");
        assert_eq!((decoded.channels(), decoded.sample_bits()), (channels, bits), "{number}");
        let found = difference(&decoded, |x, y, c| f64::from(level(x, y, c)));
        assert!(found <= most, "{number}: {found}");
    }
}

/// A file, and what the program that made it reads from it.
type Pair = (&'static [u8], &'static [u8]);

macro_rules! pair {
    ($name:literal) => {
        (file!($name), file!(concat!($name, ".png")))
    };
}

#[test]
fn pictures_with_loss_are_what_other_programs_make_of_them() {
    // Where opacity is divided out, what both have rounded is as much as two and a half times as large.
    let cases: [(Pair, usize, f64); 7] = [
        (pair!("yuv420.avif"), 3, 1.0),
        (pair!("alpha.avif"), 4, 1.0),
        (pair!("premultiplied.avif"), 4, 3.0),
        (pair!("p3.avif"), 3, 1.0),
        (pair!("deep10.avif"), 3, 0.1),
        (pair!("deep12.avif"), 3, 0.1),
        (pair!("gray.avif"), 1, 0.0),
    ];
    for (number, ((file, elsewhere), channels, most)) in cases.into_iter().enumerate() {
        let (_folder, _, decoded) = read(file);
        let (_folder, _, expected) = read(elsewhere);
        assert_eq!((decoded.width(), decoded.height()), (WIDTH, HEIGHT), "{number}");
        assert_eq!(decoded.channels(), channels, "{number}");
        let found = difference(&decoded, |x, y, c| level_at(&expected, x, y, c));
        assert!(found <= most, "{number}: {found}");
        if channels == 4 {
            let found = |x| (level_at(&decoded, x, 5, 3) - f64::from(opacity(x))).abs();
            assert!((0..WIDTH).all(|x| found(x) <= 1.0), "{number}");
        }
    }
}

#[test]
fn tiles_are_put_together() {
    let (_folder, source, decoded) = read(file!("grid.avif"));
    assert_eq!((source.width, source.height), (256, 256));
    let found = difference(&decoded, |x, y, c| match [x, y].iter().any(|place| place.abs_diff(128) <= 4) {
        // Color differences of one tile reach into the next, whose colors are others.
        true => level_at(&decoded, x, y, c),
        false => f64::from(level(x % 128 * 23 / 127, y % 128 * 17 / 127, c)),
    });
    assert!(found <= 6.0, "{found}");
}

#[test]
fn what_the_file_says_of_orientation_counts() {
    let (_folder, source, decoded) = read(file!("turned.avif"));
    assert_eq!((source.width, source.height, source.orientation), (HEIGHT, WIDTH, 1));
    // A quarter turn anticlockwise, then top and bottom exchanged: rows and columns are, as in what heif-convert 1.15
    // makes of it.
    let found = difference(&decoded, |x, y, c| f64::from(level(y, x, c)));
    assert!(found <= 3.0, "{found}");
}

#[test]
fn exif_and_color_spaces_are_read() {
    let (_folder, source, _) = read(file!("turned.avif"));
    // 24 mm on film: of the diagonal of 30 pixels, 24 / 43.27.
    let focal = source.focal_prior.expect("a focal length").focal_px;
    assert!((focal - 30.0 * 24.0 / 43.266_615).abs() < 1e-6, "{focal}");
    assert_eq!(read_fields(&source.path, &[exif::Tag::FocalLengthIn35mmFilm]).len(), 1);
    let space = |bytes: &[u8]| {
        let (_folder, source, _) = read(bytes);
        let (mut input, reading) = open(&source.path).expect("a file");
        let icc = reading.icc(&mut input);
        (PhotographColors::survey(&[source], &StageContext::default()).name(), icc.is_some())
    };
    assert_eq!(space(file!("yuv420.avif")), ("sRGB".to_owned(), false));
    assert_eq!(space(file!("p3.avif")), ("primaries 12, transfer 13 of H.273".to_owned(), true));
}

#[test]
fn files_that_are_cut_off_are_refused() {
    for whole in [file!("yuv420.avif"), file!("alpha.avif"), file!("grid.avif")] {
        check_cut_off(whole);
    }
}

/// A file in which the only bytes like `old` are others.
fn with(file: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let places: Vec<usize> = (0..file.len()).filter(|&at| file[at..].starts_with(old)).collect();
    let [place] = places[..] else { panic!("{places:?}") };
    [&file[..place], new, &file[place + old.len()..]].concat()
}

/// Why a file is refused, when it is looked at or when it is decoded.
fn refusal(bytes: &[u8]) -> String {
    let (_folder, sources) = scanned(bytes);
    match sources.photographs.first() {
        None => sources.rejected.into_iter().map(|rejected| rejected.reason).collect(),
        Some(source) => crate::decode::photograph(source).expect_err("refused").to_string(),
    }
}

#[test]
fn what_is_coded_is_what_is_stated() {
    let size = |width: u32, height: u32| [&b"ispe\0\0\0\0"[..], &width.to_be_bytes(), &height.to_be_bytes()].concat();
    let whole = file!("lossless.avif");
    // The decoder finds out; before it has allocated anything of that size.
    for (width, height) in [(48, 18), (20, 18), (24, 17)] {
        let words = refusal(&with(whole, &size(24, 18), &size(width, height)));
        assert!(words.contains("larger than is stated") || words.contains("are stated"), "{words}");
    }
    let words = refusal(&with(whole, &size(24, 18), &size(u32::MAX, u32::MAX)));
    assert!(words.contains("megapixels"), "{words}");
    let words = refusal(&with(whole, &size(24, 18), &size(0, 18)));
    assert!(words.contains("no pixels"), "{words}");
    // 8 bits that are said to be 10.
    let words = refusal(&with(whole, b"av1C\x81\x20\x00", b"av1C\x81\x20\x40"));
    assert!(words.contains("10 bits are stated, 8 coded"), "{words}");
    // Tiles that are fewer, or do not reach.
    let grid = |rows: u8, side: u16| {
        let side = side.to_be_bytes();
        [&[0, 0, rows - 1, 1][..], &side, &side].concat()
    };
    let whole = file!("grid.avif");
    assert!(refusal(&with(whole, &grid(2, 256), &grid(1, 256))).contains("not as many tiles"));
    for side in [128, 257] {
        assert!(refusal(&with(whole, &grid(2, 256), &grid(2, side))).contains("do not make up"));
    }
}

#[test]
fn what_cannot_be_shown_as_it_should_is_refused() {
    // Its mirroring as something else that must be heeded.
    let words = refusal(&with(file!("turned.avif"), b"imir", b"news"));
    assert!(words.contains("a property that is not known"), "{words}");
    let words =
        refusal(&with(file!("lossless.avif"), b"infe\x02\0\0\0\0\x01\0\0av01", b"infe\x02\0\0\0\0\x01\0\0j2k1"));
    assert!(words.contains("neither coded by AV1"), "{words}");
    // Its matrix as one that is derived from its primaries, without the luma that is needed for it.
    let words = refusal(&with(file!("yuv420.avif"), b"nclx\0\x01\0\x0d\0\x06", b"nclx\0\x01\0\x0d\0\x0d"));
    assert!(words.contains("of a rare kind"), "{words}");
}

#[test]
fn a_part_of_a_picture_is_cut_out_and_turned() {
    // In place of the mirroring, which no other box depends on: 20 x 16 pixels, their middle 1 to the right of the
    // whole's and 1 up.
    let whole = file!("turned.avif");
    let start = whole.windows(4).position(|kind| kind == b"imir").expect("mirroring") - 4;
    let fractions: Vec<u8> =
        [20_u32, 1, 16, 1, 1, 1, 1_u32.wrapping_neg(), 1].iter().flat_map(|n| n.to_be_bytes()).collect();
    let crop = [&40_u32.to_be_bytes()[..], b"clap", &fractions].concat();
    let mut bytes = [&whole[..start], &crop, &whole[start + 9..]].concat();
    // Boxes around it, and where the items lie behind it, are 31 bytes longer and further.
    let grown = |bytes: &mut Vec<u8>, at: usize| {
        let number = u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")) + 31;
        bytes[at..at + 4].copy_from_slice(&number.to_be_bytes());
    };
    for kind in [b"meta", b"iprp", b"ipco"] {
        let at = bytes.windows(4).position(|found| found == kind).expect("a box") - 4;
        grown(&mut bytes, at);
    }
    let list = bytes.windows(4).position(|found| found == b"iloc").expect("places") + 4;
    for item in 0..2 {
        grown(&mut bytes, list + 8 + item * 14 + 6);
    }
    let (_folder, source, decoded) = read(&bytes);
    assert_eq!((source.width, source.height), (16, 20));
    // From column 3 and row 0 on; what was the last column is the first row.
    let found = difference(&decoded, |x, y, c| f64::from(level(3 + 19 - y, x, c)));
    assert!(found <= 3.0, "{found}");
}
