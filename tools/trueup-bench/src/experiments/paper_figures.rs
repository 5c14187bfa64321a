//! The paper's own figures, for scale: its sets are not public, ours are others.
//!
//! From *Vanishing Point Guided Natural Image Stitching*, section VI.

/// A method's figures on several sets.
#[derive(Debug, Clone, Copy)]
pub(super) struct PaperRow<const SETS: usize> {
    /// The method, as the paper calls it.
    pub method: &'static str,
    /// Local distortion, x 1e-2.
    pub ld: [f64; SETS],
    /// Global direction inconsistency, degrees.
    pub gdic_deg: [f64; SETS],
}

/// Sets 04 to 09 (warps of homographies).
pub(super) const WARPS: [PaperRow<6>; 4] = [
    PaperRow {
        method: "APAP",
        ld: [6.69, 8.36, 6.70, 4.01, 6.21, 5.55],
        gdic_deg: [18.94, 22.76, 11.44, 11.48, 4.76, 7.02],
    },
    PaperRow {
        method: "SPHP",
        ld: [2.20, 3.93, 7.32, 2.66, 3.07, 2.32],
        gdic_deg: [11.21, 20.16, 5.32, 4.92, 8.06, 13.27],
    },
    PaperRow {
        method: "SPHP*",
        ld: [2.29, 2.08, 3.17, 2.81, 2.29, 2.16],
        gdic_deg: [8.75, 3.94, 6.58, 8.52, 6.30, 12.70],
    },
    PaperRow {
        method: "VPG",
        ld: [0.82, 1.35, 1.11, 1.08, 0.19, 1.15],
        gdic_deg: [1.21, 0.81, 0.95, 0.95, 1.16, 2.13],
    },
];

/// Sets 01 to 12.
pub(super) const NATURAL: [PaperRow<12>; 4] = [
    PaperRow {
        method: "AANAP",
        ld: [1.21, 1.56, 1.20, 2.94, 1.47, 1.10, 0.94, 5.17, 5.95, 1.50, 1.14, 0.89],
        gdic_deg: [2.26, 1.06, 2.33, 8.72, 7.24, 8.60, 2.75, 9.49, 25.06, 4.37, 2.59, 3.25],
    },
    PaperRow {
        method: "GSP-2D",
        ld: [1.48, 1.73, 1.82, 2.19, 1.85, 1.28, 1.00, 3.00, 2.68, 2.04, 1.01, 0.74],
        gdic_deg: [6.06, 2.07, 1.66, 2.77, 6.20, 1.63, 2.50, 2.70, 4.26, 1.23, 2.22, 1.76],
    },
    PaperRow {
        method: "GSP-3D",
        ld: [1.41, 1.60, 1.59, 1.81, 1.84, 1.43, 1.05, 2.06, 2.69, 1.35, 1.11, 0.67],
        gdic_deg: [4.54, 2.78, 3.41, 1.05, 1.83, 1.05, 3.73, 2.05, 0.86, 1.11, 1.70, 1.18],
    },
    PaperRow {
        method: "VPG",
        ld: [1.44, 1.45, 1.57, 2.06, 1.68, 1.53, 0.93, 2.69, 2.50, 1.27, 1.19, 0.73],
        gdic_deg: [0.73, 0.49, 0.77, 0.49, 0.55, 0.74, 0.72, 0.50, 0.52, 1.41, 0.81, 0.63],
    },
];

/// GDIC under noise on the vanishing points, sets 01 to 12.
#[derive(Debug, Clone, Copy)]
pub(super) struct PaperNoise {
    /// Share of the vanishing points that are replaced.
    pub share: f64,
    /// Without the robust scheme, degrees.
    pub without_deg: [f64; 12],
    /// With it, degrees.
    pub with_deg: [f64; 12],
}

/// The noise experiment at 0, 10 and 20 %.
pub(super) const NOISE: [PaperNoise; 3] = [
    PaperNoise {
        share: 0.0,
        without_deg: [0.73, 0.49, 0.77, 0.82, 1.01, 0.74, 0.72, 0.65, 0.96, 2.41, 0.81, 0.63],
        with_deg: [0.73, 0.49, 0.77, 0.49, 0.55, 0.74, 0.72, 0.50, 0.52, 1.41, 0.81, 0.63],
    },
    PaperNoise {
        share: 0.1,
        without_deg: [2.97, 0.44, 1.28, 1.74, 0.90, 0.80, 0.65, 1.65, 0.81, 2.30, 1.01, 1.79],
        with_deg: [0.53, 0.44, 0.64, 0.84, 0.59, 0.65, 0.65, 0.54, 0.38, 1.37, 0.94, 1.53],
    },
    PaperNoise {
        share: 0.2,
        without_deg: [4.74, 2.57, 4.47, 2.29, 2.47, 2.67, 1.67, 2.21, 3.19, 8.55, 1.65, 1.13],
        with_deg: [0.56, 0.42, 0.63, 0.47, 0.57, 0.63, 0.74, 0.71, 0.56, 3.75, 0.94, 0.85],
    },
];

/// A panorama of the paper's gallery (its table 4).
#[derive(Debug, Clone, Copy)]
pub(super) struct GalleryPanorama {
    /// Its letter.
    pub letter: char,
    /// How many photographs it was made of.
    pub photographs: usize,
    /// Their divergence.
    pub divergence: f64,
}

const fn panorama(letter: char, photographs: usize, divergence: f64) -> GalleryPanorama {
    GalleryPanorama { letter, photographs, divergence }
}

/// The gallery, (a) to (h) taken for Manhattan scenes and (i) to (l) not.
pub(super) const GALLERY: [GalleryPanorama; 12] = [
    panorama('a', 2, 0.0204),
    panorama('b', 4, 0.0019),
    panorama('c', 5, 0.0068),
    panorama('d', 6, 0.0005),
    panorama('e', 11, 0.0740),
    panorama('f', 3, 0.0002),
    panorama('g', 5, 0.0114),
    panorama('h', 21, 0.0781),
    panorama('i', 10, 0.1917),
    panorama('j', 5, 0.1291),
    panorama('k', 7, 0.1464),
    panorama('l', 15, 0.2022),
];

/// Divergences that the paper's gallery states for Manhattan scenes.
pub(super) const MANHATTAN_DIVERGENCES: [f64; 8] = [0.0204, 0.0019, 0.0068, 0.0005, 0.0740, 0.0002, 0.0114, 0.0781];
/// Divergences that it states for others.
pub(super) const OTHER_DIVERGENCES: [f64; 4] = [0.1917, 0.1291, 0.1464, 0.2022];
/// The divergence up to which the paper believes the vanishing points.
pub(super) const THRESHOLD: f64 = 0.10;

/// Mean seconds on one of the paper's groups of sets.
#[derive(Debug, Clone, Copy)]
pub(super) struct PaperSeconds {
    /// The group.
    pub sets: &'static str,
    /// AANAP.
    pub aanap: f64,
    /// GSP.
    pub gsp: f64,
    /// VPG.
    pub vpg: f64,
}

/// The paper's times.
pub(super) const SECONDS: [PaperSeconds; 2] = [
    PaperSeconds { sets: "VPG's sets", aanap: 109.44, gsp: 45.82, vpg: 47.82 },
    PaperSeconds { sets: "GSP's sets", aanap: 53.63, gsp: 23.55, vpg: 29.04 },
];
