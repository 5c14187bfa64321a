use super::*;

struct Picture(Raster<f32>);

impl RowSource for Picture {
    fn width(&self) -> usize {
        self.0.width()
    }
    fn height(&self) -> usize {
        self.0.height()
    }
    fn rgba8_row(&self, y: usize, row: &mut [u8]) -> Result<()> {
        for (pixel, &gray) in row.chunks_exact_mut(4).zip(self.0.row(y)) {
            pixel.copy_from_slice(&[gray as u8, gray as u8, gray as u8, 255]);
        }
        Ok(())
    }
    fn rgba16_row(&self, _: usize, _: &mut [u16]) -> Result<()> {
        unreachable!("measured at 8 bits")
    }
    fn linear_row(&self, _: usize, _: &mut [f32]) -> Result<()> {
        unreachable!("measured at 8 bits")
    }
}

fn layer(level: impl Fn(usize, usize) -> f32) -> Layer {
    let mut gray = Raster::new(60, 30, 1);
    for y in 0..30 {
        for x in 0..60 {
            gray.pixel_mut(x, y)[0] = level(x, y);
        }
    }
    let covered = Raster::from_data(60, 30, 1, vec![true; 1800]).expect("as many");
    Layer { left: 0, top: 0, gray, covered }
}

fn halves() -> Vec<u16> {
    (0..1800).map(|at| u16::from(at % 60 >= 30)).collect()
}

#[test]
fn a_hard_cut_shows_the_whole_step_and_no_ghost() {
    let layers = [layer(|x, _| 50.0 + x as f32), layer(|x, _| 70.0 + x as f32)];
    let cut = Picture(layer(|x, _| x as f32 + if x < 30 { 50.0 } else { 70.0 }).gray);
    let found = measure(&cut, &layers, &halves(), false).expect("one canvas");
    assert_eq!(found.line_px, 30);
    assert!((found.step - 20.0).abs() < 1e-5, "{found:?}");
    // One column of 59 has a gradient that is off by 20.
    assert!((found.ghost - 20.0 / 59.0).abs() < 1e-5, "{found:?}");
    let one = Picture(layers[0].gray.clone());
    let found = measure(&one, &layers, &halves(), false).expect("one canvas");
    assert!(found.step < 1e-5 && found.ghost < 1e-5, "{found:?}");
}

/// A ramp that goes on across the ends of a cylinder: whoever shows it, there is no step, and one that is there is
/// found.
#[test]
fn the_ends_of_a_full_turn_are_a_line_too() {
    let whole = layer(|x, _| 50.0 + x as f32);
    // Two of them, of half the width, the second from column 45 over the end to column 15.
    let half = |left: usize, first: usize| {
        let mut gray = Raster::new(30, 30, 1);
        for y in 0..30 {
            for x in 0..30 {
                gray.pixel_mut(x, y)[0] = 50.0 + (first + x) as f32;
            }
        }
        Layer { left, top: 0, gray, covered: Raster::from_data(30, 30, 1, vec![true; 900]).expect("as many") }
    };
    let layers = [half(15, 15), half(45, 45)];
    let shown: Vec<u16> = (0..1800).map(|at| u16::from(!(15..45).contains(&(at % 60)))).collect();
    assert_eq!(deepest(&layers, [60, 30], true).expect("on the cylinder"), shown);
    assert!(deepest(&layers, [60, 30], false).is_err());
    let true_levels = |x: usize| if x < 15 { 110.0 + x as f32 } else { 50.0 + x as f32 };
    let good = Picture(layer(|x, _| true_levels(x)).gray);
    let found = measure(&good, &layers, &shown, true).expect("one cylinder");
    assert_eq!(found.wrap_px, 30);
    assert!(found.wrap_step < 1e-5 && found.column_step < 1e-5, "{found:?}");
    let bad = Picture(layer(|x, _| true_levels(x) + if x < 15 { 12.0 } else { 0.0 }).gray);
    let found = measure(&bad, &layers, &shown, true).expect("one cylinder");
    assert!((found.wrap_step - 12.0).abs() < 1e-5, "{found:?}");
    // The same step at column 32, the only one of 60 columns that is compared.
    let inner = Picture(layer(|x, _| true_levels(x) + if (20..32).contains(&x) { 12.0 } else { 0.0 }).gray);
    let found = measure(&inner, &layers, &shown, true).expect("one cylinder");
    assert!((found.column_step - 12.0).abs() < 1e-5 && found.wrap_step < 1e-5, "{found:?}");
    let flat = measure(&good, &[whole], &vec![0; 1800], false).expect("one canvas");
    assert_eq!((flat.wrap_px, flat.wrap_step, flat.column_step), (0, 0.0, 0.0));
}

#[test]
fn a_mean_of_two_that_do_not_fit_is_a_ghost() {
    let bar = |at: usize| layer(move |x, _| if (at..at + 4).contains(&x) { 200.0 } else { 40.0 });
    let layers = [bar(20), bar(26)];
    let mean = Picture(layer(|x, _| if (20..24).contains(&x) || (26..30).contains(&x) { 120.0 } else { 40.0 }).gray);
    let found = measure(&mean, &layers, &vec![0; 1800], false).expect("one canvas");
    // Four edges of 80, each 80 away from the nearer photograph (one shows 160 there, the other nothing).
    assert!((found.ghost - 4.0 * 80.0 / 59.0).abs() < 1e-4, "{found:?}");
    assert!((found.ghost_share - 4.0 / 59.0).abs() < 1e-9);
    assert!(measure(&mean, &layers, &[], false).is_err());
}

/// All of the canvas is the overlap, and both photographs' borders are equally far everywhere: feathering goes over
/// nowhere, but places are counted. Half of one photograph's slope of 2 levels a column, and none of the other's, is 8
/// of 16 levels over 8 columns.
#[test]
fn steps_all_over_the_overlap_are_those_no_photograph_shows() {
    let layers = [layer(|x, _| 2.0 * x as f32), layer(|_, _| 100.0)];
    let mean = Picture(layer(|x, _| 50.0 + x as f32).gray);
    let found = measure(&mean, &layers, &[0; 1800], false).expect("one canvas");
    assert!(found.overlap_line_px > 0 && (found.overlap_step - 8.0).abs() < 1e-5, "{found:?}");
    assert_eq!(found.line_px, 0);
    let one = Picture(layers[0].gray.clone());
    assert!(measure(&one, &layers, &[0; 1800], false).expect("one canvas").overlap_step < 1e-5);
}
