//! A panorama's geometry and photographs, found again from its project.

use std::path::Path;

use trueup_align::metrics::without_torn_cells;
use trueup_compose::crop::Crop;
use trueup_compose::exposure::{Correction, Corrections};
use trueup_compose::layout::{CanvasLayout, Placed};
use trueup_core::geometry::Homography;
use trueup_core::mesh::GridMesh;
use trueup_core::source::{SourceImage, StackMember};
use trueup_core::{Error, Result, StageContext};
use trueup_io::source::{self, RejectedSource, SourceOptions};

use super::paths::place_of;
use super::projection::{FARTHEST_PX, ProjectionRecord};
use super::record::{Canvas, ImageRecord, MeshRecord, Project, StackMemberRecord};

/// What a project must be to be read again.
const AS_WRITTEN: &str = "Give a project file as `trueup stitch --project` wrote it.";
/// Vertices may lie this far beyond the canvas that is recorded with them, which is rounded to whole pixels.
const ROUNDED_PX: f64 = 1.0;
/// Largest distance of a grid's recorded sources from an even grid, relative to the photograph's longer side: what
/// rounding leaves.
const EVEN: f64 = 1e-6;

/// Recorded focal lengths, in longer sides of the photograph: ten times beyond what cameras are estimated at, so that a
/// record of any program passes, and one that no lens has does not.
const FOCAL: std::ops::RangeInclusive<f64> = 0.03..=100.0;

/// What a project says of its panorama's geometry, checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Recorded {
    /// Positions in [`Project::images`] of the photographs in the panorama.
    pub used: Vec<usize>,
    /// The canvas; photographs are numbered by their place in `used`.
    pub layout: CanvasLayout,
    /// What evens out their light.
    pub corrections: Corrections,
    /// The reference's place in `used`.
    pub reference: usize,
}

impl Recorded {
    /// Reads the geometry of `project`, which may have been edited to anything.
    ///
    /// # Errors
    /// [`Error::Options`]; [`Error::Input`] if grids, corrections, canvas or reference are missing or cannot be.
    pub(crate) fn new(project: &Project) -> Result<Self> {
        project.options.validate()?;
        let used = project.used_positions();
        let records: Vec<&ImageRecord> = project.used_images().collect();
        if used.is_empty() {
            return Err(Error::input("the project", "it uses no photographs", AS_WRITTEN));
        }
        let reference = records.iter().position(|record| record.path == project.reference).ok_or_else(|| {
            Error::input(&project.reference, "it is the reference, but none of the photographs used", AS_WRITTEN)
        })?;
        records.iter().try_for_each(|record| record.check_focal().and_then(|()| check_stack(record)))?;
        let mut meshes = records.iter().map(|record| solved_grid(record)).collect::<Result<Vec<_>>>()?;
        let corrections = recorded_corrections(project, &records)?;
        if !project.light.is_none_or(|range| range.is_sound()) {
            return Err(Error::input("the project", "its range of light is none", AS_WRITTEN));
        }
        check_projection(project)?;
        if !project.by_cameras.is_none_or(|plane| plane.is_sound()) {
            return Err(Error::input("the project", "its plane of directions is none", AS_WRITTEN));
        }
        let mut canvas = project.solved_canvas();
        // Earlier versions recorded a cropped canvas in place of the whole one.
        let may_be_a_part = project.projection.is_none() && project.mesh_canvas.is_none();
        if may_be_a_part && project.options.arrange.canvas.crop != Crop::None {
            canvas = whole_canvas(&mut meshes, canvas);
        }
        let (width, height) = (canvas.width, canvas.height);
        let is_stray = |mesh: &GridMesh| is_stray(mesh, canvas);
        let pixels = width as f64 * height as f64;
        let strays = meshes.iter().any(is_stray);
        // No canvas reaches beyond all grids by more than a part of a pixel.
        let reach =
            |axis: usize| meshes.iter().map(|mesh| mesh.bounds().1[axis]).fold(0.0, f64::max).ceil() + ROUNDED_PX;
        let empty = (!canvas.full_turn && width as f64 > reach(0)) || height as f64 > reach(1);
        if pixels < 1.0 || pixels > project.options.arrange.canvas.max_pixels || strays || empty {
            let reason = format!("the canvas of {width} x {height} px does not belong to the grids");
            return Err(Error::input("the project", reason, AS_WRITTEN));
        }
        let placed = meshes.into_iter().enumerate().map(|(photograph, mesh)| Placed { photograph, mesh }).collect();
        let period = canvas.full_turn.then_some(width);
        let layout = CanvasLayout { width, height, canvas_from_target: 1.0, origin: [0.0; 2], placed, period };
        Ok(Self { used, layout, corrections, reference })
    }
}

