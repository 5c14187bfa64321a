//! Depths, backgrounds, tiles and smaller copies, read back by other crates.

use std::fs::File;
use std::io::BufReader;

use ::tiff::decoder::{Decoder, DecodingResult};
use ::tiff::tags::Tag;
use tempfile::TempDir;

use super::samples::OutputSample;
use super::tests::{Gradient, files_in, read};
use super::*;

/// Levels of red, green, blue and alpha by place, finer than 8 bits; the middle third may be transparent.
pub(super) struct Fine {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) hole: bool,
}

impl Fine {
    pub(super) fn pixel(&self, x: usize, y: usize) -> [u16; 4] {
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

pub(super) fn written(name: &str, picture: &dyn RowSource, options: &OutputOptions) -> (TempDir, std::path::PathBuf) {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join(name);
    let bytes = write(&path, picture, &Metadata::default(), options, &StageContext::default()).expect("written");
    if !name.ends_with(".dzi") {
        assert_eq!(bytes, path.metadata().expect("a file").len());
    }
    (folder, path)
}

pub(super) fn pages(path: &Path) -> Decoder<BufReader<File>> {
    Decoder::new(BufReader::new(File::open(path).expect("a file"))).expect("a TIFF")
}

pub(super) fn sixteen(decoder: &mut Decoder<BufReader<File>>) -> Vec<u16> {
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
fn dropped_alpha_and_chosen_colors_show_the_background() {
    let picture = Gradient { width: 20, height: 20 };
    let orange = Background::Color([255, 136, 0]);
    let cases = [
        (Alpha::Drop, Background::WHITE, Some([255; 3])),
        (Alpha::Drop, Background::Auto, Some([0; 3])),
        (Alpha::Auto, orange, Some([255, 136, 0])),
        (Alpha::Keep, orange, None),
        (Alpha::Auto, Background::Auto, None),
        (Alpha::Auto, Background::Transparent, None),
    ];
    for (alpha, background, shown) in cases {
        let options = OutputOptions { alpha, background, ..OutputOptions::default() };
        for name in ["a.png", "a.tif", "a.webp"] {
            let (_folder, path) = written(name, &picture, &options);
            let raster = read(&path);
            let pixel = picture.pixel(15, 3);
            match shown {
                None => assert_eq!((raster.pixel(2, 3)[3], raster.pixel(15, 3)), (0, &pixel[..]), "{name} {options:?}"),
                Some(shown) => assert_eq!((raster.pixel(2, 3), raster.pixel(15, 3)), (&shown[..], &pixel[..3])),
            }
        }
    }
}

#[test]
fn a_transparent_background_is_refused_where_nothing_is_transparent() {
    let folder = TempDir::new().expect("a temporary folder");
    let said = |name: &str, options: OutputOptions| {
        let options = OutputOptions { background: Background::Transparent, ..options };
        check_writable(&folder.path().join(name), &options).err().map(|error| error.to_string())
    };
    for (name, options, advice) in [
        ("a.jpg", OutputOptions::default(), "End the name in .png, "),
        ("a.dzi", OutputOptions::default(), "Set output.dzi_format to png"),
        ("a.png", OutputOptions { alpha: Alpha::Drop, ..OutputOptions::default() }, "Leave output.alpha at auto"),
    ] {
        let said = said(name, options).expect("refused");
        assert!(said.contains("a transparent background is not supported") && said.contains(advice), "{said}");
    }
    let png_tiles = OutputOptions { dzi_format: DeepZoomFormat::Png, ..OutputOptions::default() };
    assert_eq!(said("a.dzi", png_tiles), None);
    assert_eq!(said("a.png", OutputOptions::default()), None);
    assert!(files_in(&folder).is_empty());
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
    assert!(chosen.keeps_light(Path::new("a.tif")) && auto.keeps_light(Path::new("a.exr")));
    assert!(!auto.keeps_light(Path::new("a.tif")) && !auto.keeps_light(Path::new("a.jpg")));
}
