//! What the panorama is drawn on, and what the user asks of it.

use trueup_core::options::{InvalidOption, OptionValue};

use super::flat::FlatKind;

trueup_core::choice! {
    /// What the panorama is drawn on.
    pub enum Projection {
        /// The view a person would choose: as straight as it can be without stretching. Perspective up to about 95
        /// degrees, from there ever more like Panini's and the cylinder, and equirectangular for full turns. For vpg;
        /// other methods keep their mesh.
        Auto = "auto",
        /// The solved mesh itself: every photograph as natural as its neighbors allow.
        Mesh = "mesh",
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
        /// What the panorama is drawn on. Choose equirectangular for viewers of spherical panoramas, the mesh where
        /// photographs that were taken from several places do not meet, and any other as you like it.
        kind: Projection = Projection::Auto, Allowed::Any, "", basic;
        /// Turns the viewer to the right of where the panorama faces: change it to bring another place to the middle.
        /// Not for the mesh, as the next three.
        yaw: f64 = 0.0, between(-360.0, 360.0), "degrees", basic;
        /// Turns the viewer up: change it where the panorama shows too much ground, or too much sky.
        pitch: f64 = 0.0, between(-90.0, 90.0), "degrees", basic;
        /// Turns the viewer clockwise: change it where the panorama leans.
        roll: f64 = 0.0, between(-180.0, 180.0), "degrees", basic;
        /// Horizontal field of view that may be shown; 0 shows what is there, as far as the projection carries well.
        /// Lower it to leave stretched sides out, raise it to see them.
        fov: f64 = 0.0, between(0.0, 360.0), "degrees", basic;
        /// Distance of Panini's viewpoint behind the cylinder's axis: 0 is perspective, 1 Panini's own, more is
        /// flatter. Lower it where slanting lines bend too much, raise it where the sides are too large.
        panini_distance: f64 = 1.0, between(0.0, 10.0), "";
        /// How far photographs may contradict each other because of parallax and still be made to meet; beyond, each
        /// stays where its camera looks. Raise it for hand-held photographs of near things that show double, lower it
        /// where meeting bends them.
        max_parallax_deg: f64 = 8.0, between(0.0, 45.0), "degrees";
    }
}

impl ProjectionOptions {
    /// What no single option's range can say: a field of view beyond what the projection can draw.
    pub fn beyond_the_projection(&self) -> Vec<InvalidOption> {
        let kind = match self.kind {
            Projection::Perspective => FlatKind::Perspective,
            Projection::Panini => FlatKind::Panini,
            Projection::Stereographic => FlatKind::Stereographic,
            _ => return Vec::new(),
        };
        let largest = 2.0 * kind.largest_half_width().to_degrees();
        let wrong = self.fov > largest;
        let named = InvalidOption {
            name: "projection.fov".to_owned(),
            value: self.fov.display(),
            allowed: format!("0 to {largest:.0} for projection.kind = {}", kind.name()),
        };
        if wrong { vec![named] } else { Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_of_view_beyond_the_projection_is_named() {
        let wide = ProjectionOptions { kind: Projection::Perspective, fov: 200.0, ..ProjectionOptions::default() };
        let named = wide.beyond_the_projection();
        assert_eq!(
            named[0].to_string(),
            "invalid projection.fov = 200 (allowed: 0 to 160 for projection.kind = perspective)"
        );
        assert!(ProjectionOptions { fov: 360.0, ..ProjectionOptions::default() }.beyond_the_projection().is_empty());
    }
}