/// Whether a grid lies beyond the canvas; on a full turn, it may lie beyond its ends by less than a turn.
fn is_stray(mesh: &GridMesh, canvas: Canvas) -> bool {
    let (width, height) = (canvas.width as f64, canvas.height as f64);
    let turn = canvas.period().unwrap_or(0.0);
    let (low, high) = mesh.bounds();
    low.x < -ROUNDED_PX - turn
        || high.x > width + ROUNDED_PX + turn
        || low.y < -ROUNDED_PX
        || high.y > height + ROUNDED_PX
}

/// All that grids cover of which `part` is recorded, and the grids moved there; of a full turn, rows alone were cut
/// off.
fn whole_canvas(meshes: &mut [GridMesh], part: Canvas) -> Canvas {
    if !meshes.iter().any(|mesh| is_stray(mesh, part)) {
        return part;
    }
    let bounds: Vec<_> = meshes.iter().map(GridMesh::bounds).collect();
    let axes = |axis: usize, length: usize| {
        let low = bounds.iter().map(|(low, _)| low[axis]).fold(0.0, f64::min).floor();
        let high = bounds.iter().map(|(_, high)| high[axis]).fold(length as f64, f64::max).ceil();
        // The casts saturate.
        (-low, (high - low) as usize)
    };
    let (left, width) = if part.full_turn { (0.0, part.width) } else { axes(0, part.width) };
    let (top, height) = axes(1, part.height);
    for vertex in meshes.iter_mut().flat_map(|mesh| &mut mesh.target) {
        *vertex = [vertex[0] + left, vertex[1] + top];
    }
    Canvas { width, height, ..part }
}

/// The grids of used photographs over the original photographs, in the panorama, without cells that are torn.
///
/// # Errors
/// [`Error::Input`] if one is missing or damaged, or the recorded projection is.
pub(crate) fn whole_grids(project: &Project, records: &[&ImageRecord]) -> Result<Vec<GridMesh>> {
    check_projection(project)?;
    let turn = project.projection.as_ref().and_then(ProjectionRecord::turn_px);
    records.iter().map(|record| Ok(without_torn_cells(&record.grid()?, turn))).collect()
}

/// Refuses a projection by which nothing can have been drawn: its scale divides, and a turn of no length has no end.
fn check_projection(project: &Project) -> Result<()> {
    match project.projection.is_none_or(|projection| projection.is_sound()) {
        true => Ok(()),
        false => Err(Error::input(
            "the project",
            "its projection is damaged: no panorama is of such a scale or place",
            AS_WRITTEN,
        )),
    }
}

impl ImageRecord {
    /// Refuses a focal length that no photograph can have: projections would become of any size.
    ///
    /// # Errors
    /// [`Error::Input`] if that is recorded.
    pub(crate) fn check_focal(&self) -> Result<()> {
        let longer = self.width.max(self.height) as f64;
        match self.focal_px {
            Some(focal_px) if !FOCAL.contains(&(focal_px / longer)) => {
                let reason = format!("its recorded focal length of {focal_px} px cannot be");
                Err(Error::input(&self.path, reason, AS_WRITTEN))
            }
            _ => Ok(()),
        }
    }

    /// The grid of a photograph in use over the original photograph, in the panorama. Vertices for which a projection
    /// has no place are NaN.
    ///
    /// # Errors
    /// [`Error::Input`] if it is missing or damaged.
    pub fn grid(&self) -> Result<GridMesh> {
        /// Why a grid may be missing, and what helps.
        const COMPOSE_AGAIN: &str = "If an earlier version wrote the project, compose it again with `--project`.";
        let missing = || Error::input(&self.path, "the project holds no grid of it in the panorama", COMPOSE_AGAIN);
        grid(self, self.mesh.as_ref().ok_or_else(missing)?)
    }
}

