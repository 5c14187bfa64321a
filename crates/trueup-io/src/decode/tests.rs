//! Files of every kind of pixel, decoded and reduced.

use std::path::PathBuf;

use tempfile::TempDir;
use trueup_core::color::{LightRange, TransferCurve};
use trueup_core::raster::{Photograph, Raster};
use trueup_core::source::{PhotographSource, SourceImage, WorkingFrame};
use trueup_core::{Error, StageContext};

use super::*;
use crate::formats::specimens::{Container, Specimen};
use crate::source::{InMemory, SourceOptions, scan};

const WIDTH: u32 = 45;
const HEIGHT: u32 = 33;

/// The value of channel `c` at (x, y), a different one almost everywhere.
fn value(x: u32, y: u32, c: u32) -> u8 {
    ((x * 5 + y * 7 + c * 50) % 251) as u8
}

fn write(folder: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("writing a test file");
    path
}

fn examine(path: PathBuf) -> SourceImage {
    let inputs = [path.display().to_string()];
    let mut sources = scan(&inputs, &SourceOptions::default(), &StageContext::default()).expect("a scan");
    assert!(sources.rejected.is_empty(), "{:?}", sources.rejected);
    sources.photographs.remove(0)
}

fn rgb8() -> Specimen {
    rgb8_of(WIDTH, HEIGHT)
}

fn rgb8_of(width: u32, height: u32) -> Specimen {
    Specimen::eight(width, height, |x, y| [0, 1, 2].map(|c| value(x, y, c)))
}

fn rgb16() -> Specimen {
    Specimen::sixteen(WIDTH, HEIGHT, |x, y| [0, 1, 2].map(|c| u16::from(value(x, y, c)) * 257 + 3 * (x % 2) as u16))
}

/// Channels and depth of what comes out, and whether a sample pixel has the expected values.
#[test]
fn every_kind_of_pixel_keeps_its_depth() {
    let folder = TempDir::new().expect("a temporary folder");
    let gray = Specimen::eight(WIDTH, HEIGHT, |x, y| [value(x, y, 0)]);
    let gray_alpha = Specimen::eight(WIDTH, HEIGHT, |x, y| [value(x, y, 0), 77]);
    let rgba = Specimen::eight(WIDTH, HEIGHT, |x, y| [value(x, y, 0), value(x, y, 1), value(x, y, 2), 99]);
    let (v0, v1, v2) = (value(11, 5, 0), value(11, 5, 1), value(11, 5, 2));
    let eight: [(&Specimen, &[Container], Vec<u8>); 4] = [
        (&gray, &[Container::Png, Container::Tiff], vec![v0]),
        (&gray_alpha, &[Container::Png], vec![v0, v0, v0, 77]),
        (&rgb8(), &[Container::Png, Container::Tiff, Container::WebP], vec![v0, v1, v2]),
        (&rgba, &[Container::Png, Container::Tiff, Container::WebP], vec![v0, v1, v2, 99]),
    ];
    for (picture, formats, pixel) in eight {
        for &format in formats {
            let source = examine(write(&folder, "picture", &picture.file(format)));
            let Photograph::Eight(raster) = photograph(&source).expect("a photograph") else {
                panic!("{format:?}: 16 bit")
            };
            assert_eq!((raster.width(), raster.height()), (WIDTH as usize, HEIGHT as usize));
            assert_eq!(raster.pixel(11, 5), pixel, "{format:?}");
        }
    }
    for format in [Container::Png, Container::Tiff] {
        let source = examine(write(&folder, "picture", &rgb16().file(format)));
        let Photograph::Sixteen(raster) = photograph(&source).expect("a photograph") else {
            panic!("{format:?}: 8 bit")
        };
        assert_eq!(raster.pixel(11, 5), [v0, v1, v2].map(|v| u16::from(v) * 257 + 3), "{format:?}");
    }
}

