//! Light that depends on the place alone, worked out once per scene: windows, lamps, sky and what walls return.
//!
//! Every face carries a grid of irradiance, the same from every camera. Each grid point gathers with one pattern of
//! directions, turned by a hash of its index, and neighbors are averaged. Direct sun is left to the renderer, whose
//! shadow edges are finer than the grid.

mod direct;
mod grid;
mod grid_point;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::bvh::{Ray, SURFACE_OFFSET_M};
use crate::color::Rgb;
use crate::dice::{mix, unit_of};
use crate::scene::unlit::UnlitScene;
use crate::solid::Solid;
use direct::direct_light;
use grid::{binomial, grid_points, spread};
use grid_point::{GridPoint, importance};

/// Grid points keep this distance from a face's border, metres: right in a corner everything is dark.
const BORDER_M: f64 = 0.015;

/// How finely light is worked out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LightDetail {
    /// Distance of grid points, metres.
    pub(crate) spacing_m: f64,
    /// Directions gathered in the last pass; the first takes half.
    pub(crate) directions: usize,
    /// Directions gathered at least, where it matters little.
    pub(crate) least_directions: usize,
    /// Samples along each side of a portal.
    pub(crate) portal_samples: usize,
}

#[derive(Debug, Clone, Copy)]
struct Grid {
    start: usize,
    columns: usize,
    rows: usize,
}

/// Irradiance over all faces.
#[derive(Debug, Clone, Default)]
pub(crate) struct LightField {
    /// Six a body; unused faces have no columns.
    grids: Vec<[Option<Grid>; 6]>,
    values: Vec<Vector3<f32>>,
}

/// By how much the patterns of directions are thinned for places that matter less.
const THINNING: [usize; 3] = [1, 3, 8];

impl LightField {
    /// Irradiance at chart position (s, t) of a face.
    pub(crate) fn at(&self, solid: usize, face: usize, [s, t]: [f64; 2]) -> Rgb {
        let Some(grid) = self.grids.get(solid).and_then(|grids| grids[face]) else { return Rgb::zeros() };
        let (x, y) = (s.clamp(0.0, 1.0) * (grid.columns - 1) as f64, t.clamp(0.0, 1.0) * (grid.rows - 1) as f64);
        let (column, row) = ((x as usize).min(grid.columns - 2), (y as usize).min(grid.rows - 2));
        let (u, v) = ((x - column as f64) as f32, (y - row as f64) as f32);
        let value = |dx: usize, dy: usize| self.values[grid.start + (row + dy) * grid.columns + column + dx];
        let top = value(0, 0) * (1.0 - u) + value(1, 0) * u;
        let bottom = value(0, 1) * (1.0 - u) + value(1, 1) * u;
        (top * (1.0 - v) + bottom * v).map(f64::from)
    }

    /// Works the light of a scene out.
    pub(crate) fn gather(scene: &UnlitScene, detail: &LightDetail) -> Self {
        let mut field = Self::laid_out(&scene.solids, detail);
        let places = field.places(scene);
        let direct: Vec<(Rgb, Rgb)> =
            places.par_iter().map(|place| direct_light(scene, place, detail.portal_samples)).collect();
        let albedo = mean_albedo(scene);
        field.fill(&places, direct.iter().map(|(portals, sun)| portals + sun));
        for directions in [detail.directions / 2, detail.directions] {
            let patterns =
                THINNING.map(|thinning| cosine_pattern((directions / thinning).max(detail.least_directions)));
            let bounced: Vec<Rgb> = places
                .par_iter()
                .enumerate()
                .map(|(index, place)| field.bounced(scene, place, index, &patterns[place.pattern], &albedo))
                .collect();
            let with_sun = directions < detail.directions;
            let total = bounced
                .iter()
                .zip(&direct)
                .map(|(bounced, (portals, sun))| bounced + portals + if with_sun { *sun } else { Rgb::zeros() });
            field.fill(&places, total);
            field.smooth();
        }
        field
    }

    fn laid_out(solids: &[Solid], detail: &LightDetail) -> Self {
        let mut field = Self { grids: Vec::with_capacity(solids.len()), values: Vec::new() };
        let mut start = 0;
        for solid in solids {
            let mut grids = [None; 6];
            for &face in solid.used_faces() {
                let [columns, rows] = solid.face_size(face).map(|size| grid_points(size, detail.spacing_m));
                grids[face] = Some(Grid { start, columns, rows });
                start += columns * rows;
            }
            field.grids.push(grids);
        }
        field.values = vec![Vector3::zeros(); start];
        field
    }

    fn places(&self, scene: &UnlitScene) -> Vec<GridPoint> {
        let mut places = Vec::with_capacity(self.values.len());
        let eye = Vector3::from(scene.viewpoint.eye);
        for (solid, grids) in scene.solids.iter().zip(&self.grids) {
            for (face, grid) in grids.iter().enumerate() {
                let Some(grid) = grid else { continue };
                let border = solid.face_size(face).map(|size| (BORDER_M / size).min(0.25));
                for row in 0..grid.rows {
                    for column in 0..grid.columns {
                        let s = (column as f64 / (grid.columns - 1) as f64).clamp(border[0], 1.0 - border[0]);
                        let t = (row as f64 / (grid.rows - 1) as f64).clamp(border[1], 1.0 - border[1]);
                        let (point, normal) = solid.at_chart(face, s, t);
                        let normal = solid.to_world(normal);
                        let point = solid.center + solid.to_world(point) + normal * (10.0 * SURFACE_OFFSET_M);
                        let buried = scene.hierarchy.covers(&scene.solids, point);
                        places.push(GridPoint { point, normal, buried, pattern: importance(point, normal, eye) });
                    }
                }
            }
        }
        places
    }

