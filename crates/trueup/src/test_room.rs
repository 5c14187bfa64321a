//! The example photographs for tests, and what comes of them in bytes.

use trueup_core::StageContext;
use trueup_core::raster::{Photograph, RowSource};
use trueup_io::decode;
use trueup_io::source::{InMemory, SourceOptions, scan};

use crate::inputs::Inputs;

/// The folder of the five photographs of a room.
pub(crate) const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room");

/// The room's photographs in memory under the names of their files, each as `changed` makes it.
pub(crate) fn room_in_memory(changed: impl Fn(Photograph) -> Photograph) -> Inputs {
    let scanned = scan(&[ROOM.to_owned()], &SourceOptions::default(), &StageContext::default());
    let files = scanned.expect("the room").photographs;
    let mut in_memory = InMemory::default();
    for file in &files {
        in_memory.insert(&file.name, changed(decode::photograph(file).expect("decoded")));
    }
    Inputs { in_memory, ..Inputs::new(files.iter().map(|file| file.name.clone())) }
}

/// The samples of a panorama, four channels of 8 bits.
pub(crate) fn samples_of(panorama: &dyn RowSource) -> Vec<u8> {
    let mut samples = vec![0; panorama.width() * panorama.height() * 4];
    for (y, row) in samples.chunks_exact_mut(panorama.width() * 4).enumerate() {
        panorama.rgba8_row(y, row).expect("a row");
    }
    samples
}