#[test]
fn floating_point_is_linear_light() {
    let folder = TempDir::new().expect("a temporary folder");
    let picture = Specimen::float(WIDTH, HEIGHT, |_, _| [0.5, -1.0, 7.0]);
    let source = examine(write(&folder, "float.tif", &picture.file(Container::Tiff)));
    let Photograph::Sixteen(raster) = photograph(&source).expect("a photograph") else { panic!("8 bit") };
    // IEC 61966-2-1: 1.055 * 0.5^(1 / 2.4) - 0.055 = 0.735357, of 65535.
    assert_eq!(raster.pixel(0, 0), [48_192, 0, 65_535]);
    assert_eq!(sample_bits(&source).expect("a header"), 32);
    assert!(source.is_float && source.light.is_none());
    // What is brighter than white is kept in a range that holds it.
    let range = LightRange { white: 1.0, peak: 8.0 };
    let curve = TransferCurve::light(range).expect("a range");
    let source = SourceImage { light: Some(range), ..source };
    let Photograph::Sixteen(raster) = photograph(&source).expect("a photograph") else { panic!("8 bit") };
    for (sample, light) in raster.pixel(3, 4).iter().zip([0.5, 0.0, 7.0]) {
        assert!((8.0 * curve.linear(f64::from(*sample) / 65535.0) - light).abs() <= 1e-3 * light, "{sample}");
    }
}

/// Ordinary photographs beside light stand for the same light as before.
#[test]
fn photographs_are_handed_out_in_light() {
    let folder = TempDir::new().expect("a temporary folder");
    let source = examine(write(&folder, "picture.png", &rgb8().file(Container::Png)));
    let Photograph::Eight(own) = photograph(&source).expect("a photograph") else { panic!("16 bit") };
    let range = LightRange { white: 2.0, peak: 30.0 };
    let files = FilePhotographs::new(vec![source], 0).in_light(Some(range));
    assert_eq!(files.light(), Some(range));
    let Photograph::Sixteen(raster) = files.photograph(0).expect("decoded") else { panic!("8 bit") };
    for (sample, level) in raster.pixel(11, 5).iter().zip(own.pixel(11, 5)) {
        let light = 30.0 * files.transfer_curve().linear(f64::from(*sample) / 65535.0);
        let expected = TransferCurve::SRGB.linear(f64::from(*level) / 255.0);
        assert!((light - expected).abs() <= 1e-3 * expected, "{light} {expected}");
    }
}

#[test]
fn palettes_and_single_bits_are_spread() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 16, 16);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_palette(vec![10, 20, 30, 40, 50, 60]);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[0b0100_0000; 32]).expect("pixels");
    writer.finish().expect("an end");
    let source = examine(write(&folder, "palette.png", &bytes));
    let Photograph::Eight(raster) = photograph(&source).expect("a photograph") else { panic!("16 bit") };
    assert_eq!((raster.pixel(0, 0), raster.pixel(1, 0)), (&[10, 20, 30][..], &[40, 50, 60][..]));
}

fn jpeg(color: jpeg_encoder::ColorType, progressive: bool) -> Vec<u8> {
    let channels = match color {
        jpeg_encoder::ColorType::Luma => 1,
        jpeg_encoder::ColorType::Rgb => 3,
        _ => 4,
    };
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, 95);
    encoder.set_progressive(progressive);
    let pixels: Vec<u8> =
        (0..64 * 48_usize).flat_map(|i| (0..channels).map(move |c| ((i % 64) * 2 + (i / 64) + c * 30) as u8)).collect();
    encoder.encode(&pixels, 64, 48, color).expect("encoding to memory");
    bytes
}

#[test]
fn every_kind_of_jpeg_is_decoded_but_none_that_is_cut_off() {
    let folder = TempDir::new().expect("a temporary folder");
    use jpeg_encoder::ColorType::{Cmyk, CmykAsYcck, Luma, Rgb};
    for (color, channels) in [(Luma, 1), (Rgb, 3), (Cmyk, 3), (CmykAsYcck, 3)] {
        for progressive in [false, true] {
            let bytes = jpeg(color, progressive);
            let path = write(&folder, "picture.jpg", &bytes);
            let source = examine(path);
            let decoded = photograph(&source).expect("a photograph");
            assert_eq!(decoded.channels(), channels, "{color:?} {progressive}");
            if let (Luma | Rgb, Photograph::Eight(raster)) = (color, &decoded) {
                for (c, level) in raster.pixel(20, 20).iter().enumerate() {
                    assert!(level.abs_diff(60 + 30 * c as u8) <= 8, "{color:?} {progressive}: {level} of channel {c}");
                }
            }
            // Anywhere in the file, and just before its end. But that of one scan, of which nothing but the marker of
            // the end is missing, or bits that fill up its last byte.
            let is_one_scan = !progressive;
            for cut in (16..bytes.len()).step_by(101).chain(bytes.len() - 4..bytes.len()) {
                write(&folder, "picture.jpg", &bytes[..cut]);
                let missing = bytes.len() - cut;
                match photograph(&source) {
                    Err(error) => {
                        assert!(error.to_string().starts_with("picture.jpg"), "{error}");
                        assert!(!is_one_scan || missing > 2, "{color:?}: {error}");
                    }
                    Ok(read) => {
                        assert!(is_one_scan && missing <= 3, "{color:?} {progressive}: {missing} bytes are missing");
                        assert_eq!(read, decoded, "{color:?}");
                    }
                }
            }
        }
    }
}

