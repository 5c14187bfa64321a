//! A bounding-volume hierarchy: which body a ray meets first, and whether it meets any.

use nalgebra::Vector3;

use crate::solid::{Entry, Solid};

/// Bodies a leaf holds at most.
const LEAF_SIZE: usize = 3;

#[derive(Debug, Clone, Copy)]
struct Node {
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Leaf: first body; branch: index of the right child (the left one follows the node).
    start: usize,
    /// Bodies of a leaf; 0 for a branch.
    count: usize,
}

/// A hierarchy over bodies, which it refers to by index.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hierarchy {
    nodes: Vec<Node>,
    order: Vec<usize>,
}

/// A ray with what the slab test wants precomputed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    pub(crate) origin: Vector3<f64>,
    pub(crate) direction: Vector3<f64>,
    inverse: Vector3<f64>,
}

impl Ray {
    pub(crate) fn new(origin: Vector3<f64>, direction: Vector3<f64>) -> Self {
        // A component of exactly 0 would make 0 * infinity; a tiny one keeps the slab test sound.
        let inverse = direction.map(|component| if component == 0.0 { 1e300 } else { 1.0 / component });
        Self { origin, direction, inverse }
    }
}

impl Node {
    /// Distance at which the ray enters the node's box; infinite if it misses or enters beyond `limit`.
    fn enter(&self, ray: &Ray, limit: f64) -> f64 {
        let low = (self.low - ray.origin).component_mul(&ray.inverse);
        let high = (self.high - ray.origin).component_mul(&ray.inverse);
        let near = low.x.min(high.x).max(low.y.min(high.y)).max(low.z.min(high.z)).max(0.0);
        let far = low.x.max(high.x).min(low.y.max(high.y)).min(low.z.max(high.z)).min(limit);
        if near <= far { near } else { f64::INFINITY }
    }
}

impl Hierarchy {
    /// Splits at the median of the longest axis of the centres.
    pub(crate) fn new(solids: &[Solid]) -> Self {
        let mut hierarchy = Self { nodes: Vec::with_capacity(solids.len()), order: (0..solids.len()).collect() };
        if !solids.is_empty() {
            hierarchy.build(solids, 0, solids.len());
        }
        hierarchy
    }

    fn build(&mut self, solids: &[Solid], start: usize, end: usize) {
        let mut low = Vector3::repeat(f64::INFINITY);
        let (mut high, mut centre_low, mut centre_high) = (-low, low, -low);
        for &index in &self.order[start..end] {
            let (solid_low, solid_high) = solids[index].bounds();
            (low, high) = (low.inf(&solid_low), high.sup(&solid_high));
            (centre_low, centre_high) = (centre_low.inf(&solids[index].centre), centre_high.sup(&solids[index].centre));
        }
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, start, count: end - start });
        if end - start <= LEAF_SIZE {
            return;
        }
        let axis = (centre_high - centre_low).imax();
        let middle = start + (end - start) / 2;
        // Ties break by index, so that the tree depends on nothing but the bodies.
        self.order[start..end]
            .sort_unstable_by(|&a, &b| solids[a].centre[axis].total_cmp(&solids[b].centre[axis]).then(a.cmp(&b)));
        self.build(solids, start, middle);
        self.nodes[node].start = self.nodes.len();
        self.nodes[node].count = 0;
        self.build(solids, middle, end);
    }

    /// The first body along a ray within `limit`, and where the ray enters it.
    pub(crate) fn nearest(&self, solids: &[Solid], ray: &Ray, limit: f64) -> Option<(usize, Entry)> {
        let mut best: Option<(usize, Entry)> = None;
        self.traverse(ray, limit, |index, limit| {
            let Some(entry) = solids[index].enter(ray.origin, ray.direction, limit) else { return limit };
            best = Some((index, entry));
            entry.distance
        });
        best
    }

    /// Whether anything lies along a ray within `limit`.
    pub(crate) fn blocked(&self, solids: &[Solid], ray: &Ray, limit: f64) -> bool {
        let mut blocked = false;
        self.traverse(ray, limit, |index, limit| {
            if solids[index].enter(ray.origin, ray.direction, limit).is_none() {
                return limit;
            }
            blocked = true;
            f64::NEG_INFINITY
        });
        blocked
    }

    /// Calls `visit(body, limit)` on bodies whose boxes the ray meets, nearer boxes first; it returns the new limit.
    fn traverse(&self, ray: &Ray, mut limit: f64, mut visit: impl FnMut(usize, f64) -> f64) {
        // A median split halves each time: 64 levels hold more bodies than memory does.
        let mut stack = [(0_usize, 0.0_f64); 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let (index, near) = stack[depth];
            if near > limit {
                continue;
            }
            let node = &self.nodes[index];
            if node.count > 0 {
                for &body in &self.order[node.start..node.start + node.count] {
                    limit = visit(body, limit);
                }
                continue;
            }
            let (left, right) = (index + 1, node.start);
            let (left_near, right_near) = (self.nodes[left].enter(ray, limit), self.nodes[right].enter(ray, limit));
            let ordered = if left_near <= right_near {
                [(right, right_near), (left, left_near)]
            } else {
                [(left, left_near), (right, right_near)]
            };
            for child in ordered.into_iter().filter(|child| child.1 < f64::INFINITY) {
                stack[depth] = child;
                depth += 1;
            }
        }
    }

    /// Whether a point lies inside any body.
    pub(crate) fn covers(&self, solids: &[Solid], point: Vector3<f64>) -> bool {
        let mut pending = vec![0];
        while let Some(index) = pending.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            if (0..3).any(|axis| point[axis] < node.low[axis] || point[axis] > node.high[axis]) {
                continue;
            }
            if node.count == 0 {
                pending.extend([index + 1, node.start]);
            } else if self.order[node.start..node.start + node.count].iter().any(|&body| solids[body].contains(point)) {
                return true;
            }
        }
        false
    }
}
