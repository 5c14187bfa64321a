//! A bounding-volume hierarchy: which body a ray meets first, and whether it meets any.

mod build;
mod node;
mod ray;

use nalgebra::{Matrix3, Vector3};

use crate::solid::{RayEntry, Solid, SolidShape, enter_aligned, enter_round};
use node::Node;
pub(crate) use ray::{Ray, SURFACE_OFFSET_M};

/// What a ray needs to know of a body, in the order of the leaves.
#[derive(Debug, Clone, Copy)]
struct Body {
    center: Vector3<f64>,
    /// Half extents of a block; one over them for round shapes.
    extents: Vector3<f64>,
    shape: SolidShape,
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
            let (center, shape) = (solid.center, solid.shape);
            let extents = if shape == SolidShape::Block { solid.half } else { solid.half.map(f64::recip) };
            hierarchy.bodies.push(Body { center, extents, shape, solid: index, rotation });
        }
        hierarchy
    }

    /// Where a ray from outside enters a body within (0, limit].
    #[inline]
    fn enter(&self, body: &Body, ray: &Ray, limit: f64) -> Option<RayEntry> {
        let mut origin = ray.origin - body.center;
        let (mut direction, mut inverse) = (ray.direction, ray.inverse);
        if body.rotation > 0 {
            let rotation = &self.rotations[body.rotation as usize - 1];
            (origin, direction) = (rotation.tr_mul(&origin), rotation.tr_mul(&direction));
            inverse = direction.map(f64::recip);
        }
        let entry = match body.shape {
            SolidShape::Block => enter_aligned(origin, direction, inverse, body.extents),
            shape => enter_round(shape, origin, direction, body.extents),
        }?;
        (entry.distance > 0.0 && entry.distance <= limit).then_some(entry)
    }

    /// The first body along a ray within `limit`, and where the ray enters it. Of several that meet it at the same
    /// distance the one with the lowest index counts, so that the answer does not depend on the tree.
    pub(crate) fn nearest(&self, ray: &Ray, limit: f64) -> Option<(usize, RayEntry)> {
        let mut best: Option<(usize, RayEntry)> = None;
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

#[cfg(test)]
mod tests {
    use trueup_core::geometry::exp_rotation;

    use super::*;
    use crate::dice::Dice;

    fn vector(dice: &mut Dice, reach: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| dice.range(-reach, reach))
    }

    fn bodies(dice: &mut Dice, count: usize) -> Vec<Solid> {
        (0..count)
            .map(|_| Solid {
                shape: [SolidShape::Block, SolidShape::Cylinder, SolidShape::Ellipsoid][dice.index(3)],
                center: vector(dice, 10.0),
                half: Vector3::from_fn(|_, _| dice.range(0.02, 0.9)),
                world_from_body: dice.chance(0.5).then(|| exp_rotation(&vector(dice, 2.0))),
                faces: [0; 6],
                texture_center: Vector3::zeros(),
                seed: 0,
            })
            .collect()
    }

    /// The tree must find what asking every body in turn finds.
    #[test]
    fn the_tree_finds_what_all_bodies_together_find() {
        let mut dice = Dice::new(4, 0);
        let mut hits = 0;
        for count in [0, 1, 5, 300] {
            let solids = bodies(&mut dice, count);
            let tree = Hierarchy::new(&solids);
            let alone: Vec<Hierarchy> =
                solids.iter().map(|solid| Hierarchy::new(std::slice::from_ref(solid))).collect();
            for _ in 0..400 {
                let ray = Ray::new(vector(&mut dice, 12.0), vector(&mut dice, 1.0).normalize());
                let limit = dice.range(1.0, 30.0);
                let expected = alone
                    .iter()
                    .enumerate()
                    .filter_map(|(index, one)| one.nearest(&ray, limit).map(|(_, entry)| (index, entry.distance)))
                    .min_by(|a, b| a.1.total_cmp(&b.1));
                let found = tree.nearest(&ray, limit).map(|(index, entry)| (index, entry.distance));
                assert_eq!(found, expected);
                hits += usize::from(expected.is_some());
                assert_eq!(tree.blocked(&ray, limit), expected.is_some());
                let inside = solids.iter().any(|solid| solid.contains(ray.origin));
                assert_eq!(tree.covers(&solids, ray.origin), inside);
            }
        }
        assert!(hits > 40, "only {hits} rays met anything");
    }

    /// A unit block seen along z from 3 m, and past its edge; a ball of radius 1/2 behind it, worked out by hand.
    #[test]
    fn distances_and_faces_are_those_of_the_drawing_board() {
        let plain = |shape, center: [f64; 3]| Solid {
            shape,
            center: Vector3::from(center),
            half: Vector3::repeat(0.5),
            world_from_body: None,
            faces: [0; 6],
            texture_center: Vector3::zeros(),
            seed: 0,
        };
        let tree =
            Hierarchy::new(&[plain(SolidShape::Block, [0.0, 0.0, 3.5]), plain(SolidShape::Ellipsoid, [0.8, 0.0, 6.0])]);
        let ahead = |x: f64| tree.nearest(&Ray::new(Vector3::new(x, 0.0, 0.0), Vector3::z()), f64::INFINITY);
        let (index, entry) = ahead(0.2).expect("the block");
        assert_eq!((index, entry.face, entry.distance), (0, 4, 3.0));
        // Beside the block the ball's surface is at 6 - sqrt(1/4 - 1/100) = 5.510102...
        let (index, entry) = ahead(0.7).expect("the ball");
        assert!(index == 1 && (entry.distance - 5.510_102_051_443_364).abs() < 1e-12);
        assert!(ahead(-0.51).is_none());
    }

    #[test]
    fn of_bodies_at_one_distance_the_first_counts() {
        let mut dice = Dice::new(5, 0);
        let mut solids = bodies(&mut dice, 40);
        let twin = Solid { shape: SolidShape::Block, world_from_body: None, ..solids[3].clone() };
        (solids[3], solids[31]) = (twin.clone(), twin);
        let tree = Hierarchy::new(&solids);
        let to = solids[3].center;
        let ray = Ray::new(to + Vector3::new(0.0, 0.0, -2.0), Vector3::z());
        assert_eq!(tree.nearest(&ray, f64::INFINITY).map(|(index, _)| index), Some(3));
    }
}
