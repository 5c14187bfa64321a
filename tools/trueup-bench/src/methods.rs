//! The methods that are compared, each a name and the options that make it. A new method is one line.

/// A method of stitching.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Method {
    /// Name in tables and files.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Departures from the default options.
    pub overrides: &'static [&'static str],
    /// The paper's method it stands beside, if any.
    pub paper: Option<&'static str>,
    /// Where it is compared.
    pub family: Family,
}

/// Which tables a method belongs in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    /// A similarity prior and the mesh: on whole sets, and in every table.
    Prior,
    /// The default with more energies that draw overlaps together: on whole sets, in the table of alignment.
    Alignment,
    /// Warps without a prior that cannot show a wide field of view: on reduced sets alone.
    Warp,
    /// Warps without a prior that are tried on whole sets too.
    WideWarp,
}

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

/// The warps that the paper compares with.
pub(crate) const APAP: &str = "apap";
pub(crate) const SPHP: &str = "sphp";
pub(crate) const SPHP_FREE: &str = "sphp-free";
pub(crate) const AANAP: &str = "aanap";

/// Options of the mesh as published: one similarity per picture, moving DLT, undivided cells.
pub(crate) const PUBLISHED_MESH: [&str; 3] =
    ["mesh.base=similarity", "mesh.subdivision=1", "match_points.model=moving-dlt"];

/// Every method that exists.
pub(crate) const METHODS: [Method; 17] = [
    Method {
        name: VPG,
        meaning: "vanishing points, level sphere (the default)",
        overrides: &[],
        paper: Some("VPG"),
        family: Family::Prior,
    },
    Method {
        name: GSP_2D,
        meaning: "global similarity prior in two dimensions, level sphere",
        overrides: &["similarity.prior=gsp-2d"],
        paper: Some("GSP-2D"),
        family: Family::Prior,
    },
    Method {
        name: GSP_3D,
        meaning: "global similarity prior in three dimensions, level sphere",
        overrides: &["similarity.prior=gsp-3d"],
        paper: Some("GSP-3D"),
        family: Family::Prior,
    },
    Method {
        name: LEVELLED,
        meaning: "what the default falls back to without vanishing points: cameras straightened with a prior on their pitch, \
                  level sphere",
        overrides: &["similarity.prior=straightening"],
        paper: None,
        family: Family::Prior,
    },
    Method {
        name: VPG_PUBLISHED,
        meaning: "vanishing points, mesh as published",
        overrides: &PUBLISHED_MESH,
        paper: Some("VPG"),
        family: Family::Prior,
    },
    Method {
        name: GSP_2D_PUBLISHED,
        meaning: "global similarity prior in two dimensions, mesh as published",
        overrides: &["similarity.prior=gsp-2d", PUBLISHED_MESH[0], PUBLISHED_MESH[1], PUBLISHED_MESH[2]],
        paper: Some("GSP-2D"),
        family: Family::Prior,
    },
    Method {
        name: GSP_3D_PUBLISHED,
        meaning: "global similarity prior in three dimensions, mesh as published",
        overrides: &["similarity.prior=gsp-3d", PUBLISHED_MESH[0], PUBLISHED_MESH[1], PUBLISHED_MESH[2]],
        paper: Some("GSP-3D"),
        family: Family::Prior,
    },
    Method {
        name: "vpg+lines",
        meaning: "the default, and matched lines drawn together and held straight",
        overrides: &["stitch.align=lines"],
        paper: Some("VPG+DFW"),
        family: Family::Alignment,
    },
    Method {
        name: "vpg+photometric",
        meaning: "the default, and the pixels of overlaps drawn together",
        overrides: &["stitch.align=photometric"],
        paper: Some("VPG+GCPW"),
        family: Family::Alignment,
    },
    Method {
        name: "vpg+lines+photometric",
        meaning: "both",
        overrides: &["stitch.align=lines+photometric"],
        paper: None,
        family: Family::Alignment,
    },
    Method {
        name: "homography",
        meaning: "one homography per picture, onto the plane of the reference",
        overrides: &["stitch.method=homography", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: None,
        family: Family::Warp,
    },
    Method {
        name: "quasi-homography",
        meaning: "homographies whose scale grows only linearly outside the overlaps",
        overrides: &["stitch.method=quasi-homography", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: None,
        family: Family::Warp,
    },
    Method {
        name: APAP,
        meaning: "as-projective-as-possible: a homography for every grid vertex",
        overrides: &["stitch.method=apap", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: Some("APAP"),
        family: Family::Warp,
    },
    Method {
        name: SPHP,
        meaning: "shape-preserving half-projective, its similarity upright",
        overrides: &["stitch.method=sphp", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: Some("SPHP"),
        family: Family::Warp,
    },
    Method {
        name: SPHP_FREE,
        meaning: "the same, its similarity free to turn",
        overrides: &["stitch.method=sphp-free", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: Some("SPHP*"),
        family: Family::Warp,
    },
    Method {
        name: AANAP,
        meaning: "adaptive as-natural-as-possible: homographies that turn into similarities",
        overrides: &["stitch.method=aanap", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: Some("AANAP"),
        family: Family::WideWarp,
    },
    Method {
        name: "autostitch",
        meaning: "straightened cameras on a sphere",
        overrides: &["stitch.method=autostitch", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: None,
        family: Family::WideWarp,
    },
];

/// The method of this name.
pub(crate) fn method(name: &str) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.name == name)
}

/// The methods of one family, in the order of [`METHODS`].
pub(crate) fn methods_of(family: Family) -> impl Iterator<Item = &'static Method> + Clone {
    METHODS.iter().filter(move |method| method.family == family)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::Trial;

    #[test]
    fn every_method_has_valid_options_and_a_name_of_its_own() {
        for (index, one) in METHODS.iter().enumerate() {
            Trial::new("test", "set", one.name, one.overrides).options().expect(one.name);
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
            APAP,
            SPHP,
            SPHP_FREE,
            AANAP,
        ];
        assert!(named.iter().all(|name| method(name).is_some()));
    }
}
