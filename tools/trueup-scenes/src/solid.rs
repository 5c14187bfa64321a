//! Boxes, cylinders and ellipsoids at any place and turn: all that scenes are made of.

use nalgebra::{Matrix3, Vector3};

use crate::material::{MaterialId, Spot};

/// What a [`Solid`] is in its own frame, stretched to its half extents.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SolidShape {
    /// Faces 0..6: -x, +x, -y (top, as y points down), +y, -z, +z.
    Block,
    /// Axis along y. Face 0 is the side, 2 the top, 3 the bottom.
    Cylinder,
    /// Face 0 is all there is.
    Ellipsoid,
}

/// One convex body.
#[derive(Debug, Clone)]
pub(crate) struct Solid {
    pub(crate) shape: SolidShape,
    /// In the world, metres.
    pub(crate) center: Vector3<f64>,
    /// Along the body's own axes, metres.
    pub(crate) half: Vector3<f64>,
    /// World from body; `None` when the axes agree.
    pub(crate) world_from_body: Option<Matrix3<f64>>,
    /// Material of each face.
    pub(crate) faces: [MaterialId; 6],
    /// Where the body's center lies in its texture, metres: walls share one texture frame so that a pattern runs on
    /// over several bodies; pieces of furniture differ.
    pub(crate) texture_center: Vector3<f64>,
    /// Makes equal bodies look different.
    pub(crate) seed: u32,
}

/// Where a ray enters a body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayEntry {
    /// Distance in units of the ray's direction.
    pub(crate) distance: f64,
    pub(crate) face: usize,
}

/// The normal axis of a face, its sign, and the axes of its chart with their signs: s to the right and t down as seen
/// from outside.
const FACES: [(usize, f64, usize, f64, usize); 6] = [
    (0, -1.0, 2, -1.0, 1),
    (0, 1.0, 2, 1.0, 1),
    (1, -1.0, 0, 1.0, 2),
    (1, 1.0, 0, -1.0, 2),
    (2, -1.0, 0, 1.0, 1),
    (2, 1.0, 0, -1.0, 1),
];

impl Solid {
    /// A vector of the world in the body's axes.
    pub(crate) fn to_body(&self, vector: Vector3<f64>) -> Vector3<f64> {
        self.world_from_body.map_or(vector, |rotation| rotation.tr_mul(&vector))
    }

    /// A vector of the body's axes in the world.
    pub(crate) fn to_world(&self, vector: Vector3<f64>) -> Vector3<f64> {
        self.world_from_body.map_or(vector, |rotation| rotation * vector)
    }

    /// Corners of the smallest axis-aligned box around the body.
    pub(crate) fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        let reach = self.world_from_body.map_or(self.half, |rotation| rotation.abs() * self.half);
        (self.center - reach, self.center + reach)
    }

    /// How many faces the shape uses, and which.
    pub(crate) fn used_faces(&self) -> &'static [usize] {
        match self.shape {
            SolidShape::Block => &[0, 1, 2, 3, 4, 5],
            SolidShape::Cylinder => &[0, 2, 3],
            SolidShape::Ellipsoid => &[0],
        }
    }

    /// Whether a point of the world lies inside.
    pub(crate) fn contains(&self, point: Vector3<f64>) -> bool {
        let unit = self.to_body(point - self.center).component_div(&self.half);
        match self.shape {
            SolidShape::Block => unit.amax() < 1.0,
            SolidShape::Cylinder => unit.y.abs() < 1.0 && unit.x * unit.x + unit.z * unit.z < 1.0,
            SolidShape::Ellipsoid => unit.norm_squared() < 1.0,
        }
    }

    /// Width and height of a face's chart, metres.
    pub(crate) fn face_size(&self, face: usize) -> [f64; 2] {
        let half = self.half;
        match self.shape {
            SolidShape::Cylinder if face == 0 => [std::f64::consts::PI * (half.x + half.z), 2.0 * half.y],
            SolidShape::Ellipsoid => [std::f64::consts::PI * (half.x + half.z), std::f64::consts::PI * half.y],
            _ => {
                let (_, _, s_axis, _, t_axis) = FACES[face.min(5)];
                [2.0 * half[s_axis], 2.0 * half[t_axis]]
            }
        }
    }

    /// Point and outward normal, in the body's frame, at chart position (s, t) in [0, 1] of a face.
    pub(crate) fn at_chart(&self, face: usize, s: f64, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        use std::f64::consts::{PI, TAU};
        match self.shape {
            SolidShape::Cylinder if face == 0 => {
                let (sine, cosine) = (TAU * s).sin_cos();
                let unit = Vector3::new(sine, 2.0 * t - 1.0, cosine);
                (unit.component_mul(&self.half), self.round_normal(Vector3::new(sine, 0.0, cosine)))
            }
            SolidShape::Ellipsoid => {
                let ((sine, cosine), (up, level)) = ((TAU * s).sin_cos(), (PI * (t - 0.5)).sin_cos());
                let unit = Vector3::new(sine * level, up, cosine * level);
                (unit.component_mul(&self.half), self.round_normal(unit))
            }
            _ => {
                let (axis, sign, s_axis, s_sign, t_axis) = FACES[face.min(5)];
                let mut unit = Vector3::zeros();
                unit[axis] = sign;
                let normal = unit;
                unit[s_axis] = s_sign * (2.0 * s - 1.0);
                unit[t_axis] = 2.0 * t - 1.0;
                (unit.component_mul(&self.half), normal)
            }
        }
    }

    /// Chart position of a point on a face and the outward normal, both in the body's frame.
    pub(crate) fn chart(&self, face: usize, point: Vector3<f64>) -> ([f64; 2], Vector3<f64>) {
        use std::f64::consts::{PI, TAU};
        let unit = point.component_div(&self.half);
        match self.shape {
            SolidShape::Cylinder if face == 0 => {
                let turn = unit.x.atan2(unit.z) / TAU;
                let normal = self.round_normal(Vector3::new(unit.x, 0.0, unit.z));
                ([turn.rem_euclid(1.0), (unit.y + 1.0) / 2.0], normal)
            }
            SolidShape::Ellipsoid => {
                let turn = unit.x.atan2(unit.z) / TAU;
                let height = unit.y.clamp(-1.0, 1.0).asin() / PI + 0.5;
                ([turn.rem_euclid(1.0), height], self.round_normal(unit))
            }
            _ => {
                let (axis, sign, s_axis, s_sign, t_axis) = FACES[face.min(5)];
                let mut normal = Vector3::zeros();
                normal[axis] = sign;
                ([(s_sign * unit[s_axis] + 1.0) / 2.0, (unit[t_axis] + 1.0) / 2.0], normal)
            }
        }
    }

    /// The coordinates of a place on a face, for its pattern. `point` is in the body's frame.
    pub(crate) fn spot(&self, face: usize, point: Vector3<f64>, unit: [f64; 2], footprint: f64) -> Spot {
        let size = self.face_size(face);
        let texture = point + self.texture_center;
        let flat = self.shape == SolidShape::Block || face != 0;
        let (across, down) = match face {
            _ if !flat => (unit[0] * size[0], texture.y),
            0 => (-texture.z, texture.y),
            1 => (texture.z, texture.y),
            4 => (texture.x, texture.y),
            5 => (-texture.x, texture.y),
            _ => (texture.x, texture.z),
        };
        let grain = self.half.imax();
        Spot { point: texture, across, down, unit, size, grain, footprint, seed: self.seed }
    }

    /// The normal of a stretched round shape: the unit shape's normal by the inverse stretch.
    fn round_normal(&self, unit: Vector3<f64>) -> Vector3<f64> {
        unit.component_div(&self.half).normalize()
    }
}

