//! Long straight lines, by the direction of the scene that they point to.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueup::{ImageRecord, MeasuredLine, PhotographMeasures, Project, Result};
use trueup_core::geometry::matrix_from_rows;
use trueup_core::mesh::GridMesh;

use super::svg::{Document, Stroke, path, placed, tenths};
use crate::text::counted;

/// Width of lines, pixels of the screen.
const THIN_PX: f64 = 1.8;
/// Width of those that are bent.
const THICK_PX: f64 = 4.5;

/// A direction of the scene that lines of photographs point to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineDirection {
    /// Up and down.
    Vertical,
    /// One of two level directions, at right angles to each other: 0 or 1.
    Level(usize),
    /// None of the photograph's vanishing points.
    Other,
}

impl LineDirection {
    /// All there are, as legends list them.
    pub const ALL: [Self; 4] = [Self::Vertical, Self::Level(0), Self::Level(1), Self::Other];

    /// The color that it is drawn in.
    pub fn color(self) -> &'static str {
        match self {
            Self::Vertical => "#ff5fb0",
            Self::Level(0) => "#35d0ff",
            Self::Level(_) => "#ffd21f",
            Self::Other => "#ffffff",
        }
    }

    /// The dashes that it is drawn in, for those who do not see the color; empty for none.
    pub fn dashes(self) -> &'static str {
        match self {
            Self::Vertical => "",
            Self::Level(0) => "9 3",
            Self::Level(_) => "3 3",
            Self::Other => "1 4",
        }
    }

    /// What it is, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Vertical => "upright lines",
            Self::Level(0) => "level lines of one direction",
            Self::Level(_) => "level lines at right angles to it",
            Self::Other => "other lines",
        }
    }
}

/// What each of a photograph's three vanishing directions is in the scene. `None` without vanishing directions or a
/// rotation.
fn directions(image: &ImageRecord, dominant: Option<&[[f64; 3]; 3]>) -> Option<[LineDirection; 3]> {
    let level_from_camera = matrix_from_rows(image.rotation.as_ref()?).transpose();
    let found = image.vanishing_points?.map(|direction| level_from_camera * Vector3::from(direction));
    let upright = most(found.iter().map(|direction| direction.y.abs()))?;
    // Without directions that the photographs share, the level ones stand in their own order.
    let axes = dominant.map_or_else(Matrix3::identity, matrix_from_rows);
    let shared_upright = most((0..3).map(|axis| axes[(1, axis)].abs()))?;
    let level_axes: Vec<usize> = (0..3).filter(|&axis| axis != shared_upright).collect();
    let named = |k: usize| match k == upright {
        true => LineDirection::Vertical,
        false => {
            let nearness = level_axes.iter().map(|&axis| axes.column(axis).dot(&found[k]).abs());
            LineDirection::Level(most(nearness).unwrap_or(0))
        }
    };
    Some([0, 1, 2].map(named))
}

/// The position of the largest number.
fn most(values: impl Iterator<Item = f64>) -> Option<usize> {
    values.enumerate().max_by(|one, two| one.1.total_cmp(&two.1)).map(|(position, _)| position)
}

/// A line's direction.
fn direction_of(line: &MeasuredLine, directions: Option<[LineDirection; 3]>) -> LineDirection {
    let known = line.direction.zip(directions).and_then(|(index, directions)| directions.get(index).copied());
    known.unwrap_or(LineDirection::Other)
}

/// The long lines of the photograph at `position` of [`Project::images`], colored by the direction they point to, and
/// where upright is in its middle, with its interval of 95 %. The `viewBox` is the photograph in its own pixels.
pub fn lines_of_photograph(project: &Project, position: usize) -> Option<String> {
    let image = project.images.get(position)?;
    let measures = measures_of(project, image)?;
    let directions = directions(image, project.manhattan.dominant.as_ref());
    let mut document = Document::new([image.width, image.height], "lines");
    for line in &measures.lines {
        document.stroke(&path([line.start, line.end], usize::MAX), &stroke(direction_of(line, directions), THIN_PX));
    }
    draw_plumb_line(&mut document, image, measures);
    let label =
        format!("{} of the photograph, by the direction they point to.", counted(measures.lines.len(), "long line"));
    Some(document.finish(&label))
}

