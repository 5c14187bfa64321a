//! Scenes: bodies, materials, light, and the place from which to photograph them.

mod boxes;
mod builder;
mod furnish;
mod furniture;
mod nature;
mod room;
mod street;
mod style;
mod viewpoint;
mod wall;

use nalgebra::Vector3;
use trueup_core::Result;
use trueup_core::options::StageOptions;

use crate::bvh::Hierarchy;
use crate::light::{LightDetail, LightField, Portal};
use crate::material::{Material, Spot};
use crate::sky::{Sky, Sun};
use crate::solid::{Shape, Solid};
pub use style::RoomStyle;
pub use viewpoint::Viewpoint;

trueup_core::choice! {
    /// What is built.
    pub enum SceneKind {
        /// A furnished room: Manhattan, near surfaces, soft light.
        Room = "room",
        /// A street of town houses: Manhattan, far surfaces, sun.
        Street = "street",
        /// Rocks and trees at random turns on rough ground: no dominant directions at all.
        Nature = "nature",
        /// Blocks at random turns in the air: many straight edges, no dominant directions.
        Boxes = "boxes",
        /// A room of five or six walls at free angles: one vertical, no shared horizontals.
        TurnedRoom = "turned-room",
        /// A square between houses at free angles: one vertical, no shared horizontals.
        TurnedStreet = "turned-street",
    }
}

trueup_core::choice! {
    /// How finely the light of a scene is worked out.
    pub enum LightQuality {
        /// A fraction of a second; blurred shadows. For tests.
        Fast = "fast",
        /// Two or three seconds of one processor. For sets to stitch.
        Standard = "standard",
        /// Ten seconds of one processor. For pictures to look at.
        Fine = "fine",
    }
}

trueup_core::options! {
    /// What scene is built.
    pub struct SceneOptions("scene") {
        /// Kind of scene.
        kind: SceneKind = SceneKind::Room, Allowed::Any, "";
        /// What a room is for; nothing else heeds it.
        style: RoomStyle = RoomStyle::Living, Allowed::Any, "";
        /// Seed of its layout, colors and textures.
        seed: u64 = 1, Allowed::Any, "";
        /// How finely light is worked out.
        light: LightQuality = LightQuality::Fine, Allowed::Any, "";
    }
}

/// A scene ready to be photographed. Its Manhattan directions, where it has them, are the axes of the world.
#[derive(Debug, Clone)]
pub struct Scene {
    pub(crate) solids: Vec<Solid>,
    pub(crate) materials: Vec<Material>,
    pub(crate) hierarchy: Hierarchy,
    pub(crate) portals: Vec<Portal>,
    pub(crate) sky: Sky,
    pub(crate) sun: Option<Sun>,
    pub(crate) light: LightField,
    pub(crate) exposure: f64,
    viewpoint: Viewpoint,
}

impl Scene {
    /// Builds and lights a scene. The same options give the same scene for any number of threads.
    ///
    /// # Errors
    /// [`trueup_core::Error::Options`] listing every option outside its range.
    pub fn new(options: &SceneOptions) -> Result<Self> {
        let mut scene = Self::unlit(options)?;
        scene.illuminate(options.light);
        Ok(scene)
    }

    /// Builds a scene in the dark: bodies and viewpoint only.
    pub(crate) fn unlit(options: &SceneOptions) -> Result<Self> {
        options.check()?;
        let builder = match options.kind {
            SceneKind::Room => room::build(options.seed, options.style),
            SceneKind::Street => street::build(options.seed),
            SceneKind::Nature => nature::build(options.seed),
            SceneKind::Boxes => boxes::build(options.seed),
            SceneKind::TurnedRoom => room::build_turned(options.seed, options.style),
            SceneKind::TurnedStreet => street::build_turned(options.seed),
        };
        let mut scene = Self {
            hierarchy: Hierarchy::new(&builder.solids),
            solids: builder.solids,
            materials: builder.materials,
            portals: builder.portals,
            sky: builder.sky,
            sun: builder.sun,
            light: LightField::default(),
            exposure: 1.0,
            viewpoint: Viewpoint { eye: builder.eye.into(), yaw_deg: builder.yaw_deg, depth_m: 1.0 },
        };
        scene.step_clear();
        scene.measure_depth();
        Ok(scene)
    }

    /// From where, and in which direction first, the scene is meant to be photographed.
    pub fn viewpoint(&self) -> Viewpoint {
        self.viewpoint
    }

    /// Adds a small self-luminous ball to the scene: a target whose picture can be found exactly.
    pub fn add_marker(&mut self, center: [f64; 3], radius_m: f64) {
        let material = Material::new(crate::material::Pattern::Paint, 1.0, [0xff_0000; 3]).emitting(1e3);
        self.materials.push(material);
        self.solids.push(Solid {
            shape: Shape::Ellipsoid,
            center: Vector3::from(center),
            half: Vector3::repeat(radius_m),
            world_from_body: None,
            faces: [self.materials.len() - 1; 6],
            texture_center: Vector3::zeros(),
            seed: 0,
        });
        self.hierarchy = Hierarchy::new(&self.solids);
    }

    /// Works the light out, and the exposure that suits it.
    fn illuminate(&mut self, quality: LightQuality) {
        let light = |spacing_m, directions, least_directions, portal_samples| LightDetail {
            spacing_m,
            directions,
            least_directions,
            portal_samples,
        };
        let detail = match (quality, self.is_outdoors()) {
            (LightQuality::Fast, false) => light(0.4, 24, 8, 2),
            (LightQuality::Fast, true) => light(3.0, 16, 4, 1),
            (LightQuality::Standard, false) => light(0.12, 64, 8, 3),
            (LightQuality::Standard, true) => light(0.9, 32, 8, 1),
            (LightQuality::Fine, false) => light(0.08, 128, 8, 4),
            (LightQuality::Fine, true) => light(0.6, 64, 8, 1),
        };
        self.light = LightField::gather(self, &detail);
        self.measure_exposure();
    }

    /// Whether the sky lights the scene from all sides rather than through windows.
    fn is_outdoors(&self) -> bool {
        self.portals.is_empty()
    }

    /// The coordinates of a place on a face, for its pattern. `point` is in the body's frame.
    pub(crate) fn spot(solid: &Solid, face: usize, point: Vector3<f64>, unit: [f64; 2], footprint: f64) -> Spot {
        let size = solid.face_size(face);
        let texture = point + solid.texture_center;
        let flat = solid.shape == Shape::Block || face != 0;
        let (across, down) = match face {
            _ if !flat => (unit[0] * size[0], texture.y),
            0 => (-texture.z, texture.y),
            1 => (texture.z, texture.y),
            4 => (texture.x, texture.y),
            5 => (-texture.x, texture.y),
            _ => (texture.x, texture.z),
        };
        let grain = solid.half.imax();
        Spot { point: texture, across, down, unit, size, grain, footprint, seed: solid.seed }
    }
}
