//! Layers and labels, for finishing by hand, read back by other crates.

use std::fs::File;
use std::io::BufReader;

use ::tiff::decoder::Decoder;
use ::tiff::tags::Tag;
use tempfile::TempDir;

use super::failure::WriteFailure;
use super::format_tests::{Fine, pages, sixteen};
use super::tests::FullDisk;
use super::*;
use crate::provenance::{PanoramaPart, of_part};
use crate::source::is_own_output;

/// Two layers on a panorama of 400 x 300 pixels.
struct TwoLayers;

impl LayerSet for TwoLayers {
    fn whole(&self) -> [usize; 2] {
        [400, 300]
    }
    fn count(&self) -> usize {
        2
    }
    fn pixels(&self) -> u64 {
        200 * 100 * 2
    }
    fn open(&self, index: usize) -> Result<LayerPage<'_>> {
        let rows = Box::new(Fine { width: 200, height: 100, hole: false });
        Ok(LayerPage { name: ["a.jpg", "Übung.tif"][index].to_owned(), corner: [[10, 20], [150, 200]][index], rows })
    }
}

#[test]
fn layers_are_pages_with_a_place() {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join("layers.tif");
    for layer_extent in [LayerExtent::Canvas, LayerExtent::Cropped] {
        let options = OutputOptions { layer_extent, depth: Depth::Sixteen, ..OutputOptions::default() };
        let bytes = write_layers(
            &path,
            &TwoLayers,
            &of_part(PanoramaPart::Layers, MetadataKept::Keep),
            &options,
            &StageContext::default(),
        )
        .expect("written");
        assert_eq!(bytes, path.metadata().expect("a file").len());
        let mut file = pages(&path);
        for (index, [left, top]) in [[10, 20], [150, 200]].into_iter().enumerate() {
            if index > 0 {
                file.next_image().expect("another page");
            }
            let (width, height) = file.dimensions().expect("a size");
            let samples = sixteen(&mut file);
            let pixel = |x: usize, y: usize| &samples[(y * width as usize + x) * 4..][..4];
            let layer = Fine { width: 200, height: 100, hole: false };
            let numbers = |tag| file.get_tag_u32_vec(Tag::Unknown(tag)).expect("a tag");
            let corner = match layer_extent {
                LayerExtent::Canvas => {
                    assert_eq!((width, height), (400, 300));
                    assert_eq!((pixel(0, 0), pixel(left - 1, top)), (&[0; 4][..], &[0; 4][..]));
                    assert_eq!(pixel(left + 3, top + 7), layer.pixel(3, 7));
                    [0, 0]
                }
                LayerExtent::Cropped => {
                    assert_eq!((width, height), (200, 100));
                    assert_eq!(pixel(3, 7), layer.pixel(3, 7));
                    [left as u32, top as u32]
                }
            };
            let place = |file: &mut Decoder<_>, tag| match file.get_tag(Tag::Unknown(tag)).expect("a tag") {
                ::tiff::decoder::ifd::Value::Rational(n, d) => f64::from(n) * 72.0 / f64::from(d),
                other => panic!("{other:?}"),
            };
            let mut numbers = numbers;
            assert_eq!((numbers(33300), numbers(33301)), (vec![400], vec![300]));
            assert_eq!(numbers(297), [index as u32, 2]);
            let software = file.get_tag_ascii_string(Tag::Software).expect("a maker");
            assert_eq!(software, crate::provenance::SOFTWARE);
            assert_eq!([place(&mut file, 286), place(&mut file, 287)], corner.map(f64::from));
        }
        assert!(!file.more_images());
        assert!(is_own_output(&path), "it is known by its maker");
        let bytes = std::fs::read(&path).expect("a file");
        assert!(bytes.windows(10).any(|some| some == "Übung.tif".as_bytes()));
    }
    assert!(check_layers_place(&folder.path().join("a.png")).is_err());
    let options = OutputOptions::default();
    for room in [0, 100, 5_000] {
        let failed = layers::write_pages(
            &mut FullDisk { position: 0, room },
            &TwoLayers,
            &Metadata::default(),
            &options,
            &StageContext::default(),
        );
        assert!(matches!(failed, Err(WriteFailure::Io(_))), "{failed:?}");
    }
}

/// Labels that grow along the rows.
struct Stripes(usize);

impl LabelMap for Stripes {
    fn size(&self) -> [usize; 2] {
        [self.0 + 1, 5]
    }
    fn names(&self) -> Vec<String> {
        (1..=self.0).map(|number| format!("IMG_{number}.jpg")).collect()
    }
    fn row(&self, _: usize, row: &mut Vec<u16>) -> Result<()> {
        row.clear();
        row.extend(0..=self.0 as u16);
        Ok(())
    }
}

#[test]
fn labels_are_the_samples() {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join("seams.png");
    for photographs in [3, 255, 300] {
        write_labels(
            &path,
            &Stripes(photographs),
            &of_part(PanoramaPart::Seams, MetadataKept::Keep),
            &OutputOptions::default(),
            &StageContext::default(),
        )
        .expect("written");
        assert!(is_own_output(&path), "it is known by its maker");
        let mut decoder = png::Decoder::new(BufReader::new(File::open(&path).expect("a file")));
        decoder.set_transformations(png::Transformations::IDENTITY);
        let mut reader = decoder.read_info().expect("a PNG");
        let named = reader
            .info()
            .utf8_text
            .iter()
            .any(|text| text.keyword == "Photograph 3" && text.get_text().is_ok_and(|text| text == "IMG_3.jpg"));
        assert!(named);
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut bytes).expect("readable");
        let labels: Vec<u16> = match photographs {
            ..=255 => bytes.iter().map(|&byte| u16::from(byte)).collect(),
            _ => bytes.as_chunks::<2>().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect(),
        };
        assert_eq!(info.color_type == png::ColorType::Indexed, photographs <= 255);
        assert_eq!(labels[..photographs + 1], (0..=photographs as u16).collect::<Vec<_>>());
        if photographs == 255 {
            let palette = reader.info().palette.as_ref().expect("a palette").to_vec();
            let mut colors: Vec<[u8; 3]> = palette.as_chunks::<3>().0.to_vec();
            colors.sort_unstable();
            colors.dedup();
            assert_eq!(colors.len(), 256, "colors are distinct");
        }
    }
    let failed = labels::write_map(
        &mut FullDisk { position: 0, room: 50 },
        &Stripes(300),
        &Metadata::default(),
        &OutputOptions::default(),
        &StageContext::default(),
    );
    assert!(matches!(failed, Err(WriteFailure::Io(_))));
    assert!(check_labels_place(&folder.path().join("a.tif")).is_err());
}
