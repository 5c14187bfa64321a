use nalgebra::Vector2;
use proptest::prelude::*;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::{Photograph, Raster, RowSource};
use trueup_core::scratch::{ScratchFile, ScratchSpace};

use trueup_core::colour::TransferCurve;

use super::panorama::Pixels;
use super::*;
use crate::deformed_grid::DeformedGrid;
use crate::exposure::Response;
use crate::layout::{self, CanvasOptions, Placed};
use crate::simd::{Positions, invert_row};

/// Photographs in memory.
pub(crate) struct Memory(pub(crate) Vec<Photograph>);

impl PhotographSource for Memory {
    fn photograph(&self, index: usize) -> Result<Photograph> {
        self.0.get(index).cloned().ok_or_else(|| Error::input(index, "no such photograph", ""))
    }
}

/// A scratch file in memory that takes at most so many bytes.
#[derive(Debug)]
pub(crate) struct RamDisk {
    pub(crate) room: u64,
    pub(super) bytes: Arc<std::sync::Mutex<Vec<u8>>>,
}

impl Default for RamDisk {
    fn default() -> Self {
        Self { room: u64::MAX, bytes: Default::default() }
    }
}

impl RamDisk {
    /// The most that was written.
    pub(crate) fn length(&self) -> usize {
        self.bytes.lock().expect("no writer failed").len()
    }
}

impl ScratchSpace for RamDisk {
    fn create(&self, _: u64) -> Result<Box<dyn ScratchFile>> {
        Ok(Box::new(Self { room: self.room, bytes: self.bytes.clone() }))
    }
}

impl ScratchFile for RamDisk {
    fn write_at(&self, bytes: &[u8], offset: u64) -> Result<()> {
        let end = offset as usize + bytes.len();
        if end as u64 > self.room {
            return Err(Error::io("writing", std::path::Path::new("disk"), std::io::ErrorKind::StorageFull.into()));
        }
        let mut all = self.bytes.lock().expect("no writer failed");
        let length = all.len().max(end);
        all.resize(length, 0);
        all[offset as usize..end].copy_from_slice(bytes);
        Ok(())
    }

    fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<()> {
        let all = self.bytes.lock().expect("no writer failed");
        bytes.copy_from_slice(&all[offset as usize..][..bytes.len()]);
        Ok(())
    }
}

pub(super) fn noise(width: usize, height: usize, channels: usize) -> Raster<u8> {
    let data = (0..width * height * channels).map(|i| ((i * 2_654_435_761) >> 13) as u8).collect();
    Raster::from_data(width, height, channels, data).expect("as many samples")
}

fn gradient(width: usize, height: usize, level: impl Fn(f64, f64) -> f64) -> Photograph {
    let data = (0..width * height)
        .flat_map(|i| [level((i % width) as f64 + 0.5, (i / width) as f64 + 0.5).round() as u8; 3])
        .collect();
    Photograph::Eight(Raster::from_data(width, height, 3, data).expect("as many samples"))
}

pub(super) fn moved(photograph: usize, width: f64, height: f64, move_to: impl Fn(Vector2<f64>) -> [f64; 2]) -> Placed {
    let mut mesh = GridMesh::regular(width, height, 20.0);
    for vertex in &mut mesh.target {
        *vertex = move_to(Vector2::from(*vertex));
    }
    Placed { photograph, mesh }
}

pub(super) fn canvas(width: usize, height: usize, placed: Vec<Placed>) -> CanvasLayout {
    CanvasLayout { width, height, canvas_from_target: 1.0, origin: [0.0; 2], placed, period: None }
}

fn render(layout: &CanvasLayout, pictures: Vec<Photograph>, options: &RenderOptions) -> Panorama {
    let corrections = Corrections::plain(layout.placed.len());
    compose(layout, &corrections, &Memory(pictures), options, &StageContext::default()).expect("renders")
}

fn compose(
    layout: &CanvasLayout,
    corrections: &Corrections,
    photographs: &Memory,
    options: &RenderOptions,
    context: &StageContext,
) -> Result<Panorama> {
    run(layout, corrections, photographs, options, &SeamOptions::default(), context)
}

fn linear(panorama: &Panorama, x: usize, y: usize) -> [f32; 4] {
    panorama.linear_pixel(x, y).expect("pixels in memory")
}

