//! What photographs hold beside their pixels, read from memory: for `trueup-fuzz`, which cannot try enough of it
//! through files.

use crate::color::icc::understand;
use crate::metadata::block::parsed;
use crate::metadata::exif_fields::ExifFields;
use crate::metadata::gravity::{PixelOrder, recorded_gravity};
use crate::metadata::{focal, maker_note, pose};

/// Sides of the photographs that the metadata are read for, in pixels: one that is wide and one that is tall.
const SIZES: [[usize; 2]; 2] = [[640, 480], [480, 640]];

/// Reads an EXIF block, from its byte order mark on, and all that is concluded from it.
pub fn read_exif_block(block: &[u8]) {
    let Some(exif) = parsed(block.to_vec()) else { return };
    conclude(&ExifFields::from_exif(&exif));
}

/// Reads a maker note.
pub fn read_maker_note(note: &[u8]) {
    conclude(&ExifFields { apple_acceleration: maker_note::apple_acceleration(note), ..ExifFields::default() });
}

/// Reads an XMP packet.
pub fn read_xmp_packet(packet: &[u8]) {
    conclude(&ExifFields { pose: pose::stated_pose(packet), ..ExifFields::default() });
}

/// Reads a color profile.
pub fn read_color_profile(profile: &[u8]) {
    drop(understand(profile));
}

fn conclude(fields: &ExifFields) {
    for stored in SIZES {
        if let Some(prior) = focal::focal_prior(fields, stored[0] as f64, stored[1] as f64) {
            assert!(prior.focal_px.is_finite() && prior.focal_px > 0.0, "{prior:?}");
        }
        for stated in 1..=8 {
            let down =
                recorded_gravity(fields, PixelOrder { stored, stated, applied: stated }).map(|gravity| gravity.down);
            let length = down.map_or(1.0, |[x, y, z]| x.hypot(y).hypot(z));
            assert!((length - 1.0).abs() < 1e-6, "{down:?} is no direction");
        }
    }
}
