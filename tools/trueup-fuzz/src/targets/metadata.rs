//! What photographs hold beside their pixels, from memory: many times as often as through files.

use trueup_io::fuzzing::{read_color_profile, read_exif_block, read_maker_note as read_note, read_xmp_packet};

use super::blocks;
use super::work::Work;

/// Apple's maker note with an acceleration vector of -1/4, -39/40 and 1/8 g: name, one entry of a directory, its
/// values.
fn apple_note() -> Vec<u8> {
    const VALUES_AT: u32 = 14 + 2 + 12 + 4;
    let mut note = b"Apple iOS\0\0\x01MM\0\x01\0\x08\0\x0a\0\0\0\x03".to_vec();
    note.extend(VALUES_AT.to_be_bytes());
    note.extend([0; 4]);
    note.extend([-1_i32, 4, -39, 40, 1, 8].map(i32::to_be_bytes).concat());
    note
}

/// An EXIF block whose second directory has a maker note, in the other byte order than [`blocks::exif`].
fn exif_with_note() -> Vec<u8> {
    let note = apple_note();
    let mut block = b"MM\0*\0\0\0\x08\0\x02".to_vec();
    block.extend(b"\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\x87\x69\0\x04\0\0\0\x01\0\0\0\x26\0\0\0\0");
    block.extend(b"\0\x02\x92\x7c\0\x07");
    block.extend((note.len() as u32).to_be_bytes());
    block.extend(0x44_u32.to_be_bytes());
    block.extend(b"\xa4\x05\0\x03\0\0\0\x01\0\x1a\0\0\0\0\0\0");
    block.extend(note);
    block
}

pub(super) fn exif_blocks() -> Vec<Vec<u8>> {
    vec![blocks::exif(), exif_with_note()]
}

pub(super) fn read_exif(_: &Work, input: &[u8]) {
    read_exif_block(input);
}

pub(super) fn maker_notes() -> Vec<Vec<u8>> {
    vec![apple_note()]
}

pub(super) fn read_maker_note(_: &Work, input: &[u8]) {
    read_note(input);
}

pub(super) fn packets() -> Vec<Vec<u8>> {
    vec![blocks::POSES.as_bytes().to_vec()]
}

pub(super) fn read_xmp(_: &Work, input: &[u8]) {
    read_xmp_packet(input);
}

pub(super) fn read_profile(_: &Work, input: &[u8]) {
    read_color_profile(input);
}
