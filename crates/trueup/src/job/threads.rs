//! How many threads a job works on.

use trueup_core::{Error, Result};

/// A pool of `threads` threads; 0 for one per core.
///
/// # Errors
/// [`Error::Input`] if there cannot be so many.
pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool> {
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    built.map_err(|error| Error::input("threads", error, "Ask for fewer threads."))
}
