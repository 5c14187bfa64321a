//! EXIF and XMP written, and read back by the EXIF library and by plain text.

use std::io::{BufReader, Cursor};
use std::path::PathBuf;

use exif::{Context, Exif, In, Rational};
use tempfile::TempDir;
use trueup_core::StageContext;
use trueup_core::raster::RowSource;
use trueup_core::spherical::{SphericalFrame, SphericalProjection};

use super::*;
use crate::encode::{OutputOptions, write};

fn field(tag: Tag, value: Value) -> Field {
    Field { tag, ifd_num: In::PRIMARY, value }
}

fn ascii(text: &str) -> Value {
    Value::Ascii(vec![text.as_bytes().to_vec()])
}

fn ratio(num: u32, denom: u32) -> Value {
    Value::Rational(vec![Rational { num, denom }])
}

/// A camera's EXIF at a time of day; with a place, north is 40 degrees to the right of where it looks.
fn camera(time: &str, with_place: bool) -> Vec<Field> {
    let mut fields = vec![
        field(Tag::Make, ascii("Maker")),
        field(Tag::Model, ascii("Model 7")),
        field(Tag::Artist, ascii("A. Photographer")),
        field(Tag::Orientation, Value::Short(vec![6])),
        field(Tag::Software, ascii("Camera 1.0")),
        field(Tag::DateTimeOriginal, ascii(&format!("2024:05:04 {time}"))),
        field(Tag::OffsetTimeOriginal, ascii("+02:00")),
        field(Tag::ExposureTime, ratio(1, 250)),
        field(Tag::FNumber, ratio(28, 10)),
        field(Tag::PhotographicSensitivity, Value::Short(vec![200])),
        field(Tag::FocalLength, ratio(24, 1)),
        field(Tag::FocalLengthIn35mmFilm, Value::Short(vec![36])),
        field(Tag::LensModel, ascii("24mm F2.8")),
        field(Tag::ImageUniqueID, ascii("0123456789abcdef")),
        field(Tag::MakerNote, Value::Undefined(vec![1, 2, 3, 4], 0)),
        field(Tag::PixelXDimension, Value::Long(vec![6000])),
    ];
    if with_place {
        let degrees =
            |d, m, s| Value::Rational([(d, 1), (m, 1), (s, 100)].map(|(num, denom)| Rational { num, denom }).into());
        fields.extend([
            field(Tag::GPSVersionID, Value::Byte(vec![2, 3, 0, 0])),
            field(Tag::GPSLatitudeRef, ascii("N")),
            field(Tag::GPSLatitude, degrees(43, 46, 2256)),
            field(Tag::GPSLongitudeRef, ascii("E")),
            field(Tag::GPSLongitude, degrees(11, 15, 2200)),
            field(Tag::GPSImgDirection, ratio(320, 1)),
        ]);
    }
    fields
}

/// A photograph with this EXIF.
fn photograph(folder: &TempDir, name: &str, fields: &[Field]) -> PathBuf {
    let path = folder.path().join(name);
    let block = record::block(fields).expect("a block");
    let metadata = Metadata { exif: Some(block), ..Metadata::default() };
    write(&path, &White, &metadata, &OutputOptions::default(), &StageContext::default()).expect("written");
    path
}

struct White;

impl RowSource for White {
    fn width(&self) -> usize {
        20
    }
    fn height(&self) -> usize {
        20
    }
    fn rgba8_row(&self, _: usize, row: &mut [u8]) -> trueup_core::Result<()> {
        row.fill(255);
        Ok(())
    }
    fn rgba16_row(&self, _: usize, row: &mut [u16]) -> trueup_core::Result<()> {
        row.fill(65_535);
        Ok(())
    }
    fn linear_row(&self, _: usize, row: &mut [f32]) -> trueup_core::Result<()> {
        row.fill(1.0);
        Ok(())
    }
}

const FRAME: SphericalFrame = SphericalFrame {
    projection: SphericalProjection::Equirectangular,
    full_width: 8000,
    full_height: 4000,
    left: 1000,
    top: 1500,
    middle_yaw: 0.0,
};

fn panorama<'a>(photographs: &'a [&'a Path], yaws: &'a [Option<f64>]) -> PanoramaDescription<'a> {
    PanoramaDescription {
        photographs,
        reference: 1,
        yaws,
        width: 4000,
        height: 1200,
        is_srgb: false,
        spherical: Some(FRAME),
        pose_deg: [0.0; 2],
    }
}

fn parse(block: Vec<u8>) -> Exif {
    exif::Reader::new().read_raw(block).expect("an EXIF block")
}

fn shown(exif: &Exif, tag: Tag) -> Option<String> {
    exif.get_field(tag, In::PRIMARY).map(|field| field.display_value().to_string())
}

