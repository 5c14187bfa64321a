//! Files that are made here, good and bad, and what becomes of them.

use std::path::{Path, PathBuf};

use exif::experimental::Writer;
use exif::{Field, In, Rational, Tag, Value};
use jpeg_encoder::{ColorType, Encoder};
use proptest::prelude::*;
use tempfile::TempDir;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::{FocalSource, GravitySource, PhotographSource, WorkingFrame};

use super::*;
use crate::decode::FilePhotographs;
use crate::formats::specimens::{Container, Specimen};

/// An EXIF block of the given fields.
fn exif_block(fields: &[(Tag, Value)]) -> Vec<u8> {
    let fields: Vec<Field> =
        fields.iter().map(|(tag, value)| Field { tag: *tag, ifd_num: In::PRIMARY, value: value.clone() }).collect();
    let mut writer = Writer::new();
    fields.iter().for_each(|field| writer.push_field(field));
    let mut block = std::io::Cursor::new(Vec::new());
    writer.write(&mut block, false).expect("writing to memory");
    block.into_inner()
}

/// A gray JPEG; `shade` tells photographs apart.
fn jpeg(width: u16, height: u16, shade: u8, exif: &[(Tag, Value)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 90);
    if !exif.is_empty() {
        encoder.add_exif_metadata(&exif_block(exif)).expect("a small block");
    }
    let pixels: Vec<u8> = (0..usize::from(width) * usize::from(height)).map(|i| (i % 7) as u8 * 9 + shade).collect();
    encoder.encode(&pixels, width, height, ColorType::Luma).expect("encoding to memory");
    bytes
}

/// A folder of files, and what scanning the given names in it finds.
struct Files(TempDir);

impl Files {
    fn new(files: &[(&str, Vec<u8>)]) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        for (name, bytes) in files {
            std::fs::write(folder.path().join(name), bytes).expect("writing a test file");
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn scan(&self, names: &[&str]) -> Sources {
        self.scan_with(names, &SourceOptions::default())
    }

    fn scan_with(&self, names: &[&str], options: &SourceOptions) -> Sources {
        let inputs: Vec<String> = names.iter().map(|name| self.path(name).display().to_string()).collect();
        scan(&inputs, options, &StageContext::default()).expect("scanning only fails when cancelled")
    }
}

fn names(sources: &Sources) -> Vec<&str> {
    sources.photographs.iter().map(|source| source.name.as_str()).collect()
}

/// The code of the only rejection, which must come with a reason and a hint.
fn only_code(sources: &Sources) -> &str {
    let [rejected] = sources.rejected.as_slice() else { panic!("one rejection expected: {:?}", sources.rejected) };
    assert!(!rejected.reason.is_empty() && rejected.hint.ends_with('.') && !rejected.name.is_empty());
    assert!(matches!(rejected.to_error(), Error::Input { .. }));
    &rejected.code
}

#[test]
fn folders_are_read_in_natural_order() {
    let photograph = |shade| jpeg(32, 24, shade, &[]);
    let files = Files::new(&[
        ("img10.jpg", photograph(1)),
        ("IMG2.JPEG", photograph(2)),
        ("img1 été.jpg", photograph(3)),
        (".hidden.jpg", photograph(4)),
        ("notes.txt", b"hello".to_vec()),
    ]);
    std::fs::create_dir(files.path("inner")).expect("a folder");
    let sources = files.scan(&[""]);
    assert_eq!(names(&sources), ["img1 été.jpg", "IMG2.JPEG", "img10.jpg"]);
    assert!(sources.rejected.is_empty(), "{:?}", sources.rejected);
    assert_eq!((sources.photographs[0].width, sources.photographs[0].height), (32, 24));
    assert_eq!(names(&files.scan(&["img1*.jpg"])), ["img1 été.jpg", "img10.jpg"]);
}

#[test]
fn existing_paths_are_no_patterns() {
    let files = Files::new(&[("a[1].jpg", jpeg(32, 24, 1, &[])), ("a1.jpg", jpeg(32, 24, 2, &[]))]);
    assert_eq!(names(&files.scan(&["a[1].jpg"])), ["a[1].jpg"]);
    assert_eq!(names(&files.scan(&["a[1-9].jpg"])), ["a1.jpg"]);
}

#[test]
fn content_decides_the_format() {
    let files = Files::new(&[("jpeg.png", jpeg(32, 24, 1, &[]))]);
    assert_eq!(names(&files.scan(&["jpeg.png"])), ["jpeg.png"]);
}

#[test]
fn every_bad_file_is_named_and_the_good_ones_are_used() {
    let good = jpeg(32, 24, 1, &[]);
    let huge = {
        let mut bytes = jpeg(32, 24, 2, &[]);
        // The frame header's height and width, ITU-T T.81 B.2.2.
        let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).expect("a baseline frame");
        bytes[frame + 5..frame + 9].copy_from_slice(&[0xea, 0x60, 0xea, 0x60]);
        bytes
    };
    let cases: [(&str, Vec<u8>, &str); 8] = [
        ("text.jpg", b"this is no picture at all".to_vec(), "not-a-picture"),
        ("empty.jpg", Vec::new(), "file-empty"),
        ("header only.jpg", good[..40].to_vec(), "picture-damaged"),
        ("huge.jpg", huge, "picture-too-large"),
        ("tiny.jpg", jpeg(8, 8, 0, &[]), "picture-too-small"),
        ("same.jpg", good.clone(), "duplicate"),
        ("scan.jp2", b"\0\0\0\x0cjP  \r\n\x87\n".to_vec(), "format-unsupported"),
        ("broken.png", b"\x89PNG\r\n\x1a\n\0\0".to_vec(), "picture-damaged"),
    ];
    for (name, bytes, code) in cases {
        let files = Files::new(&[("good.jpg", good.clone()), (name, bytes)]);
        let sources = files.scan(&["good.jpg", name]);
        assert_eq!(names(&sources), ["good.jpg"], "{name}");
        assert_eq!(only_code(&sources), code, "{name}: {:?}", sources.rejected);
        assert_eq!(sources.rejected[0].name, name);
        let folder = files.scan(&[""]);
        assert_eq!((folder.photographs.len(), only_code(&folder)), (1, code), "{name} in a folder");
    }
}

