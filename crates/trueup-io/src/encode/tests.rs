//! Pictures written and read back.

use tempfile::TempDir;
use trueup_core::context::{CancelToken, Silent};
use trueup_core::raster::{Photograph, Raster};

use super::failure::WriteFailure;
use super::*;
use crate::format::Output;
use crate::formats;
use crate::source::{SourceOptions, scan};

/// A smooth picture with a transparent left half.
pub(super) struct Gradient {
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Gradient {
    pub(super) fn pixel(&self, x: usize, y: usize) -> [u8; 4] {
        let alpha = if x < self.width / 2 { 0 } else { 255 };
        [(x * 255 / self.width) as u8, (y * 255 / self.height) as u8, 128, alpha]
    }
}

impl RowSource for Gradient {
    fn width(&self) -> usize {
        self.width
    }
    fn height(&self) -> usize {
        self.height
    }
    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        for (x, pixel) in row.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            *pixel = self.pixel(x, y);
        }
        Ok(())
    }
    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        for (x, pixel) in row.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            *pixel = self.pixel(x, y).map(|level| 257 * u16::from(level));
        }
        Ok(())
    }
    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        for (x, pixel) in row.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            *pixel = self.pixel(x, y).map(|level| f32::from(level) / 255.0);
        }
        Ok(())
    }
}

pub(super) fn read(path: &Path) -> Raster<u8> {
    let sources =
        scan(&[path.display().to_string()], &SourceOptions::default(), &StageContext::default()).expect("a scan");
    let source = sources.photographs.first().unwrap_or_else(|| panic!("{:?}", sources.rejected));
    match crate::decode::photograph(source).expect("what was written can be read") {
        Photograph::Eight(raster) => raster,
        Photograph::Sixteen(_) => panic!("8 bits were written"),
    }
}

fn write_default(path: &Path, picture: &Gradient) -> Result<u64> {
    write(path, picture, &Metadata::default(), &OutputOptions::default(), &StageContext::default())
}

/// The files in a folder, temporary ones included.
pub(super) fn files_in(folder: &TempDir) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path()).expect("our own folder");
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn lossless_formats_return_every_pixel() {
    let folder = TempDir::new().expect("a temporary folder");
    // Heights of one strip, of several, and of a rest.
    for (width, height) in [(37, 64), (51, 200), (16, 17)] {
        let picture = Gradient { width, height };
        for name in ["a.png", "a.tif", "a.TIFF", "a.webp"] {
            let path = folder.path().join(name);
            let bytes = write_default(&path, &picture).expect("written");
            assert_eq!(bytes, std::fs::metadata(&path).expect("a file").len());
            let raster = read(&path);
            assert_eq!((raster.width(), raster.height(), raster.channels()), (width, height, 4), "{name}");
            for y in 0..height {
                for x in 0..width {
                    assert_eq!(raster.pixel(x, y), picture.pixel(x, y), "{name} at {x}, {y}");
                }
            }
        }
    }
}

#[test]
fn compression_changes_no_pixel() {
    let folder = TempDir::new().expect("a temporary folder");
    let picture = Gradient { width: 40, height: 70 };
    let options = [
        ("a.png", OutputOptions { png_compression: PngCompression::Balanced, ..OutputOptions::default() }),
        ("a.png", OutputOptions { png_compression: PngCompression::High, ..OutputOptions::default() }),
        ("a.tif", OutputOptions { tiff_compression: TiffCompression::None, ..OutputOptions::default() }),
    ];
    for (name, options) in options {
        let path = folder.path().join(name);
        write(&path, &picture, &Metadata::default(), &options, &StageContext::default()).expect("written");
        let raster = read(&path);
        assert_eq!(raster.pixel(33, 66), picture.pixel(33, 66));
    }
}

