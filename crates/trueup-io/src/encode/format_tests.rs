//! Depths, tiles, smaller copies, Deep Zoom, layers and labels, read back by other crates.

use std::fs::File;
use std::io::BufReader;

use ::tiff::decoder::{Decoder, DecodingResult};
use ::tiff::tags::Tag;
use tempfile::TempDir;
use trueup_core::context::{CancelToken, Silent};

use super::tests::{CancelAtEnd, FullDisk, Gradient, files_in, read};
use super::*;

/// Levels of red, green, blue and alpha by place, finer than 8 bits; the middle third may be transparent.
struct Fine {
    width: usize,
    height: usize,
    hole: bool,
}

impl Fine {
    fn pixel(&self, x: usize, y: usize) -> [u16; 4] {
        if self.hole && (self.width / 3..self.width * 2 / 3).contains(&x) {
            return [0; 4];
        }
        [(x * 97 + y * 13) as u16, (40_000 + y) as u16, (x * y % 65_536) as u16, 65_535]
    }

    fn row_of<S>(&self, y: usize, row: &mut [S], of: impl Fn(u16) -> S) -> Result<()> {
        for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
            for (sample, value) in pixel.iter_mut().zip(self.pixel(x, y)) {
                *sample = of(value);
            }
        }
        Ok(())
    }
}

impl RowSource for Fine {
    fn width(&self) -> usize {
        self.width
    }
    fn height(&self) -> usize {
        self.height
    }
    fn is_opaque(&self) -> bool {
        !self.hole
    }
    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        self.row_of(y, row, |value| (value / 257) as u8)
    }
    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        self.row_of(y, row, |value| value)
    }
    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        self.row_of(y, row, |value| f32::from(value) / 65_535.0)
    }
}

fn written(name: &str, picture: &dyn RowSource, options: &OutputOptions) -> (TempDir, std::path::PathBuf) {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join(name);
    let bytes = write(&path, picture, &Metadata::default(), options, &StageContext::default()).expect("written");
    if !name.ends_with(".dzi") {
        assert_eq!(bytes, path.metadata().expect("a file").len());
    }
    (folder, path)
}

fn pages(path: &Path) -> Decoder<BufReader<File>> {
    Decoder::new(BufReader::new(File::open(path).expect("a file"))).expect("a TIFF")
}

fn sixteen(decoder: &mut Decoder<BufReader<File>>) -> Vec<u16> {
    match decoder.read_image().expect("readable") {
        DecodingResult::U16(samples) => samples,
        other => panic!("{other:?}"),
    }
}

#[test]
fn tiled_tiff_has_halved_copies_behind_it() {
    let picture = Fine { width: 700, height: 530, hole: true };
    let options =
        OutputOptions { depth: Depth::Sixteen, tiff_layout: TiffLayout::Tiles256, ..OutputOptions::default() };
    for tiff_big in [BigTiff::Auto, BigTiff::Always] {
        for tiff_compression in [TiffCompression::Deflate, TiffCompression::None] {
            let options = OutputOptions { tiff_big, tiff_compression, ..options.clone() };
            let (_folder, path) = written("a.tif", &picture, &options);
            let version = std::fs::read(&path).expect("a file")[2];
            assert_eq!(version, if tiff_big == BigTiff::Always { 43 } else { 42 });
            let mut file = pages(&path);
            let mut last: Option<Vec<u16>> = None;
            for (level, (width, height)) in [(700, 530), (350, 265), (175, 133)].into_iter().enumerate() {
                if level > 0 {
                    file.next_image().expect("another level");
                }
                assert_eq!(file.dimensions().expect("a size"), (width as u32, height as u32));
                assert_eq!(file.chunk_dimensions(), (256, 256));
                let subfile = file.get_tag_u32(Tag::NewSubfileType).expect("a tag");
                assert_eq!(subfile, u32::from(level > 0));
                let samples = sixteen(&mut file);
                match &last {
                    None => {
                        for (at, pixel) in samples.chunks_exact(4).enumerate() {
                            assert_eq!(pixel, picture.pixel(at % width, at / width), "{at}");
                        }
                    }
                    Some(last) => {
                        let (x, y) = (width - 2, height - 3);
                        let wide = 2 * width - usize::from(level == 2 && 350 % 2 == 1);
                        let of = |x: usize, y: usize| -> [u16; 4] {
                            last[(y * wide + x) * 4..][..4].try_into().expect("four")
                        };
                        let four =
                            [of(2 * x, 2 * y), of(2 * x + 1, 2 * y), of(2 * x, 2 * y + 1), of(2 * x + 1, 2 * y + 1)];
                        assert_eq!(samples[(y * width + x) * 4..][..4], u16::mean(four));
                    }
                }
                last = Some(samples);
            }
            assert!(!file.more_images());
        }
    }
}

