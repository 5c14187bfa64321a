//! How small the canvas of small views is.

/// Pixels of the canvas on which seams are found first. More sees smaller things, and takes longer.
pub(crate) const COARSE_PIXELS: f64 = 120_000.0;

/// Pixels of the canvas down to which seams are followed. More lets them run closer to contours.
const FINE_PIXELS: f64 = 1.5e6;

/// The size of a canvas of at most [`FINE_PIXELS`] pixels, and at most half of the canvas along each side. `around` a
/// cylinder it can be halved as often as the search for seams wants to.
pub(crate) fn small_size(canvas: [usize; 2], around: bool) -> [usize; 2] {
    let scale = (FINE_PIXELS / (canvas[0] as f64 * canvas[1] as f64)).sqrt().min(0.5);
    let size = canvas.map(|length| ((length as f64 * scale) as usize).max(1));
    let halvings = (FINE_PIXELS / COARSE_PIXELS).max(1.0).log2() / 2.0;
    // The cast saturates.
    let unit = 1_usize << (halvings.ceil() as u32).min(size[0].ilog2());
    if around { [size[0] / unit * unit, size[1]] } else { size }
}