fn measures_of<'a>(project: &'a Project, image: &ImageRecord) -> Option<&'a PhotographMeasures> {
    project.measures.as_ref()?.photographs.iter().find(|one| one.path == image.path)
}

/// Draws which way is down in the photograph's middle, and the wedge that holds it with a probability of 95 %.
fn draw_plumb_line(document: &mut Document, image: &ImageRecord, measures: &PhotographMeasures) {
    /// Half its length, as a share of the photograph's shorter side.
    const REACH: f64 = 0.4;
    let (Some(gamma), Some(within)) = (measures.gamma_deg, measures.within_deg) else { return };
    let middle = Vector2::new(image.width as f64, image.height as f64) / 2.0;
    let reach = REACH * image.width.min(image.height) as f64;
    let written = |place: Vector2<f64>| format!("{} {}", tenths(place.x), tenths(place.y));
    let end = |degrees: f64, sign: f64| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        written(middle + sign * reach * Vector2::new(sine, cosine))
    };
    let center = written(middle);
    let half = |sign: f64| format!("M{center}L{}L{}Z", end(gamma - within, sign), end(gamma + within, sign));
    let wedge = format!("{}{}", half(1.0), half(-1.0));
    document.element(format_args!("<path d=\"{wedge}\" fill=\"#ffffff\" fill-opacity=\"0.35\"/>"));
    let line = format!("M{}L{}", end(gamma, -1.0), end(gamma, 1.0));
    document.stroke(&line, &Stroke { color: "#ffffff", width: THIN_PX, dashes: "" });
}

/// The long lines of all photographs where the panorama shows them, colored by the direction they point to; those that
/// are bent there are thick.
///
/// # Errors
/// [`trueup::Error::Input`] if the project's grids are damaged.
pub fn lines_of_panorama(project: &Project) -> Result<String> {
    let canvas = project.canvas;
    let mut count = 0;
    let mut document = Document::new([canvas.width, canvas.height], "lines");
    for (_, image, mesh) in placed(project)? {
        let Some(measures) = measures_of(project, image) else { continue };
        let directions = directions(image, project.manhattan.dominant.as_ref());
        for line in &measures.lines {
            let width = if line.straightness().is_bent() { THICK_PX } else { THIN_PX };
            let data = path(carried(line, &mesh), canvas.width);
            document.stroke(&data, &stroke(direction_of(line, directions), width));
        }
        count += measures.lines.len();
    }
    let label = format!("{} of the photographs on the panorama.", counted(count, "long line"));
    Ok(document.finish_around(canvas, &label))
}

/// Points of a line on the canvas.
fn carried(line: &MeasuredLine, mesh: &GridMesh) -> impl Iterator<Item = [f64; 2]> {
    /// Parts that a line is drawn in: a bend shows.
    const PARTS: usize = 24;
    let (start, end) = (Vector2::from(line.start), Vector2::from(line.end));
    (0..=PARTS).map(move |part| mesh.warp(start.lerp(&end, part as f64 / PARTS as f64)).into())
}

fn stroke(direction: LineDirection, width: f64) -> Stroke {
    Stroke { color: direction.color(), width, dashes: direction.dashes() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera turned by 90 degrees about the vertical: its z looks along the level world's x.
    #[test]
    fn directions_are_told_apart_in_the_level_world() {
        let image = serde_json::json!({"path": "a.jpg", "width": 8, "height": 6, "status": "used", "reason": "", "hint": "",
            "component": 0, "focal_px": 5.0, "rotation": [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
            "theta_deg": null, "scale": null, "gain": null, "mesh": null,
            "vanishing_points": [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]});
        let image: ImageRecord = serde_json::from_value(image).expect("a record");
        let expected = [LineDirection::Level(0), LineDirection::Vertical, LineDirection::Level(1)];
        assert_eq!(directions(&image, None), Some(expected));
        // The scene's first level axis is z: the two change places.
        let dominant = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
        let expected = [LineDirection::Level(1), LineDirection::Vertical, LineDirection::Level(0)];
        assert_eq!(directions(&image, Some(&dominant)), Some(expected));
        assert_eq!(directions(&ImageRecord { vanishing_points: None, ..image }, None), None);
    }
}