/// Everything a panorama holds, exactly.
pub(super) fn bits(panorama: &Panorama) -> Vec<[u32; 4]> {
    (0..panorama.height())
        .flat_map(|y| match &panorama.pixels {
            Pixels::Sums(sums) => {
                sums.row(y).expect("a row").iter().map(|sum| sum.map(f32::to_bits)).collect::<Vec<_>>()
            }
            Pixels::Roots(roots) => roots.row(y).expect("a row").iter().map(|root| root.map(u32::from)).collect(),
        })
        .collect()
}

pub(super) fn rows(panorama: &Panorama) -> Vec<u8> {
    let mut bytes = vec![0; panorama.width() * panorama.height() * 4];
    for (y, row) in bytes.chunks_exact_mut(panorama.width() * 4).enumerate() {
        panorama.rgba8_row(y, row).expect("rows in memory");
    }
    bytes
}

#[test]
fn an_undeformed_grid_returns_the_photograph() {
    let raster = noise(83, 61, 3);
    for interpolation in [Interpolation::Bilinear, Interpolation::Bicubic] {
        for blend in [Blend::MultiBand, Blend::Feather, Blend::Average, Blend::None] {
            let options = RenderOptions { interpolation, blend, ..RenderOptions::default() };
            let placed = vec![moved(0, 83.0, 61.0, |p| p.into())];
            let context = StageContext::default();
            let layout = layout::run(placed, 0, &CanvasOptions::default(), &context).expect("one grid");
            assert_eq!((layout.width, layout.height), (83, 61));
            let bytes = rows(&render(&layout, vec![Photograph::Eight(raster.clone())], &options));
            for (got, expected) in bytes.chunks_exact(4).zip(raster.data().chunks_exact(3)) {
                assert_eq!((&got[..3], got[3]), (expected, 255));
            }
        }
    }
}

#[test]
fn gray_masked_and_deep_photographs_come_back_too() {
    let gray = noise(40, 30, 1);
    let masked = Raster::from_data(40, 30, 4, gray.data().iter().flat_map(|&v| [v, 0, 9, v | 1]).collect());
    let deep = Raster::from_data(40, 30, 3, gray.data().iter().flat_map(|&v| [u16::from(v) * 257; 3]).collect());
    let layout = canvas(40, 30, vec![moved(0, 40.0, 30.0, |p| p.into())]);
    let options = RenderOptions::default();
    let from_gray = rows(&render(&layout, vec![Photograph::Eight(gray.clone())], &options));
    let from_deep = rows(&render(&layout, vec![Photograph::Sixteen(deep.expect("deep"))], &options));
    assert_eq!(from_gray, from_deep);
    for (got, &level) in from_gray.chunks_exact(4).zip(gray.data()) {
        assert_eq!(got, [level, level, level, 255]);
    }
    let from_masked = rows(&render(&layout, vec![Photograph::Eight(masked.expect("masked"))], &options));
    for (got, &level) in from_masked.chunks_exact(4).zip(gray.data()) {
        assert_eq!(got, [level, 0, 9, level | 1]);
    }
}

#[test]
fn a_shift_by_half_a_pixel_moves_a_gradient_by_half_a_step() {
    let picture = gradient(64, 48, |x, y| 20.0 + 2.0 * x + y);
    let layout = canvas(65, 49, vec![moved(0, 64.0, 48.0, |p| [p.x + 0.5, p.y + 0.5])]);
    let bytes = rows(&render(&layout, vec![picture], &RenderOptions::default()));
    for y in 3..46 {
        for x in 3..61 {
            let expected = 20.0 + 2.0 * x as f64 + y as f64;
            let got = f64::from(bytes[(y * 65 + x) * 4]);
            assert!((got - expected).abs() <= 1.0, "({x}, {y}): {got} for {expected}");
        }
    }
    // The border runs through the centres of the first column: half covered, and no darker for it.
    let edge = &bytes[(20 * 65) * 4..][..4];
    assert_eq!(edge[3], 128);
    assert!(edge[0] >= 41, "{edge:?}");
}

