//! How the colors of two photographs differ in their overlap.

use trueup_core::mesh::GridMesh;

use super::sample::PixelSample;

/// Largest difference in contrast that is believed.
const MAX_GAIN: f64 = 4.0;
/// Strength, in samples, with which the color difference in a cell is drawn to that of the whole overlap.
const RIDGE: f64 = 10.0;

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

    /// Sums of squared deviations from the mean.
    fn deviations(&self) -> [f64; 2] {
        [0, 1].map(|side| (self.squares[side] - self.sums[side].powi(2) / self.count.max(1.0)).max(0.0))
    }
}

impl Colors {
    /// # Departures
    /// The gain is the quotient of the standard deviations. The least-squares gain of one photograph on the other
    /// shrinks while the photographs are not yet aligned, and would explain the misalignment as lack of contrast.
    pub(super) fn of(samples: &[Vec<PixelSample>], grid: &GridMesh) -> Self {
        let mut all = Moments::default();
        let mut cells = vec![Moments::default(); grid.len()];
        for sample in samples.iter().flatten() {
            all.add(sample);
            cells[sample.cells[0] as usize].add(sample);
        }
        let [here, there] = all.deviations();
        let gain = if here > 0.0 && there > 0.0 { (here / there).sqrt() } else { 1.0 };
        let gain = gain.clamp(1.0 / MAX_GAIN, MAX_GAIN);
        let overall = Color { gain, bias: (all.sums[0] - gain * all.sums[1]) / all.count.max(1.0) };
        let variance = there / all.count.max(1.0);
        let cells = cells
            .iter()
            .map(|cell| {
                let [here, there] = cell.deviations();
                let drawn = (here + RIDGE * gain * gain * variance) / (there + RIDGE * variance);
                let gain = if drawn.is_finite() && drawn > 0.0 { drawn.sqrt() } else { gain };
                let gain = gain.clamp(1.0 / MAX_GAIN, MAX_GAIN);
                let count = cell.count + RIDGE;
                // What the ridge contributes is the overall model at the overlap's mean gray value.
                let mean = all.sums[1] / all.count.max(1.0);
                let wanted = RIDGE * (overall.bias + (overall.gain - gain) * mean);
                let bias = (cell.sums[0] - gain * cell.sums[1] + wanted) / count;
                (cell.count > 0.0 && count > 0.0).then_some(Color { gain, bias })
            })
            .collect();
        Self { overall, cells }
    }

    pub(super) fn of_sample(&self, sample: &PixelSample) -> Color {
        self.cells[sample.cells[0] as usize].unwrap_or(self.overall)
    }

    pub(super) fn residual(&self, sample: &PixelSample) -> f64 {
        let Color { gain, bias } = self.of_sample(sample);
        gain * sample.gray[1].value + bias - sample.gray[0].value
    }
}
