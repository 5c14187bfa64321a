//! A node of the tree and where a ray enters its box.

use super::ray::Ray;

/// A box around bodies, in single precision rounded outwards: half the memory, and never too small.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// Lower corner, then upper corner.
    pub(super) bounds: [f32; 6],
    /// Leaf: first body; branch: index of the right child (the left one follows the node).
    pub(super) start: u32,
    /// Bodies of a leaf; 0 for a branch.
    pub(super) count: u32,
}

// `f64::max` and `f64::min` look for NaN, which costs several instructions; there is none here.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

impl Node {
    /// Distance at which the ray enters the node's box; infinite if it misses or enters beyond `limit`.
    #[inline]
    pub(super) fn enter(&self, ray: &Ray, limit: f64) -> f64 {
        let (mut near, mut far) = (0.0, limit);
        for axis in 0..3 {
            let entering = ray.entering[axis];
            let leaving = if entering < 3 { entering + 3 } else { entering - 3 };
            near = larger(near, (f64::from(self.bounds[entering]) - ray.origin[axis]) * ray.inverse[axis]);
            far = smaller(far, (f64::from(self.bounds[leaving]) - ray.origin[axis]) * ray.inverse[axis]);
        }
        if near <= far { near } else { f64::INFINITY }
    }
}
