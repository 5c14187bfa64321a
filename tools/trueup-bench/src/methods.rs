//! The methods that are compared, each a name and the options that make it.

use crate::published_forms::{
    GSP_2D_AS_PUBLISHED, GSP_2D_PRIOR, GSP_3D_AS_PUBLISHED, GSP_3D_PRIOR, PUBLISHED_WARP_GRID, VPG_AS_PUBLISHED,
};

/// A method of stitching.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ComparedMethod {
    /// Name in tables and files.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Lists of departures from the default options, applied one after the other.
    pub options: &'static [&'static [&'static str]],
    /// The paper's method it stands beside, if any.
    pub paper: Option<&'static str>,
    /// Where it is compared.
    pub family: Family,
}

impl ComparedMethod {
    /// The departures from the default options, each `table.option=value`.
    pub(crate) fn overrides(&self) -> Vec<&'static str> {
        self.options.concat()
    }
}

/// Which tables a method belongs in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    /// A similarity prior and the mesh: on whole sets, and in every table.
    Prior,
    /// A prior in another reading of its publication: on whole sets, in the comparison of methods alone.
    Reading,
    /// VPG, by default or as published, with more energies that draw overlaps together: on whole sets, in the table of
    /// alignment.
    Alignment,
    /// Warps without a prior that cannot show a wide field of view: on reduced sets alone.
    Warp,
    /// Warps without a prior that are tried on whole sets too.
    WideWarp,
}

/// What every method is seen on: the mesh that it solved. A projection is drawn from the cameras, which all methods
/// have alike, and would hide what is compared.
pub(crate) const VIEW: &str = "projection.kind=mesh";

/// The name of the default method in [`METHODS`].
pub(crate) const VPG: &str = "vpg";
/// The published priors of others, on the default mesh.
pub(crate) const GSP_2D: &str = "gsp-2d";
pub(crate) const GSP_3D: &str = "gsp-3d";
/// The name of the method without vanishing points, on the default mesh.
pub(crate) const LEVELLED: &str = "levelled";
/// The same on the mesh as published.
pub(crate) const VPG_PUBLISHED: &str = "vpg-published";
pub(crate) const GSP_2D_PUBLISHED: &str = "gsp-2d-published";
pub(crate) const GSP_3D_PUBLISHED: &str = "gsp-3d-published";
/// VPG as published with what the paper adds for alignment.
pub(crate) const VPG_LINES_PUBLISHED: &str = "vpg-published+lines";
pub(crate) const VPG_PIXELS_PUBLISHED: &str = "vpg-published+photometric";

/// The warps that the paper compares with.
pub(crate) const APAP: &str = "apap";
pub(crate) const SPHP: &str = "sphp";
pub(crate) const SPHP_FREE: &str = "sphp-free";
pub(crate) const AANAP: &str = "aanap";
/// AANAP's turns on the published mesh: what the paper compares with on whole sets.
pub(crate) const AANAP_PUBLISHED: &str = "aanap-published";