/// The grid of a photograph in use as it was solved: all of it is defined.
fn solved_grid(record: &ImageRecord) -> Result<GridMesh> {
    let missing = || Error::input(&record.path, "the project holds no grid of it", AS_WRITTEN);
    let solved = grid(record, record.solved_mesh.as_ref().or(record.mesh.as_ref()).ok_or_else(missing)?)?;
    match (0..solved.len()).all(|vertex| solved.is_defined(vertex)) {
        true => Ok(solved),
        false => Err(Error::input(&record.path, "vertices of its grid are missing", AS_WRITTEN)),
    }
}

fn grid(record: &ImageRecord, mesh: &MeshRecord) -> Result<GridMesh> {
    let damaged = |reason: String| Error::input(&record.path, reason, AS_WRITTEN);
    if !is_whole(mesh, record.width, record.height) {
        return Err(damaged(format!(
            "its grid of {} x {} with {} vertices over {} x {} px is damaged",
            mesh.rows,
            mesh.cols,
            mesh.target.len(),
            record.width,
            record.height
        )));
    }
    let (width, height) = (record.width as f64, record.height as f64);
    Ok(GridMesh { rows: mesh.rows, columns: mesh.cols, width, height, target: mesh.target.clone(), lines: None })
}

fn is_whole(mesh: &MeshRecord, width: usize, height: usize) -> bool {
    let counted = mesh.rows >= 2
        && mesh.cols >= 2
        && mesh.rows.checked_mul(mesh.cols) == Some(mesh.target.len())
        && mesh.source.len() == mesh.target.len()
        && width.min(height) > 0;
    let is_place = |place: &[f64; 2]| {
        place.iter().all(|coordinate| coordinate.abs() <= FARTHEST_PX) || place.iter().all(|one| one.is_nan())
    };
    if !counted || !mesh.target.iter().all(is_place) {
        return false;
    }
    let (width, height) = (width as f64, height as f64);
    let even = GridMesh { rows: mesh.rows, columns: mesh.cols, width, height, target: Vec::new(), lines: None };
    let tolerance = EVEN * width.max(height);
    let is_even = |(vertex, source): (usize, &[f64; 2])| {
        let expected = even.source(vertex);
        (0..2).all(|axis| (source[axis] - expected[axis]).abs() <= tolerance)
    };
    mesh.source.iter().enumerate().all(is_even)
}

/// Whether a project says what evens out the light of its photographs.
pub(crate) fn knows_light(project: &Project) -> bool {
    project.used_images().any(|record| record.correction.is_some() || record.gain.is_some())
}

/// What evens out the light of used photographs, the `records` of `project`; gains alone in files of programs that knew
/// no more.
///
/// # Errors
/// [`Error::Input`] if one is no positive factor on light.
pub(crate) fn recorded_corrections(project: &Project, records: &[&ImageRecord]) -> Result<Corrections> {
    let correction = |record: &&ImageRecord| {
        let correction = record.correction.unwrap_or(Correction::uniform(record.gain.unwrap_or(1.0)));
        let damaged = |_| Error::input(&record.path, "its recorded gains are no positive factors on light", AS_WRITTEN);
        correction.check().map_err(damaged).map(|()| correction)
    };
    let photographs = records.iter().map(correction).collect::<Result<_>>()?;
    Ok(Corrections { response: project.response, photographs })
}

/// The file of a recorded photograph, checked to be of its size: beside the project file as recorded, as recorded from
/// the current folder, or beside the project file by its name alone. So are the other exposures of its stack.
///
/// # Errors
/// [`Error::Input`] if there is none, it cannot be read or has another size; [`Error::Options`]; [`Error::Cancelled`].
pub(crate) fn find_photograph(
    record: &ImageRecord,
    project_folder: &Path,
    options: &SourceOptions,
    context: &StageContext,
) -> Result<SourceImage> {
    let find = |path: &str| as_recorded(find_file(path, project_folder, options, context)?, record);
    let mut image = find(&record.path)?;
    for member in &record.stack {
        let source = find(&member.path)?;
        image.stack.push(StackMember { source, reference_from_member: member.reference_from_member });
    }
    Ok(image)
}

