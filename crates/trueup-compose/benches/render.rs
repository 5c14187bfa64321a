//! Rendering speed: two photographs of 2.7 megapixels, overlapping by half, mildly deformed.
//!
//! `cargo bench -p trueup-compose`; divan reports photograph samples placed per second.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use trueup_compose::exposure::Correction;
use trueup_compose::layout::{CanvasLayout, CanvasOptions, Placed, run as lay_out};
use trueup_compose::render::{Blend, Interpolation, Panorama, RenderInput, RenderOptions, Resources, run as render};
use trueup_compose::seam::SeamOptions;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::{Photograph, Raster, RowSource};
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result, StageContext};

const WIDTH: usize = 1920;
const HEIGHT: usize = 1440;

struct Memory(Vec<Photograph>);

impl PhotographSource for Memory {
    fn photograph(&self, index: usize) -> Result<Photograph> {
        self.0.get(index).cloned().ok_or_else(|| Error::input(index, "no such photograph", ""))
    }
}

fn photographs() -> Memory {
    let photograph = |seed: usize| {
        let data =
            (0..WIDTH * HEIGHT * 3).map(|i| (i / 3 % WIDTH / 8 + (i * 2_654_435_761 + seed) % 61) as u8).collect();
        Photograph::Eight(Raster::from_data(WIDTH, HEIGHT, 3, data).expect("as many samples"))
    };
    Memory(vec![photograph(1), photograph(2)])
}

fn layout(scale: f64) -> CanvasLayout {
    let placed = (0..2)
        .map(|photograph| {
            let mut mesh = GridMesh::regular(WIDTH as f64, HEIGHT as f64, 96.0);
            let shift = photograph as f64 * 960.0;
            for vertex in &mut mesh.target {
                let [x, y] = *vertex;
                *vertex = [x + 6.0 * (y / 300.0).sin() + shift, y + 0.02 * x + 5.0 * (x / 400.0).cos()];
            }
            Placed { photograph, mesh }
        })
        .collect();
    let options = CanvasOptions { scale, ..CanvasOptions::default() };
    lay_out(placed, 0, &options, &StageContext::default()).expect("two grids")
}

fn compose(layout: &CanvasLayout, photographs: &Memory, options: &RenderOptions) -> Result<Panorama> {
    let corrections = vec![Correction::uniform(0.9), Correction::uniform(1.1)].into();
    let input = RenderInput { layout, corrections: &corrections, photographs };
    let (seams, context) = (SeamOptions::default(), StageContext::default());
    Ok(render(&input, &Resources::unlimited(), options, &seams, None, &context)?.panorama)
}

fn bench_render(bencher: Bencher, scale: f64, threads: usize, options: RenderOptions) {
    let (photographs, layout) = (photographs(), layout(scale));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
    let samples = (2.0 * (WIDTH * HEIGHT) as f64 * scale * scale) as usize;
    bencher.counter(ItemsCount::new(samples)).bench(|| pool.install(|| compose(&layout, &photographs, &options)));
}

fn feather(interpolation: Interpolation) -> RenderOptions {
    RenderOptions { interpolation, blend: Blend::Feather, ..RenderOptions::default() }
}

#[divan::bench(args = [1, 2], sample_count = 10)]
fn bicubic(bencher: Bencher, threads: usize) {
    bench_render(bencher, 1.0, threads, feather(Interpolation::Bicubic));
}

#[divan::bench(args = [1, 2], sample_count = 10)]
fn bilinear(bencher: Bencher, threads: usize) {
    bench_render(bencher, 1.0, threads, feather(Interpolation::Bilinear));
}

#[divan::bench(args = [1, 2], sample_count = 10)]
fn reduced_to_0_6(bencher: Bencher, threads: usize) {
    bench_render(bencher, 0.6, threads, feather(Interpolation::Bicubic));
}

/// Seams and multi-band blending.
#[divan::bench(args = [1, 2], sample_count = 10)]
fn multiband(bencher: Bencher, threads: usize) {
    bench_render(bencher, 1.0, threads, RenderOptions::default());
}

/// Seams alone.
#[divan::bench(args = [1, 2], sample_count = 10)]
fn cut(bencher: Bencher, threads: usize) {
    bench_render(bencher, 1.0, threads, RenderOptions { blend: Blend::None, ..RenderOptions::default() });
}

#[divan::bench(sample_count = 10)]
fn encode_rows(bencher: Bencher) {
    let layout = layout(1.0);
    let panorama: Panorama = compose(&layout, &photographs(), &RenderOptions::default()).expect("renders");
    let mut row = vec![0; 4 * panorama.width()];
    bencher.counter(ItemsCount::new(panorama.width() * panorama.height())).bench_local(|| {
        for y in 0..panorama.height() {
            panorama.rgba8_row(y, black_box(&mut row)).expect("rows in memory");
        }
    });
}

fn main() {
    divan::main();
}
