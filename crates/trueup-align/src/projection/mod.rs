//! Projections: the panorama of rotating cameras, drawn from directions.
//!
//! * [`flat`](Flat): each projection as a map between directions and a plane;
//! * [`ProjectionView`]: where the viewer looks, how much is shown, and which projection suits;
//! * [`place`]: every photograph's grid on the plane, as it is drawn, where it gives way ([`ParallaxShift`]) if it has
//!   to; [`place_once`]: as it is measured and recorded.
//!
//! Directions are in the level world: x right, y down, z forward.

mod coverage;
mod fitted;
mod flat;
mod grid;
mod once;
mod options;
mod parallax_shift;
mod photograph;
mod seen;
mod view;
#[cfg(test)]
mod view_tests;

pub(crate) use coverage::{samples, steepest};
pub use fitted::Fit;
pub use flat::{Flat, FlatKind};
pub use grid::{PlacedGrid, Placement, place};
pub use once::place_once;
pub use options::{Projection, ProjectionOptions};
pub use parallax_shift::ParallaxShift;
pub use photograph::PosedPhotograph;
pub(crate) use seen::smooth;
pub use view::ProjectionView;
