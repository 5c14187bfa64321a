//! Ghosts and blur: how far a panorama's gradients are from those of the photographs it may show.

use super::measured::{MeasuredPanorama, level};

/// Gradient distance from which on a ghost is seen, gray levels a pixel.
pub const GHOST_LEVEL: f64 = 8.0;

/// Distances of gradients over all overlaps.
#[derive(Default)]
pub(super) struct Ghosts {
    pub(super) pixels: usize,
    sum: f64,
    seen: usize,
}

impl Ghosts {
    pub(super) fn mean(&self) -> f64 {
        self.sum / self.pixels.max(1) as f64
    }

    /// Share of the pixels whose distance is above [`GHOST_LEVEL`].
    pub(super) fn share(&self) -> f64 {
        self.seen as f64 / self.pixels.max(1) as f64
    }
}

impl MeasuredPanorama<'_> {
    pub(super) fn ghosts(&self) -> Ghosts {
        let mut ghosts = Ghosts::default();
        let (width, height) = (self.gray.width(), self.gray.height());
        let difference = |value: &dyn Fn(usize, usize) -> Option<f64>, x: usize, y: usize| {
            let middle = value(x, y)?;
            Some([value(x + 1, y)? - middle, value(x, y + 1)? - middle])
        };
        for y in 0..height.saturating_sub(1) {
            for x in 0..width.saturating_sub(1) {
                let own = difference(&|x, y| Some(f64::from(self.gray.pixel(x, y)[0])), x, y);
                let Some(own) = own else { continue };
                let (mut nearest, mut covering) = (f64::INFINITY, 0);
                for layer in self.layers {
                    if let Some(other) = difference(&|x, y| level(layer, x, y, self.turn), x, y) {
                        nearest = nearest.min((own[0] - other[0]).hypot(own[1] - other[1]));
                        covering += 1;
                    }
                }
                if covering >= 2 {
                    ghosts.pixels += 1;
                    ghosts.sum += nearest;
                    ghosts.seen += usize::from(nearest > GHOST_LEVEL);
                }
            }
        }
        ghosts
    }
}
