//! Files that are read a byte at a time are what they are when read at once, whole or damaged.

use std::fs::File;
use std::io::{BufReader, Seek, Write};
use std::path::{Path, PathBuf};

use trueup_core::source::SourceImage;

use super::recognize;
use super::specimens::{Container, Specimen};
use crate::format::Input;

/// What is put in place of a byte of a damaged file.
const DAMAGE: u8 = 0x5a;

/// Places at which each file is damaged, in turn.
const PLACES: usize = 6;

/// All that is read of a file through a buffer of so many bytes, in words that tell any difference.
fn read_through(file: &File, buffer_bytes: usize) -> Vec<String> {
    let opened = || {
        let mut input: Input = BufReader::with_capacity(buffer_bytes, file.try_clone().expect("opened"));
        input.rewind().expect("a file");
        input
    };
    let Ok(Some(reading)) = recognize(&mut opened()) else { return vec!["no picture".to_owned()] };
    let stored = reading.stored(&mut opened());
    let mut read = vec![
        format!("{stored:?}"),
        format!("{:?}", reading.icc(&mut opened())),
        format!("{:?}", reading.exif(&mut opened())),
        format!("{:?}", reading.whole_fields(&mut opened(), &[exif::Tag::Make, exif::Tag::GPSAltitude])),
    ];
    if let Ok(stored) = stored {
        let source = SourceImage::unknown("photograph", "photograph", [stored.width, stored.height]);
        // What is larger is none of the files here: a damaged header claims it.
        if stored.width * stored.height <= 1 << 20 {
            let decoded = reading.pixels(&source, opened());
            read.push(decoded.map_or_else(|error| error.to_string(), |photograph| format!("{photograph:?}")));
        }
    }
    read
}

/// Files of every format that is read: those that other programs made, and those that are written here.
fn files() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/formats/files");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the files of the tests")
        .map(|entry| entry.expect("readable").path())
        // Pictures of what other programs read from those beside them: plain PNG.
        .filter(|path| path.extension().is_some_and(|extension| extension != "png"))
        .collect();
    paths.sort();
    let mut files: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).expect("readable")).collect();
    let picture = Specimen::eight(24, 18, |x, y| [40 + 3 * x as u8, 60 + 4 * y as u8, 200 - 2 * x as u8]);
    files.extend(Container::ALL.map(|container| picture.file(container)));
    let samples: Vec<u8> = (0..24 * 18 * 3).map(|at| (at % 251) as u8).collect();
    for progressive in [false, true] {
        let mut bytes = Vec::new();
        let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, 90);
        encoder.set_progressive(progressive);
        encoder.encode(&samples, 24, 18, jpeg_encoder::ColorType::Rgb).expect("to memory");
        files.push(bytes);
    }
    let mut radiance = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n".to_vec();
    radiance.extend((0..2 * 8 * 4).map(|at| 120 + at as u8));
    files.push(radiance);
    files
}

#[test]
fn reading_byte_by_byte_is_reading_at_once() {
    let mut decoded = 0;
    for (number, whole) in files().into_iter().enumerate() {
        let places = (0..PLACES).map(|place| whole.len() * (place * 2 + 1) / (2 * PLACES));
        for damaged in std::iter::once(None).chain(places.map(Some)) {
            let mut bytes = whole.clone();
            damaged.into_iter().for_each(|place| bytes[place] = DAMAGE);
            let mut file = tempfile::tempfile().expect("a file");
            file.write_all(&bytes).expect("written");
            let at_once = read_through(&file, bytes.len() + 1);
            assert_eq!(at_once, read_through(&file, 1), "file {number}, damaged at {damaged:?}");
            decoded += usize::from(damaged.is_none() && at_once.len() == 5 && at_once[4].contains("Raster"));
        }
    }
    assert!(decoded >= 35, "{decoded} whole files were decoded");
}
