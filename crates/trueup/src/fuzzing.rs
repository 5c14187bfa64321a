//! What a cache keeps, read from memory: for `trueup-fuzz`. Behind a checksum nothing but what was written is ever
//! read, and mutations would not get there.

use std::io::ErrorKind;

use serde::de::DeserializeOwned;
use trueup_align::projection::ParallaxShift;
use trueup_compose::exposure::Corrections;
use trueup_core::diagnostics::Reported;
use trueup_core::matches::PairMatches;
use trueup_vision::pairing::Likeness;
use trueup_vision::stacks::FoundStack;

use crate::memo::{checked_content, entry_with_content};
use crate::pipeline::align::Geometry;
use crate::pipeline::measured::Measured;

/// The content of an entry of a cache, if its checksum is right.
pub fn content_of_cache_entry(entry: &[u8]) -> Option<&[u8]> {
    checked_content(entry)
}

/// Reads what an entry of a cache holds, as each kind of result, behind a checksum that is right.
pub fn read_cache_content(content: &[u8]) {
    let entry = entry_with_content(content);
    let Some(content) = checked_content(&entry) else { panic!("an entry is what it was written as") };
    read_as::<Reported<Measured>>(content);
    read_as::<PairMatches>(content);
    read_as::<Likeness>(content);
    read_as::<Reported<Geometry>>(content);
    read_as::<Vec<FoundStack>>(content);
    read_as::<Vec<ParallaxShift>>(content);
    read_as::<Reported<Corrections>>(content);
}

fn read_as<T: DeserializeOwned>(content: &[u8]) {
    if let Err(rmp_serde::decode::Error::InvalidDataRead(error)) = rmp_serde::from_slice::<T>(content) {
        assert_ne!(error.kind(), ErrorKind::OutOfMemory, "{error}");
    }
}