#[test]
fn strips_hold_every_depth() {
    let picture = Fine { width: 75, height: 150, hole: false };
    let options = |depth, alpha| OutputOptions { depth, alpha, ..OutputOptions::default() };
    for (alpha, channels) in [(Alpha::Auto, 3), (Alpha::Keep, 4), (Alpha::Drop, 3)] {
        let (_folder, path) = written("a.tif", &picture, &options(Depth::Sixteen, alpha));
        let samples = sixteen(&mut pages(&path));
        for (at, pixel) in samples.chunks_exact(channels).enumerate() {
            assert_eq!(pixel, &picture.pixel(at % 75, at / 75)[..channels]);
        }
        let (_folder, path) = written("a.tif", &picture, &options(Depth::Float, alpha));
        let DecodingResult::F32(samples) = pages(&path).read_image().expect("readable") else { panic!("no floats") };
        for (at, pixel) in samples.chunks_exact(channels).enumerate() {
            let expected = picture.pixel(at % 75, at / 75).map(|value| f32::from(value) / 65_535.0);
            assert_eq!(pixel, &expected[..channels]);
        }
        let (_folder, path) = written("a.png", &picture, &options(Depth::Sixteen, alpha));
        let mut reader =
            png::Decoder::new(BufReader::new(File::open(&path).expect("a file"))).read_info().expect("a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut bytes).expect("readable");
        let samples: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect();
        for (at, pixel) in samples.chunks_exact(channels).enumerate() {
            assert_eq!(pixel, &picture.pixel(at % 75, at / 75)[..channels]);
        }
    }
}

#[test]
fn dropped_alpha_shows_the_background() {
    let picture = Gradient { width: 20, height: 20 };
    let options = OutputOptions { alpha: Alpha::Drop, background: Background::White, ..OutputOptions::default() };
    for name in ["a.png", "a.tif", "a.webp"] {
        let (_folder, path) = written(name, &picture, &options);
        let raster = read(&path);
        assert_eq!(raster.channels(), 3, "{name}");
        assert_eq!((raster.pixel(2, 3), raster.pixel(15, 3)), (&[255; 3][..], &picture.pixel(15, 3)[..3]));
    }
}

#[test]
fn a_depth_that_a_format_has_not_is_refused_with_advice() {
    let folder = TempDir::new().expect("a temporary folder");
    let cases =
        [("a.jpg", Depth::Sixteen), ("a.webp", Depth::Sixteen), ("a.dzi", Depth::Sixteen), ("a.png", Depth::Float)];
    for (name, depth) in cases {
        let options = OutputOptions { depth, ..OutputOptions::default() };
        let error = check_writable(&folder.path().join(name), &options).expect_err(name).to_string();
        assert!(error.contains(".tif"), "{error}");
    }
    assert!(files_in(&folder).is_empty());
    let auto = OutputOptions::default();
    let depth = |name: &str, bits| auto.with_depth_for(Path::new(name), bits).depth;
    assert_eq!(depth("a.tif", 16), Depth::Sixteen);
    assert_eq!(depth("a.png", 32), Depth::Sixteen);
    assert_eq!([depth("a.tif", 8), depth("a.jpg", 16), depth("a.dzi", 16)], [Depth::Eight; 3]);
    let chosen = OutputOptions { depth: Depth::Float, ..OutputOptions::default() };
    assert_eq!(chosen.with_depth_for(Path::new("a.tif"), 8).depth, Depth::Float);
}

/// The tiles of every level, put together by the arithmetic of the format, are the picture and its halves.
#[test]
fn deep_zoom_tiles_make_up_every_level() {
    let picture = Gradient { width: 150, height: 97 };
    let options = OutputOptions {
        dzi_format: DeepZoomFormat::Png,
        dzi_tile_px: 32,
        dzi_overlap_px: 2,
        ..OutputOptions::default()
    };
    let (folder, path) = written("pano.dzi", &picture, &options);
    let mut names = files_in(&folder);
    names.sort();
    assert_eq!(names, ["pano.dzi", "pano_files"]);
    let description = std::fs::read_to_string(&path).expect("a text");
    for part in ["Format=\"png\"", "Overlap=\"2\"", "TileSize=\"32\"", "Width=\"150\"", "Height=\"97\""] {
        assert!(description.contains(part), "{description}");
    }
    let mut tiles = 0;
    for level in 0..=8_u32 {
        // The size of a level by the format's own rule: 2^8 is the first power that holds 150 pixels.
        let size = |length: usize| length.div_ceil(1 << (8 - level));
        let (width, height) = (size(150), size(97));
        let at_level = folder.path().join("pano_files").join(level.to_string());
        for row in 0..height.div_ceil(32) {
            for column in 0..width.div_ceil(32) {
                let raster = read_small(&at_level.join(format!("{column}_{row}.png")));
                tiles += 1;
                let (left, top) = ((column * 32_usize).saturating_sub(2), (row * 32_usize).saturating_sub(2));
                assert_eq!(raster.width(), ((column + 1) * 32 + 2).min(width) - left);
                assert_eq!(raster.height(), ((row + 1) * 32 + 2).min(height) - top);
                for y in 0..raster.height() {
                    for x in 0..raster.width() {
                        if level == 8 {
                            assert_eq!(raster.pixel(x, y), picture.pixel(left + x, top + y));
                        } else if left + x < (width / 2).saturating_sub(1) {
                            assert_eq!(raster.pixel(x, y)[3], 0, "the left half is transparent at level {level}");
                        }
                    }
                }
            }
        }
    }
    let found: usize = (0..=8)
        .map(|level: u32| {
            let folder = folder.path().join("pano_files").join(level.to_string());
            std::fs::read_dir(folder).expect("a level").count()
        })
        .sum();
    assert_eq!(found, tiles);
}

/// A PNG of any size, which photographs are not.
fn read_small(path: &Path) -> trueup_core::raster::Raster<u8> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).expect("a file"))).read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut bytes).expect("readable");
    trueup_core::raster::Raster::from_data(info.width as usize, info.height as usize, 4, bytes).expect("RGBA")
}

