//! Small pictures, put into files by the codecs themselves, for tests.

use std::io::Cursor;

use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::{Gray8, RGB8, RGB16, RGB32Float, RGBA8};

/// A picture to be put into a file.
#[derive(Debug, Clone)]
pub(crate) struct Specimen {
    pub(crate) width: u32,
    pub(crate) height: u32,
    channels: usize,
    levels: Levels,
}

/// Samples, channels interleaved.
#[derive(Debug, Clone)]
enum Levels {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
    Float(Vec<f32>),
}

/// What a specimen is put into, without loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Container {
    Png,
    Tiff,
    WebP,
}

impl Container {
    pub(crate) const ALL: [Self; 3] = [Self::Png, Self::Tiff, Self::WebP];
}

impl Specimen {
    /// 8-bit samples: gray, gray with alpha, RGB or RGBA.
    pub(crate) fn eight<const C: usize>(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; C]) -> Self {
        Self { width, height, channels: C, levels: Levels::Eight(samples(width, height, pixel)) }
    }

    /// 16-bit RGB.
    pub(crate) fn sixteen(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u16; 3]) -> Self {
        Self { width, height, channels: 3, levels: Levels::Sixteen(samples(width, height, pixel)) }
    }

    /// Floating point RGB.
    pub(crate) fn float(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [f32; 3]) -> Self {
        Self { width, height, channels: 3, levels: Levels::Float(samples(width, height, pixel)) }
    }

    /// The bytes of a file.
    pub(crate) fn file(&self, container: Container) -> Vec<u8> {
        match container {
            Container::Png => self.png(None),
            Container::Tiff => self.tiff(),
            Container::WebP => self.webp(),
        }
    }

    /// The bytes of a PNG with a color profile.
    pub(crate) fn png(&self, icc: Option<Vec<u8>>) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut info = png::Info::with_size(self.width, self.height);
        info.icc_profile = icc.map(Into::into);
        info.color_type =
            [png::ColorType::Grayscale, png::ColorType::GrayscaleAlpha, png::ColorType::Rgb, png::ColorType::Rgba]
                [self.channels - 1];
        let (depth, data) = match &self.levels {
            Levels::Eight(samples) => (png::BitDepth::Eight, samples.clone()),
            Levels::Sixteen(samples) => {
                (png::BitDepth::Sixteen, samples.iter().flat_map(|sample| sample.to_be_bytes()).collect())
            }
            Levels::Float(_) => panic!("PNG has whole numbers"),
        };
        info.bit_depth = depth;
        let mut writer = png::Encoder::with_info(&mut bytes, info).expect("valid").write_header().expect("to memory");
        writer.write_image_data(&data).expect("to memory");
        writer.finish().expect("to memory");
        bytes
    }

    fn tiff(&self) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).expect("to memory");
        let (width, height) = (self.width, self.height);
        match (&self.levels, self.channels) {
            (Levels::Eight(samples), 1) => encoder.write_image::<Gray8>(width, height, samples),
            (Levels::Eight(samples), 3) => encoder.write_image::<RGB8>(width, height, samples),
            (Levels::Eight(samples), 4) => encoder.write_image::<RGBA8>(width, height, samples),
            (Levels::Sixteen(samples), 3) => encoder.write_image::<RGB16>(width, height, samples),
            (Levels::Float(samples), 3) => encoder.write_image::<RGB32Float>(width, height, samples),
            other => panic!("{other:?}"),
        }
        .expect("to memory");
        bytes.into_inner()
    }

    fn webp(&self) -> Vec<u8> {
        let Levels::Eight(samples) = &self.levels else { panic!("WebP has 8 bits") };
        let color = if self.channels == 4 { image_webp::ColorType::Rgba8 } else { image_webp::ColorType::Rgb8 };
        let mut bytes = Vec::new();
        let encoder = image_webp::WebPEncoder::new(&mut bytes);
        encoder.encode(samples, self.width, self.height, color).expect("to memory");
        bytes
    }
}

fn samples<S, const C: usize>(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [S; C]) -> Vec<S> {
    let pixel = &pixel;
    (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y))).collect()
}
