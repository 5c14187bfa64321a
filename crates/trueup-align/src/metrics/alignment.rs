//! How well the photographs meet where the true cameras say that they show the same.

use nalgebra::Vector2;
use trueup_core::camera::Camera;
use trueup_core::geometry::wrap_length;
use trueup_core::mesh::GridMesh;

use super::outline::Outline;

/// Points sampled across a photograph.
const ACROSS: usize = 40;
/// Points sampled down a photograph.
const DOWN: usize = 30;
/// Distance from the border of the first and last of them, pixels.
const MARGIN_PX: f64 = 2.0;
/// Distance from the border of the other photograph beyond which a point counts as seen there: left and above, right
/// and below, pixels.
const SEEN_PX: [f64; 2] = [1.0, 2.0];
/// Overlaps with fewer sampled points are passed over.
const MIN_POINTS: usize = 20;
/// An open full turn is cut somewhere: points this share of the panorama's width apart lie at the cut and are no error.
const CUT_SHARE: f64 = 0.25;

/// Root mean square distance in the panorama between the two places of what two photographs both show, over all
/// overlapping pairs, divided by the photographs' mean scale: in their own pixels. `None` if no two photographs overlap
/// or the lists differ in length.
///
/// On a full turn whose ends meet, distances are taken modulo its `period`.
///
/// `cameras` are the true ones, of one common center, in the pixels of the grids' photographs. 40 x 30 points are
/// carried from each photograph to all later ones.
pub fn true_alignment(meshes: &[GridMesh], cameras: &[Camera], period: Option<f64>) -> Option<f64> {
    if meshes.len() != cameras.len() {
        return None;
    }
    let (low, high) = meshes.iter().map(GridMesh::bounds).reduce(|all, one| (all.0.inf(&one.0), all.1.sup(&one.1)))?;
    let cut = CUT_SHARE * (high.x - low.x);
    let (mut squares, mut count) = (0.0, 0_usize);
    for (i, mesh) in meshes.iter().enumerate() {
        for j in i + 1..meshes.len() {
            let seen: Vec<f64> = samples(mesh)
                .filter_map(|point| {
                    let there = cameras[i].transfer(&cameras[j], point)?;
                    let way = mesh.warp(point) - meshes[j].warp(there);
                    is_seen(&meshes[j], there).then(|| wrap_length(way.x, period).hypot(way.y))
                })
                .collect();
            if seen.len() >= MIN_POINTS {
                let near = seen.iter().filter(|&&distance| distance < cut);
                count += near.clone().count();
                squares += near.map(|distance| distance * distance).sum::<f64>();
            }
        }
    }
    let scale = |mesh: &GridMesh| (Outline::new(mesh).area() / (mesh.width * mesh.height)).sqrt();
    let mean_scale = meshes.iter().map(scale).sum::<f64>() / meshes.len() as f64;
    (count > 0 && mean_scale > 0.0).then(|| (squares / count as f64).sqrt() / mean_scale)
}

/// Evenly spaced points from border to border, row by row.
fn samples(mesh: &GridMesh) -> impl Iterator<Item = Vector2<f64>> + use<> {
    let [width, height] = [mesh.width, mesh.height].map(|length| (length - 2.0 * MARGIN_PX).max(0.0));
    (0..DOWN).flat_map(move |row| {
        (0..ACROSS).map(move |column| {
            let share = Vector2::new(column as f64 / (ACROSS - 1) as f64, row as f64 / (DOWN - 1) as f64);
            Vector2::new(MARGIN_PX + width * share.x, MARGIN_PX + height * share.y)
        })
    })
}

fn is_seen(mesh: &GridMesh, point: Vector2<f64>) -> bool {
    let inside = |at: f64, length: f64| at > SEEN_PX[0] && at < length - SEEN_PX[1];
    inside(point.x, mesh.width) && inside(point.y, mesh.height)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use trueup_core::geometry::rotation_about_y;

    use super::*;

    /// Two cameras 20 degrees apart, each photograph carried to the level cylinder of radius 1000 px: exact but for the
    /// bilinear interpolation in cells of 4 px.
    fn panned() -> (Vec<GridMesh>, Vec<Camera>) {
        let cameras =
            [0.0, 0.35].map(|yaw: f64| Camera::new(500.0, 400.0, 300.0, &rotation_about_y(yaw).transpose())).to_vec();
        let unrolled = |camera: &Camera| {
            let mut mesh = GridMesh::regular(400.0, 300.0, 4.0);
            mesh.target = (0..mesh.len())
                .map(|vertex| camera.world_direction(mesh.source(vertex)))
                .map(|to| [1000.0 * to.x.atan2(to.z), 1000.0 * to.y / to.x.hypot(to.z)])
                .collect();
            mesh
        };
        (cameras.iter().map(unrolled).collect(), cameras)
    }

    #[test]
    fn photographs_that_meet_have_no_error_and_a_shift_counts_in_their_own_pixels() {
        let (mut meshes, cameras) = panned();
        let exact = true_alignment(&meshes, &cameras, None).expect("an overlap");
        assert!(exact < 0.01, "{exact}");
        for vertex in &mut meshes[1].target {
            vertex[1] += 3.0;
        }
        // The cylinder doubles the pixel scale at the middle of a photograph and less elsewhere.
        let scale = (Outline::new(&meshes[0]).area() / (400.0 * 300.0)).sqrt();
        let shifted = true_alignment(&meshes, &cameras, None).expect("an overlap");
        assert!((shifted - 3.0 / scale).abs() < 0.01, "{shifted}");
        for vertex in &mut meshes[1].target {
            vertex[0] += 5000.0;
        }
        let round = true_alignment(&meshes, &cameras, Some(5000.0)).expect("an overlap");
        assert!((round - shifted).abs() < 1e-9, "{round}");
    }

    #[test]
    fn without_overlap_there_is_no_figure() {
        let (meshes, _) = panned();
        let away = [0.0, 3.0].map(|yaw: f64| Camera::new(500.0, 400.0, 300.0, &rotation_about_y(yaw).transpose()));
        assert_eq!(true_alignment(&meshes, &away, None), None);
        assert_eq!(true_alignment(&[], &[], None), None);
        assert_eq!(true_alignment(&meshes[..1], &[Camera::new(500.0, 400.0, 300.0, &Matrix3::identity())], None), None);
    }
}