#[test]
fn inputs_that_lead_nowhere_are_rejected() {
    let files = Files::new(&[("notes.txt", b"hello".to_vec()), ("one.jpg", jpeg(32, 24, 1, &[]))]);
    std::fs::create_dir(files.path("x.jpg")).expect("a folder");
    assert_eq!(only_code(&files.scan(&["absent.jpg"])), "file-missing");
    assert_eq!(only_code(&files.scan(&["*.webp"])), "pattern-without-match");
    assert_eq!(only_code(&files.scan(&["[.jpg"])), "pattern-without-match");
    assert_eq!(only_code(&files.scan(&["x.jpg"])), "folder-without-pictures");
    assert_eq!(only_code(&files.scan(&["notes.txt"])), "not-a-picture");
    let folder = files.scan(&[""]);
    assert_eq!((names(&folder), only_code(&folder)), (vec!["one.jpg"], "folder-not-file"));
    assert_eq!(scan(&[], &SourceOptions::default(), &StageContext::default()).expect("nothing"), Sources::default());
}

#[test]
fn the_same_file_is_used_once() {
    let files = Files::new(&[("a.jpg", jpeg(32, 24, 1, &[])), ("b.jpg", jpeg(32, 24, 1, &[]))]);
    let twice = files.scan(&["a.jpg", "a.jpg"]);
    assert_eq!(only_code(&twice), "duplicate");
    assert!(twice.rejected[0].reason.contains("same file as a.jpg"));
    let copy = files.scan(&["b.jpg", "a.jpg"]);
    assert!(copy.rejected[0].reason.contains("same bytes as b.jpg"), "{:?}", copy.rejected);
}

