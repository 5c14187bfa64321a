//! Pictures with exactly known cameras for examples, tests and experiments: rendered scenes, and views cut out of
//! panoramas of real places ([`cut`]).
//!
//! A [`LitScene`] (a room, a street, or open country) is built from a seed; [`rig`] places the cameras of a hand-held
//! panorama in it; [`render`] takes the photographs and [`write_set`] stores them with their truth. [`flat_rig`] moves
//! cameras along something flat.
//!
//! ```
//! use trueup_scenes::{LightQuality, Quality, RigOptions, LitScene, SceneOptions, render, rig};
//! let scene = LitScene::new(&SceneOptions { light: LightQuality::Fast, ..SceneOptions::default() })?;
//! let cameras = rig(&RigOptions { width: 32, height: 24, ..RigOptions::default() }, &scene.viewpoint())?;
//! let picture = render(&scene, &cameras[0], Quality::Preview);
//! assert_eq!((picture.width(), picture.height(), picture.channels()), (32, 24, 3));
//! # Ok::<(), trueup_core::Error>(())
//! ```
//!
//! The world's y points down and, where a scene has Manhattan directions, they are the world's axes. Everything is
//! drawn by rule: there are no asset files.
#![forbid(unsafe_code)]

mod bvh;
mod catalogue;
mod color;
pub mod cut;
mod dice;
mod flat;
mod light;
mod material;
mod noise;
mod portal;
mod render;
mod rig;
mod scene;
mod set;
mod sky;
mod solid;
mod study;
#[cfg(test)]
mod tests;
mod trace;

pub use catalogue::{RECIPE, SetOutcome, SetRequest};
pub use flat::{FlatSetKind, FlatTexture, flat_picture, flat_rig, write_flat_set};
pub use render::{Quality, render};
pub use rig::{PosedCamera, RigOptions, Shade, camera_from_world, rig};
pub use scene::{LightQuality, LitScene, RoomStyle, SceneKind, SceneOptions, Viewpoint};
pub use set::{SetOutput, truth_of, write_set};
pub use study::{SetKind, example_set};
