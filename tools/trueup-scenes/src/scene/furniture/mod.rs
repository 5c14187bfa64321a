//! What stands along walls and in the middle of rooms. Heights and depths are metres.

mod fittings;
mod living;
mod materials;
mod openings;
mod pictures;
mod shelves;
mod tables;

pub(super) use fittings::{lockers, painting, refrigerator, sculptures, white_board, workbench, worktop};
pub(super) use living::{plant, sofa};
pub(super) use materials::RoomMaterials;
pub(super) use openings::{door, door_opening, window, window_opening};
pub(super) use pictures::{gallery, picture};
pub(super) use shelves::{bookcase, cabinet};
pub(super) use tables::{desk, table};