/// Codes after lost or replaced bytes are most often decodable as others.
#[test]
fn a_jpeg_whose_data_were_replaced_or_lost_is_damaged() {
    let folder = TempDir::new().expect("a temporary folder");
    let (width, height) = (256_u16, 192_u16);
    let mut seed = 7_u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 24) as u8 / 4
    };
    let levels: Vec<u8> =
        (0..usize::from(width) * usize::from(height) * 3).map(|sample| (sample / 3 % 192) as u8 + noise()).collect();
    for progressive in [false, true] {
        let mut whole = Vec::new();
        let mut encoder = jpeg_encoder::Encoder::new(&mut whole, 90);
        encoder.set_progressive(progressive);
        encoder.encode(&levels, width, height, jpeg_encoder::ColorType::Rgb).expect("encoding to memory");
        let source = examine(write(&folder, "picture.jpg", &whole));
        photograph(&source).expect("whole");
        // What is filled up between the data and the end is nothing that was lost.
        let mut filled = whole.clone();
        filled.splice(whole.len() - 2..whole.len() - 2, [0; 512]);
        write(&folder, "picture.jpg", &filled);
        assert!(photograph(&source).is_ok(), "{progressive}");
        let from = whole.len() / 4;
        let mut replaced = whole.clone();
        replaced[from..from + 1024].fill(0);
        let mut lost = whole.clone();
        lost.drain(from..from + 1024);
        for damaged in [replaced, lost] {
            write(&folder, "picture.jpg", &damaged);
            let refused = photograph(&source);
            // Of several scans, what ends too soon within one is not told.
            if !progressive {
                let error = refused.expect_err("damaged").to_string();
                assert!(error.starts_with("picture.jpg: ") && error.contains("damaged"), "{error}");
            }
        }
    }
}

/// Bytes of zeros where a file ends, whose room was taken before it was written, are no picture.
#[test]
fn a_jpeg_that_ends_in_nothing_is_cut_off() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut bytes = jpeg(jpeg_encoder::ColorType::Rgb, false);
    let source = examine(write(&folder, "picture.jpg", &bytes));
    let half = bytes.len() / 2;
    bytes[half..].fill(0);
    bytes.extend([0; 1 << 16]);
    write(&folder, "picture.jpg", &bytes);
    let error = photograph(&source).expect_err("half a file").to_string();
    assert!(error.contains("cut off"), "{error}");
}

/// Optimized tables make the encoder write a scan per component. The coefficients are the same, so that the pixels are,
/// but for how color is interpolated.
#[test]
fn jpegs_with_a_scan_per_component_and_reduced_color_are_decoded() {
    let folder = TempDir::new().expect("a temporary folder");
    let smooth = |x: u32, y: u32| [x * 5, y * 7, 100 + x].map(|value| value as u8);
    let pixels: Vec<u8> = (0..HEIGHT).flat_map(|y| (0..WIDTH).flat_map(move |x| smooth(x, y))).collect();
    for factor in [(2, 1), (2, 2), (1, 2), (1, 1)] {
        let decoded = [false, true].map(|separate| {
            let mut bytes = Vec::new();
            let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, 95);
            let factor = jpeg_encoder::SamplingFactor::from_factors(factor.0, factor.1).expect("known factors");
            encoder.set_sampling_factor(factor);
            encoder.set_optimized_huffman_tables(separate);
            encoder.encode(&pixels, WIDTH as u16, HEIGHT as u16, jpeg_encoder::ColorType::Rgb).expect("encoded");
            let source = examine(write(&folder, "scans.jpg", &bytes));
            let Photograph::Eight(raster) = photograph(&source).expect("a photograph") else { panic!("16 bit") };
            raster
        });
        for (together, separate) in decoded[0].data().iter().zip(decoded[1].data()) {
            assert!(together.abs_diff(*separate) <= 12, "{factor:?}: {together} {separate}");
        }
    }
}