/// Ways in which a file cannot be read whoever asks, so that the test holds for the administrator, too.
#[cfg(unix)]
#[test]
fn unreadable_files_are_rejected() {
    let files = Files::new(&[("a.jpg", jpeg(32, 24, 1, &[]))]);
    std::os::unix::fs::symlink(files.path("loop.jpg"), files.path("loop.jpg")).expect("a link to itself");
    let _listener = std::os::unix::net::UnixListener::bind(files.path("socket.jpg")).expect("a socket");
    for (name, reason) in [
        ("a.jpg/inside.jpg", "it cannot be read ("),
        ("loop.jpg", "it cannot be read ("),
        ("socket.jpg", "it is not a regular file"),
    ] {
        let sources = files.scan(&["a.jpg", name]);
        assert_eq!((names(&sources), only_code(&sources)), (vec!["a.jpg"], "file-unreadable"), "{name}");
        assert!(sources.rejected[0].reason.starts_with(reason), "{:?}", sources.rejected);
    }
    // Found in the folder, they are looked into one by one.
    let folder = files.scan(&[""]);
    let codes: Vec<&str> = folder.rejected.iter().map(|rejected| rejected.code.as_str()).collect();
    assert_eq!((names(&folder), codes), (vec!["a.jpg"], vec!["file-unreadable"; 2]));
}

#[test]
fn stale_orientation_tags_are_not_applied() {
    let tagged = |tag| [(Tag::Orientation, Value::Short(vec![tag]))];
    let files = Files::new(&[
        ("true.jpg", jpeg(32, 24, 1, &tagged(8))),
        ("stale.jpg", jpeg(24, 32, 2, &tagged(8))),
        ("turned.jpg", jpeg(24, 32, 3, &tagged(3))),
    ]);
    let inputs = ["true.jpg", "stale.jpg", "turned.jpg"].map(|name| files.path(name).display().to_string());
    let facts = |trust_orientation| {
        let context = StageContext::default();
        let options = SourceOptions { trust_orientation, ..SourceOptions::default() };
        let sources = scan(&inputs, &options, &context).expect("three photographs");
        let notes: Vec<String> = context
            .findings()
            .into_iter()
            .map(|note| format!("{} {}", note.code, note.subject.named(&["true.jpg", "stale.jpg"])))
            .collect();
        let facts: Vec<_> = sources.photographs.iter().map(|i| (i.orientation, i.width, i.height)).collect();
        (facts, notes)
    };
    let (auto, notes) = facts(OrientationTrust::Auto);
    assert_eq!(auto, [(8, 24, 32), (1, 24, 32), (3, 24, 32)]);
    assert_eq!(notes, ["orientation-tag-stale stale.jpg"]);
    assert_eq!(facts(OrientationTrust::Always).0, [(8, 24, 32), (8, 32, 24), (3, 24, 32)]);
    assert_eq!(facts(OrientationTrust::Never).0, [(1, 32, 24), (1, 24, 32), (1, 24, 32)]);
}

#[test]
fn focal_length_and_camera_come_from_exif() {
    let exif = [
        (Tag::Make, Value::Ascii(vec![b"NIKON CORPORATION ".to_vec()])),
        (Tag::Model, Value::Ascii(vec![b"NIKON D7000".to_vec()])),
        (Tag::FocalLength, Value::Rational(vec![Rational { num: 105, denom: 1 }])),
        (Tag::FocalLengthIn35mmFilm, Value::Short(vec![157])),
    ];
    let files = Files::new(&[("a.jpg", jpeg(400, 300, 1, &exif))]);
    let source = &files.scan(&["a.jpg"]).photographs[0];
    assert_eq!(source.camera_model.as_deref(), Some("NIKON D7000"));
    let prior = source.focal_prior.expect("a focal length");
    assert_eq!(prior.source, FocalSource::Equivalent35mm);
    // 157 mm * 500 px / 43.2666 mm.
    assert!((prior.focal_px - 1814.3).abs() < 0.1, "{prior:?}");
}