/// Where a ray enters a block about the origin; `inverse` is one over each component of the direction.
#[inline]
pub(crate) fn enter_aligned(
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    inverse: Vector3<f64>,
    half: Vector3<f64>,
) -> Option<RayEntry> {
    let (mut near, mut far, mut face) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for axis in 0..3 {
        if direction[axis] == 0.0 {
            if origin[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let inverse = inverse[axis];
        let (low, high) = ((-half[axis] - origin[axis]) * inverse, (half[axis] - origin[axis]) * inverse);
        // Entering through the low side exactly when the ray runs towards larger coordinates.
        let (enter, leave, entered) = if inverse > 0.0 { (low, high, 2 * axis) } else { (high, low, 2 * axis + 1) };
        if enter > near {
            (near, face) = (enter, entered);
        }
        if leave < far {
            far = leave;
        }
    }
    (near <= far && near.is_finite()).then_some(RayEntry { distance: near, face })
}

/// Where a ray enters a cylinder or an ellipsoid about the origin; `inverse_half` is one over each half extent.
pub(crate) fn enter_round(
    shape: SolidShape,
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    inverse_half: Vector3<f64>,
) -> Option<RayEntry> {
    let (origin, direction) = (origin.component_mul(&inverse_half), direction.component_mul(&inverse_half));
    if shape == SolidShape::Cylinder { enter_cylinder(origin, direction) } else { enter_ball(origin, direction) }
}

/// The smaller root of the unit circle or sphere; `None` if missed.
fn near_root(a: f64, half_b: f64, c: f64) -> Option<f64> {
    let discriminant = half_b * half_b - a * c;
    (discriminant >= 0.0 && a > 0.0).then(|| (-half_b - discriminant.sqrt()) / a)
}

fn enter_ball(origin: Vector3<f64>, direction: Vector3<f64>) -> Option<RayEntry> {
    let distance = near_root(direction.norm_squared(), origin.dot(&direction), origin.norm_squared() - 1.0)?;
    Some(RayEntry { distance, face: 0 })
}

fn enter_cylinder(origin: Vector3<f64>, direction: Vector3<f64>) -> Option<RayEntry> {
    let (o, d) = (origin, direction);
    let side = near_root(d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z - 1.0)
        .filter(|&distance| (o.y + distance * d.y).abs() <= 1.0);
    let (level, face) = if d.y > 0.0 { (-1.0, 2) } else { (1.0, 3) };
    let cap = (level - o.y) / d.y;
    let (x, z) = (o.x + cap * d.x, o.z + cap * d.z);
    let cap = (d.y != 0.0 && x * x + z * z <= 1.0).then_some(cap);
    match (side, cap) {
        (_, Some(distance)) if side.is_none_or(|side| side < distance) => Some(RayEntry { distance, face }),
        (side, _) => side.map(|distance| RayEntry { distance, face: 0 }),
    }
}