#[test]
fn jpeg_strips_join_without_a_trace() {
    let folder = TempDir::new().expect("a temporary folder");
    let subsamplings = [ChromaSubsampling::Full, ChromaSubsampling::HalfWidth, ChromaSubsampling::Quarter];
    // More strips than there are restart markers, the last one of any height.
    for (width, height) in [(50, 500), (33, 48), (16, 49), (17, 16), (64, 96)] {
        let picture = Gradient { width, height };
        for jpeg_subsampling in subsamplings {
            let options = OutputOptions { jpeg_subsampling, background: Background::WHITE, ..OutputOptions::default() };
            let path = folder.path().join("a.jpg");
            write(&path, &picture, &Metadata::default(), &options, &StageContext::default()).expect("written");
            let raster = read(&path);
            assert_eq!((raster.width(), raster.height(), raster.channels()), (width, height, 3));
            for y in 0..height {
                // Away from the border between background and picture, where chroma and ringing blur.
                let x = width - 4;
                let expected = picture.pixel(x, y);
                for (actual, expected) in raster.pixel(x, y).iter().zip(expected) {
                    let difference = actual.abs_diff(expected);
                    assert!(difference <= 16, "{width} x {height} {jpeg_subsampling:?} at {y}: {difference}");
                }
                assert!(raster.pixel(1, y).iter().all(|&value| value > 240), "the background is white");
            }
        }
    }
}

#[test]
fn bytes_do_not_depend_on_the_threads() {
    let folder = TempDir::new().expect("a temporary folder");
    let picture = Gradient { width: 60, height: 700 };
    let tiled = OutputOptions { tiff_layout: TiffLayout::Tiles256, depth: Depth::Sixteen, ..OutputOptions::default() };
    let plain = OutputOptions::default();
    let cases = [("a.jpg", &plain), ("a.png", &plain), ("a.tif", &plain), ("a.webp", &plain), ("b.tif", &tiled)];
    for (name, options) in cases {
        let path = folder.path().join(name);
        let bytes_with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| write(&path, &picture, &Metadata::default(), options, &StageContext::default()))
                .expect("written");
            std::fs::read(&path).expect("a file")
        };
        assert_eq!(bytes_with(1), bytes_with(2), "{name}");
    }
}

#[test]
fn one_pixel_is_a_picture_and_none_is_not() {
    let folder = TempDir::new().expect("a temporary folder");
    for name in ["a.jpg", "a.png", "a.tif", "a.webp"] {
        let path = folder.path().join(name);
        write_default(&path, &Gradient { width: 1, height: 1 }).expect("written");
        let empty = write_default(&path, &Gradient { width: 0, height: 5 }).expect_err("nothing to write").to_string();
        assert!(empty.contains("the panorama is empty"), "{empty}");
    }
}

#[test]
fn sizes_beyond_the_format_are_refused_with_advice() {
    let folder = TempDir::new().expect("a temporary folder");
    let cases = [("a.jpg", 65_536, ".tif"), ("a.webp", 16_384, ".jpg"), ("a.png", 1 << 31, "smaller")];
    for (name, width, advice) in cases {
        let refused = write_default(&folder.path().join(name), &Gradient { width, height: 2 });
        let Err(error @ Error::Limits { .. }) = refused else { panic!("{name}: {refused:?}") };
        assert!(error.to_string().contains(advice), "{error}");
    }
    assert!(files_in(&folder).is_empty());
}

#[test]
fn what_cannot_be_written_is_said_early_and_leaves_nothing() {
    let folder = TempDir::new().expect("a temporary folder");
    let check_writable = |path: &Path| check_writable(path, &OutputOptions::default());
    let at = |name: &str| folder.path().join(name);
    assert!(matches!(check_writable(&at("a.gif")), Err(Error::Unsupported { .. })));
    assert!(matches!(check_writable(&at("a")), Err(Error::Unsupported { .. })));
    let missing = check_writable(&at("absent/a.jpg")).expect_err("no such folder").to_string();
    assert!(missing.contains("does not exist. Create it"), "{missing}");
    std::fs::create_dir(at("x.jpg")).expect("a folder");
    assert!(matches!(check_writable(&at("x.jpg")), Err(Error::Input { .. })));
    std::fs::remove_dir(at("x.jpg")).expect("our own folder");
    check_writable(&at("a.jpg")).expect("writable");
    assert!(files_in(&folder).is_empty());
}

/// Cancels the work when its last row is asked for.
pub(super) struct CancelAtEnd<'a>(pub(super) Gradient, pub(super) &'a CancelToken);

