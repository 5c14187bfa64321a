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

/// Measures how far apart matched points land, each way from one to the other as long as it is in the photographs
/// there: the root mean square of its lengths in the two. That counts a way across the stretched rows beside a sphere's
/// pole as what it shows. `None` without a match that lies in unfolded places of both. On a full turn whose ends meet,
/// distances are taken modulo its `period`.
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

/// How far apart each match of a pair lands, in the order of the matches, measured as by [`reprojection`]; not finite
/// where that is no number.
pub fn match_distances(pair: &MatchedPair, period: Option<f64>) -> impl Iterator<Item = f64> {
    pair.matches.iter().zip(panorama_ways(pair, period)).map(move |(one, way)| {
        ((squared_length_in(pair.a, one.in_a.into(), way) + squared_length_in(pair.b, one.in_b.into(), way)) / 2.0)
            .sqrt()
    })
}

/// How far apart each match of a pair lands, in the order of the matches, in pixels of the panorama; not finite where
/// that is no number.
pub fn panorama_distances(pair: &MatchedPair, period: Option<f64>) -> impl Iterator<Item = f64> {
    panorama_ways(pair, period).map(|way| way.norm())
}

/// The way from each match's place in the second photograph to that in the first, in pixels of the panorama.
fn panorama_ways(pair: &MatchedPair, period: Option<f64>) -> impl Iterator<Item = Vector2<f64>> {
    pair.matches.iter().map(move |one| {
        let way = pair.a.warp(one.in_a.into()) - pair.b.warp(one.in_b.into());
        Vector2::new(wrap_length(way.x, period), way.y)
    })
}

/// The share of the distances below the percentile, by its nearest rank.
const PERCENTILE: f64 = 0.95;

/// The square of a panorama way's length in the photograph, by what the grid does around a point; NaN where it is
/// folded.
fn squared_length_in(mesh: &GridMesh, point: Vector2<f64>, way: Vector2<f64>) -> f64 {
    let derivative = mesh.derivative(point);
    let unfolded = (derivative.determinant() > 0.0).then(|| derivative.try_inverse()).flatten();
    unfolded.map_or(f64::NAN, |photograph_from_panorama| (photograph_from_panorama * way).norm_squared())
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

    /// x to x^2 / 100, y kept: at x = 24.5 ways along x are twice as long in the photograph (1 / 0.49), at x = 75 two
    /// thirds; across, as long.
    #[test]
    fn a_way_is_as_long_as_in_the_photograph() {
        let mut mesh = GridMesh::regular(100.0, 100.0, 1.0);
        for vertex in &mut mesh.target {
            vertex[0] = vertex[0] * vertex[0] / 100.0;
        }
        let length = |x: f64, way: [f64; 2]| squared_length_in(&mesh, Vector2::new(x, 50.0), way.into()).sqrt();
        assert!((length(24.5, [0.98, 0.0]) - 2.0).abs() < 1e-9);
        assert!((length(74.5, [2.98, 0.0]) - 2.0).abs() < 1e-9);
        assert!((length(24.5, [0.0, 3.0]) - 3.0).abs() < 1e-9);
        let mut folded = mesh.clone();
        folded.target.iter_mut().for_each(|vertex| vertex[0] = -vertex[0]);
        assert!(squared_length_in(&folded, Vector2::new(24.5, 50.0), Vector2::x()).is_nan());
    }

    #[test]
    fn no_matches_have_no_figure() {
        assert_eq!(reprojection(&[], None), None);
    }
}