    /// Stores values; points buried in other bodies take the mean of their neighbors, so that no dark rim shows.
    fn fill(&mut self, places: &[GridPoint], values: impl Iterator<Item = Rgb>) {
        for (stored, value) in self.values.iter_mut().zip(values) {
            *stored = value.map(|channel| channel as f32);
        }
        // Faces that lie wholly in others show only where these are thin: half the scene's mean light will do.
        let lit = places.iter().filter(|place| !place.buried).count().max(1);
        let dim = self.values.iter().sum::<Vector3<f32>>() * (0.5 / lit as f32);
        for grid in self.grids.iter().flatten().flatten() {
            let mut known: Vec<bool> =
                places[grid.start..grid.start + grid.columns * grid.rows].iter().map(|place| !place.buried).collect();
            let values = &mut self.values[grid.start..grid.start + known.len()];
            if known.iter().all(|&known| !known) {
                values.fill(dim);
                continue;
            }
            while known.iter().any(|&known| !known) {
                known = spread(values, &known, grid.columns);
            }
        }
    }

    /// Averages neighboring grid points of a face with binomial weights.
    fn smooth(&mut self) {
        const PASSES: usize = 2;
        for grid in self.grids.iter().flatten().flatten() {
            let values = &mut self.values[grid.start..grid.start + grid.columns * grid.rows];
            for _ in 0..PASSES {
                for row in values.chunks_exact_mut(grid.columns) {
                    binomial(row, 1);
                }
                for column in 0..grid.columns {
                    binomial(&mut values[column..], grid.columns);
                }
            }
        }
    }

    /// Light that other surfaces return, and under the open sky the sky's.
    fn bounced(
        &self,
        scene: &UnlitScene,
        place: &GridPoint,
        index: usize,
        pattern: &[Vector3<f64>],
        albedo: &[[Rgb; 6]],
    ) -> Rgb {
        const SKY_BLUR: f64 = 0.2;
        if place.buried {
            return Rgb::zeros();
        }
        let (tangent, bitangent) = tangents(place.normal);
        let (sine, cosine) = (std::f64::consts::TAU * unit_of(mix(index as u64))).sin_cos();
        let (tangent, bitangent) = (tangent * cosine + bitangent * sine, bitangent * cosine - tangent * sine);
        let mut sum = Rgb::zeros();
        for local in pattern {
            let direction = tangent * local.x + bitangent * local.y + place.normal * local.z;
            let ray = Ray::new(place.point, direction);
            if let Some((solid, entry)) = scene.hierarchy.nearest(&ray, f64::INFINITY) {
                let body = &scene.solids[solid];
                let at = body.to_body(place.point + direction * entry.distance - body.center);
                let (chart, _) = body.chart(entry.face, at);
                sum += albedo[solid][entry.face].component_mul(&self.at(solid, entry.face, chart));
            } else if scene.portals.is_empty() {
                // Indoors the sky comes through the portals, sampled directly.
                sum += scene.sky.radiance(direction, SKY_BLUR) * std::f64::consts::PI;
            }
        }
        sum / pattern.len() as f64
    }
}

/// The mean albedo of every face, for the light it returns.
fn mean_albedo(scene: &UnlitScene) -> Vec<[Rgb; 6]> {
    const SIDE: usize = 4;
    let solid_albedo = |solid: &Solid| {
        let mut means = [Rgb::zeros(); 6];
        for &face in solid.used_faces() {
            let sum: Rgb = (0..SIDE * SIDE)
                .map(|k| {
                    let (s, t) = (((k % SIDE) as f64 + 0.5) / SIDE as f64, ((k / SIDE) as f64 + 0.5) / SIDE as f64);
                    let (point, _) = solid.at_chart(face, s, t);
                    let blur = 0.5 * solid.half.amin().min(0.05);
                    scene.materials[solid.faces[face]].albedo(&solid.spot(face, point, [s, t], blur))
                })
                .sum();
            means[face] = sum / (SIDE * SIDE) as f64;
        }
        means
    };
    scene.solids.par_iter().map(solid_albedo).collect()
}

/// Directions about z with density proportional to their cosine: the Hammersley points on Malley's disc.
fn cosine_pattern(count: usize) -> Vec<Vector3<f64>> {
    (0..count)
        .map(|k| {
            let radius = ((k as f64 + 0.5) / count as f64).sqrt();
            let turn = f64::from((k as u32).reverse_bits()) / 4_294_967_296.0;
            let (sine, cosine) = (turn * std::f64::consts::TAU).sin_cos();
            Vector3::new(radius * cosine, radius * sine, (1.0 - radius * radius).sqrt())
        })
        .collect()
}

/// Two unit vectors that complete a normal to a frame.
pub(crate) fn tangents(normal: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if normal.y.abs() < 0.9 { Vector3::y() } else { Vector3::x() };
    let tangent = helper.cross(&normal).normalize();
    (tangent, normal.cross(&tangent))
}