/// The file of a recorded path, at its [place](place_of).
///
/// # Errors
/// [`Error::Input`] if there is none or it cannot be read; [`Error::Options`]; [`Error::Cancelled`].
pub(crate) fn find_file(
    recorded: &str,
    project_folder: &Path,
    options: &SourceOptions,
    context: &StageContext,
) -> Result<SourceImage> {
    let Some(path) = place_of(recorded, project_folder) else {
        // What a name has in place of bytes that are no UTF-8: no file is called so.
        if recorded.contains(char::REPLACEMENT_CHARACTER) {
            let reason = "photograph not found: its name is no UTF-8, and a project cannot hold such a name";
            return Err(Error::input(
                recorded,
                reason,
                "Give the folder that holds it, or rename it and stitch again.",
            ));
        }
        return Err(Error::input(
            recorded,
            "photograph not found, neither here nor beside the project file",
            "Run the command in the folder that the stitch was made in.",
        ));
    };
    let path = path.display().to_string();
    let mut found = source::scan(std::slice::from_ref(&path), options, context)?;
    let Some(image) = found.photographs.pop() else {
        return Err(found.rejected.first().map_or_else(
            || Error::input(&path, "it cannot be read", "Check the file and its permissions."),
            RejectedSource::to_error,
        ));
    };
    Ok(image)
}

/// Farthest that a recorded homography may take a corner from its place, in longer sides: what is aligned stays within
/// a tenth, so that a record of any program passes, and one that no camera can have turned by does not.
const FARTHEST_TURN: f64 = 0.5;

/// Refuses homographies that are none of two exposures of one view.
fn check_stack(record: &ImageRecord) -> Result<()> {
    let (width, height) = (record.width as f64, record.height as f64);
    let is_sound = |member: &StackMemberRecord| {
        let map = Homography::from_rows(&member.reference_from_member);
        let is_near = |corner: [f64; 2]| {
            let corner = corner.into();
            map.denominator(corner) > 0.0 && (map.apply(corner) - corner).norm() <= FARTHEST_TURN * width.max(height)
        };
        [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]].into_iter().all(is_near) && map.inverse().is_some()
    };
    match record.stack.iter().find(|member| !is_sound(member)) {
        Some(member) => {
            let reason = format!("it does not lie on {} by its recorded homography", record.path);
            Err(Error::input(&member.path, reason, AS_WRITTEN))
        }
        None => Ok(()),
    }
}