/// An alpha channel that is full everywhere is none: in files, and in memory.
#[test]
fn opaque_photographs_are_the_same_with_alpha_and_without() {
    let folder = TempDir::new().expect("a temporary folder");
    let opaque = |x, y| [value(x, y, 0), value(x, y, 1), value(x, y, 2), 255];
    let eight = [rgb8(), Specimen::eight(WIDTH, HEIGHT, opaque)];
    for format in [Container::Png, Container::Tiff, Container::WebP] {
        let [without, with] = [0, 1].map(|one| {
            photograph(&examine(write(&folder, "picture", &eight[one].file(format)))).expect("a photograph")
        });
        assert!(with == without && with.channels() == 3, "{format:?}");
    }
    let given = Raster::from_data(2, 1, 4, vec![1_u8, 2, 3, 255, 4, 5, 6, 255]).expect("eight samples");
    let mut in_memory = InMemory::default();
    in_memory.insert("given", Photograph::Eight(given));
    let source = SourceImage::unknown("given", "given", [2, 1]);
    let photographs = FilePhotographs::new(vec![source], 0).with_in_memory(in_memory);
    let expected = Raster::from_data(2, 1, 3, vec![1_u8, 2, 3, 4, 5, 6]).expect("six samples");
    assert_eq!(photographs.photograph(0).expect("in memory"), Photograph::Eight(expected));
}

#[test]
fn data_after_the_end_of_a_jpeg_are_ignored() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut bytes = jpeg(jpeg_encoder::ColorType::Rgb, false);
    let without = photograph(&examine(write(&folder, "picture.jpg", &bytes))).expect("a photograph");
    assert_eq!((without.width(), without.height(), without.channels()), (64, 48, 3));
    bytes.extend_from_slice(b"maker's data");
    assert_eq!(photograph(&examine(write(&folder, "picture.jpg", &bytes))).expect("a photograph"), without);
}

#[test]
fn cut_pngs_tiffs_and_webps_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    for format in Container::ALL {
        let bytes = rgb8().file(format);
        let source = examine(write(&folder, "picture", &bytes));
        write(&folder, "picture", &bytes[..bytes.len() / 2]);
        assert!(matches!(photograph(&source), Err(Error::Input { .. })), "{format:?}");
    }
}

/// Twelve bytes end a PNG; those before them are the sum of the pixels' chunk. A file may be cut between these or
/// within the twelve.
#[test]
fn a_png_that_lacks_its_end_alone_is_read() {
    let folder = TempDir::new().expect("a temporary folder");
    for bytes in [rgb8().file(Container::Png), rgb16().file(Container::Png)] {
        let whole = photograph(&examine(write(&folder, "picture", &bytes))).expect("a photograph");
        let read = |missing: usize| photograph(&examine(write(&folder, "picture", &bytes[..bytes.len() - missing])));
        for missing in 1..=12 {
            assert_eq!(read(missing).expect("all of its pixels"), whole, "{missing} bytes");
        }
        for missing in 13..30 {
            assert!(matches!(read(missing), Err(Error::Input { .. })), "{missing} bytes");
        }
    }
}

/// The sum of the pixels' chunk may end as the chunk behind it begins: with a zero.
#[test]
fn a_png_whose_last_sum_ends_with_a_zero_may_lack_its_end() {
    let folder = TempDir::new().expect("a temporary folder");
    let lacking = (0..=u8::MAX).flat_map(|red| (0..8).map(move |green| [red, green, 0])).find_map(|color| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 16, 16);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&color.repeat(16 * 16)).expect("pixels");
        writer.finish().expect("an end");
        bytes.truncate(bytes.len() - 12);
        (bytes.last() == Some(&0)).then_some((bytes, color))
    });
    let (bytes, color) = lacking.expect("one in 256 of them");
    let read = photograph(&examine(write(&folder, "picture", &bytes))).expect("all of its pixels");
    assert!(matches!(read, Photograph::Eight(read) if read.data() == color.repeat(16 * 16)));
}

#[test]
fn files_that_change_after_the_scan_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let source = examine(write(&folder, "picture", &rgb8().file(Container::Png)));
    write(&folder, "picture", &rgb8_of(20, 20).file(Container::Png));
    assert!(photograph(&source).expect_err("another size").to_string().contains("examined"));
    std::fs::remove_file(&source.path).expect("our own file");
    assert!(matches!(photograph(&source), Err(Error::Io { .. })));
}

