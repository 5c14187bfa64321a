//! A scene in the dark: bodies, materials, sources of light, and the place from which to photograph them.

use crate::bvh::Hierarchy;
use crate::material::SurfaceMaterial;
use crate::portal::Portal;
use crate::sky::{Sky, Sun};
use crate::solid::Solid;

/// A place from which a scene can be photographed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// The photographer's eye in the world, metres; y points down and the floor is at y = 0.
    pub eye: [f64; 3],
    /// The direction first looked at: turn about the vertical from world z towards world x, degrees.
    pub yaw_deg: f64,
    /// Median distance of what is seen at eye level all round, metres.
    pub depth_m: f64,
}

/// A scene whose light has not been worked out.
#[derive(Debug, Clone)]
pub(crate) struct UnlitScene {
    pub(crate) solids: Vec<Solid>,
    pub(crate) materials: Vec<SurfaceMaterial>,
    pub(crate) hierarchy: Hierarchy,
    pub(crate) portals: Vec<Portal>,
    pub(crate) sky: Sky,
    pub(crate) sun: Option<Sun>,
    pub(crate) viewpoint: Viewpoint,
}

impl UnlitScene {
    /// Whether the sky lights the scene from all sides rather than through windows.
    pub(crate) fn is_outdoors(&self) -> bool {
        self.portals.is_empty()
    }
}
