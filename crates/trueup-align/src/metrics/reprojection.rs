//! How well matched points meet in the panorama.

use nalgebra::Vector2;
use trueup_core::geometry::wrap_length;
use trueup_core::matches::PointMatch;
use trueup_core::mesh::GridMesh;

/// Distances of matched points in the panorama, in the photographs' own pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reprojection {
    /// Matches measured.
    pub matches: usize,
    /// Mean distance.
    pub mean_px: f64,
    /// Root mean square distance.
    pub rms_px: f64,
    /// 95 of 100 are not farther apart.
    pub percentile_95_px: f64,
}

/// The matches of one pair of photographs, in the pixels that the grids lie over.
#[derive(Debug, Clone)]
pub struct MatchedPair<'a> {
    /// The first photograph's grid.
    pub a: &'a GridMesh,
    /// The second photograph's grid.
    pub b: &'a GridMesh,
    /// The matches.
    pub matches: Vec<PointMatch>,
}

/// Measures how far apart matched points land, each distance divided by the local scale there, the root mean square of
/// the two photographs' own. `None` without a match that lies in unfolded places of both. On a full turn whose ends
/// meet, distances are taken modulo its `period`.
pub fn reprojection(pairs: &[MatchedPair], period: Option<f64>) -> Option<Reprojection> {
    let mut distances: Vec<f64> =
        pairs.iter().flat_map(|pair| match_distances(pair, period)).filter(|distance| distance.is_finite()).collect();
    if distances.is_empty() {
        return None;
    }
    distances.sort_by(f64::total_cmp);
    let count = distances.len() as f64;
    let rank = (PERCENTILE * count).ceil() as usize;
    Some(Reprojection {
        matches: distances.len(),
        mean_px: distances.iter().sum::<f64>() / count,
        rms_px: (distances.iter().map(|distance| distance * distance).sum::<f64>() / count).sqrt(),
        percentile_95_px: distances[rank.clamp(1, distances.len()) - 1],
    })
}

/// How far apart each match of a pair lands, in the order of the matches, measured as by [`reprojection`]; not finite where
/// that is no number.
pub fn match_distances(pair: &MatchedPair, period: Option<f64>) -> impl Iterator<Item = f64> {
    let scale = |one: &PointMatch| {
        ((squared_scale(pair.a, one.in_a.into()) + squared_scale(pair.b, one.in_b.into())) / 2.0).sqrt()
    };
    pair.matches.iter().zip(panorama_distances(pair, period)).map(move |(one, distance)| distance / scale(one))
}

/// How far apart each match of a pair lands, in the order of the matches, in pixels of the panorama; not finite where that is no number.
pub fn panorama_distances(pair: &MatchedPair, period: Option<f64>) -> impl Iterator<Item = f64> {
    pair.matches.iter().map(move |one| {
        let way = pair.a.warp(one.in_a.into()) - pair.b.warp(one.in_b.into());
        wrap_length(way.x, period).hypot(way.y)
    })
}

/// The share of the distances below the percentile, by its nearest rank.
const PERCENTILE: f64 = 0.95;

/// How much the grid magnifies areas at a point of the photograph; NaN where it is folded.
fn squared_scale(mesh: &GridMesh, point: Vector2<f64>) -> f64 {
    let area = mesh.derivative(point).determinant();
    if area > 0.0 { area } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grids of twice the photographs' size, the second shifted by what the match is off.
    #[test]
    fn distances_are_in_the_photographs_own_pixels() {
        let mut a = GridMesh::regular(100.0, 100.0, 10.0);
        for vertex in &mut a.target {
            *vertex = [2.0 * vertex[0], 2.0 * vertex[1]];
        }
        let b = a.clone();
        // 20 matches, off by 1 .. 20 px: mean 10.5, mean square 143.5, the 19th of 20 is 19.
        let matches = (1..=20).map(|k| PointMatch { in_a: [50.0, 37.0], in_b: [50.0, 37.0 + f64::from(k)] }).collect();
        let found = reprojection(&[MatchedPair { a: &a, b: &b, matches }], None).expect("twenty matches");
        assert_eq!(found.matches, 20);
        assert!((found.mean_px - 10.5).abs() < 1e-9);
        assert!((found.rms_px - 143.5_f64.sqrt()).abs() < 1e-9);
        assert!((found.percentile_95_px - 19.0).abs() < 1e-9);
    }

    /// x to x^2 / 100, y kept: at x = 25 areas are halved, at x = 75 enlarged by one and a half.
    #[test]
    fn the_scale_is_that_of_the_place() {
        let mut mesh = GridMesh::regular(100.0, 100.0, 1.0);
        for vertex in &mut mesh.target {
            vertex[0] = vertex[0] * vertex[0] / 100.0;
        }
        assert!((squared_scale(&mesh, Vector2::new(24.5, 50.0)) - 0.49).abs() < 1e-9);
        assert!((squared_scale(&mesh, Vector2::new(74.5, 50.0)) - 1.49).abs() < 1e-9);
    }

    #[test]
    fn no_matches_have_no_figure() {
        assert_eq!(reprojection(&[], None), None);
    }
}
