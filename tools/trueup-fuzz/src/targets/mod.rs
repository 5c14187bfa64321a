//! What is fuzzed: everything that reads what somebody else wrote.

mod pictures;
mod texts;
mod work;

pub(crate) use work::Work;

/// Something that reads.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    /// Valid inputs to start from, at least one.
    pub(crate) seeds: fn() -> Vec<Vec<u8>>,
    /// Reads an input; panics if it must not be read so.
    pub(crate) read: fn(&Work, &[u8]),
}

/// All targets.
pub(crate) static TARGETS: [Target; 14] = [
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
    Target { name: "icc", seeds: pictures::profiles, read: pictures::read_profile },
    Target { name: "project", seeds: texts::projects, read: texts::read_project },
    Target { name: "graph", seeds: texts::graphs, read: texts::read_graph },
    Target { name: "config", seeds: texts::configurations, read: texts::read_configuration },
];
