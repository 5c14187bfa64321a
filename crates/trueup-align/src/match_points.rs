//! Where the vertices of one picture's grid appear in another: the data of the alignment energy.

/// The vertices of picture `from`'s grid carried into picture `to` (working pixels).
#[derive(Debug, Clone, PartialEq)]
pub struct OverlapWarp {
    /// Index of the picture whose grid it is.
    pub from: usize,
    /// Index of the picture it is carried into.
    pub to: usize,
    /// For every vertex of `from`'s grid, row-major: its place in `to`, or `None` outside the overlap.
    pub vertices: Vec<Option<[f64; 2]>>,
}