/// A telephone held upright, its camera up by 30 degrees, and a drone's that looks down by 10, rolled by 20: down in
/// the pictures as they are shown.
#[test]
fn gravity_comes_from_the_maker_note_and_from_xmp() {
    let mut note = b"Apple iOS\0\0\x01MM\0\x01\0\x08\0\x0a\0\0\0\x03\0\0\0\x20\0\0\0\0".to_vec();
    for numerator in [0_i32, -866_025, 500_000] {
        note.extend(numerator.to_be_bytes());
        note.extend(1_000_000_i32.to_be_bytes());
    }
    let telephone = [
        (Tag::Orientation, Value::Short(vec![6])),
        (Tag::Make, Value::Ascii(vec![b"Apple".to_vec()])),
        (Tag::MakerNote, Value::Undefined(note, 0)),
    ];
    let packet = "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\
                  <rdf:Description xmlns:drone-dji=\"http://www.dji.com/drone-dji/1.0/\" drone-dji:GimbalPitchDegree=\"-10.0\" \
                  drone-dji:GimbalRollDegree=\"+20.0\"/></rdf:RDF></x:xmpmeta>";
    let mut segment = b"http://ns.adobe.com/xap/1.0/\0".to_vec();
    segment.extend_from_slice(packet.as_bytes());
    let mut drone = jpeg(32, 24, 2, &[]);
    let length = u16::try_from(segment.len() + 2).expect("a short packet").to_be_bytes();
    drone.splice(2..2, [&[0xff, 0xe1], &length[..], &segment].concat());
    let files =
        Files::new(&[("a.jpg", jpeg(32, 24, 1, &telephone)), ("b.jpg", drone), ("c.jpg", jpeg(32, 24, 3, &[]))]);
    let found: Vec<_> =
        files.scan(&["a.jpg", "b.jpg", "c.jpg"]).photographs.iter().map(|source| source.gravity).collect();
    let (sine, cosine) = 10_f64.to_radians().sin_cos();
    let (roll_sine, roll_cosine) = 20_f64.to_radians().sin_cos();
    let expected = [
        (GravitySource::AppleAcceleration, [0.0, 0.75_f64.sqrt(), -0.5]),
        (GravitySource::DjiGimbal, [roll_sine * cosine, roll_cosine * cosine, sine]),
    ];
    for (found, (source, down)) in found.iter().zip(expected) {
        let found = found.expect("it was recorded");
        assert_eq!(found.source, source);
        assert!(found.down.iter().zip(down).all(|(one, other)| (one - other).abs() < 1e-5), "{found:?}");
    }
    assert_eq!(found[2], None);
}

#[test]
fn tiff_tags_are_read_like_exif() {
    use tiff::encoder::{TiffEncoder, colortype::Gray8};
    use tiff::tags::Tag as TiffTag;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).expect("to memory");
    let mut page = encoder.new_image::<Gray8>(32, 24).expect("a picture");
    page.encoder().write_tag(TiffTag::Orientation, 6_u16).expect("a tag");
    page.encoder().write_tag(TiffTag::Model, "NIKON D7000").expect("a tag");
    page.write_data(&[9; 32 * 24]).expect("pixels");
    let files = Files::new(&[("a.tif", bytes.into_inner())]);
    let source = &files.scan(&["a.tif"]).photographs[0];
    assert_eq!((source.orientation, source.width, source.height), (6, 24, 32));
    assert_eq!(source.camera_model.as_deref(), Some("NIKON D7000"));
}

#[test]
fn options_out_of_range_are_refused_and_a_stop_is_obeyed() {
    let bad = SourceOptions { max_megapixels: f64::NAN, ..SourceOptions::default() };
    assert!(matches!(scan(&[], &bad, &StageContext::default()), Err(Error::Options(_))));
    let cancel = trueup_core::context::CancelToken::default();
    cancel.cancel();
    let context = StageContext::new(&trueup_core::context::Silent, &cancel);
    let stopped = scan(&["nowhere.jpg".to_owned()], &SourceOptions::default(), &context);
    assert!(matches!(stopped, Err(Error::Cancelled)));
}

