//! Scenes: bodies, materials, light, and the place from which to photograph them.

mod boxes;
mod builder;
mod exposure;
mod furnish;
mod furniture;
pub(crate) mod lit;
mod nature;
mod room;
mod street;
mod style;
pub(crate) mod unlit;
mod viewpoint;
mod wall;

use trueup_core::Result;
use trueup_core::options::StageOptions;

use crate::bvh::Hierarchy;
use crate::light::{LightDetail, LightField};
pub use lit::LitScene;
pub use style::RoomStyle;
use unlit::UnlitScene;
pub use unlit::Viewpoint;

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

impl LitScene {
    /// Builds and lights a scene. The same options give the same scene for any number of threads.
    ///
    /// # Errors
    /// [`trueup_core::Error::Options`] listing every option outside its range.
    pub fn new(options: &SceneOptions) -> Result<Self> {
        let unlit = UnlitScene::new(options)?;
        let light = LightField::gather(&unlit, &light_detail(options.light, unlit.is_outdoors()));
        let mut scene = Self { unlit, light, exposure: 1.0 };
        scene.exposure = exposure::measure(&scene);
        Ok(scene)
    }
}

impl UnlitScene {
    /// Builds a scene in the dark: bodies and viewpoint only.
    pub(crate) fn new(options: &SceneOptions) -> Result<Self> {
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
            viewpoint: Viewpoint { eye: builder.eye.into(), yaw_deg: builder.yaw_deg, depth_m: 1.0 },
        };
        scene.step_clear();
        scene.measure_depth();
        Ok(scene)
    }
}

fn light_detail(quality: LightQuality, outdoors: bool) -> LightDetail {
    let light = |spacing_m, directions, least_directions, portal_samples| LightDetail {
        spacing_m,
        directions,
        least_directions,
        portal_samples,
    };
    match (quality, outdoors) {
        (LightQuality::Fast, false) => light(0.4, 24, 8, 2),
        (LightQuality::Fast, true) => light(3.0, 16, 4, 1),
        (LightQuality::Standard, false) => light(0.12, 64, 8, 3),
        (LightQuality::Standard, true) => light(0.9, 32, 8, 1),
        (LightQuality::Fine, false) => light(0.08, 128, 8, 4),
        (LightQuality::Fine, true) => light(0.6, 64, 8, 1),
    }
}
