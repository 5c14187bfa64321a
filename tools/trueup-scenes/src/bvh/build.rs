//! Growing the tree: the surface area heuristic over a fixed number of bins.
//!
//! # Source
//! Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007.

use nalgebra::Vector3;

use super::node::Node;
use crate::solid::Solid;

/// Bodies a leaf holds at most.
const LEAF_SIZE: usize = 4;

/// Bins along each axis.
const BINS: usize = 16;

/// Levels a tree may have: below [`HALVING_DEPTH`] every split halves, and 2^32 bodies do not fit into memory.
pub(super) const MAX_DEPTH: usize = 64;
const HALVING_DEPTH: usize = MAX_DEPTH - 33;

#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Bounds {
    const EMPTY: Self =
        Self { low: Vector3::new(f64::MAX, f64::MAX, f64::MAX), high: Vector3::new(f64::MIN, f64::MIN, f64::MIN) };

    fn with(self, other: Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Half the surface; 0 if empty.
    fn area(&self) -> f64 {
        let size = (self.high - self.low).map(|extent| extent.max(0.0));
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// The corners in single precision, rounded outwards.
    fn outwards(&self) -> [f32; 6] {
        let down = |value: f64| {
            let near = value as f32;
            if f64::from(near) > value { near.next_down() } else { near }
        };
        let (low, high) = (self.low.map(down), self.high.map(|value| -down(-value)));
        [low.x, low.y, low.z, high.x, high.y, high.z]
    }
}

struct Grower<'a> {
    boxes: Vec<(Bounds, Vector3<f64>)>,
    order: Vec<u32>,
    nodes: &'a mut Vec<Node>,
}

/// Grows the tree over all bodies; returns them in the order of the leaves.
pub(super) fn grow(solids: &[Solid], nodes: &mut Vec<Node>) -> Vec<u32> {
    let boxes = solids
        .iter()
        .map(|solid| {
            let (low, high) = solid.bounds();
            (Bounds { low, high }, solid.center)
        })
        .collect();
    let mut grower = Grower { boxes, order: (0..solids.len() as u32).collect(), nodes };
    if !solids.is_empty() {
        grower.grow(0, solids.len(), 0);
    }
    grower.order
}

impl Grower<'_> {
    fn grow(&mut self, start: usize, end: usize, depth: usize) {
        let members = self.order[start..end].iter().map(|&body| self.boxes[body as usize]);
        let (bounds, centers) = members.fold((Bounds::EMPTY, Bounds::EMPTY), |(bounds, centers), (body, center)| {
            (bounds.with(body), centers.with(Bounds { low: center, high: center }))
        });
        let node = self.nodes.len();
        self.nodes.push(Node { bounds: bounds.outwards(), start: start as u32, count: (end - start) as u32 });
        if end - start <= LEAF_SIZE {
            return;
        }
        let split = if depth < HALVING_DEPTH { self.best_split(start, end, &centers) } else { None };
        let middle = match split {
            Some((axis, bin)) => {
                let boxes = &self.boxes;
                // A stable sort keeps the order of the bodies: the tree depends on nothing but them.
                self.order[start..end].sort_by_key(|&body| bin_of(boxes[body as usize].1[axis], axis, &centers) >= bin);
                start
                    + self.order[start..end]
                        .partition_point(|&body| bin_of(boxes[body as usize].1[axis], axis, &centers) < bin)
            }
            None => {
                let axis = (centers.high - centers.low).imax();
                let boxes = &self.boxes;
                self.order[start..end]
                    .sort_by(|&a, &b| boxes[a as usize].1[axis].total_cmp(&boxes[b as usize].1[axis]).then(a.cmp(&b)));
                start + (end - start) / 2
            }
        };
        self.grow(start, middle, depth + 1);
        self.nodes[node].start = self.nodes.len() as u32;
        self.nodes[node].count = 0;
        self.grow(middle, end, depth + 1);
    }

    /// The axis and the first bin of the right side with the least expected work; `None` if all centers share a bin.
    fn best_split(&self, start: usize, end: usize, centers: &Bounds) -> Option<(usize, usize)> {
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in 0..3 {
            let mut bins = [(Bounds::EMPTY, 0_usize); BINS];
            for &body in &self.order[start..end] {
                let (bounds, center) = self.boxes[body as usize];
                let bin = &mut bins[bin_of(center[axis], axis, centers)];
                *bin = (bin.0.with(bounds), bin.1 + 1);
            }
            let mut rights = [0.0; BINS];
            let (mut bounds, mut count) = (Bounds::EMPTY, 0);
            for k in (1..BINS).rev() {
                (bounds, count) = (bounds.with(bins[k].0), count + bins[k].1);
                rights[k] = bounds.area() * count as f64;
            }
            (bounds, count) = (Bounds::EMPTY, 0);
            for k in 1..BINS {
                (bounds, count) = (bounds.with(bins[k - 1].0), count + bins[k - 1].1);
                let cost = bounds.area() * count as f64 + rights[k];
                let separates = count > 0 && count < end - start;
                if separates && best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, k));
                }
            }
        }
        best.map(|(_, axis, bin)| (axis, bin))
    }
}

fn bin_of(center: f64, axis: usize, centers: &Bounds) -> usize {
    let extent = centers.high[axis] - centers.low[axis];
    if extent > 0.0 { (((center - centers.low[axis]) / extent * BINS as f64) as usize).min(BINS - 1) } else { 0 }
}
