//! A bounding-volume hierarchy: which body a ray meets first, and whether it meets any.

mod build;

use nalgebra::{Matrix3, Vector3};

use crate::solid::{Entry, Shape, Solid, enter_aligned, enter_round};

/// A box around bodies, in single precision rounded outwards: half the memory, and never too small.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// Lower corner, then upper corner.
    bounds: [f32; 6],
    /// Leaf: first body; branch: index of the right child (the left one follows the node).
    start: u32,
    /// Bodies of a leaf; 0 for a branch.
    count: u32,
}

/// What a ray needs to know of a body, in the order of the leaves.
#[derive(Debug, Clone, Copy)]
struct Body {
    centre: Vector3<f64>,
    half: Vector3<f64>,
    shape: Shape,
    /// Index of the body among the scene's solids.
    solid: u32,
    /// Index of its rotation plus 1; 0 for a body along the world's axes.
    rotation: u32,
}

/// A hierarchy over bodies, which it refers to by their index among the solids it was made of.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hierarchy {
    nodes: Vec<Node>,
    bodies: Vec<Body>,
    rotations: Vec<Matrix3<f64>>,
}

/// A ray with what the slab test wants precomputed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    pub(crate) origin: Vector3<f64>,
    pub(crate) direction: Vector3<f64>,
    inverse: Vector3<f64>,
    /// Where in a node's bounds the ray enters along each axis; it leaves by the other side.
    entering: [usize; 3],
}

impl Ray {
    pub(crate) fn new(origin: Vector3<f64>, direction: Vector3<f64>) -> Self {
        // A component of exactly 0 would make 0 * infinity; a tiny one keeps the slab test sound.
        let inverse = direction.map(|component| if component == 0.0 { 1e300 } else { 1.0 / component });
        let entering = std::array::from_fn(|axis| if inverse[axis] < 0.0 { axis + 3 } else { axis });
        Self { origin, direction, inverse, entering }
    }
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
    fn enter(&self, ray: &Ray, limit: f64) -> f64 {
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

impl Hierarchy {
    /// Splits where the surface area heuristic expects the fewest tests.
    pub(crate) fn new(solids: &[Solid]) -> Self {
        let mut hierarchy = Self::default();
        let order = build::grow(solids, &mut hierarchy.nodes);
        for index in order {
            let solid = &solids[index as usize];
            let rotation = solid.world_from_body.map_or(0, |rotation| {
                hierarchy.rotations.push(rotation);
                hierarchy.rotations.len() as u32
            });
            let (centre, half, shape) = (solid.centre, solid.half, solid.shape);
            hierarchy.bodies.push(Body { centre, half, shape, solid: index, rotation });
        }
        hierarchy
    }

    /// Where a ray from outside enters a body within (0, limit].
    #[inline]
    fn enter(&self, body: &Body, ray: &Ray, limit: f64) -> Option<Entry> {
        let origin = ray.origin - body.centre;
        let entry = if body.rotation == 0 && body.shape == Shape::Block {
            enter_aligned(origin, ray.direction, ray.inverse, body.half)
        } else if body.rotation == 0 {
            enter_round(body.shape, origin, ray.direction, body.half)
        } else {
            let rotation = &self.rotations[body.rotation as usize - 1];
            let turned = Ray::new(rotation.tr_mul(&origin), rotation.tr_mul(&ray.direction));
            match body.shape {
                Shape::Block => enter_aligned(turned.origin, turned.direction, turned.inverse, body.half),
                shape => enter_round(shape, turned.origin, turned.direction, body.half),
            }
        }?;
        (entry.distance > 0.0 && entry.distance <= limit).then_some(entry)
    }

    /// The first body along a ray within `limit`, and where the ray enters it. Of several that meet it at the same
    /// distance the one with the lowest index counts, so that the answer does not depend on the tree.
    pub(crate) fn nearest(&self, ray: &Ray, limit: f64) -> Option<(usize, Entry)> {
        let mut best: Option<(usize, Entry)> = None;
        self.traverse(ray, limit, |body, limit| {
            let Some(entry) = self.enter(body, ray, limit) else { return limit };
            let solid = body.solid as usize;
            if best.is_none_or(|(other, found)| entry.distance < found.distance || solid < other) {
                best = Some((solid, entry));
            }
            entry.distance
        });
        best
    }

    /// Whether anything lies along a ray within `limit`.
    pub(crate) fn blocked(&self, ray: &Ray, limit: f64) -> bool {
        let mut blocked = false;
        self.traverse(ray, limit, |body, limit| {
            if self.enter(body, ray, limit).is_none() {
                return limit;
            }
            blocked = true;
            f64::NEG_INFINITY
        });
        blocked
    }

    /// Calls `visit(body, limit)` on bodies whose boxes the ray meets, nearer boxes first; it returns the new limit.
    #[inline]
    fn traverse(&self, ray: &Ray, mut limit: f64, mut visit: impl FnMut(&Body, f64) -> f64) {
        let mut stack = [(0_u32, 0.0_f64); build::MAX_DEPTH];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let (mut index, mut near) = stack[depth];
            // Down the nearer children; the farther ones wait.
            while near <= limit {
                let node = &self.nodes[index as usize];
                if node.count > 0 {
                    let start = node.start as usize;
                    for body in &self.bodies[start..start + node.count as usize] {
                        limit = visit(body, limit);
                    }
                    break;
                }
                let (left, right) = (index + 1, node.start);
                let left_near = self.nodes[left as usize].enter(ray, limit);
                let right_near = self.nodes[right as usize].enter(ray, limit);
                let (closer, further) = if left_near <= right_near {
                    ((left, left_near), (right, right_near))
                } else {
                    ((right, right_near), (left, left_near))
                };
                if further.1 < f64::INFINITY {
                    stack[depth] = further;
                    depth += 1;
                }
                (index, near) = closer;
                if near == f64::INFINITY {
                    break;
                }
            }
        }
    }

    /// Whether a point lies inside any body.
    pub(crate) fn covers(&self, solids: &[Solid], point: Vector3<f64>) -> bool {
        let mut pending = vec![0];
        while let Some(index) = pending.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            let outside = |axis: usize| {
                point[axis] < f64::from(node.bounds[axis]) || point[axis] > f64::from(node.bounds[axis + 3])
            };
            if (0..3).any(outside) {
                continue;
            }
            let start = node.start as usize;
            if node.count == 0 {
                pending.extend([index + 1, start]);
            } else if self.bodies[start..start + node.count as usize]
                .iter()
                .any(|body| solids[body.solid as usize].contains(point))
            {
                return true;
            }
        }
        false
    }
}