/// Every method that exists.
pub(crate) static METHODS: [ComparedMethod; 21] = [
    ComparedMethod {
        name: VPG,
        meaning: "vanishing points, level sphere (the default)",
        options: &[],
        paper: Some("VPG"),
        family: Family::Prior,
    },
    ComparedMethod {
        name: GSP_2D,
        meaning: "global similarity prior in two dimensions, level sphere",
        options: &[&GSP_2D_PRIOR],
        paper: Some("GSP-2D"),
        family: Family::Prior,
    },
    ComparedMethod {
        name: GSP_3D,
        meaning: "global similarity prior in three dimensions, level sphere",
        options: &[&GSP_3D_PRIOR],
        paper: Some("GSP-3D"),
        family: Family::Prior,
    },
    ComparedMethod {
        name: LEVELLED,
        meaning: "what the default falls back to without vanishing points: cameras straightened with a prior on their pitch, \
                  level sphere",
        options: &[&["stitch.method=straightening"]],
        paper: None,
        family: Family::Prior,
    },
    ComparedMethod {
        name: VPG_PUBLISHED,
        meaning: "vanishing points, as published",
        options: &[&VPG_AS_PUBLISHED],
        paper: Some("VPG"),
        family: Family::Prior,
    },
    ComparedMethod {
        name: "vpg-literal",
        meaning: "vanishing points, by the paper's equations as they are printed, errors included",
        options: &[&["stitch.method=vpg-literal"]],
        paper: None,
        family: Family::Reading,
    },
    ComparedMethod {
        name: AANAP_PUBLISHED,
        meaning: "the least turns of AANAP as a prior, on the mesh as published",
        options: &[&["stitch.method=aanap-published"]],
        paper: Some("AANAP"),
        family: Family::Reading,
    },
    ComparedMethod {
        name: GSP_2D_PUBLISHED,
        meaning: "global similarity prior in two dimensions, as published",
        options: &[&GSP_2D_AS_PUBLISHED],
        paper: Some("GSP-2D"),
        family: Family::Prior,
    },
    ComparedMethod {
        name: GSP_3D_PUBLISHED,
        meaning: "global similarity prior in three dimensions, as published",
        options: &[&GSP_3D_AS_PUBLISHED],
        paper: Some("GSP-3D"),
        family: Family::Prior,
    },
    ComparedMethod {
        name: VPG_LINES_PUBLISHED,
        meaning: "as published, and matched lines drawn together and held straight",
        options: &[&VPG_AS_PUBLISHED, &["stitch.align=lines"]],
        paper: Some("VPG+DFW"),
        family: Family::Alignment,
    },
    ComparedMethod {
        name: VPG_PIXELS_PUBLISHED,
        meaning: "as published, and the pixels of overlaps drawn together",
        options: &[&VPG_AS_PUBLISHED, &["stitch.align=photometric"]],
        paper: Some("VPG+GCPW"),
        family: Family::Alignment,
    },
    ComparedMethod {
        name: "vpg+lines",
        meaning: "the default, and matched lines drawn together and held straight",
        options: &[&["stitch.align=lines"]],
        paper: Some("VPG+DFW"),
        family: Family::Alignment,
    },
    ComparedMethod {
        name: "vpg+photometric",
        meaning: "the default, and the pixels of overlaps drawn together",
        options: &[&["stitch.align=photometric"]],
        paper: Some("VPG+GCPW"),
        family: Family::Alignment,
    },
    ComparedMethod {
        name: "vpg+lines+photometric",
        meaning: "both",
        options: &[&["stitch.align=lines+photometric"]],
        paper: None,
        family: Family::Alignment,
    },
    ComparedMethod {
        name: "homography",
        meaning: "one homography per photograph, onto the plane of the reference",
        options: &[&["stitch.method=homography"], &PUBLISHED_WARP_GRID],
        paper: None,
        family: Family::Warp,
    },
    ComparedMethod {
        name: "quasi-homography",
        meaning: "homographies whose scale grows only linearly outside the overlaps",
        options: &[&["stitch.method=quasi-homography"], &PUBLISHED_WARP_GRID],
        paper: None,
        family: Family::Warp,
    },
    ComparedMethod {
        name: APAP,
        meaning: "as-projective-as-possible: a homography for every grid vertex",
        options: &[&["stitch.method=apap"], &PUBLISHED_WARP_GRID],
        paper: Some("APAP"),
        family: Family::Warp,
    },
    ComparedMethod {
        name: SPHP,
        meaning: "shape-preserving half-projective, its similarity upright",
        options: &[&["stitch.method=sphp"], &PUBLISHED_WARP_GRID],
        paper: Some("SPHP"),
        family: Family::Warp,
    },
    ComparedMethod {
        name: SPHP_FREE,
        meaning: "the same, its similarity free to turn",
        options: &[&["stitch.method=sphp-free"], &PUBLISHED_WARP_GRID],
        paper: Some("SPHP*"),
        family: Family::Warp,
    },
    ComparedMethod {
        name: AANAP,
        meaning: "adaptive as-natural-as-possible: homographies that turn into similarities",
        options: &[&["stitch.method=aanap"], &PUBLISHED_WARP_GRID],
        paper: Some("AANAP"),
        family: Family::WideWarp,
    },
    ComparedMethod {
        name: "autostitch",
        meaning: "straightened cameras on a sphere",
        options: &[&["stitch.method=autostitch"], &PUBLISHED_WARP_GRID],
        paper: None,
        family: Family::WideWarp,
    },
];

/// The method of this name.
pub(crate) fn method(name: &str) -> Option<&'static ComparedMethod> {
    METHODS.iter().find(|method| method.name == name)
}

/// The methods of one family, in the order of [`METHODS`].
pub(crate) fn methods_of(family: Family) -> impl Iterator<Item = &'static ComparedMethod> + Clone {
    METHODS.iter().filter(move |method| method.family == family)
}

#[cfg(test)]
mod tests {
    use trueup::Method;

    use super::*;
    use crate::trial::Trial;

    #[test]
    fn every_method_of_the_stitcher_is_compared() {
        let compared: Vec<Method> = METHODS
            .iter()
            .map(|one| {
                Trial::new("test", "set", one.name, &one.overrides()).options().expect(one.name).align.stitch.method
            })
            .collect();
        for name in Method::NAMES {
            let declared = Method::named(name).expect("a declared name");
            assert!(compared.contains(&declared), "{name}");
        }
    }

    #[test]
    fn every_method_has_valid_options_and_a_name_of_its_own() {
        for (index, one) in METHODS.iter().enumerate() {
            Trial::new("test", "set", one.name, &one.overrides()).options().expect(one.name);
            assert!(METHODS[..index].iter().all(|other| other.name != one.name), "{}", one.name);
        }
        let named = [
            VPG,
            GSP_2D,
            GSP_3D,
            LEVELLED,
            VPG_PUBLISHED,
            GSP_2D_PUBLISHED,
            GSP_3D_PUBLISHED,
            VPG_LINES_PUBLISHED,
            VPG_PIXELS_PUBLISHED,
            APAP,
            SPHP,
            SPHP_FREE,
            AANAP,
            AANAP_PUBLISHED,
        ];
        assert!(named.iter().all(|name| method(name).is_some()));
    }
}
