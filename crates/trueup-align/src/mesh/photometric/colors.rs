//! How the colors of two photographs differ in their overlap.

use trueup_core::mesh::GridMesh;

use super::sample::PixelSample;

/// Largest difference in contrast that is believed.
const MAX_GAIN: f64 = 4.0;
/// Strength, in samples, with which the color difference in a cell is drawn to that of the whole overlap.
const RIDGE: f64 = 10.0;

/// Cells on every side that count as around one. Measured: with two, pairs of a gallery meet to 0.45 px and less
/// instead of 0.26.
const REACH: usize = 1;

/// The second photograph's gray values as the first would show them: gain times value plus bias.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Color {
    pub gain: f64,
    pub bias: f64,
}

/// A color model for every cell of the first photograph.
pub(super) struct Colors {
    overall: Color,
    /// By the cell's first vertex.
    cells: Vec<Option<Color>>,
}

/// Sums from which a color model follows.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    sums: [f64; 2],
    squares: [f64; 2],
}

impl Moments {
    fn add(&mut self, sample: &PixelSample) {
        self.count += 1.0;
        for side in 0..2 {
            self.sums[side] += sample.gray[side].value;
            self.squares[side] += sample.gray[side].value.powi(2);
        }
    }

    fn join(&mut self, other: &Self) {
        self.count += other.count;
        for side in 0..2 {
            self.sums[side] += other.sums[side];
            self.squares[side] += other.squares[side];
        }
    }

    /// Sums of squared deviations from the mean.
    fn deviations(&self) -> [f64; 2] {
        [0, 1].map(|side| (self.squares[side] - self.sums[side].powi(2) / self.count.max(1.0)).max(0.0))
    }
}

/// A color model with the gray values of the second photograph that it rests on.
#[derive(Clone, Copy)]
struct Fitted {
    color: Color,
    mean: f64,
    variance: f64,
}

impl Fitted {
    /// Of all samples of an overlap.
    ///
    /// # Departures
    /// The gain is the quotient of the standard deviations. The least-squares gain of one photograph on the other
    /// shrinks while the photographs are not yet aligned, and would explain the misalignment as lack of contrast.
    fn of(all: &Moments) -> Self {
        let [here, there] = all.deviations();
        let count = all.count.max(1.0);
        let gain = if here > 0.0 && there > 0.0 { (here / there).sqrt() } else { 1.0 };
        let gain = gain.clamp(1.0 / MAX_GAIN, MAX_GAIN);
        let color = Color { gain, bias: (all.sums[0] - gain * all.sums[1]) / count };
        Self { color, mean: all.sums[1] / count, variance: there / count }
    }

    /// Of some samples, drawn to this one of more.
    fn of_some(&self, some: &Moments) -> Self {
        let Color { gain: wanted_gain, bias: wanted_bias } = self.color;
        let [here, there] = some.deviations();
        let drawn = (here + RIDGE * wanted_gain * wanted_gain * self.variance) / (there + RIDGE * self.variance);
        let gain = if drawn.is_finite() && drawn > 0.0 { drawn.sqrt() } else { wanted_gain };
        let gain = gain.clamp(1.0 / MAX_GAIN, MAX_GAIN);
        // What the ridge contributes is the wider model at its mean gray value.
        let wanted = RIDGE * (wanted_bias + (wanted_gain - gain) * self.mean);
        let count = some.count + RIDGE;
        let color = Color { gain, bias: (some.sums[0] - gain * some.sums[1] + wanted) / count };
        Self {
            color,
            mean: (some.sums[1] + RIDGE * self.mean) / count,
            variance: (there + RIDGE * self.variance) / count,
        }
    }
}

impl Colors {
    /// Of every cell, drawn to that of the cells around it, which is drawn to that of the overlap: light falls off
    /// towards a photograph's corners, and by what is left of that in a cell with few samples, edges would seem to be
    /// elsewhere.
    pub(super) fn of(samples: &[Vec<PixelSample>], grid: &GridMesh) -> Self {
        let mut all = Moments::default();
        let mut cells = vec![Moments::default(); grid.len()];
        for sample in samples.iter().flatten() {
            all.add(sample);
            cells[sample.cells[0] as usize].add(sample);
        }
        let overall = Fitted::of(&all);
        let of_cell = |first: usize| {
            let cell = &cells[first];
            (cell.count > 0.0).then(|| overall.of_some(&around(&cells, grid, first)).of_some(cell).color)
        };
        Self { overall: overall.color, cells: (0..grid.len()).map(of_cell).collect() }
    }

    pub(super) fn of_sample(&self, sample: &PixelSample) -> Color {
        self.cells[sample.cells[0] as usize].unwrap_or(self.overall)
    }

    pub(super) fn residual(&self, sample: &PixelSample) -> f64 {
        let Color { gain, bias } = self.of_sample(sample);
        gain * sample.gray[1].value + bias - sample.gray[0].value
    }
}

/// The sums over the cells around one, which is given by its first vertex.
fn around(cells: &[Moments], grid: &GridMesh, first: usize) -> Moments {
    let near = |at: usize, count: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(count);
    let (row, column) = (first / grid.columns, first % grid.columns);
    let mut sum = Moments::default();
    for row in near(row, grid.rows) {
        cells[row * grid.columns..][near(column, grid.columns)].iter().for_each(|cell| sum.join(cell));
    }
    sum
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::super::pyramid::Gray;
    use super::*;

    /// Twelve samples a cell, as along an edge, half at 60 and half at 160; the second photograph's light falls off to
    /// 0.7 from left to right. Drawn to all of the overlap alone, the outer cells keep more than 6 gray levels of this.
    #[test]
    fn light_that_falls_off_leaves_next_to_nothing_where_samples_are_few() {
        let grid = GridMesh::regular(320.0, 240.0, 40.0);
        let mut samples = Vec::new();
        for row in 0..grid.rows - 1 {
            for column in 0..grid.columns - 1 {
                let fall_off = 1.0 - 0.3 * column as f64 / (grid.columns - 2) as f64;
                for k in 0..12 {
                    let value = if k % 2 == 0 { 60.0 } else { 160.0 };
                    let gray = [value, value * fall_off].map(|value| Gray { value, slope: Vector2::zeros() });
                    let cell = (row * grid.columns + column) as u32;
                    let within = [Vector2::zeros(); 2];
                    samples.push(PixelSample { cells: [cell; 2], within, gray, gap: Vector2::zeros() });
                }
            }
        }
        let samples = [samples];
        let colors = Colors::of(&samples, &grid);
        let worst = samples[0].chunks(12).map(|cell| {
            let mean = cell.iter().map(|sample| colors.residual(sample)).sum::<f64>() / 12.0;
            mean.abs()
        });
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < 3.5, "{worst}");
    }
}
