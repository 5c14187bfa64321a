//! How alike two pictures are.

use std::fmt;
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, GenericImage, Rgba, RgbaImage};

/// What two pictures of the same panorama may differ by on average, in levels of 255.
///
/// Measured on the references: another seed of every random choice, as another machine's rounding may be, differs by
/// 0.00 (and where it does by one level); `render.blend=none` in place of `multiband`, which differ least of the blend
/// modes, by 0.29, the mesh with cells smaller by a tenth by 0.47.
const MEAN_TOLERANCE: f64 = 0.1;
/// What all but a thousandth of the pixels may differ by: blend modes differ by 16 and more, a seam elsewhere by 14.
const HIGH_TOLERANCE: f64 = 4.0;
/// The share of the pixels that differ by at most the high difference.
const HIGH_SHARE: f64 = 0.999;
/// Differences are shown so many times larger than they are.
const ENLARGED: u8 = 8;
/// Columns between pictures side by side.
const GAP: u32 = 8;

/// How alike two pictures are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Likeness {
    /// They differ in size: expected and actual width and height.
    OtherSize([u32; 2], [u32; 2]),
    /// They differ in their pixels: by the mean, and by what [`HIGH_SHARE`] of the pixels do not exceed.
    Pixels { mean: f64, high: f64 },
}

impl Likeness {
    /// Compares pixel by pixel, where one of the pictures shows anything, by the channel that differs most.
    pub(crate) fn of(expected: &RgbaImage, actual: &RgbaImage) -> Self {
        if expected.dimensions() != actual.dimensions() {
            return Self::OtherSize(expected.dimensions().into(), actual.dimensions().into());
        }
        let pairs = expected.pixels().zip(actual.pixels());
        let shown = pairs.filter(|(expected, actual)| expected[3] > 0 || actual[3] > 0);
        let mut differences: Vec<f64> = shown
            .map(|(expected, actual)| f64::from(difference(*expected, *actual).into_iter().max().unwrap_or(0)))
            .collect();
        assert!(!differences.is_empty(), "two pictures that show nothing");
        differences.sort_by(f64::total_cmp);
        let mean = differences.iter().sum::<f64>() / differences.len() as f64;
        let high = differences[(HIGH_SHARE * (differences.len() - 1) as f64) as usize];
        Self::Pixels { mean, high }
    }

    /// Whether they are as alike as two pictures of the same panorama.
    pub(crate) fn is_close(self) -> bool {
        matches!(self, Self::Pixels { mean, high } if mean <= MEAN_TOLERANCE && high <= HIGH_TOLERANCE)
    }
}

impl fmt::Display for Likeness {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherSize([width, height], [other_width, other_height]) => {
                write!(formatter, "{other_width} x {other_height} px instead of {width} x {height} px")
            }
            Self::Pixels { mean, high } => write!(
                formatter,
                "it differs by {mean:.3} levels on average (at most {MEAN_TOLERANCE}) and by {high} in one of 1000 pixels \
                 (at most {HIGH_TOLERANCE})"
            ),
        }
    }
}

/// Differences of red, green, blue and alpha. What is transparent has no color.
fn difference(expected: Rgba<u8>, actual: Rgba<u8>) -> [u8; 4] {
    let visible = expected[3] > 0 && actual[3] > 0;
    let channel = |index: usize| if visible || index == 3 { expected[index].abs_diff(actual[index]) } else { 0 };
    [channel(0), channel(1), channel(2), channel(3)]
}

/// The expected picture, the actual one and, if they have one size, their difference, enlarged; white where alpha
/// differs.
pub(crate) fn side_by_side(expected: &RgbaImage, actual: &RgbaImage) -> RgbaImage {
    let mut pictures = vec![expected.clone(), actual.clone()];
    if expected.dimensions() == actual.dimensions() {
        pictures.push(RgbaImage::from_fn(expected.width(), expected.height(), |x, y| {
            let [red, green, blue, alpha] = difference(*expected.get_pixel(x, y), *actual.get_pixel(x, y));
            let shown = |level: u8| level.max(alpha).saturating_mul(ENLARGED);
            Rgba([shown(red), shown(green), shown(blue), 255])
        }));
    }
    let width = pictures.iter().map(|picture| picture.width() + GAP).sum::<u32>() - GAP;
    let height = pictures.iter().map(RgbaImage::height).max().unwrap_or(0);
    let mut whole = RgbaImage::new(width, height);
    let mut left = 0;
    for picture in &pictures {
        whole.copy_from(picture, left, 0).expect("room for every picture");
        left += picture.width() + GAP;
    }
    whole
}

/// Writes a PNG file as small as can be; without alpha where all of it is opaque.
pub(crate) fn write_small(picture: &RgbaImage, path: &Path) {
    let picture = DynamicImage::ImageRgba8(picture.clone());
    let opaque = picture.as_rgba8().is_some_and(|rgba| rgba.pixels().all(|pixel| pixel[3] == 255));
    let picture = if opaque { DynamicImage::ImageRgb8(picture.to_rgb8()) } else { picture };
    let file = std::io::BufWriter::new(std::fs::File::create(path).expect("a file"));
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    picture.write_with_encoder(encoder).expect("written");
}

/// A picture with detail: levels that change by about 20 from pixel to pixel.
fn detail(shift: f64, gain: f64) -> RgbaImage {
    RgbaImage::from_fn(120, 80, |x, y| {
        let wave = |at: f64| (128.0 + 90.0 * (0.35 * (at + shift)).sin()) * gain;
        let level = |at: u32| wave(f64::from(at)).round() as u8;
        Rgba([level(x), level(y), level(x + y), 255])
    })
}

#[test]
fn what_is_seen_to_differ_is_told_and_rounding_is_not() {
    let expected = detail(0.0, 1.0);
    assert_eq!(Likeness::of(&expected, &expected), Likeness::Pixels { mean: 0.0, high: 0.0 });
    assert!(Likeness::of(&expected, &detail(0.001, 1.0)).is_close());
    for (what, actual) in [("a shift", detail(0.05, 1.0)), ("a gain", detail(0.0, 1.01))] {
        let likeness = Likeness::of(&expected, &actual);
        assert!(!likeness.is_close(), "{what}: {likeness}");
    }
    // A few wrong pixels among many.
    let mut spots = expected.clone();
    spots.pixels_mut().step_by(500).for_each(|pixel| pixel[1] ^= 0x80);
    assert!(!Likeness::of(&expected, &spots).is_close());
    let mut hole = expected.clone();
    hole.pixels_mut().take(20).for_each(|pixel| pixel[3] = 0);
    assert!(!Likeness::of(&expected, &hole).is_close());
    let cut = image::imageops::crop_imm(&expected, 0, 0, 119, 80).to_image();
    assert_eq!(Likeness::of(&expected, &cut).to_string(), "119 x 80 px instead of 120 x 80 px");
    assert_eq!(side_by_side(&expected, &expected).dimensions(), (3 * 120 + 2 * GAP, 80));
}
