//! What is fuzzed: everything that reads what somebody else wrote.

mod blocks;
mod metadata;
mod pictures;
mod records;
mod requests;
mod structured;
mod texts;
mod work;

pub use work::Work;

/// Something that reads.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// What it is called, and the folder of its inputs.
    pub name: &'static str,
    /// Valid inputs to start from, at least one.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Reads an input; panics if it must not be read so.
    pub read: fn(&Work, &[u8]),
}

/// All targets.
pub const TARGETS: [Target; 27] = [
    Target { name: "jpeg", seeds: || pictures::seeds("jpg"), read: pictures::read },
    Target { name: "png", seeds: || pictures::seeds("png"), read: pictures::read },
    Target { name: "tiff", seeds: || pictures::seeds("tif"), read: pictures::read },
    Target { name: "dng", seeds: pictures::digital_negatives, read: pictures::read },
    Target { name: "webp", seeds: || pictures::seeds("webp"), read: pictures::read },
    Target { name: "heic", seeds: pictures::heic, read: pictures::read },
    Target { name: "avif", seeds: pictures::avif, read: pictures::read },
    Target { name: "jxl", seeds: pictures::jpeg_xl, read: pictures::read },
    Target { name: "exr", seeds: pictures::open_exr, read: pictures::read },
    Target { name: "hdr", seeds: || pictures::seeds("hdr"), read: pictures::read },
    Target { name: "mask", seeds: pictures::masks, read: pictures::read_mask },
    Target { name: "icc", seeds: pictures::profiles, read: pictures::read_profile },
    Target { name: "icc-memory", seeds: pictures::profiles, read: metadata::read_profile },
    Target { name: "exif", seeds: metadata::exif_blocks, read: metadata::read_exif },
    Target { name: "maker-note", seeds: metadata::maker_notes, read: metadata::read_maker_note },
    Target { name: "xmp", seeds: metadata::packets, read: metadata::read_xmp },
    Target { name: "project", seeds: texts::projects, read: texts::read_project },
    Target { name: "project-structured", seeds: structured::projects, read: structured::read_project },
    Target { name: "hugin", seeds: texts::hugin_projects, read: texts::read_hugin_project },
    Target { name: "graph", seeds: texts::graphs, read: texts::read_graph },
    Target { name: "config", seeds: texts::configurations, read: texts::read_configuration },
    Target { name: "options-structured", seeds: structured::options, read: structured::read_options },
    Target { name: "rankings", seeds: texts::rankings, read: texts::read_rankings },
    Target { name: "truth", seeds: texts::truths, read: texts::read_truth },
    Target { name: "cache-entry", seeds: records::entries, read: records::read_entry },
    Target { name: "cache-content", seeds: records::contents, read: records::read_content },
    Target { name: "request", seeds: requests::requests, read: requests::answer },
];

/// The target of that name. A program that asks while it is compiled consists of no other target's code.
#[must_use]
pub const fn target_named(name: &str) -> Option<Target> {
    let mut index = 0;
    while index < TARGETS.len() {
        if is_same(TARGETS[index].name.as_bytes(), name.as_bytes()) {
            return Some(TARGETS[index]);
        }
        index += 1;
    }
    None
}

/// `==` of slices, which a constant may not ask.
const fn is_same(one: &[u8], other: &[u8]) -> bool {
    let mut index = 0;
    while index < one.len() && index < other.len() && one[index] == other[index] {
        index += 1;
    }
    index == one.len() && index == other.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_found_by_their_whole_names() {
        for target in &TARGETS {
            assert_eq!(target_named(target.name).expect("known").name, target.name);
        }
        for unknown in ["", "ic", "iccs", "icc-memor"] {
            assert!(target_named(unknown).is_none(), "{unknown}");
        }
    }
}
