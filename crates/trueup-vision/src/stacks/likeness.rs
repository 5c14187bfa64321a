//! Whether two exposures show the same view.

use trueup_core::color::{ToneRelation, ToneSums, TransferCurve};
use trueup_core::raster::{LUMA, Raster};
use trueup_core::statistics::median;

/// Levels from which a sample tells that there is light, but not how much: what cameras and JPEG compression leave of
/// white.
pub(super) const CLIPPED: f32 = 250.0;
/// Levels up to which a sample tells of no light.
pub(super) const CRUSHED: f32 = 5.0;

/// Pixels beside a pixel of whose mean its detail is the difference: wide enough for edges that are half a pixel off,
/// and narrow enough that sky above ground is none.
const DETAIL_RADIUS: usize = 4;

/// Pictures are divided into so many tiles along each side, each of which is asked whether it agrees.
const TILES: usize = 4;
/// Root mean square of a tile's detail, in levels, from which it has any: more than compression and noise leave in a
/// small copy.
const LEAST_DETAIL: f64 = 1.0;
/// Share of a tile that both exposures must tell of.
const LEAST_TILE_SHARE: f64 = 0.05;
/// Correlation of a tile's details from which it agrees: of unrelated ones of some hundred pixels it stays below.
const TILE_AGREES: f64 = 0.4;

/// How alike the details of two pictures are once the one has the other's tones.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Likeness {
    /// Correlation of the details, -1 to 1.
    pub(super) correlation: f64,
    /// Share, 0 to 1, of the tiles with detail in which they agree.
    pub(super) agreeing_tiles: f64,
    /// Share of the picture in which both tell something, 0 to 1.
    pub(super) told: f64,
}

/// How alike `dark` and `predicted`, what the other exposure lets expect of it, are; NaN where it lets expect nothing.
pub(super) fn likeness(dark: &Raster<f32>, predicted: &[f32]) -> Likeness {
    let (width, height) = (dark.width(), dark.height());
    let details = details(dark.data(), predicted, width);
    // Products over each tile: of the one, of both, of the other, and how many.
    let mut tiles = [[0.0_f64; 4]; TILES * TILES];
    for (index, &[own, other]) in details.iter().enumerate().filter(|(_, [own, _])| !own.is_nan()) {
        let (x, y) = (index % width, index / width);
        let tile = &mut tiles[(y * TILES / height) * TILES + x * TILES / width];
        let (own, other) = (f64::from(own), f64::from(other));
        for (sum, product) in tile.iter_mut().zip([own * own, own * other, other * other, 1.0]) {
            *sum += product;
        }
    }
    let correlation = |[own, both, other, _]: [f64; 4]| both / (own * other).sqrt().max(f64::MIN_POSITIVE);
    let all = tiles.iter().fold([0.0; 4], |sum, tile| std::array::from_fn(|part| sum[part] + tile[part]));
    let pixels = (width * height) as f64;
    let least = LEAST_TILE_SHARE * pixels / (TILES * TILES) as f64;
    let is_told = |tile: &&[f64; 4]| tile[3] > least && tile[0] > LEAST_DETAIL * LEAST_DETAIL * tile[3];
    let (agreeing, told) = tiles.iter().filter(is_told).fold((0_u32, 0_u32), |(agreeing, told), tile| {
        (agreeing + u32::from(correlation(*tile) > TILE_AGREES), told + 1)
    });
    Likeness {
        correlation: correlation(all),
        agreeing_tiles: if told == 0 { 0.0 } else { f64::from(agreeing) / f64::from(told) },
        told: all[3] / pixels,
    }
}

