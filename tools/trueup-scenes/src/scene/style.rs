//! What rooms are for: what stands along their walls, what they are made of, how large they are.

use super::builder::Builder;
use crate::material::{MaterialId, Pattern, SurfaceMaterial};

trueup_core::choice! {
    /// What a room is for.
    pub enum RoomStyle {
        /// Papered walls, sofa, bookcase, a table under a lamp.
        Living = "living",
        /// Desks, steel cabinets, a white board, a panelled ceiling with lamps.
        Office = "office",
        /// Worktops before tiled walls, wall units, a refrigerator, a tiled floor.
        Kitchen = "kitchen",
        /// Bookcases all round, dark floor, beams.
        Library = "library",
        /// Paintings on pale walls, benches and sculptures.
        Gallery = "gallery",
        /// Workbenches under boards of tools, shelves, brick walls.
        Workshop = "workshop",
    }
}

/// What may stand along a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Feature {
    Window,
    Door,
    Bookcase,
    Cabinet,
    Gallery,
    Sofa,
    Desk,
    Worktop,
    Refrigerator,
    WhiteBoard,
    Lockers,
    Painting,
    Workbench,
}

impl Feature {
    /// Metres of wall it wants.
    pub(super) fn width(self) -> f64 {
        match self {
            Self::Window => 1.35,
            Self::Door => 0.95,
            Self::Bookcase => 1.3,
            Self::Cabinet => 1.45,
            Self::Gallery => 1.3,
            Self::Sofa => 1.95,
            Self::Desk => 1.4,
            Self::Worktop => 2.4,
            Self::Refrigerator => 0.7,
            Self::WhiteBoard => 1.8,
            Self::Lockers => 1.2,
            Self::Painting => 1.5,
            Self::Workbench => 2.0,
        }
    }
}

/// What stands in the middle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Middle {
    /// A table with chairs on a rug, under a lamp.
    Table,
    /// The same on the bare floor.
    BareTable,
    /// Benches and sculptures on stands.
    Sculptures,
}

impl RoomStyle {
    /// What each wall carries at most, in order of importance.
    pub(super) fn walls(self) -> [&'static [Feature]; 4] {
        use Feature::{
            Bookcase, Cabinet, Desk, Door, Gallery, Lockers, Painting, Refrigerator, Sofa, WhiteBoard, Window,
            Workbench, Worktop,
        };
        match self {
            Self::Living => [
                &[Window, Bookcase, Cabinet, Gallery],
                &[Door, Desk, Gallery, Bookcase],
                &[Sofa, Bookcase, Gallery, Cabinet],
                &[Window, Cabinet, Window, Gallery],
            ],
            Self::Office => [
                &[Window, Desk, Window, Lockers],
                &[Door, WhiteBoard, Lockers, Desk],
                &[Desk, Bookcase, Desk, Gallery],
                &[Desk, Lockers, WhiteBoard, Gallery],
            ],
            Self::Kitchen => [
                &[Worktop, Refrigerator, Window],
                &[Door, Cabinet, Gallery, Window],
                &[Window, Worktop, Cabinet],
                &[Bookcase, Refrigerator, Worktop, Gallery],
            ],
            Self::Library => [
                &[Bookcase, Window, Bookcase, Bookcase],
                &[Door, Bookcase, Bookcase, Bookcase],
                &[Bookcase, Desk, Bookcase, Gallery],
                &[Bookcase, Bookcase, Window, Bookcase],
            ],
            Self::Gallery => [
                &[Painting, Painting, Painting, Painting],
                &[Door, Painting, Gallery, Painting],
                &[Painting, Gallery, Painting, Gallery],
                &[Painting, Painting, Cabinet, Painting],
            ],
            Self::Workshop => [
                &[Workbench, Window, Bookcase],
                &[Door, Lockers, Workbench, Gallery],
                &[Workbench, Bookcase, Window],
                &[Window, Workbench, Lockers, Gallery],
            ],
        }
    }

    /// Least and greatest width, length and height, metres.
    pub(super) fn extents(self) -> [[f64; 2]; 3] {
        match self {
            Self::Living => [[5.2, 6.8], [5.8, 7.6], [2.65, 2.95]],
            Self::Office => [[6.4, 7.6], [6.8, 8.4], [2.8, 3.0]],
            Self::Kitchen => [[5.4, 6.4], [5.8, 6.8], [2.6, 2.8]],
            Self::Library => [[6.0, 7.0], [7.0, 8.4], [2.9, 3.2]],
            Self::Gallery => [[7.2, 8.6], [8.0, 9.6], [3.3, 3.8]],
            Self::Workshop => [[6.0, 7.2], [6.6, 8.2], [2.9, 3.3]],
        }
    }

    pub(super) fn middle(self) -> Middle {
        match self {
            Self::Living | Self::Library => Middle::Table,
            Self::Office | Self::Kitchen | Self::Workshop => Middle::BareTable,
            Self::Gallery => Middle::Sculptures,
        }
    }

    /// Rows and columns of lamps in the ceiling.
    pub(super) fn ceiling_lamps(self) -> [usize; 2] {
        match self {
            Self::Living | Self::Library => [0, 0],
            Self::Kitchen => [1, 2],
            Self::Office | Self::Workshop => [2, 2],
            Self::Gallery => [3, 2],
        }
    }

