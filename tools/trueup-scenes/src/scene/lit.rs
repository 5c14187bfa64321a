//! A scene ready to be photographed.

use super::unlit::{UnlitScene, Viewpoint};
use crate::light::LightField;

/// A scene ready to be photographed. Its Manhattan directions, where it has them, are the axes of the world.
#[derive(Debug, Clone)]
pub struct LitScene {
    pub(crate) unlit: UnlitScene,
    pub(crate) light: LightField,
    /// Gain that makes the brightness round the viewpoint a middle gray.
    pub(crate) exposure: f64,
}

impl LitScene {
    /// From where, and in which direction first, the scene is meant to be photographed.
    pub fn viewpoint(&self) -> Viewpoint {
        self.unlit.viewpoint
    }
}
