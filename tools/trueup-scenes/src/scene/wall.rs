//! A wall as its furniture sees it: along, up, and out.

use nalgebra::Vector3;

use super::builder::Builder;
use crate::material::MaterialId;

/// A rectangle cut out of a wall: from `left` to `right` along it, from `foot` to `head` above the floor, metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Opening {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) foot: f64,
    pub(crate) head: f64,
}

/// An upright wall and its frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wall {
    /// The foot of its left end, as seen by whoever faces it.
    pub(crate) corner: Vector3<f64>,
    /// Unit vector to the right along it.
    pub(crate) along: Vector3<f64>,
    /// Unit vector off it, towards whoever faces it.
    pub(crate) out: Vector3<f64>,
    /// Metres.
    pub(crate) length: f64,
}

impl Wall {
    /// The point `along` metres to the right, `up` metres high and `out` metres off the wall.
    pub(crate) fn at(&self, along: f64, up: f64, out: f64) -> Vector3<f64> {
        self.corner + self.along * along + self.out * out - Vector3::new(0.0, up, 0.0)
    }

    /// Opposite corners of a block given by its ranges along, up and out.
    pub(crate) fn span(&self, along: [f64; 2], up: [f64; 2], out: [f64; 2]) -> [Vector3<f64>; 2] {
        [self.at(along[0], up[0], out[0]), self.at(along[1], up[1], out[1])]
    }

    /// Builds the wall, `thickness` metres behind its face, between heights `foot` and `head`, around its openings:
    /// columns of them may stand over one another if their left and right sides agree.
    pub(crate) fn build(
        &self,
        builder: &mut Builder,
        openings: &[Opening],
        [foot, head]: [f64; 2],
        thickness: f64,
        material: MaterialId,
    ) {
        let mut sorted = openings.to_vec();
        sorted.sort_by(|a, b| a.left.total_cmp(&b.left).then(a.foot.total_cmp(&b.foot)));
        let depth = [-thickness, 0.0];
        let (mut from, mut k) = (0.0, 0);
        while let Some(first) = sorted.get(k).copied() {
            builder.block(self.span([from, first.left], [foot, head], depth), material);
            let sides = [first.left, first.right];
            let mut floor = foot;
            while let Some(opening) = sorted.get(k).filter(|opening| opening.left == first.left) {
                if opening.foot > floor {
                    builder.block(self.span(sides, [floor, opening.foot], depth), material);
                }
                floor = opening.head;
                k += 1;
            }
            builder.block(self.span(sides, [floor, head], depth), material);
            from = first.right;
        }
        builder.block(self.span([from, self.length], [foot, head], depth), material);
    }
}