#[test]
fn the_border_is_anti_aliased_where_it_runs_askew() {
    let picture = gradient(60, 60, |_, _| 180.0);
    let turn = nalgebra::Rotation2::new(0.3);
    let centre = Vector2::new(50.0, 50.0);
    let layout = canvas(100, 100, vec![moved(0, 60.0, 60.0, |p| (turn * (p - Vector2::repeat(30.0)) + centre).into())]);
    let bytes = rows(&render(&layout, vec![picture], &RenderOptions::default()));
    let covered: f64 = bytes.chunks_exact(4).map(|pixel| f64::from(pixel[3]) / 255.0).sum();
    assert!((covered - 3600.0).abs() < 4.0, "{covered}");
    let partial = bytes.chunks_exact(4).filter(|pixel| pixel[3] > 0 && pixel[3] < 255).count();
    assert!(partial > 200, "{partial}");
    for pixel in bytes.chunks_exact(4).filter(|pixel| pixel[3] > 0) {
        assert_eq!(&pixel[..3], [180; 3]);
    }
}

#[test]
fn an_inner_border_leaves_no_trace_on_equal_pictures() {
    let options = RenderOptions::default();
    let picture = gradient(60, 60, |_, _| 137.0);
    let layout = canvas(
        90,
        60,
        vec![moved(0, 60.0, 60.0, |p| p.into()), moved(1, 60.0, 60.0, |p| [p.x + 29.7, p.y * 0.9 + 2.3])],
    );
    let bytes = rows(&render(&layout, vec![picture.clone(), picture], &options));
    for pixel in bytes.chunks_exact(4).filter(|pixel| pixel[3] > 0) {
        assert_eq!(&pixel[..3], [137; 3]);
    }
    assert!(bytes.chunks_exact(4).take(60).all(|pixel| pixel[3] == 255));
}

#[test]
fn gains_act_on_linear_light() {
    let layout = canvas(30, 30, vec![moved(0, 30.0, 30.0, |p| p.into())]);
    let photographs = Memory(vec![gradient(30, 30, |_, _| 100.0)]);
    let options = RenderOptions::default();
    let context = StageContext::default();
    let panorama =
        compose(&layout, &vec![Correction::uniform(2.0)].into(), &photographs, &options, &context).expect("renders");
    // sRGB 100 is 0.127438 in linear light; twice that, levelled off by 0.1 %, is level 137.6.
    assert!((linear(&panorama, 15, 15)[0] - 0.254_876 / 1.000_987).abs() < 2e-5);
    assert_eq!(&rows(&panorama)[..4], [138, 138, 138, 255]);
    assert!(matches!(
        compose(&layout, &Corrections::plain(0), &photographs, &options, &context),
        Err(Error::Input { .. })
    ));
    let bad = vec![Correction::uniform(f64::NAN)].into();
    assert!(matches!(compose(&layout, &bad, &photographs, &options, &context), Err(Error::Input { .. })));
}

#[test]
fn a_reduced_panorama_shows_means_not_single_samples() {
    // A one-pixel checkerboard must turn into even gray at any scale clearly below 1.
    let board = gradient(256, 256, |x, y| if (x as usize + y as usize).is_multiple_of(2) { 40.0 } else { 160.0 });
    for scale in [0.55, 0.3, 0.11] {
        let layout = canvas(30, 30, vec![moved(0, 256.0, 256.0, |p| (p * scale).into())]);
        let bytes = rows(&render(&layout, vec![board.clone()], &RenderOptions::default()));
        for y in 4..24 {
            for x in 4..24 {
                let level = bytes[(y * 30 + x) * 4];
                assert!(level.abs_diff(100) <= 12, "{level} at scale {scale}");
            }
        }
    }
}

#[test]
fn folds_are_counted_and_every_pixel_is_hit_once() {
    let mut folded = moved(0, 60.0, 60.0, |p| p.into());
    // Pull an inner vertex across its right neighbour.
    folded.mesh.target[5] = [55.0, 20.0];
    let layout = canvas(60, 60, vec![folded]);
    let context = StageContext::default();
    let options = RenderOptions { blend: Blend::Average, ..RenderOptions::default() };
    let photographs = Memory(vec![gradient(60, 60, |_, _| 90.0)]);
    let panorama = compose(&layout, &Corrections::plain(1), &photographs, &options, &context).expect("renders");
    let Pixels::Sums(sums) = &panorama.pixels else { panic!("a mean") };
    assert!((0..60).all(|y| sums.row(y).expect("in memory").iter().all(|sum| sum[3] <= 1.0)));
    let diagnostics = context.take_diagnostics();
    assert_eq!(diagnostics[0].code, "grid-folded");
    assert!(diagnostics[0].message.starts_with("2 of 18"), "{}", diagnostics[0].message);
}

