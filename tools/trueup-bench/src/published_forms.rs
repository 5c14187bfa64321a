//! Lists of options that make what was published out of the product's default. Each entry is `table.option=value`.
//!
//! What the experiment on the robust scheme holds open beside these stands with its noise, in `robust_scheme`.

/// The mesh of VPG and GSP as published: one similarity per photograph, moving DLT, undivided cells.
pub(crate) const PUBLISHED_MESH: [&str; 3] =
    ["mesh.base=similarity", "mesh.subdivision=1", "match_points.model=moving-dlt"];

/// The grid that the published warps deform: moving DLT, undivided cells.
pub(crate) const PUBLISHED_WARP_GRID: [&str; 2] = ["mesh.subdivision=1", "match_points.model=moving-dlt"];

/// VPG as published: prior and mesh.
pub(crate) const VPG_AS_PUBLISHED: [&str; 1] = ["stitch.method=vpg-published"];

/// GSP as published, in two and in three dimensions.
pub(crate) const GSP_2D_AS_PUBLISHED: [&str; 1] = ["stitch.method=gsp-2d-published"];
pub(crate) const GSP_3D_AS_PUBLISHED: [&str; 1] = ["stitch.method=gsp-3d-published"];

/// The prior of GSP in two dimensions.
pub(crate) const GSP_2D_PRIOR: [&str; 1] = ["stitch.method=gsp-2d"];

/// The prior of GSP in three dimensions.
pub(crate) const GSP_3D_PRIOR: [&str; 1] = ["stitch.method=gsp-3d"];

/// VPG's gate as published: the divergence alone decides.
pub(crate) const DIVERGENCE_GATE: [&str; 1] = ["similarity.gate=paper"];

/// VPG's vanishing points as published: each photograph finds its own.
pub(crate) const OWN_VANISHING_POINTS: [&str; 2] =
    ["similarity.guided_redetection=false", "similarity.joint_refinement=false"];

/// VPG's beta as published: the twist of the relative rotation.
pub(crate) const RELATIVE_TWIST: [&str; 1] = ["similarity.beta_mode=relative"];
