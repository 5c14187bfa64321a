//! What a warp model refuses: photographs that it cannot place without tearing, folding or blowing them up.

use nalgebra::Vector2;
use trueup_core::camera::Camera;
use trueup_core::geometry::Homography;
use trueup_core::mesh::GridMesh;
use trueup_core::options::OptionValue;
use trueup_core::{Error, Result};

use super::input::WarpInput;
use super::options::WarpModel;
use crate::mesh::count_folds;

/// Depth, relative to the distance, below which a viewing direction counts as beside or behind the panorama's plane:
/// 88.9 degrees off its axis.
pub(super) const MIN_DEPTH: f64 = 0.02;

/// How far photographs may be deformed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Farthest that a photograph may reach from the reference's center, in diagonals of the reference.
    pub max_reach: f64,
    /// Largest area of a photograph in the panorama, in areas of the reference.
    pub max_area_ratio: f64,
    /// Largest share of a photograph's grid that may be folded.
    pub max_folded_share: f64,
}

/// Beyond these a panorama is of no use: a photograph near the plane's horizon would be most of it.
pub(super) const LIMITS: Limits = Limits { max_reach: 20.0, max_area_ratio: 25.0, max_folded_share: 0.02 };

/// What a user can do about a field of view that is too wide.
const TOO_WIDE: &str = "Use the method vpg or autostitch, or stitch fewer photographs.";
/// What a user can do where the sphere does not help either.
const TOO_STEEP: &str = "Use the method vpg, or leave this photograph out.";

/// The refusal of a set by a model. `reason` says which photograph and why; the angle that the photograph reaches is
/// added.
pub(super) fn refuse(model: WarpModel, input: &WarpInput<'_>, photograph: usize, reason: &str) -> Error {
    let angle = farthest_angle(input, photograph).to_degrees();
    let (name, reference) = (&input.names[photograph], &input.names[input.reference]);
    Error::not_applicable(
        model.display(),
        format!("{name} {reason}; it reaches {angle:.0} degrees from the axis of {reference}"),
        if model == WarpModel::Autostitch { TOO_STEEP } else { TOO_WIDE },
    )
}

/// The largest angle in radians between the reference's axis and a direction that a photograph's border sees.
pub(super) fn farthest_angle(input: &WarpInput<'_>, photograph: usize) -> f64 {
    let axis = input.cameras[input.reference].forward();
    let frame = &input.frames[photograph];
    corners(frame.width, frame.height)
        .into_iter()
        .map(|corner| input.cameras[photograph].world_direction(corner).angle(&axis))
        .fold(0.0, f64::max)
}

/// The corners of a photograph, clockwise from the top left.
pub(super) fn corners(width: f64, height: f64) -> [Vector2<f64>; 4] {
    [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)].map(|(x, y)| Vector2::new(x, y))
}

/// The homography scaled so that its denominator is the depth of a viewing direction of unit depth in the photograph:
/// what it is for `K_to R K_from^-1` with a rotation R. `None` if it mirrors or is singular.
///
/// For other homographies (parallax) the determinant defines the same scale.
pub(super) fn with_depth(homography: &Homography, focal_from: f64, focal_to: f64) -> Option<Homography> {
    let ratio = homography.0.determinant() * (focal_from / focal_to).powi(2);
    let scaled = homography.0 / ratio.cbrt();
    scaled.iter().all(|entry| entry.is_finite()).then_some(Homography(scaled))
}

/// The smallest depth over a photograph's corners, relative to the distance along the viewing direction.
///
/// `homography` as of [`with_depth`]. Where no corner is behind the plane, no point of the photograph is.
pub(super) fn least_depth(homography: &Homography, input: &WarpInput<'_>, photograph: usize) -> f64 {
    let (frame, camera) = (&input.frames[photograph], &input.cameras[photograph]);
    let depth = |corner: Vector2<f64>| depth_at(homography, camera, input.straight(photograph, corner));
    // What no pinhole sees lies behind every plane; `f64::min` would pass over it.
    let depths = corners(frame.width, frame.height).into_iter().map(depth);
    depths.map(|depth| if depth.is_nan() { f64::NEG_INFINITY } else { depth }).fold(f64::INFINITY, f64::min)
}

