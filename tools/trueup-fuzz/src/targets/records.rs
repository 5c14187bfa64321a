//! Entries of a cache.

use trueup::fuzzing::{content_of_cache_entry, read_cache_content};
use trueup::{InMemory, Inputs, Photograph, PhotographCache, Raster, StageContext, StitchOptions, Stitcher};

use super::work::Work;

/// Two photographs, side by side, of a picture without a pattern; and how far apart, in pixels.
const SIDES: [usize; 2] = [96, 72];
const APART: usize = 40;

/// Pixels at which features are found: a few of them are enough.
const WORKING_PIXELS: &str = "working.pixels=20000";

/// What a small stitch keeps: every kind of entry, as its bytes.
pub(super) fn entries() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder for the seeds");
    let mut options = StitchOptions::default();
    options.set(WORKING_PIXELS).expect("an option");
    let mut photographs = InMemory::default();
    for (name, from) in [("a", 0), ("b", APART)] {
        let pixel = |x: usize, y: usize| blob((from + x) / 5, y / 5);
        let pixels = (0..SIDES[1]).flat_map(|y| (0..SIDES[0]).flat_map(move |x| [pixel(x, y); 3])).collect();
        let raster = Raster::from_data(SIDES[0], SIDES[1], 3, pixels).expect("of that size");
        photographs.insert(name, Photograph::Eight(raster));
    }
    let mut inputs = Inputs::new(["a", "b"]);
    inputs.in_memory = photographs;
    let context = StageContext::default();
    let cache = PhotographCache::open(folder.path(), 1e9).expect("a cache");
    // Whether they are joined does not matter: what was measured and matched is kept.
    let _ = Stitcher::new(&options, &context).with_cache(Some(&cache)).align(&inputs);
    let mut paths: Vec<_> =
        std::fs::read_dir(folder.path()).expect("readable").flatten().map(|file| file.path()).collect();
    paths.sort();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "trueup"));
    paths.iter().filter_map(|path| std::fs::read(path).ok()).collect()
}

/// A level for a cell of a pattern that does not repeat.
fn blob(column: usize, row: usize) -> u8 {
    let mixed = (column * 73_856_093) ^ (row * 19_349_663);
    (mixed ^ (mixed >> 7) ^ (mixed >> 13)) as u8
}

pub(super) fn contents() -> Vec<Vec<u8>> {
    entries().iter().filter_map(|entry| content_of_cache_entry(entry)).map(<[u8]>::to_vec).collect()
}

pub(super) fn read_entry(_: &Work, input: &[u8]) {
    if let Some(content) = content_of_cache_entry(input) {
        read_cache_content(content);
    }
}

pub(super) fn read_content(_: &Work, input: &[u8]) {
    read_cache_content(input);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seeds_have_every_kind_of_entry_that_is_kept_of_a_pair() {
        let entries = entries();
        assert!(entries.len() >= 4, "{} entries", entries.len());
        assert_eq!(contents().len(), entries.len());
    }
}
