//! Materials that the pieces of one room share.

use crate::material::{MaterialId, Pattern, SurfaceMaterial};
use crate::scene::builder::Builder;

/// Materials that the pieces of one room share.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct RoomMaterials {
    pub(in crate::scene) timber: MaterialId,
    pub(in crate::scene) dark_timber: MaterialId,
    pub(in crate::scene) white_paint: MaterialId,
    pub(in crate::scene) metal: MaterialId,
    pub(in crate::scene) fabric: MaterialId,
    pub(in crate::scene) cushion: MaterialId,
    pub(in crate::scene) curtain: MaterialId,
    pub(in crate::scene) spine: MaterialId,
    pub(in crate::scene) paper: MaterialId,
    pub(in crate::scene) page: MaterialId,
    pub(in crate::scene) picture: MaterialId,
    pub(in crate::scene) ceramic: MaterialId,
    pub(in crate::scene) leaves: MaterialId,
    pub(in crate::scene) shade: MaterialId,
    pub(in crate::scene) iron: MaterialId,
}

impl RoomMaterials {
    /// Chosen by the builder's dice.
    pub(in crate::scene) fn new(builder: &mut Builder) -> Self {
        let timbers = [0x9a_6a3a, 0xb4_8650, 0x7a_4a28, 0xc8_a070];
        let fabrics = [[0x4a_6078, 0x7a_90a0], [0x8a_4a40, 0xb8_7a60], [0x5a_6a48, 0x8a_9870], [0x6a_6460, 0x9a_948c]];
        let timber = timbers[builder.dice.index(timbers.len())];
        let fabric = fabrics[builder.dice.index(fabrics.len())];
        let cushion = fabrics[builder.dice.index(fabrics.len())];
        let mut add = |material: SurfaceMaterial| builder.material(material);
        Self {
            timber: add(SurfaceMaterial::new(Pattern::Wood, 1.0, [timber; 3]).glossy(0.008)),
            dark_timber: add(SurfaceMaterial::new(Pattern::Wood, 1.0, [0x5a_3820; 3]).glossy(0.01)),
            white_paint: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0xe8_e4da; 3]).glossy(0.02)),
            metal: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0x8a_8a88; 3]).glossy(0.25)),
            fabric: add(SurfaceMaterial::new(Pattern::Fabric, 0.008, [fabric[0], fabric[1], 0])),
            cushion: add(SurfaceMaterial::new(Pattern::Fabric, 0.006, [cushion[1], 0xe0_d0b0, 0])),
            curtain: add(SurfaceMaterial::new(Pattern::Curtain, 0.11, [0xd8_ccb4, cushion[0], 0])),
            spine: add(SurfaceMaterial::new(Pattern::Spine, 1.0, [0xff_ffff; 3])),
            paper: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0xe0_d8c4; 3])),
            page: add(SurfaceMaterial::new(Pattern::Page, 1.0, [0xee_eae0, 0x22_2222, 0])),
            picture: add(SurfaceMaterial::new(Pattern::Picture, 1.0, [0xff_ffff; 3]).glossy(0.01)),
            ceramic: add(SurfaceMaterial::new(Pattern::Tiles, 0.09, [0xc8_d4d0, 0x3a_6a84, 0xe0_dcd0]).glossy(0.06)),
            leaves: add(SurfaceMaterial::new(Pattern::Foliage, 1.0, [0x2e_5a26, 0x78_a048, 0])),
            shade: add(SurfaceMaterial::new(Pattern::Fabric, 0.01, [0xc8_9860, 0xa8_6a3c, 0]).emitting(0.25)),
            iron: add(SurfaceMaterial::new(Pattern::Paint, 1.0, [0x2a_2c2e; 3]).glossy(0.03)),
        }
    }
}