/// What stands in an element of the packet.
fn element<'a>(xmp: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = xmp.split_once(&format!("<GPano:{name}>"))?;
    rest.split_once("</").map(|(value, _)| value)
}

#[test]
fn the_camera_is_kept_and_what_no_longer_holds_is_not() {
    let folder = TempDir::new().expect("a folder");
    let paths = [
        photograph(&folder, "a.jpg", &camera("10:00:05", false)),
        photograph(&folder, "b.png", &camera("10:00:09", true)),
        photograph(&folder, "c.tif", &camera("10:00:01", false)),
    ];
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let told = describe(&panorama(&paths, &[None; 3]), MetadataKept::Keep);
    let exif = parse(told.exif.expect("EXIF"));
    for (tag, expected) in [
        (Tag::Make, "\"Maker\""),
        (Tag::Model, "\"Model 7\""),
        (Tag::Artist, "\"A. Photographer\""),
        (Tag::LensModel, "\"24mm F2.8\""),
        (Tag::ExposureTime, "1/250"),
        (Tag::FNumber, "2.8"),
        (Tag::PhotographicSensitivity, "200"),
        (Tag::FocalLength, "24"),
        (Tag::DateTimeOriginal, "2024-05-04 10:00:01"),
        (Tag::OffsetTimeOriginal, "\"+02:00\""),
        (Tag::Software, concat!("\"trueup ", env!("CARGO_PKG_VERSION"), "\"")),
        (Tag::Orientation, "row 0 at top and column 0 at left"),
        (Tag::PixelXDimension, "4000"),
        (Tag::PixelYDimension, "1200"),
        (Tag::ColorSpace, "uncalibrated"),
        (Tag::GPSLatitude, "43 deg 46 min 22.56 sec"),
        (Tag::GPSLongitude, "11 deg 15 min 22 sec"),
    ] {
        assert_eq!(shown(&exif, tag).as_deref(), Some(expected), "{tag}");
    }
    for tag in [Tag::MakerNote, Tag::ImageUniqueID, Tag::FocalLengthIn35mmFilm, Tag::GPSImgDirection] {
        assert_eq!(shown(&exif, tag), None, "{tag}");
    }
    let xmp = told.xmp.expect("XMP");
    assert_eq!(element(&xmp, "FirstPhotoDate"), Some("2024-05-04T10:00:01+02:00"));
    assert_eq!(element(&xmp, "LastPhotoDate"), Some("2024-05-04T10:00:09+02:00"));
    assert_eq!(element(&xmp, "SourcePhotosCount"), Some("3"));
}

#[test]
fn the_place_and_all_of_it_can_be_kept_back() {
    let folder = TempDir::new().expect("a folder");
    let path = photograph(&folder, "a.jpg", &camera("10:00:05", true));
    let paths = [path.as_path(); 2];
    let panorama = panorama(&paths, &[Some(0.0), Some(0.0)]);
    let told = describe(&panorama, MetadataKept::NoLocation);
    let exif = parse(told.exif.expect("EXIF"));
    assert!(exif.fields().all(|field| field.tag.context() != Context::Gps));
    assert_eq!(shown(&exif, Tag::Model).as_deref(), Some("\"Model 7\""));
    let xmp = told.xmp.expect("XMP");
    assert_eq!((element(&xmp, "PoseHeadingDegrees"), element(&xmp, "SourcePhotosCount")), (None, Some("2")));

    let told = describe(&panorama, MetadataKept::None);
    let xmp = told.xmp.expect("the geometry that viewers need");
    assert_eq!(told.exif, None);
    assert_eq!((element(&xmp, "FirstPhotoDate"), element(&xmp, "StitchingSoftware")), (None, None));
    assert_eq!(element(&xmp, "ProjectionType"), Some("equirectangular"));
    let flat = PanoramaDescription { spherical: None, ..panorama };
    assert_eq!(describe(&flat, MetadataKept::None), Metadata::default());
    assert_eq!(element(&describe(&flat, MetadataKept::Keep).xmp.expect("XMP"), "ProjectionType"), None);
}