/// The recorded photograph in the picture `image`.
///
/// # Errors
/// [`Error::Input`] if the picture has another size than the recorded one.
pub(crate) fn as_recorded(image: SourceImage, record: &ImageRecord) -> Result<SourceImage> {
    let [width, height] = record.inset.outer([record.width, record.height]);
    let other_size =
        format!("it is {} x {} px, the project has it at {width} x {height} px", image.width, image.height);
    let path = image.path.display().to_string();
    let is_same = [image.width, image.height] == [width, height];
    let inside = if is_same { image.inside(record.inset) } else { None };
    let inside =
        inside.map(|image| SourceImage { outline: record.outline.clone(), carrier: record.carrier.clone(), ..image });
    inside.ok_or_else(|| Error::input(path, other_size, "Give back the photograph that was stitched."))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::{Value, json};
    use trueup_compose::{layout, render};
    use trueup_core::raster::{Photograph, Raster};
    use trueup_core::source::PhotographSource;

    use super::*;

    /// Two photographs of 8 x 6 pixels side by side, as a project.
    fn project() -> Value {
        let image = |path: &str, left: f64| {
            let even: Vec<[f64; 2]> = GridMesh::regular(8.0, 6.0, 4.0).target;
            let target: Vec<[f64; 2]> = even.iter().map(|vertex| [vertex[0] + left, vertex[1]]).collect();
            json!({
                "path": path, "width": 8, "height": 6, "status": "used", "reason": "", "hint": "",
                "gain": 1.1, "correction": {"gain": [1.1, 1.0, 0.9], "vignetting": [0.1, 0.0, 0.0]},
                "mesh": {"rows": 3, "cols": 3, "source": even, "target": target}
            })
        };
        json!({
            "format": "trueup-project", "version": 1, "method": "vpg", "options": {}, "reference": "b.jpg",
            "images": [image("a.jpg", 0.0), image("b.jpg", 5.5)], "pairs": [],
            "manhattan": {"threshold": 0.1, "accepted": false, "inliers": []},
            "canvas": {"width": 14, "height": 6}, "response": [0.1, 0.2, -0.1, 0.05], "seconds": {}, "diagnostics": []
        })
    }

    fn read(project: &Value) -> Result<(Project, Recorded)> {
        let project = Project::from_json(&project.to_string(), "p.json")?;
        let recorded = Recorded::new(&project)?;
        Ok((project, recorded))
    }

    /// Gray photographs of the size that is asked for.
    struct Plain(Vec<[usize; 2]>);

    impl PhotographSource for Plain {
        fn photograph(&self, index: usize) -> Result<Photograph> {
            let [width, height] = self.0[index];
            Ok(Photograph::Eight(Raster::new(width, height, 1)))
        }
    }

    #[test]
    fn a_project_is_read_as_it_was_written() {
        let (_, recorded) = read(&project()).expect("whole");
        assert_eq!((recorded.used, recorded.reference), (vec![0, 1], 1));
        assert_eq!((recorded.layout.width, recorded.layout.height), (14, 6));
        assert_eq!(recorded.layout.placed[1].mesh.target[4], [9.5, 3.0]);
        assert_eq!(recorded.corrections.photographs[0].gain, [1.1, 1.0, 0.9]);
        assert_eq!(recorded.corrections.response.coefficients, [0.1, 0.2, -0.1, 0.05]);
        let mut older = project();
        older.as_object_mut().expect("an object").remove("response");
        let (_, recorded) = read(&older).expect("whole");
        assert!(recorded.corrections.response.is_plain());
    }

    /// Version 1 recorded the solved grids, whatever the panorama was drawn on: such a file can be composed, but holds
    /// no grids of the panorama.
    #[test]
    fn a_projection_of_version_1_has_solved_grids_alone() {
        let mut older = project();
        older["projection"] = json!({
            "kind": "perspective", "yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": 0.0, "panini_distance": 1.0,
            "px_per_radian": 100.0, "origin": [-0.1, -0.1], "sphere": null
        });
        older["mesh_canvas"] = older["canvas"].take();
        older["canvas"] = json!({"width": 30, "height": 9});
        let (read, recorded) = read(&older).expect("whole");
        assert_eq!((recorded.layout.width, recorded.layout.placed[1].mesh.target[4]), (14, [9.5, 3.0]));
        let refused = read.images[0].grid().expect_err("no grid of the panorama").to_string();
        assert!(refused.contains("compose it again"), "{refused}");
    }

    /// A scale of 0 divides places by nothing, and a turn of no length is searched for its end forever.
    #[test]
    fn a_projection_without_a_scale_is_refused() {
        let with = |scale: f64, origin: f64| {
            let mut drawn = project();
            drawn["projection"] = json!({
                "kind": "equirectangular", "yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": 0.0, "panini_distance": 1.0,
                "px_per_radian": scale, "origin": [origin, -0.1], "sphere": null
            });
            drawn["mesh_canvas"] = drawn["canvas"].clone();
            drawn
        };
        assert!(read(&with(100.0, -0.1)).is_ok());
        for (scale, origin) in [(0.0, -0.1), (-100.0, -0.1), (1e-9, -0.1), (1e300, -0.1), (100.0, 1e300)] {
            let refused = read(&with(scale, origin)).expect_err("no scale").to_string();
            assert!(refused.contains("its projection is damaged"), "{scale} {origin}: {refused}");
            let damaged = Project::from_json(&with(scale, origin).to_string(), "p.json").expect("a project");
            let records: Vec<&ImageRecord> = damaged.used_images().collect();
            let refused = whole_grids(&damaged, &records).expect_err("no scale").to_string();
            assert!(refused.contains("its projection is damaged"), "{scale} {origin}: {refused}");
        }
    }

    /// A vertex that the projection has no place for is written as null and read as no number.
    #[test]
    fn vertices_without_a_place_are_kept() {
        let (mut project, _) = read(&project()).expect("whole");
        project.images[0].solved_mesh = project.images[0].mesh.clone();
        project.images[0].mesh.as_mut().expect("a grid").target[0] = [f64::NAN; 2];
        let again = Project::from_json(&project.to_json().expect("text"), "p.json").expect("a project");
        let grid = again.images[0].grid().expect("a grid");
        assert!(!grid.is_defined(0) && grid.is_defined(1));
        Recorded::new(&again).expect("solved everywhere");
    }

    #[test]
    fn exposures_that_do_not_lie_on_their_photograph_are_refused() {
        let with = |map: Value| {
            let mut changed = project();
            changed["images"][1]["stack"] = json!([{"path": "c.jpg", "reference_from_member": map}]);
            changed
        };
        let (project, _) = read(&with(json!([[1.0, 0.0, 0.5], [0.0, 1.0, -0.2], [0.001, 0.0, 1.0]]))).expect("near");
        assert_eq!(project.images[1].stack[0].path, "c.jpg");
        for map in [
            json!([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
            json!([[1.0, 0.0, 90.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            json!([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
            json!([[1e308, 1e308, 1e308], [0.0, 1e308, 0.0], [1e308, 0.0, 1.0]]),
        ] {
            let refused = read(&with(map)).expect_err("far").to_string();
            assert!(refused.starts_with("c.jpg: it does not lie on b.jpg"), "{refused}");
        }
    }

    #[test]
    fn a_range_of_light_that_is_none_is_refused() {
        for (white, peak, can_be) in
            [(1.0, 8.0, true), (2.0, 2.0, true), (0.0, 1.0, false), (8.0, 1.0, false), (1e-30, 1e30, false)]
        {
            let mut changed = project();
            changed["light"] = json!({"white": white, "peak": peak});
            assert_eq!(read(&changed).is_ok(), can_be, "{white} {peak}");
        }
    }

    #[test]
    fn focal_lengths_that_no_lens_has_are_refused() {
        for (focal_px, can_be) in [(-1.0, false), (0.0, false), (3e8, false), (1.0, true), (80.0, true)] {
            let mut changed = project();
            changed["images"][1]["focal_px"] = json!(focal_px);
            assert_eq!(read(&changed).is_ok(), can_be, "{focal_px}");
        }
    }

    /// Every place in a value, as a JSON pointer.
    fn pointers(value: &Value, here: &str, all: &mut Vec<String>) {
        all.push(here.to_owned());
        match value {
            Value::Object(fields) => {
                fields.iter().for_each(|(name, value)| pointers(value, &format!("{here}/{name}"), all));
            }
            Value::Array(values) => {
                values.iter().enumerate().for_each(|(at, value)| pointers(value, &format!("{here}/{at}"), all));
            }
            _ => {}
        }
    }

    fn anything() -> impl Strategy<Value = Value> {
        prop_oneof![
            Just(Value::Null),
            Just(json!([])),
            Just(json!({})),
            any::<bool>().prop_map(Value::from),
            any::<i64>().prop_map(Value::from),
            (0..20_i64).prop_map(Value::from),
            any::<f64>().prop_map(Value::from),
            (-20.0..20.0_f64).prop_map(Value::from),
            prop_oneof!["used", "left_out", "a.jpg", ""].prop_map(Value::from),
            Just(json!(u64::MAX)),
        ]
    }

    proptest! {
        /// Whatever is changed in a project, it is refused or composed, and nothing panics.
        #[test]
        fn no_change_of_a_project_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), anything()), 1..3)) {
            let mut changed = project();
            for (place, value) in changes {
                let mut all = Vec::new();
                pointers(&changed, "", &mut all);
                if let Some(old) = changed.pointer_mut(&all[place.index(all.len())]) {
                    *old = value;
                }
            }
            let Ok((project, recorded)) = read(&changed) else { return Ok(()) };
            let sizes: Vec<[usize; 2]> =
                recorded.used.iter().map(|&at| [project.images[at].width, project.images[at].height]).collect();
            let canvas = recorded.layout.width.saturating_mul(recorded.layout.height);
            if canvas > 10_000 || sizes.iter().any(|size| size[0].saturating_mul(size[1]) > 10_000) {
                return Ok(());
            }
            let context = StageContext::default();
            let options = &project.options;
            let photographs = Plain(sizes);
            let (layout, corrections) = (&recorded.layout, &recorded.corrections);
            let input = render::RenderInput { layout, corrections, photographs: &photographs };
            let resources = render::Resources::unlimited();
            let compose = &options.compose;
            drop(render::run(&input, &resources, &compose.render, &compose.seam, None, &context));
            drop(layout::run(recorded.layout.placed, recorded.reference, &options.arrange.canvas, &context));
        }
    }
}