#[test]
fn pictures_outside_or_far_too_small_are_harmless() {
    let picture = gradient(30, 30, |_, _| 90.0);
    let layout = canvas(
        20,
        20,
        vec![
            moved(0, 30.0, 30.0, |p| [p.x + 500.0, p.y - 900.0]),
            moved(0, 30.0, 30.0, |p| (p * 1e-7 + Vector2::repeat(7.5)).into()),
            moved(0, 30.0, 30.0, |_| [3.0, 3.0]),
            moved(0, 30.0, 30.0, |p| (p * 1e15).into()),
        ],
    );
    for blend in [Blend::Feather, Blend::MultiBand, Blend::None] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let panorama = render(&layout, vec![picture.clone()], &options);
        assert!((0..400).all(|at| linear(&panorama, at % 20, at / 20).iter().all(|value| value.is_finite())));
    }
}

#[test]
fn photographs_of_another_size_are_refused() {
    let layout = canvas(30, 30, vec![moved(0, 30.0, 30.0, |p| p.into())]);
    let options = RenderOptions::default();
    for picture in [noise(30, 29, 3), noise(30, 30, 2)] {
        let photographs = Memory(vec![Photograph::Eight(picture)]);
        let result = compose(&layout, &Corrections::plain(1), &photographs, &options, &StageContext::default());
        assert!(matches!(result, Err(Error::Input { .. })));
    }
}

#[test]
fn an_empty_layout_is_transparent() {
    let layout = canvas(70, 30, vec![]);
    let panorama = render(&layout, vec![], &RenderOptions::default());
    assert!(matches!(panorama.pixels, Pixels::Sums(_)), "nothing to seek seams between");
    assert!(rows(&panorama).iter().all(|&byte| byte == 0));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let pictures: Vec<Photograph> = (0..5).map(|_| Photograph::Eight(noise(90, 70, 3))).collect();
    let placed =
        (0..5).map(|i| moved(i, 90.0, 70.0, |p| [p.x + 13.3 * i as f64, p.y * 1.1 + 0.002 * p.x * p.y])).collect();
    let layout = canvas(160, 110, placed);
    let of_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        let of = |blend| render(&layout, pictures.clone(), &RenderOptions { blend, ..RenderOptions::default() });
        pool.install(|| [Blend::MultiBand, Blend::Feather, Blend::None].map(|blend| bits(&of(blend))))
    };
    let single = of_threads(1);
    for threads in [2, 3] {
        assert!(single == of_threads(threads));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn jittered_grids_have_no_holes_and_no_double_hits(jitter in prop::collection::vec(-6.0..6.0_f64, 2 * 7 * 6)) {
        let mut placed = moved(0, 120.0, 100.0, |p| [p.x + 10.0, p.y + 10.0]);
        for (index, vertex) in placed.mesh.target.iter_mut().enumerate() {
            vertex[0] += jitter[2 * index];
            vertex[1] += jitter[2 * index + 1];
        }
        let grid = DeformedGrid::new(&placed.mesh, 1.0, true, 140, 120);
        let all: Vec<u32> = (0..grid.cells.len() as u32).collect();
        let (mut owner, mut runs) = (Vec::new(), Vec::new());
        for y in 0..120 {
            // Count the hits of every cell on its own: with no folds they must not overlap, nor leave a gap inside.
            let mut hits = [0; 140];
            for cell in &all {
                grid.runs(y, &[*cell], &mut owner, &mut runs);
                for run in &runs {
                    hits[run.columns.clone()].iter_mut().for_each(|hit| *hit += 1);
                }
            }
            prop_assert!(hits.iter().all(|&hit| hit <= 1), "row {} {:?}", y, hits);
            if (20..100).contains(&y) {
                prop_assert!(hits[20..120].iter().all(|&hit| hit == 1), "row {} {:?}", y, hits);
            }
        }
    }

    #[test]
    fn inverting_the_grid_returns_to_the_pixel(jitter in prop::collection::vec(-6.0..6.0_f64, 2 * 7 * 6)) {
        let mut placed = moved(0, 120.0, 100.0, |p| [p.x + 10.0, p.y + 10.0]);
        for (index, vertex) in placed.mesh.target.iter_mut().enumerate() {
            vertex[0] += jitter[2 * index];
            vertex[1] += jitter[2 * index + 1];
        }
        let grid = DeformedGrid::new(&placed.mesh, 1.0, false, 140, 120);
        let all: Vec<u32> = (0..grid.cells.len() as u32).collect();
        let (mut owner, mut runs, mut positions) = (Vec::new(), Vec::new(), Positions::default());
        for y in (0..120).step_by(7) {
            grid.runs(y, &all, &mut owner, &mut runs);
            for run in &runs {
                positions.resize(run.columns.len());
                invert_row(&grid.cells[run.cell].inverse_along_row(y), run.columns.start, &mut positions);
                for (index, column) in run.columns.clone().enumerate() {
                    let source = Vector2::new(
                        f64::from(positions.column[index]) + 0.5 + f64::from(positions.fraction_x[index]),
                        f64::from(positions.row[index]) + 0.5 + f64::from(positions.fraction_y[index]),
                    );
                    let back = placed.mesh.warp(source);
                    let expected = Vector2::new(column as f64 + 0.5, y as f64 + 0.5);
                    prop_assert!((back - expected).norm() < 1e-4, "{} for {}", back, expected);
                }
            }
        }
    }
}

