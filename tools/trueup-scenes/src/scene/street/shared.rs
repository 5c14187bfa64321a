//! What all parts of a street share: its measures and its materials.

use crate::material::{MaterialId, Pattern, SurfaceMaterial};
use crate::scene::builder::Builder;

/// Half the width of the roadway, metres.
pub(super) const ROAD: f64 = 3.6;
/// Half the width of the street from front to front, metres.
pub(super) const FRONT: f64 = 6.4;
/// How far the street runs either way, metres.
pub(super) const REACH: f64 = 75.0;
/// Height of the pavement above the roadway, metres.
pub(super) const KERB: f64 = 0.13;

/// Materials shared along the street.
#[derive(Debug, Clone, Copy)]
pub(super) struct StreetMaterials {
    pub(super) stone: MaterialId,
    pub(super) trim: MaterialId,
    pub(super) pane: MaterialId,
    pub(super) window_paint: MaterialId,
    pub(super) iron: MaterialId,
    pub(super) door: MaterialId,
    pub(super) timber: MaterialId,
    pub(super) leaves: MaterialId,
    pub(super) poster: MaterialId,
    pub(super) rubber: MaterialId,
    pub(super) windscreen: MaterialId,
}

impl StreetMaterials {
    /// Adds them to a scene under construction.
    pub(super) fn new(builder: &mut Builder) -> Self {
        let mut add = |material: SurfaceMaterial| builder.material(material);
        Self {
            stone: add(SurfaceMaterial::new(Pattern::Ashlar, 0.42, [0xb8_ac98; 3])),
            trim: add(SurfaceMaterial::new(Pattern::Stucco, 1.0, [0xd8_d0c0; 3])),
            pane: add(SurfaceMaterial::new(Pattern::Pane, 1.0, [0x1c_2228; 3]).glossy(0.12)),
            window_paint: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0xe8_e6e0; 3])),
            iron: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0x2c_302e; 3]).glossy(0.04)),
            door: add(SurfaceMaterial::new(Pattern::Wood, 1.0, [0x6a_3c24; 3]).glossy(0.03)),
            timber: add(SurfaceMaterial::new(Pattern::Wood, 1.0, [0x8a_6a48; 3])),
            leaves: add(SurfaceMaterial::new(Pattern::Foliage, 1.0, [0x30_541e, 0x80_a044, 0])),
            poster: add(SurfaceMaterial::new(Pattern::Page, 1.0, [0xee_e6d4, 0x22_2222, 0])),
            rubber: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0x20_2022; 3])),
            windscreen: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0x1a_2024; 3]).glossy(0.15)),
        }
    }
}