#[test]
fn working_pictures_have_the_size_of_their_frames() {
    let folder = TempDir::new().expect("a temporary folder");
    let source = examine(write(&folder, "picture", &rgb8().file(Container::Png)));
    let frame = WorkingFrame::new(source.width, source.height, 500.0);
    let picture = working(&source, &frame, 100.0).expect("a working picture");
    assert_eq!((picture.gray.width(), picture.gray.height()), (frame.width as usize, frame.height as usize));
    assert_eq!((picture.gray.channels(), picture.thumbnail.channels()), (1, 3));
    let thumbnail_frame = WorkingFrame::new(source.width, source.height, 100.0);
    assert_eq!(picture.thumbnail_frame, thumbnail_frame);
    assert_eq!(picture.thumbnail.width(), thumbnail_frame.width as usize);
    let wrong = WorkingFrame::new(source.width * 2, source.height, 500.0);
    assert!(matches!(working(&source, &wrong, 100.0), Err(Error::Input { .. })));
}

#[test]
fn luma_is_that_of_the_standard_and_depths_agree() {
    let folder = TempDir::new().expect("a temporary folder");
    let eight = examine(write(&folder, "eight", &rgb8().file(Container::Png)));
    let sixteen = examine(write(&folder, "sixteen", &rgb16().file(Container::Png)));
    let frame = WorkingFrame::new(eight.width, eight.height, 1e9);
    let a = working(&eight, &frame, 1e9).expect("a working picture");
    let b = working(&sixteen, &frame, 1e9).expect("a working picture");
    let [r, g, b0] = [value(7, 3, 0), value(7, 3, 1), value(7, 3, 2)].map(f32::from);
    assert!((a.gray.pixel(7, 3)[0] - (0.299 * r + 0.587 * g + 0.114 * b0)).abs() < 1e-3);
    assert_eq!(a.thumbnail.pixel(7, 3), [value(7, 3, 0), value(7, 3, 1), value(7, 3, 2)]);
    for (a, b) in a.gray.data().iter().zip(b.gray.data()) {
        assert!((a - b).abs() < 0.02, "{a} {b}");
    }
}

#[test]
fn the_cache_changes_nothing_but_the_work() {
    let folder = TempDir::new().expect("a temporary folder");
    let sources = vec![
        examine(write(&folder, "a.png", &rgb8().file(Container::Png))),
        examine(write(&folder, "b.png", &rgb16().file(Container::Png))),
    ];
    let frame = WorkingFrame::new(sources[0].width, sources[0].height, 300.0);
    let first_size = (WIDTH * HEIGHT * 3) as usize;
    for budget in [0, first_size, usize::MAX] {
        let files = FilePhotographs::new(sources.clone(), budget);
        for (index, source) in sources.iter().enumerate() {
            let kept = files.working(index, &frame, 50.0).expect("a working picture");
            assert_eq!(kept, working(source, &frame, 50.0).expect("a working picture"));
        }
        // The first photograph fits wherever there is a budget, and is then there without its file.
        let away = folder.path().join("away");
        let whole = photograph(&sources[0]).expect("decoded");
        std::fs::rename(&sources[0].path, &away).expect("our own file");
        assert_eq!(files.photograph(0).ok(), (budget > 0).then_some(whole));
        assert!(files.photograph(0).is_err());
        std::fs::rename(&away, &sources[0].path).expect("our own file");
        for (index, source) in sources.iter().enumerate() {
            assert_eq!(files.photograph(index).expect("decoded"), photograph(source).expect("decoded"));
        }
        assert!(files.photograph(2).is_err());
    }
}

/// A working picture is kept beside its photograph, within the same budget, for as long, and handed out to who asks the
/// same way.
#[test]
fn a_working_picture_is_kept_as_long_as_its_photograph() {
    let folder = TempDir::new().expect("a temporary folder");
    let source = examine(write(&folder, "a.png", &rgb8().file(Container::Png)));
    let frame = WorkingFrame::new(source.width, source.height, 300.0);
    let pictures = [50.0, 20.0].map(|area| working(&source, &frame, area).expect("a working picture"));
    let whole = photograph(&source).expect("decoded").bytes();
    let reduced = size_of_val(pictures[0].gray.data()) + size_of_val(pictures[0].thumbnail.data());
    for (budget, kept) in [(whole + reduced, whole + reduced), (whole + reduced - 1, whole), (whole - 1, 0)] {
        let files = FilePhotographs::new(vec![source.clone()], budget);
        for _ in 0..2 {
            assert_eq!(files.working(0, &frame, 50.0).expect("a working picture"), pictures[0]);
            assert_eq!(files.kept_bytes(), kept);
        }
        assert_eq!(files.working(0, &frame, 20.0).expect("a working picture"), pictures[1]);
        files.photograph(0).expect("decoded");
        assert_eq!(files.kept_bytes(), 0);
    }
}

