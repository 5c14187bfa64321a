//! Projections: the panorama of rotating cameras, drawn from directions.
//!
//! * [`flat`](Flat): each projection as a map between directions and a plane;
//! * [`View`]: where the viewer looks, how much is shown, and which projection suits;
//! * [`meeting`]: what the solved mesh knows beyond the cameras: by how much each photograph must give way so that
//!   overlaps meet in spite of parallax;
//! * [`place`]: every photograph's grid on the plane.
//!
//! Directions are in the level world: x right, y down, z forward.

mod coverage;
mod flat;
mod grid;
mod meeting;
mod view;

use serde::{Deserialize, Serialize};
use trueup_core::camera::Camera;
use trueup_core::mesh::GridMesh;

pub use flat::{Flat, FlatKind};
pub use grid::{PlacedGrid, Placement, place};
pub use meeting::{Meeting, meeting};
pub use view::View;

trueup_core::choice! {
    /// What the panorama is drawn on.
    pub enum Projection {
        /// The solved mesh itself: every photograph as natural as its neighbors allow.
        Mesh = "mesh",
        /// The one of the others that suits the angle of view: perspective up to 100 degrees, Panini's up to 180, the
        /// cylinder up to 220, and the equirectangular projection for more, for full turns and for steep views.
        Auto = "auto",
        /// Longitude and latitude: holds the whole sphere; what viewers of spherical panoramas read.
        Equirectangular = "equirectangular",
        /// The cylinder seen from its axis: verticals stay straight, heights grow with the tangent.
        Cylindrical = "cylindrical",
        /// A plane, like one wide photograph: every straight line stays straight; far sides are stretched.
        Perspective = "perspective",
        /// Mercator's: a turn whose shapes are kept everywhere, larger towards zenith and nadir.
        Mercator = "mercator",
        /// Panini's: wide views in which verticals and all lines towards the middle stay straight.
        Panini = "panini",
        /// The sphere seen from its own surface: shapes are kept, circles stay circles; looks down at little planets.
        Stereographic = "stereographic",
    }
}

trueup_core::options! {
    /// What the panorama is drawn on, and where the viewer looks.
    pub struct ProjectionOptions("projection") {
        /// What the panorama is drawn on.
        kind: Projection = Projection::Mesh, Allowed::Any, "";
        /// Turns the viewer to the right of where the panorama faces.
        yaw: f64 = 0.0, between(-360.0, 360.0), "degrees";
        /// Turns the viewer up.
        pitch: f64 = 0.0, between(-90.0, 90.0), "degrees";
        /// Turns the viewer clockwise.
        roll: f64 = 0.0, between(-180.0, 180.0), "degrees";
        /// Horizontal field of view that may be shown; 0 shows what is there, as far as the projection carries well.
        fov: f64 = 0.0, between(0.0, 360.0), "degrees";
        /// Distance of Panini's viewpoint behind the cylinder's axis: 0 is perspective, 1 Panini's own, more is flatter.
        panini_distance: f64 = 1.0, between(0.0, 10.0), "";
        /// Whether the panorama faces the scene's dominant direction that is nearest to the photographs' middle.
        facing: bool = true, Allowed::Any, "";
        /// How far photographs may contradict each other because of parallax and still be made to meet; beyond, each stays
        /// where its camera looks.
        max_parallax_deg: f64 = 2.0, between(0.0, 45.0), "degrees";
    }
}

/// A photograph whose camera is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shot {
    /// In the photograph's own pixels; its world is the level one.
    pub camera: Camera,
    /// The photograph's grid in the plane of the solved mesh.
    pub mesh: GridMesh,
}
