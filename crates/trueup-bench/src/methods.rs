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
}

/// The name of the default method in [`METHODS`].
pub(crate) const VPG: &str = "vpg";
/// The name of the method without vanishing points, on the default mesh.
pub(crate) const LEVELLED: &str = "levelled";
/// The name of the paper's own form of the mesh.
pub(crate) const VPG_PUBLISHED: &str = "vpg-published";
/// The name of the method that stands beside the paper's GSP.
pub(crate) const LEVELLED_PUBLISHED: &str = "levelled-published";

/// Options of the mesh as published: one similarity per picture, moving DLT, undivided cells.
pub(crate) const PUBLISHED_MESH: [&str; 3] =
    ["mesh.base=similarity", "mesh.subdivision=1", "match_points.model=moving-dlt"];

/// Every method that exists.
pub(crate) const METHODS: [Method; 4] = [
    Method { name: VPG, meaning: "vanishing points, level sphere (the default)", overrides: &[], paper: Some("VPG") },
    Method {
        name: VPG_PUBLISHED,
        meaning: "vanishing points, mesh as published",
        overrides: &["mesh.base=similarity", "mesh.subdivision=1", "match_points.model=moving-dlt"],
        paper: Some("VPG"),
    },
    Method {
        name: LEVELLED,
        meaning: "straightened cameras instead of vanishing points, level sphere",
        overrides: &["similarity.prior=straightening"],
        paper: None,
    },
    Method {
        name: LEVELLED_PUBLISHED,
        meaning: "straightened cameras with GSP's edge ranges, mesh as published: GSP-3D's place until it exists",
        overrides: &[
            "similarity.prior=straightening",
            "mesh.base=similarity",
            "mesh.subdivision=1",
            "match_points.model=moving-dlt",
        ],
        paper: Some("GSP-3D"),
    },
];

/// The method of this name.
pub(crate) fn method(name: &str) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.name == name)
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
        assert!([VPG, VPG_PUBLISHED, LEVELLED, LEVELLED_PUBLISHED].iter().all(|name| method(name).is_some()));
    }
}
