//! Deep Zoom tiles, read back by other crates.

use std::fs::File;
use std::io::BufReader;

use trueup_core::context::{CancelToken, Silent};

use super::format_tests::written;
use super::tests::{CancelAtEnd, Gradient, files_in};
use super::*;

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
    let stopped = write(&path, &picture, &Metadata::default(), &options, &StageContext::new(&Silent, &cancel));
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