#[test]
fn photographs_in_memory_stand_among_files() {
    let plain = |width, height, shade: u16| {
        Photograph::Sixteen(Raster::from_data(width, height, 1, vec![shade; width * height]).expect("samples"))
    };
    let files = Files::new(&[("a.jpg", jpeg(20, 17, 1, &[])), ("b.jpg", jpeg(20, 17, 2, &[]))]);
    let [a, b] = ["a.jpg", "b.jpg"].map(|name| files.path(name).display().to_string());
    let mut in_memory = InMemory::default();
    in_memory.insert("first", plain(40, 30, 7));
    in_memory.insert("same", plain(40, 30, 7));
    in_memory.insert("dot", plain(9, 30, 8));
    in_memory.insert(&b, plain(40, 30, 9));
    let inputs = ["dot", "first", &a, "same", &b].map(str::to_owned);
    let (options, context) = (SourceOptions::default(), StageContext::default());
    let sources = scan_with(&inputs, &in_memory, &options, &context).expect("scanned");
    assert_eq!(names(&sources), ["first", "a.jpg"]);
    let rejected: Vec<(&str, &str)> =
        sources.rejected.iter().map(|one| (one.name.as_str(), one.code.as_str())).collect();
    assert_eq!(rejected, [("dot", "picture-too-small"), ("same", "duplicate"), ("b.jpg", "name-of-a-file")]);
    let first = &sources.photographs[0];
    assert_eq!((first.width, first.height, first.orientation), (40, 30, 1));
    assert_eq!(super::files(&inputs, &in_memory), [Path::new(&a)], "what is in memory is no file");

    let photographs = FilePhotographs::new(sources.photographs, 0).with_in_memory(in_memory);
    assert_eq!(photographs.photograph(0).expect("in memory"), plain(40, 30, 7));
    assert_eq!(photographs.photograph(1).expect("a file").width(), 20);
    assert_eq!([0, 1].map(|index| photographs.sample_bits(index).expect("known")), [16, 8]);
    let frame = WorkingFrame::new(40, 30, 300.0);
    let working = photographs.working(0, &frame, 50.0).expect("a working picture");
    assert_eq!((working.gray.width(), working.gray.height()), (20, 15));
    assert!(working.gray.data().iter().all(|value| (value - 7.0 / 257.0).abs() < 1e-5));
}

/// Scans bytes as a file and decodes whatever was accepted; only a panic can fail.
fn digest(folder: &Path, bytes: &[u8]) {
    let path = folder.join("input.bin");
    std::fs::write(&path, bytes).expect("writing a test file");
    // A small limit keeps sizes that damage made up from being decoded at length.
    let options = SourceOptions { max_megapixels: 0.1, ..SourceOptions::default() };
    let sources =
        scan_any_size(&[path.display().to_string()], &options, &StageContext::default()).expect("never fails");
    assert_eq!(sources.photographs.len() + sources.rejected.len(), 1);
    for source in &sources.photographs {
        let _ = crate::decode::photograph(source);
    }
}

/// One small file of every format, with EXIF where the encoder writes it.
fn specimens() -> Vec<Vec<u8>> {
    let mut specimens = vec![jpeg(20, 17, 1, &[(Tag::Orientation, Value::Short(vec![6]))])];
    let picture = Specimen::eight(19, 18, |x, y| [x as u8 * 9, y as u8, 7, 200]);
    specimens.extend(Container::ALL.map(|container| picture.file(container)));
    specimens
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn random_bytes_never_panic(specimen in 0_usize..4, mut bytes in proptest::collection::vec(any::<u8>(), 0..600), keep in 0_usize..32) {
        let folder = TempDir::new().expect("a temporary folder");
        let start = &specimens()[specimen];
        let keep = keep.min(bytes.len());
        bytes[..keep].copy_from_slice(&start[..keep]);
        digest(folder.path(), &bytes);
    }

    #[test]
    fn damaged_files_never_panic(
        specimen in 0_usize..4,
        cut in 0.0_f64..=1.2,
        flips in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let folder = TempDir::new().expect("a temporary folder");
        let mut bytes = specimens().swap_remove(specimen);
        for (place, value) in flips {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        bytes.truncate((bytes.len() as f64 * cut) as usize);
        digest(folder.path(), &bytes);
    }
}