#[test]
fn deep_zoom_replaces_its_own_tiles_only() {
    let options = OutputOptions::default();
    let (folder, path) = written("pano.dzi", &Gradient { width: 300, height: 300 }, &options);
    let tiles = folder.path().join("pano_files");
    assert!(tiles.join("9/1_1.jpg").is_file());
    write(&path, &Gradient { width: 200, height: 100 }, &Metadata::default(), &options, &StageContext::default())
        .expect("written again");
    assert!(!tiles.join("9").exists() && tiles.join("8/0_0.jpg").is_file());

    let cancel = CancelToken::default();
    let picture = CancelAtEnd(Gradient { width: 300, height: 300 }, &cancel);
    let stopped = write(&path, &picture, &Metadata::default(), &options, &StageContext::new(&Silent, &cancel, 0));
    assert!(matches!(stopped, Err(Error::Cancelled)), "{stopped:?}");
    assert!(!tiles.join("9").exists() && tiles.join("8/0_0.jpg").is_file());
    assert_eq!(files_in(&folder).len(), 2);

    std::fs::write(tiles.join("8/notes.txt"), "mine").expect("written");
    for refused in [
        check_writable(&path, &options),
        write(&path, &picture.0, &Metadata::default(), &options, &StageContext::default()).map(drop),
    ] {
        let message = refused.expect_err("notes are kept").to_string();
        assert!(message.contains("notes.txt"), "{message}");
    }
    assert_eq!(files_in(&folder).len(), 2);
}

#[test]
fn deep_zoom_does_not_depend_on_the_threads() {
    let picture = Gradient { width: 600, height: 300 };
    let bytes_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let (folder, _) = pool.install(|| written("a.dzi", &picture, &OutputOptions::default()));
        let tile = |name: &str| std::fs::read(folder.path().join("a_files").join(name)).expect("a tile");
        [tile("10/0_0.jpg"), tile("10/2_1.jpg"), tile("9/1_0.jpg"), tile("0/0_0.jpg")]
    };
    assert_eq!(bytes_with(1), bytes_with(3));
}

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
        let bytes =
            write_layers(&path, &TwoLayers, &Metadata::default(), &options, &StageContext::default()).expect("written");
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
            assert_eq!([place(&mut file, 286), place(&mut file, 287)], corner.map(f64::from));
        }
        assert!(!file.more_images());
        let bytes = std::fs::read(&path).expect("a file");
        assert!(bytes.windows(10).any(|some| some == "Übung.tif".as_bytes()));
    }
    assert!(check_layers_place(&folder.path().join("a.png")).is_err());
    let options = OutputOptions::default();
    for room in [0, 100, 5_000] {
        let failed = tiff::write_pages(
            &mut FullDisk { position: 0, room },
            &TwoLayers,
            &Metadata::default(),
            &options,
            &StageContext::default(),
        );
        assert!(matches!(failed, Err(Failure::Io(_))), "{failed:?}");
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
        write_labels(&path, &Stripes(photographs), &OutputOptions::default(), &StageContext::default())
            .expect("written");
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
            assert_eq!(colors.len(), 256, "colours are distinct");
        }
    }
    let failed = labels::write_map(
        &mut FullDisk { position: 0, room: 50 },
        &Stripes(300),
        &OutputOptions::default(),
        &StageContext::default(),
    );
    assert!(matches!(failed, Err(Failure::Io(_))));
    assert!(check_labels_place(&folder.path().join("a.tif")).is_err());
}
