//! Puts bodies together.

use nalgebra::Vector3;
use trueup_core::geometry::rotation_about_y;

use crate::dice::Dice;
use crate::material::{MaterialId, SurfaceMaterial};
use crate::portal::Portal;
use crate::sky::{Sky, Sun};
use crate::solid::{Solid, SolidShape};

/// A scene under construction. The y axis points down: heights are negative.
#[derive(Debug)]
pub(crate) struct Builder {
    pub(crate) solids: Vec<Solid>,
    pub(crate) materials: Vec<SurfaceMaterial>,
    pub(crate) portals: Vec<Portal>,
    pub(crate) sky: Sky,
    pub(crate) sun: Option<Sun>,
    pub(crate) eye: Vector3<f64>,
    pub(crate) yaw_deg: f64,
    pub(crate) dice: Dice,
}

impl Builder {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut dice = Dice::new(seed, stream);
        let sky = Sky { seed: dice.texture_seed(), clouds: dice.range(0.3, 0.6), brightness: 1.0 };
        Self {
            solids: Vec::new(),
            materials: Vec::new(),
            portals: Vec::new(),
            sky,
            sun: None,
            eye: Vector3::new(0.0, -1.55, 0.0),
            yaw_deg: 0.0,
            dice,
        }
    }

    pub(crate) fn material(&mut self, material: SurfaceMaterial) -> MaterialId {
        self.materials.push(material);
        self.materials.len() - 1
    }

    fn push(
        &mut self,
        shape: SolidShape,
        center: Vector3<f64>,
        half: Vector3<f64>,
        material: MaterialId,
    ) -> &mut Solid {
        const THINNEST_M: f64 = 1e-3;
        let solid = Solid {
            shape,
            center,
            half: half.map(|extent| extent.max(THINNEST_M)),
            world_from_body: None,
            faces: [material; 6],
            texture_center: center,
            seed: self.dice.texture_seed(),
        };
        self.solids.push(solid);
        let last = self.solids.len() - 1;
        &mut self.solids[last]
    }

    /// A block between two corners whose texture is fixed to the world, so that it runs on into its neighbors'.
    pub(crate) fn block(&mut self, [a, b]: [Vector3<f64>; 2], material: MaterialId) -> &mut Solid {
        self.push(SolidShape::Block, (a + b) / 2.0, ((b - a) / 2.0).abs(), material)
    }

    /// A block between two corners with a texture of its own.
    pub(crate) fn piece(&mut self, corners: [Vector3<f64>; 2], material: MaterialId) -> &mut Solid {
        let offset = Vector3::new(self.dice.range(-9.0, 9.0), self.dice.range(-9.0, 9.0), self.dice.range(-9.0, 9.0));
        let solid = self.block(corners, material);
        solid.texture_center = offset;
        solid
    }

    /// A block turned about the vertical by `yaw` radians.
    pub(crate) fn turned(
        &mut self,
        center: Vector3<f64>,
        half: Vector3<f64>,
        yaw: f64,
        material: MaterialId,
    ) -> &mut Solid {
        let solid = self.push(SolidShape::Block, center, half, material);
        solid.world_from_body = Some(rotation_about_y(yaw));
        solid
    }

    /// An upright cylinder standing at `foot`.
    pub(crate) fn cylinder(
        &mut self,
        foot: Vector3<f64>,
        radius: f64,
        height: f64,
        material: MaterialId,
    ) -> &mut Solid {
        let center = foot - Vector3::new(0.0, height / 2.0, 0.0);
        self.push(SolidShape::Cylinder, center, Vector3::new(radius, height / 2.0, radius), material)
    }

    /// An ellipsoid.
    pub(crate) fn ellipsoid(&mut self, center: Vector3<f64>, half: Vector3<f64>, material: MaterialId) -> &mut Solid {
        self.push(SolidShape::Ellipsoid, center, half, material)
    }

    /// Where the scene stands now, for [`Builder::turn_since`].
    pub(crate) fn checkpoint(&self) -> BuilderCheckpoint {
        BuilderCheckpoint { solids: self.solids.len(), portals: self.portals.len() }
    }

    /// Turns all that was added since the checkpoint about the vertical through `pivot` by `yaw` radians, from z
    /// towards x.
    pub(crate) fn turn_since(&mut self, before: BuilderCheckpoint, pivot: Vector3<f64>, yaw: f64) {
        let rotation = rotation_about_y(yaw);
        for solid in &mut self.solids[before.solids..] {
            solid.center = pivot + rotation * (solid.center - pivot);
            solid.world_from_body = Some(solid.world_from_body.map_or(rotation, |own| rotation * own));
        }
        for portal in &mut self.portals[before.portals..] {
            portal.corner = pivot + rotation * (portal.corner - pivot);
            for vector in [&mut portal.side_s, &mut portal.side_t, &mut portal.normal] {
                *vector = rotation * *vector;
            }
        }
    }
}

/// How much of a scene there was at some moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BuilderCheckpoint {
    solids: usize,
    portals: usize,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Pattern;

    /// A block 2 m ahead (z) of the pivot at (1, 0, 1), turned by 90 degrees from z towards x, lies 2 m to its right
    /// (x); what was there before the checkpoint stays.
    #[test]
    fn what_was_added_since_the_checkpoint_turns_about_the_pivot() {
        let mut builder = Builder::new(1, 0);
        let paint = builder.material(SurfaceMaterial::new(Pattern::Paint, 1.0, [0xff_ffff; 3]));
        let block = [Vector3::new(0.9, -1.0, 2.9), Vector3::new(1.1, 0.0, 3.1)];
        builder.block(block, paint);
        let checkpoint = builder.checkpoint();
        builder.block(block, paint);
        builder.turn_since(checkpoint, Vector3::new(1.0, 0.0, 1.0), std::f64::consts::FRAC_PI_2);
        assert!((builder.solids[0].center - Vector3::new(1.0, -0.5, 3.0)).norm() < 1e-12);
        assert!((builder.solids[1].center - Vector3::new(3.0, -0.5, 1.0)).norm() < 1e-12);
        assert!(builder.solids[1].contains(Vector3::new(3.05, -0.9, 1.05)));
    }
}
