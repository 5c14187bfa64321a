//! What one person may ask of their own machine, so that no page elsewhere and no mistake takes it whole.

use std::time::Duration;

/// Photographs in one session: beyond what a person sorts by hand.
pub(crate) const MAX_PHOTOGRAPHS: usize = 1000;
/// Bytes of one photograph that is dropped: a 16-bit TIFF of 100 million pixels is 600 MB.
pub(crate) const MAX_PHOTOGRAPH_BYTES: u64 = 1 << 30;
/// Bytes of all photographs dropped in one session.
pub(crate) const MAX_DROPPED_BYTES: u64 = 16 << 30;
/// Bytes of a mask: a PNG of two colors, a hundredth of the photograph.
pub(crate) const MAX_MASK_BYTES: u64 = 32 << 20;
/// Bytes of a project file: some hundred kilobytes a photograph at most.
pub(crate) const MAX_PROJECT_BYTES: u64 = 128 << 20;
/// Bytes of a request that carries wishes.
pub(crate) const MAX_WISHES_BYTES: u64 = 64 << 10;
/// Bytes per second below which a body is given up, after [`BODY_GRACE`]: a tenth of the slowest wireless network.
pub(crate) const MIN_BODY_RATE: u64 = 100_000;
/// Time that every body may take.
pub(crate) const BODY_GRACE: Duration = Duration::from_secs(10);
/// Time for the head of a request, and for which an idle connection is kept.
pub(crate) const HEAD_TIME: Duration = Duration::from_secs(10);
/// Connections at once: a browser opens six.
pub(crate) const MAX_CONNECTIONS: usize = 32;
/// How long a request for news waits for some.
pub(crate) const NEWS_TIME: Duration = Duration::from_secs(15);
/// News are told no more often: people see ten pictures a second as motion.
pub(crate) const NEWS_EVERY: Duration = Duration::from_millis(100);
/// How long who gave a wrong password waits, with all others who try: an hour for 3600 guesses.
pub(crate) const PASSWORD_PAUSE: Duration = Duration::from_secs(1);
/// Shortest password, in characters: at a guess a second, random ones of half that length last for centuries.
pub(crate) const MIN_PASSWORD: usize = 12;
/// Pixels of the preview: those of a page's width, at a shape of 2:1.
pub(crate) const PREVIEW_PIXELS: f64 = 500_000.0;
/// Pixels of a thumbnail: twice those it is shown at, for fine screens.
pub(crate) const THUMBNAIL_PIXELS: f64 = 60_000.0;
/// Pixels of a photograph that is painted on: those of a page.
pub(crate) const PAINTED_PIXELS: f64 = 1_000_000.0;
/// Characters of a file's name; the file systems in use take 255 bytes.
pub(crate) const MAX_NAME: usize = 120;
/// Steps that can be undone.
pub(crate) const MAX_STEPS: usize = 200;
/// Files that were made to be fetched and are still there: the oldest go first.
pub(crate) const MAX_EXPORTS: usize = 8;
