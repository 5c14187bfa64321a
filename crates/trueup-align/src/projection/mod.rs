//! Projections: the panorama of rotating cameras, drawn from directions.
//!
//! * [`flat`](Flat): each projection as a map between directions and a plane;
//! * [`ProjectionView`]: where the viewer looks, how much is shown, and which projection suits;
//! * [`parallax_shifts`]: what the solved mesh knows beyond the cameras: by how much each photograph must give way so
//!   that overlaps meet in spite of parallax;
//! * [`place`]: every photograph's grid on the plane, as it is drawn; [`place_once`]: as it is measured and recorded.
//!
//! Directions are in the level world: x right, y down, z forward.

mod coverage;
mod fitted;
mod flat;
mod grid;
mod once;
mod options;
mod parallax;
mod photograph;
mod seen;
mod view;
#[cfg(test)]
mod view_tests;

pub use fitted::Fit;
pub use flat::{Flat, FlatKind};
pub use grid::{PlacedGrid, Placement, place};
pub use once::place_once;
pub use options::{Projection, ProjectionOptions};
pub use parallax::{ParallaxShift, parallax_shifts};
pub use photograph::PosedPhotograph;
pub use view::ProjectionView;