/// The depth of a point relative to its distance along the viewing direction; `homography` as of [`with_depth`], the
/// point as of [`WarpInput::straight`].
pub(super) fn depth_at(homography: &Homography, camera: &Camera, point: Vector2<f64>) -> f64 {
    let aside = (point - Vector2::from(camera.principal_point)) / camera.focal_px;
    homography.denominator(point) / aside.push(1.0).norm()
}

/// Refuses a homography that carries a point of an overlap behind its neighbor's plane.
pub(super) fn check_depth_in_overlap(
    model: WarpModel,
    input: &WarpInput<'_>,
    photograph: usize,
    homography: &Homography,
    overlap: &[Vector2<f64>],
) -> Result<()> {
    let camera = &input.cameras[photograph];
    match overlap.iter().all(|&point| depth_at(homography, camera, point) > MIN_DEPTH) {
        true => Ok(()),
        false => Err(refuse(model, input, photograph, "has matches that do not lie in front of its neighbor")),
    }
}

/// Refuses placed photographs that are not finite, too far away, too large or folded.
pub(super) fn check(model: WarpModel, input: &WarpInput<'_>, meshes: &[GridMesh], limits: &Limits) -> Result<()> {
    let anchor = &meshes[input.reference];
    let center = anchor.warp(Vector2::new(anchor.width / 2.0, anchor.height / 2.0));
    let area = target_area(anchor);
    // The reference's own scale in the panorama.
    let scale = (area / (anchor.width * anchor.height)).sqrt();
    let reach = limits.max_reach * anchor.width.hypot(anchor.height) * scale;
    for (photograph, mesh) in meshes.iter().enumerate() {
        let finite = mesh.target.iter().flatten().all(|coordinate| coordinate.is_finite());
        if !finite {
            return Err(refuse(model, input, photograph, "cannot be placed"));
        }
        let farthest = mesh.target.iter().map(|&vertex| (Vector2::from(vertex) - center).norm()).fold(0.0, f64::max);
        if farthest > reach {
            let reason = format!(
                "would lie {:.0} diagonals of the reference away ({} are allowed)",
                farthest / reach * limits.max_reach,
                limits.max_reach
            );
            return Err(refuse(model, input, photograph, &reason));
        }
        let growth = target_area(mesh) / area;
        if growth.is_nan() || growth > limits.max_area_ratio {
            let reason =
                format!("would be {growth:.0} times as large as the reference ({} are allowed)", limits.max_area_ratio);
            return Err(refuse(model, input, photograph, &reason));
        }
        let triangles = 2 * (mesh.rows - 1) * (mesh.columns - 1);
        let folded = count_folds(mesh);
        if folded as f64 > limits.max_folded_share * triangles as f64 {
            let percent = 100.0 * folded as f64 / triangles as f64;
            return Err(refuse(model, input, photograph, &format!("would be folded over {percent:.0} % of it")));
        }
    }
    Ok(())
}

/// Area of a grid in the panorama: over its cells the sum of the areas, whatever their orientation.
fn target_area(mesh: &GridMesh) -> f64 {
    let vertex = |row: usize, column: usize| Vector2::from(mesh.target[row * mesh.columns + column]);
    (0..mesh.rows - 1)
        .flat_map(|row| (0..mesh.columns - 1).map(move |column| (row, column)))
        .map(|(row, column)| {
            // Area of a quadrilateral from its diagonals.
            let falling = vertex(row + 1, column + 1) - vertex(row, column);
            let rising = vertex(row, column + 1) - vertex(row + 1, column);
            0.5 * falling.perp(&rising).abs()
        })
        .sum()
}
