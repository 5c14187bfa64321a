//! Deforms the grids of one group of overlapping photographs.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use rayon::prelude::*;
use trueup_align::cameras::Cameras;
use trueup_align::full_turn::FullTurnCut;
use trueup_align::match_points::OverlapWarp;
use trueup_align::mesh::{
    self, BaseShape, ByCamerasInput, MeshInput, MeshOptions, PlainMesh, StructureInput, WarpedMesh,
};
use trueup_align::similarity::SimilarityPrior;
use trueup_align::warps::{self, WarpInput, WarpModel};
use trueup_core::geometry::matrix_from_rows;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::{Result, StageContext};
use trueup_vision::lines;

use super::AlignInput;
use super::refinement::{self, RefinementSources};
use super::turn::Turn;
use crate::options::{AlignOptions, Evidence, Structure};

/// What the grids are deformed by.
pub(super) struct Deformation<'a> {
    pub input: &'a AlignInput<'a>,
    /// Even grids over the working photographs.
    pub grids: &'a [GridMesh],
    pub cameras: &'a Cameras,
    pub prior: &'a SimilarityPrior,
    /// All overlaps.
    pub all_warps: &'a [OverlapWarp],
    /// The overlaps and pairs that do not lie across the cut of a full turn.
    pub warps: &'a [OverlapWarp],
    pub pairs: &'a [PairMatches],
    pub turn: Option<&'a Turn>,
    pub cut: Option<&'a FullTurnCut>,
}

impl Deformation<'_> {
    /// The grids deformed by the mesh, or by the cameras where it is worse, and refined.
    pub(super) fn by_mesh(&self, options: &AlignOptions, context: &StageContext) -> Result<WarpedMesh> {
        let component = self.input.component;
        let cameras = &self.cameras.cameras;
        let flat_scene = self.cameras.flat_scene.as_ref();
        let bases = match flat_scene {
            Some(scene) => mesh::bases_on_plane(scene),
            None => mesh::bases(cameras, self.grids, self.prior, &options.mesh),
        };
        let chains: Option<Vec<Vec<LineSegment>>> = (options.stitch.structure == Structure::Lines)
            .then(|| component.lines.par_iter().map(|lines| lines::merged(lines)).collect());
        let structure = chains.as_ref().map(|chains| StructureInput { chains, options: &options.structure });
        let closure = self.turn.and_then(|turn| turn.closure(mesh::turn_length(cameras, self.prior)));
        // What is turned as a whole does not go round along the panorama's rows.
        let closure = closure.filter(|_| component.reference_rotation == 0.0);
        let (grids, warps, reference) = (self.grids, self.warps, component.reference);
        let input = MeshInput { grids, warps, bases: &bases, reference, closure, structure };
        let solved = context.gather(|context| mesh::run(&input, &options.mesh, context))?;
        // What is turned or tilted as a whole, and the published similarity, want the mesh's own plane.
        let on_sphere = options.mesh.base == BaseShape::Sphere && flat_scene.is_none();
        if on_sphere && component.reference_rotation == 0.0 && !mesh::tilts(cameras, self.grids, self.prior) {
            let by_cameras = self.by_cameras_if_better(solved.value.warped(), options, context)?;
            if let Some(drawn) = by_cameras {
                return self.drawing_refined(drawn, options, context);
            }
        }
        let plain = context.absorb(solved);
        let evidence = self.evidence(&plain, options, context);
        self.refined(plain, evidence, options, context)
    }

    /// What the cameras draw, where the plain mesh is worse than they are.
    fn by_cameras_if_better(
        &self,
        plain: &WarpedMesh,
        options: &AlignOptions,
        context: &StageContext,
    ) -> Result<Option<WarpedMesh>> {
        let cameras = &self.cameras.cameras;
        let level_from_world = self.prior.level_from_world();
        let mut level = self.prior.corrected_cameras(cameras);
        for camera in &mut level {
            camera.set_rotation(&(camera.rotation() * level_from_world.transpose()));
        }
        let dominant = self.prior.guidance.dominant.as_ref().map(matrix_from_rows);
        let input = ByCamerasInput {
            grids: self.grids,
            cameras: &level,
            warps: self.all_warps,
            severed: self.cut.map_or(&[], |cut| &cut.severed),
            dominant: dominant.as_ref(),
            units_per_radian: mesh::turn_length(cameras, self.prior) / TAU,
        };
        mesh::unless_worse(plain, &input, &options.mesh, context)
    }

    /// What the cameras draw, refined as the mesh would be where the photographs lie side by side on its plane.
    fn drawing_refined(&self, drawn: WarpedMesh, options: &AlignOptions, context: &StageContext) -> Result<WarpedMesh> {
        let reference = self.input.component.reference;
        // Nothing but their outlines would hold the photographs.
        let is_held = options.mesh.outline_weight > 0.0;
        if self.cut.is_some() || !is_held || !drawn.lies_flat() {
            return Ok(drawn);
        }
        let origin = Vector2::from(drawn.meshes[reference].target[0]);
        let bases = mesh::bases_on_drawing(&drawn.meshes, origin);
        let input = MeshInput {
            grids: self.grids,
            warps: self.all_warps,
            bases: &bases,
            reference,
            closure: None,
            structure: None,
        };
        let by_evidence = MeshOptions { alignment_weight: 0.0, ..options.mesh.clone() };
        let plain = PlainMesh::of_drawing(input, &by_evidence, context);
        let evidence = self.evidence(&plain, options, context);
        if evidence == Evidence::Points {
            return Ok(drawn);
        }
        let refined = self.refined(plain, evidence, options, context)?;
        if refined.folds > drawn.folds {
            return Ok(drawn);
        }
        let meshes = refined.meshes.iter().map(|mesh| mesh.moved_by(origin)).collect();
        Ok(WarpedMesh { meshes, by_cameras: drawn.by_cameras, ..refined })
    }

    /// What the overlaps of a mesh are drawn together by, told or found out.
    fn evidence(&self, plain: &PlainMesh, options: &AlignOptions, context: &StageContext) -> Evidence {
        match options.stitch.align {
            Evidence::Auto => refinement::asked_for(plain.misaligned_share(self.pairs), context),
            told => told,
        }
    }

    /// The mesh, refined by `evidence`.
    fn refined(
        &self,
        plain: PlainMesh,
        evidence: Evidence,
        options: &AlignOptions,
        context: &StageContext,
    ) -> Result<WarpedMesh> {
        let AlignInput { component, photographs, .. } = *self.input;
        if evidence == Evidence::Points {
            return Ok(plain.into_warped());
        }
        let sources = RefinementSources::new(evidence, component, self.grids, self.warps, photographs, context)?;
        plain.refined(&sources.refinements(component, self.pairs, options), context)
    }

    /// The grids deformed by a warp model.
    pub(super) fn by_warp(
        &self,
        model: WarpModel,
        options: &AlignOptions,
        context: &StageContext,
    ) -> Result<WarpedMesh> {
        let component = self.input.component;
        let fine: Vec<GridMesh> = self.grids.iter().map(|grid| mesh::divided(grid, options.mesh.subdivision)).collect();
        let input = WarpInput {
            cameras: &self.cameras.cameras,
            frames: &component.frames,
            grids: &fine,
            pairs: self.pairs,
            match_grids: self.grids,
            overlaps: self.warps,
            names: &component.names(),
            seeds: &component.seeds(),
            reference: component.reference,
            level_from_world: self.prior.level_from_world(),
            cut_yaw: self.cut.map(|cut| cut.yaw),
            turn: component.reference_rotation,
        };
        warps::run(model, &input, &options.warps, context)
    }
}