/// Differences of the samples of both pictures, `dark` and `predicted`, from the means around them, over what both
/// tell; NaN where `predicted` is.
fn details(dark: &[f32], predicted: &[f32], width: usize) -> Vec<[f32; 2]> {
    let height = dark.len() / width;
    let stride = width + 1;
    // Sums of both, and counts, of all above and to the left.
    let mut sums = vec![[0.0_f64; 3]; stride * (height + 1)];
    for y in 0..height {
        let mut row = [0.0_f64; 3];
        for x in 0..width {
            let index = y * width + x;
            if !predicted[index].is_nan() {
                row[0] += f64::from(dark[index]);
                row[1] += f64::from(predicted[index]);
                row[2] += 1.0;
            }
            let above = sums[y * stride + x + 1];
            sums[(y + 1) * stride + x + 1] = std::array::from_fn(|part| above[part] + row[part]);
        }
    }
    let mut details = Vec::with_capacity(dark.len());
    for y in 0..height {
        let (top, bottom) = (y.saturating_sub(DETAIL_RADIUS), (y + DETAIL_RADIUS + 1).min(height));
        let [top, bottom] = [top, bottom].map(|row| &sums[row * stride..][..stride]);
        for x in 0..width {
            let index = y * width + x;
            if predicted[index].is_nan() {
                details.push([f32::NAN; 2]);
                continue;
            }
            let (left, right) = (x.saturating_sub(DETAIL_RADIUS), (x + DETAIL_RADIUS + 1).min(width));
            let within = |part: usize| bottom[right][part] - bottom[left][part] - top[right][part] + top[left][part];
            let mean = |part: usize| (within(part) / within(2)) as f32;
            details.push([dark[index] - mean(0), predicted[index] - mean(1)]);
        }
    }
    details
}

/// What `bright`, already in the frame of `dark`, lets expect of it: NaN where it is clipped, and where neither shows
/// any light.
pub(super) fn expected(dark: &Raster<f32>, bright: &[f32]) -> Option<(ToneRelation, Vec<f32>)> {
    let tells = |dark: f32, bright: f32| bright < CLIPPED && (dark > CRUSHED || bright > CRUSHED);
    let mut sums = ToneSums::default();
    for (&dark, &bright) in dark.data().iter().zip(bright) {
        if tells(dark, bright) {
            sums.add(bright, dark);
        }
    }
    let relation = ToneRelation::fit(&sums)?;
    let one = |(&dark, &bright): (&f32, &f32)| if tells(dark, bright) { relation.at(bright) } else { f32::NAN };
    let expected = dark.data().iter().zip(bright).map(one).collect();
    Some((relation, expected))
}

/// Gray values of a small color picture.
pub(super) fn gray(picture: &Raster<u8>) -> Option<Raster<f32>> {
    let (pixels, _) = picture.data().as_chunks::<3>();
    let luma = |[r, g, b]: &[u8; 3]| LUMA[0] * f32::from(*r) + LUMA[1] * f32::from(*g) + LUMA[2] * f32::from(*b);
    Raster::from_data(picture.width(), picture.height(), 1, pixels.iter().map(luma).collect()).ok()
}

/// Share of the picture in which neither exposure may be black or white for their stops to be those of these places
/// alone: as much as must tell of a view.
const LEAST_IN_BOTH: f64 = 0.02;

/// How much brighter the one exposure is, in stops: the median over places that are neither black nor white in either,
/// if there are enough of them, for what is white says less than it is: at the bright end of a bracket, that of a third
/// of a stop would be a tenth. Otherwise it is that of places that are neither in the darker one, and is more than that
/// where the brighter one is clipped.
pub(super) fn stops_between(dark: &Raster<f32>, bright: &[f32]) -> Option<f64> {
    let light: Vec<f64> = (0..=255).map(|level| TransferCurve::SRGB.linear(f64::from(level) / 255.0)).collect();
    // Levels are within 0 to 255; the cast saturates.
    let stops =
        |dark: f32, bright: f32| (light[(bright + 0.5) as u8 as usize] / light[(dark + 0.5) as u8 as usize]).log2();
    let below = |most_bright: f32| -> Vec<f64> {
        let is_told = |&(dark, bright): &(&f32, &f32)| {
            *dark > CRUSHED && *dark < CLIPPED && *bright > CRUSHED && *bright < most_bright
        };
        dark.data().iter().zip(bright).filter(is_told).map(|(&dark, &bright)| stops(dark, bright)).collect()
    };
    let mut in_both = below(CLIPPED);
    if in_both.len() as f64 >= LEAST_IN_BOTH * dark.data().len() as f64 {
        return median(&mut in_both);
    }
    median(&mut below(f32::INFINITY))
}