/// A gradient of grey moved by (30, 20): its layer is that box, with the levels it has.
#[test]
fn a_layer_is_one_photograph_where_it_lies() {
    let photographs = Memory(vec![gradient(100, 80, |x, _| x), gradient(60, 40, |x, y| 50.0 + x + 2.0 * y)]);
    let placed = vec![moved(0, 100.0, 80.0, |p| p.into()), moved(1, 60.0, 40.0, |p| [p.x + 30.0, p.y + 20.0])];
    let context = StageContext::default();
    let layout = layout::run(placed, 0, &CanvasOptions::default(), &context).expect("two grids");
    let found = layer(&layout, &Corrections::plain(2), 1, &photographs, &RenderOptions::default()).expect("a layer");
    // The extrapolated rim may reach a pixel beyond the photograph; it is not covered.
    for y in 0..layout.height {
        for x in 0..layout.width {
            let inside = (30..90).contains(&x) && (20..60).contains(&y);
            let in_box = x >= found.left
                && y >= found.top
                && x < found.left + found.gray.width()
                && y < found.top + found.gray.height();
            assert!(in_box || !inside, "{x} {y}");
            if in_box {
                let (column, row) = (x - found.left, y - found.top);
                assert_eq!(found.covered.pixel(column, row)[0], inside, "{x} {y}");
                let expected = 50.0 + (x as f32 - 29.5) + 2.0 * (y as f32 - 19.5);
                assert!(!inside || (found.gray.pixel(column, row)[0] - expected).abs() <= 1.0, "{x} {y}");
            }
        }
    }
    let corrections = Corrections::plain(2);
    let rows = layer_rows(&layout, &corrections, 1, &photographs, &RenderOptions::default())
        .expect("a layer")
        .expect("on the canvas");
    assert_eq!([rows.left, rows.top], [found.left, found.top]);
    assert_eq!([rows.width(), rows.height()], [found.gray.width(), found.gray.height()]);
    assert_eq!(layer_size(&layout, 1), [rows.width(), rows.height()]);
    let (mut eight, mut sixteen) = (vec![0; 4 * rows.width()], vec![0; 4 * rows.width()]);
    for y in 0..rows.height() {
        rows.rgba8_row(y, &mut eight).expect("a row");
        rows.rgba16_row(y, &mut sixteen).expect("a row");
        for x in 0..rows.width() {
            let covered = found.covered.pixel(x, y)[0];
            assert_eq!(eight[4 * x + 3] == 255, covered, "{x} {y}");
            assert!(!covered || (f32::from(eight[4 * x]) - found.gray.pixel(x, y)[0]).abs() < 0.01);
            assert!(!covered || (f32::from(sixteen[4 * x]) / 257.0 - f32::from(eight[4 * x])).abs() <= 0.505);
        }
    }
    assert!(layer(&layout, &Corrections::plain(2), 2, &photographs, &RenderOptions::default()).is_err());
}