impl RowSource for CancelAtEnd<'_> {
    fn width(&self) -> usize {
        self.0.width
    }
    fn height(&self) -> usize {
        self.0.height
    }
    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        if y + 1 == self.0.height {
            self.1.cancel();
        }
        self.0.rgba8_row(y, row)
    }
    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        if y + 1 == self.0.height {
            self.1.cancel();
        }
        self.0.rgba16_row(y, row)
    }
    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        if y + 1 == self.0.height {
            self.1.cancel();
        }
        self.0.linear_row(y, row)
    }
}

#[test]
fn a_stop_leaves_the_old_file_and_nothing_else() {
    let folder = TempDir::new().expect("a temporary folder");
    for name in ["a.jpg", "a.png", "a.tif", "a.webp"] {
        let path = folder.path().join(name);
        std::fs::write(&path, b"old").expect("a file");
        let cancel = CancelToken::default();
        let picture = CancelAtEnd(Gradient { width: 30, height: 300 }, &cancel);
        let stopped = write(
            &path,
            &picture,
            &Metadata::default(),
            &OutputOptions::default(),
            &StageContext::new(&Silent, &cancel),
        );
        assert!(matches!(stopped, Err(Error::Cancelled)), "{name}: {stopped:?}");
        assert_eq!(std::fs::read(&path).expect("the old file"), b"old");
        std::fs::remove_file(&path).expect("our own file");
        assert!(files_in(&folder).is_empty(), "{name}");
    }
}

/// A disk that fills up after so many bytes.
pub(super) struct FullDisk {
    pub(super) position: u64,
    pub(super) room: u64,
}

impl std::io::Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.position += bytes.len() as u64;
        if self.position > self.room { Err(std::io::ErrorKind::StorageFull.into()) } else { Ok(bytes.len()) }
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl std::io::Seek for FullDisk {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        match to {
            std::io::SeekFrom::Start(position) => self.position = position,
            std::io::SeekFrom::Current(by) => self.position = self.position.saturating_add_signed(by),
            std::io::SeekFrom::End(_) => return Err(std::io::ErrorKind::Unsupported.into()),
        }
        Ok(self.position)
    }
}

#[test]
fn a_full_disk_is_an_error_in_every_format() {
    let picture = Gradient { width: 60, height: 300 };
    let (options, context) = (OutputOptions::default(), StageContext::default());
    let tiled = OutputOptions { tiff_layout: TiffLayout::Tiles256, ..OutputOptions::default() };
    let metadata = Metadata::default();
    for room in [0, 10, 300, 700] {
        let large = Gradient { width: 600, height: 600 };
        let cases = [
            ("a.jpg", &picture, &options),
            ("a.png", &picture, &options),
            ("a.tif", &picture, &options),
            ("a.tif", &picture, &tiled),
            ("a.webp", &large, &options),
        ];
        for (name, picture, options) in cases {
            let Some(Writer::File(write)) = formats::writing_of(Path::new(name)).map(|writing| writing.writer) else {
                panic!("{name} is no single file")
            };
            let disk: &mut dyn Output = &mut FullDisk { position: 0, room };
            let result = write(disk, picture, &metadata, options, &context);
            let Err(WriteFailure::Io(error)) = result else { panic!("{name}, room {room}: {result:?}") };
            let message = WriteFailure::Io(error).at(Path::new("a.jpg")).to_string();
            assert!(message.starts_with("writing a.jpg"), "{message}");
        }
    }
}

#[test]
fn other_files_appear_at_once_too() {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().join("project.json");
    write_atomically(&path, b"one").expect("written");
    write_atomically(&path, b"two").expect("written again");
    assert_eq!(std::fs::read(&path).expect("a file"), b"two");
    assert_eq!(files_in(&folder), ["project.json"]);
    assert!(write_atomically(&folder.path().join("absent/a"), b"").is_err());
}

#[cfg(unix)]
#[test]
fn permissions_of_a_replaced_file_are_kept_and_new_ones_are_usual() {
    use std::os::unix::fs::PermissionsExt;
    let folder = TempDir::new().expect("a temporary folder");
    let mode = |path: &Path| path.metadata().expect("a file").permissions().mode() & 0o777;
    let usual = folder.path().join("usual");
    std::fs::write(&usual, b"").expect("a file");
    let path = folder.path().join("a.txt");
    write_atomically(&path, b"new").expect("written");
    assert_eq!(mode(&path), mode(&usual));
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).expect("our own file");
    write_atomically(&path, b"newer").expect("written");
    assert_eq!(mode(&path), 0o640);
}
