//! Writing large panoramas, in megapixels a second.

use divan::Bencher;
use divan::counter::ItemsCount;
use trueup_core::raster::RowSource;
use trueup_core::{Result, StageContext};
use trueup_io::encode::{Metadata, OutputOptions, TiffLayout, write};

/// 100 megapixels.
const SIDE: usize = 10_000;

/// A tile of detail, repeated: smooth shading and grain, about as compressible as a photograph.
struct Detail(Vec<u16>);

const TILE: usize = 512;

impl Detail {
    fn new() -> Self {
        let level = |at: usize| {
            let (x, y) = ((at / 4 % TILE) as f64, (at / 4 / TILE) as f64);
            if at % 4 == 3 {
                return u16::MAX;
            }
            let grain = ((at * 2_654_435_761) >> 7 & 0x3ff) as f64;
            let wave = |length: f64| std::f64::consts::TAU * (TILE as f64 / length).round() / TILE as f64;
            (30_000.0 + 12_000.0 * (x * wave(90.0)).sin() * (y * wave(60.0)).cos() + grain) as u16
        };
        Self((0..TILE * TILE * 4).map(level).collect())
    }

    fn row_of<S>(&self, y: usize, row: &mut [S], of: impl Fn(u16) -> S) -> Result<()> {
        let tile = &self.0[y % TILE * TILE * 4..][..TILE * 4];
        for part in row.chunks_mut(TILE * 4) {
            for (sample, &value) in part.iter_mut().zip(tile) {
                *sample = of(value);
            }
        }
        Ok(())
    }
}

impl RowSource for Detail {
    fn width(&self) -> usize {
        SIDE
    }
    fn height(&self) -> usize {
        SIDE
    }
    fn is_opaque(&self) -> bool {
        true
    }
    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        self.row_of(y, row, |value| (value >> 8) as u8)
    }
    fn rgba16_row(&self, y: usize, row: &mut [u16]) -> Result<()> {
        self.row_of(y, row, |value| value)
    }
    fn linear_row(&self, y: usize, row: &mut [f32]) -> Result<()> {
        self.row_of(y, row, |value| f32::from(value) / 65_535.0)
    }
}

#[divan::bench(args = ["a.jpg", "a.png", "strips.tif", "tiles.tif", "a.dzi"], sample_count = 3, sample_size = 1)]
fn hundred_megapixels(bencher: Bencher, name: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let tiff_layout = if name.starts_with("strips") { TiffLayout::Strips } else { TiffLayout::Tiles256 };
    let options = OutputOptions { tiff_layout, ..OutputOptions::default() };
    let picture = Detail::new();
    bencher.counter(ItemsCount::new(SIDE * SIDE)).bench_local(|| {
        write(&folder.path().join(name), &picture, &Metadata::default(), &options, &StageContext::default())
            .expect("written")
    });
}

fn main() {
    divan::main();
}