/// The decoder of JPEG makes photographs smaller itself; what comes out is what area averaging makes of all pixels,
/// nearly.
#[test]
fn small_photographs_are_nearly_the_means_of_their_pixels() {
    let folder = TempDir::new().expect("a temporary folder");
    // Of a size that eight does not divide, a photograph that is turned may be off by a part of a pixel.
    small_is_near_to_means(&folder, [437, 291], &[1]);
    small_is_near_to_means(&folder, [440, 288], &[1, 3, 6, 8]);
}

fn small_is_near_to_means(folder: &TempDir, [width, height]: [u16; 2], orientations: &[u8]) {
    // Soft colors, by which means are told from single samples.
    let soft = |x: u16, y: u16, c: u16| {
        let wave = (f64::from(x + 17 * c) / 23.0).sin() * (f64::from(y) / 17.0).cos();
        (128.0 + 90.0 * wave) as u8
    };
    let row = |y: u16| (0..width).flat_map(move |x| [0, 1, 2].map(|c| soft(x, y, c)));
    let pixels: Vec<u8> = (0..height).flat_map(row).collect();
    let path = folder.path().join(format!("{width}.jpg"));
    let encoder = jpeg_encoder::Encoder::new_file(&path, 95).expect("an encoder");
    encoder.encode(&pixels, width, height, jpeg_encoder::ColorType::Rgb).expect("written");
    let source = examine(path);
    for &orientation in orientations {
        let turned = match orientation {
            1 | 3 => SourceImage { orientation, ..source.clone() },
            _ => SourceImage { orientation, width: source.height, height: source.width, ..source.clone() },
        };
        for max_pixels in [1_500.0, 9_000.0, 60_000.0, 1e9] {
            let small = small(&turned, max_pixels).expect("decoded");
            let frame = WorkingFrame::new(turned.width, turned.height, max_pixels);
            let exact = working(&turned, &frame, max_pixels).expect("decoded").thumbnail;
            assert_eq!((small.width(), small.height()), (exact.width(), exact.height()));
            let apart = small.data().iter().zip(exact.data()).map(|(one, other)| f64::from(one.abs_diff(*other)));
            let mean = apart.sum::<f64>() / small.data().len() as f64;
            // A twentieth of what neighboring pixels of the smallest size differ by where it is steepest.
            assert!(mean < 2.0, "orientation {orientation}, {max_pixels}: {mean}");
        }
    }
}

/// Formats whose decoders make nothing smaller come out by exact averaging.
#[test]
fn small_photographs_of_other_formats_are_the_means_of_their_pixels() {
    let folder = TempDir::new().expect("a temporary folder");
    for (name, specimen) in [("eight.png", rgb8()), ("sixteen.png", rgb16())] {
        let source = examine(write(&folder, name, &specimen.file(Container::Png)));
        let small = small(&source, 300.0).expect("decoded");
        let exact = working(&source, &WorkingFrame::new(source.width, source.height, 300.0), 300.0).expect("decoded");
        assert!(
            small.data().iter().zip(exact.thumbnail.data()).all(|(one, other)| one.abs_diff(*other) <= 1),
            "{name}"
        );
    }
}

#[test]
fn a_small_photograph_of_a_damaged_file_is_an_error() {
    let folder = TempDir::new().expect("a temporary folder");
    let whole =
        std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room/00.jpg")).expect("a photograph");
    let path = write(&folder, "damaged.jpg", &whole);
    let source = examine(path.clone());
    // As it is on a disk that fails: the header is whole, the rest is not.
    let mut damaged = whole.clone();
    damaged.truncate(whole.len() / 3);
    std::fs::write(&path, damaged).expect("written");
    assert!(matches!(small(&source, 60_000.0), Err(Error::Input { .. })));
}