    pub(super) fn has_plants(self) -> bool {
        !matches!(self, Self::Kitchen | Self::Workshop)
    }

    /// The chance of beams under the ceiling.
    pub(super) fn beams(self) -> f64 {
        match self {
            Self::Living => 0.6,
            Self::Library | Self::Workshop => 1.0,
            Self::Office | Self::Kitchen | Self::Gallery => 0.0,
        }
    }

    pub(super) fn floor(self, builder: &mut Builder) -> SurfaceMaterial {
        let timbers = [0xa8_7848, 0xc0_9464, 0x8a_5a34];
        let timber = timbers[builder.dice.index(timbers.len())];
        let stone = SurfaceMaterial::new(Pattern::Tiles, 0.4, [0xc8_bca8, 0x9a_8878, 0x6a_645c]).glossy(0.04);
        let planks = |width| SurfaceMaterial::new(Pattern::Planks, width, [timber; 3]).glossy(0.04);
        match self {
            Self::Living => {
                if builder.dice.chance(0.7) {
                    planks(builder.dice.range(0.1, 0.18))
                } else {
                    stone
                }
            }
            Self::Office => {
                let tints = [[0x5a_6470, 0x70_7a84], [0x6a_6458, 0x80_786a], [0x4c_5c5a, 0x66_7470]];
                let [a, b] = tints[builder.dice.index(tints.len())];
                SurfaceMaterial::new(Pattern::Carpet, 0.5, [a, b, 0x30_3438])
            }
            Self::Kitchen => {
                let tints = [[0xd8_d4c8, 0x3a_3c3e], [0xb8_6848, 0xc8_8058], [0xc4_ccc8, 0x8a_9a98]];
                let [a, b] = tints[builder.dice.index(tints.len())];
                SurfaceMaterial::new(Pattern::Tiles, 0.3, [a, b, 0x8a_8680]).glossy(0.05)
            }
            Self::Library => SurfaceMaterial::new(Pattern::Planks, 0.12, [0x7a_4c2c; 3]).glossy(0.05),
            Self::Gallery => planks(0.22),
            Self::Workshop => SurfaceMaterial::new(Pattern::Asphalt, 1.0, [0x9a_9690; 3]),
        }
    }

    pub(super) fn ceiling(self, builder: &mut Builder) -> SurfaceMaterial {
        let plaster = SurfaceMaterial::new(Pattern::Plaster, 1.0, [0xf2_efe8; 3]);
        let boards = SurfaceMaterial::new(Pattern::Planks, 0.14, [0xe6_d8bc; 3]);
        match self {
            Self::Living => {
                if builder.dice.chance(0.5) {
                    boards
                } else {
                    plaster
                }
            }
            Self::Office => SurfaceMaterial::new(Pattern::CeilingPanels, 0.6, [0xe6_e6e2, 0xb0_b0ac, 0]),
            Self::Kitchen | Self::Gallery => plaster,
            Self::Library => SurfaceMaterial::new(Pattern::Planks, 0.16, [0xa8_8050; 3]),
            Self::Workshop => SurfaceMaterial::new(Pattern::Planks, 0.2, [0xb8_a480; 3]),
        }
    }

    pub(super) fn wall_covering(self, builder: &mut Builder) -> MaterialId {
        let papers =
            [[0xe8_e0c8, 0xdc_d0b0, 0x6a_6034], [0xd0_dcd8, 0xc0_d0cc, 0x2e_5654], [0xe6_d2ca, 0xd8_beb4, 0x7a_3c38]];
        let plasters = [0xe6_dcc8, 0xc4_ccc4, 0xd8_c0a4, 0xb8_c4d0];
        let brick = SurfaceMaterial::new(Pattern::Brick, 0.075, [0xa8_6248, 0xc4_b8a6, 0xc8_906c]);
        let kind = builder.dice.unit();
        let plaster = |builder: &mut Builder| {
            SurfaceMaterial::new(Pattern::Plaster, 1.0, [plasters[builder.dice.index(plasters.len())]; 3])
        };
        let paper = |builder: &mut Builder| {
            let width = builder.dice.range(0.22, 0.28);
            SurfaceMaterial::new(Pattern::Wallpaper, width, papers[builder.dice.index(papers.len())])
        };
        let material = match self {
            Self::Living if kind < 0.5 => paper(builder),
            Self::Living if kind < 0.7 => brick,
            Self::Library if kind < 0.4 => paper(builder),
            Self::Kitchen if kind < 0.5 => {
                let tints = [[0xdc_e4e0, 0xe8_ece6], [0xe4_d8b8, 0xec_e4cc], [0xa8_c4c8, 0xc0_d4d4]];
                let [a, b] = tints[builder.dice.index(tints.len())];
                SurfaceMaterial::new(Pattern::Tiles, 0.15, [a, b, 0xa8_a49c]).glossy(0.04)
            }
            Self::Workshop if kind < 0.8 => brick,
            Self::Gallery => SurfaceMaterial::new(Pattern::Plaster, 1.0, [0xee_ece4; 3]),
            _ => plaster(builder),
        };
        builder.material(material)
    }
}
