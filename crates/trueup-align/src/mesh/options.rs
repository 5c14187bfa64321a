//! What a user decides of how the grids are deformed.

trueup_core::choice! {
    /// The shape that the similarity prior asks of each photograph.
    pub enum BaseShape {
        /// The photograph on the level sphere, unrolled between the equirectangular and the Mercator projection
        /// (`mesh.conformality`); nearly a similarity around the photograph's center.
        Sphere = "sphere",
        /// A similarity of the whole photograph, as published.
        Similarity = "similarity",
    }
}

trueup_core::options! {
    /// How the grids are deformed.
    pub struct MeshOptions("mesh") {
        /// Largest side of a grid cell; of more than some 180 photographs cells are larger, so that all grids together
        /// keep as many vertices. Lower it where parallax changes within a cell; time and memory grow with its inverse
        /// square.
        cell_px: f64 = 40.0, between(4.0, 1000.0), "working px";
        /// The shape that the similarity prior asks of each photograph. Choose the similarity to compare with published
        /// results.
        base: BaseShape = BaseShape::Sphere, Allowed::Any, "";
        /// How the sphere is unrolled: 0 is the equirectangular projection, which stretches steep photographs sideways;
        /// 1 is Mercator's, which keeps shapes and enlarges steep photographs. Lower it where the top or the foot of
        /// the panorama is too large.
        conformality: f64 = 0.85, between(0.0, 1.0), "";
        /// Cells of the delivered grid per cell of the solved one, along each axis: the finer grid follows the base's
        /// curves between the solved vertices. Raise it where large cells show as kinks.
        subdivision: usize = 2, between(1.0, 16.0), "";
        /// Weight of the alignment of overlaps. Raise it where overlaps show double, lower it where aligning them bends
        /// the photographs.
        alignment_weight: f64 = 1.0, between(0.001, 1000.0), "";
        /// Weight of local similarity (on residuals). Raise it where small things are distorted.
        local_weight: f64 = 0.75, between(0.0, 1000.0), "";
        /// Weight of the similarity prior next to an overlap (on residuals, for 40 px cells). Raise it where
        /// photographs do not stand as upright as the prior wants them, lower it where that keeps overlaps apart.
        prior_weight: f64 = 6.0, between(0.001, 1000.0), "";
        /// Weight with which a refinement (`stitch.align`) keeps each photograph's outline where the plain mesh has it
        /// (on residuals). Lower it where the refinement cannot move a photograph's border far enough.
        outline_weight: f64 = 10.0, between(0.0, 1000.0), "";
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::options::StageOptions;

    use super::*;

    /// Without any weight, nothing holds photographs together, and their places are anything.
    #[test]
    fn overlaps_weigh_something() {
        let weighed = |alignment_weight: f64| MeshOptions { alignment_weight, ..MeshOptions::default() }.invalid();
        assert!(!weighed(0.0).is_empty() && weighed(0.001).is_empty());
    }
}