/// The rows of one panorama at every depth say the same, from sums and from roots.
#[test]
fn rows_of_every_depth_agree() {
    let layout = canvas(90, 50, vec![moved(0, 80.0, 40.0, |p| [p.x + 4.3, p.y + 5.6])]);
    for blend in [Blend::Feather, Blend::MultiBand] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let panorama = render(&layout, vec![Photograph::Eight(noise(80, 40, 3))], &options);
        let (mut eight, mut sixteen, mut linear) = (vec![0; 360], vec![0; 360], vec![0.0; 360]);
        for y in 0..50 {
            panorama.rgba8_row(y, &mut eight).expect("rows in memory");
            panorama.rgba16_row(y, &mut sixteen).expect("rows in memory");
            panorama.linear_row(y, &mut linear).expect("rows in memory");
            for x in 0..90 {
                let at = 4 * x..4 * x + 4;
                let linear = &linear[at.clone()];
                // A part of a pixel too small for 8 bits of alpha is left out there.
                if eight[at.end - 1] == 0 {
                    continue;
                }
                for ((&eight, &sixteen), channel) in eight[at.clone()].iter().zip(&sixteen[at]).zip(0..) {
                    assert!((f32::from(sixteen) / 257.0 - f32::from(eight)).abs() <= 0.505, "{eight} {sixteen}");
                    let light = f64::from(linear[channel]).min(1.0);
                    let encoded = match channel {
                        3 => light,
                        _ if light <= 0.0031308 => 12.92 * light,
                        _ => 1.055 * light.powf(1.0 / 2.4) - 0.055,
                    };
                    assert!((encoded * 65535.0 - f64::from(sixteen)).abs() < 0.6, "{encoded} {sixteen}");
                }
            }
        }
    }
}

/// What is shown as it was taken keeps its samples, whatever the response; floating point stays the profile's light.
#[test]
fn a_response_leaves_the_look_of_a_photograph() {
    let response = Response { coefficients: [0.1, -0.6, 0.5, 0.2] };
    let ramp = |levels: usize, level: &dyn Fn(usize) -> u16| -> Vec<u16> {
        (0..levels).flat_map(|at| [level(at), level(levels - 1 - at), level(at)]).collect()
    };
    let eight: Vec<u8> = ramp(256, &|at| at as u16).iter().map(|&level| level as u8).collect();
    let sixteen = ramp(256, &|at| at as u16 * 257);
    let eight = Photograph::Eight(Raster::from_data(256, 1, 3, eight).expect("as many samples"));
    let sixteen = Photograph::Sixteen(Raster::from_data(256, 1, 3, sixteen).expect("as many samples"));
    let layout = canvas(256, 1, vec![moved(0, 256.0, 1.0, |p| [p.x, p.y])]);
    let corrections = Corrections { response, photographs: vec![Correction::default()] };
    for blend in [Blend::MultiBand, Blend::None, Blend::Feather, Blend::Average] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        for photograph in [eight.clone(), sixteen.clone()] {
            let context = StageContext::default();
            let panorama =
                compose(&layout, &corrections, &Memory(vec![photograph]), &options, &context).expect("renders");
            let (mut levels, mut fine, mut light) = (vec![0; 1024], vec![0; 1024], vec![0.0; 1024]);
            panorama.rgba8_row(0, &mut levels).expect("a row");
            panorama.rgba16_row(0, &mut fine).expect("a row");
            panorama.linear_row(0, &mut light).expect("a row");
            for x in 0..256 {
                let expected = TransferCurve::SRGB.linear(x as f64 / 255.0);
                assert_eq!(usize::from(levels[4 * x]), x, "{blend:?}");
                // Square roots in 16 bits are this fine, and coarser in the darkest hundredth.
                assert!(fine[4 * x].abs_diff(x as u16 * 257) <= 2, "{blend:?} {x}: {}", fine[4 * x]);
                assert!((f64::from(light[4 * x]) - expected).abs() < 1e-4, "{blend:?} {x}: {}", light[4 * x]);
                assert_eq!(panorama.linear_pixel(x, 0).expect("in memory"), light[4 * x..4 * x + 4], "{blend:?}");
            }
        }
    }
}