#[test]
fn the_crop_adds_up() {
    let xmp = gpano::packet(&panorama(&[], &[]), Some(&FRAME), &gpano::Facts::default()).expect("XMP");
    let number = |name: &str| element(&xmp, name).and_then(|text| text.parse::<usize>().ok()).expect("a number");
    assert_eq!(number("FullPanoWidthPixels"), 2 * number("FullPanoHeightPixels"));
    assert!(number("CroppedAreaLeftPixels") + number("CroppedAreaImageWidthPixels") <= number("FullPanoWidthPixels"));
    assert!(number("CroppedAreaTopPixels") + number("CroppedAreaImageHeightPixels") <= number("FullPanoHeightPixels"));
    assert_eq!((number("CroppedAreaImageWidthPixels"), number("CroppedAreaImageHeightPixels")), (4000, 1200));
    assert_eq!((number("CroppedAreaLeftPixels"), number("CroppedAreaTopPixels")), (1000, 1500));
    assert_eq!(element(&xmp, "UsePanoramaViewer"), Some("True"));
    let pose = |xmp: &str| ["PosePitchDegrees", "PoseRollDegrees"].map(|name| element(xmp, name).map(str::to_owned));
    assert_eq!(pose(&xmp), [Some("0.0".to_owned()), Some("0.0".to_owned())]);
    let tilted = PanoramaDescription { pose_deg: [12.34, -5.0], ..panorama(&[], &[]) };
    let xmp = gpano::packet(&tilted, Some(&FRAME), &gpano::Facts::default()).expect("XMP");
    assert_eq!(pose(&xmp), [Some("12.3".to_owned()), Some("-5.0".to_owned())]);
    let outside = SphericalFrame { left: 5000, ..FRAME };
    assert_eq!(gpano::packet(&panorama(&[], &[]), Some(&outside), &gpano::Facts::default()), None);
}

#[test]
fn the_compass_says_where_the_middle_looks() {
    let folder = TempDir::new().expect("a folder");
    let path = photograph(&folder, "a.jpg", &camera("10:00:05", true));
    let paths = [path.as_path(); 2];
    // Both looked to 320 degrees; one was 10 degrees right of the world's z axis, one 10 degrees left: z is at 320.
    let yaws = [Some(10_f64.to_radians()), Some((-10_f64).to_radians())];
    let frame = SphericalFrame { middle_yaw: 60_f64.to_radians(), ..FRAME };
    let panorama = PanoramaDescription { spherical: Some(frame), ..panorama(&paths, &yaws) };
    let xmp = describe(&panorama, MetadataKept::Keep).xmp.expect("XMP");
    assert_eq!(element(&xmp, "PoseHeadingDegrees"), Some("20.0"));
    // The crop's middle is column 3000 of 8000, an eighth of a turn left of the whole's.
    assert_eq!(element(&xmp, "InitialViewHeadingDegrees"), Some("335"));
}

#[test]
fn every_format_gives_the_metadata_back() {
    let folder = TempDir::new().expect("a folder");
    let source = photograph(&folder, "source.jpg", &camera("10:00:05", true));
    let paths = [source.as_path(); 2];
    let metadata = describe(&panorama(&paths, &[None; 2]), MetadataKept::Keep);
    let expected = parse(metadata.exif.clone().expect("EXIF"));
    for name in ["p.jpg", "p.png", "p.tif", "p.webp"] {
        let path = folder.path().join(name);
        write(&path, &White, &metadata, &OutputOptions::default(), &StageContext::default()).expect("written");
        let bytes = std::fs::read(&path).expect("readable");
        let found = exif::Reader::new().read_from_container(&mut BufReader::new(Cursor::new(&bytes))).expect(name);
        for field in expected.fields() {
            if name == "p.tif" && crate::formats::tiff::metadata::OF_JPEG.contains(&field.tag) {
                continue;
            }
            let found = found.get_field(field.tag, In::PRIMARY).unwrap_or_else(|| panic!("{name}: {}", field.tag));
            assert_eq!(found.display_value().to_string(), field.display_value().to_string(), "{name}: {}", field.tag);
        }
        let xmp = metadata.xmp.as_ref().expect("XMP").as_bytes();
        assert!(bytes.windows(xmp.len()).any(|window| window == xmp), "{name}: no XMP");
    }
}

#[test]
fn absurd_exif_is_left_out() {
    let folder = TempDir::new().expect("a folder");
    let mut fields = camera("10:00:05", false);
    fields[0] = field(Tag::Make, ascii(&"x".repeat(60_000)));
    fields[5] = field(Tag::DateTimeOriginal, ascii("0000:00:00 00:00:00"));
    let path = photograph(&folder, "a.png", &fields);
    let nothing = folder.path().join("none.jpg");
    let paths = [nothing.as_path(), path.as_path()];
    let told = describe(&panorama(&paths, &[None; 2]), MetadataKept::Keep);
    let block = told.exif.expect("EXIF");
    assert!(block.len() < 4000, "{}", block.len());
    let exif = parse(block);
    assert_eq!((shown(&exif, Tag::Make), shown(&exif, Tag::DateTimeOriginal)), (None, None));
    assert_eq!(shown(&exif, Tag::Model).as_deref(), Some("\"Model 7\""));
}
