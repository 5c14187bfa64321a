//! The data set of the paper's authors, where a user has it.
//!
//! The paper says what is in it: 36 sets, 01 to 12 rendered with known cameras, 13 to 36 photographed with a telephone.
//! It does not say how it is stored. Taken for granted is the least that any archive of it must have: a folder per set,
//! named by its number, which holds the photographs. Cameras are read from a file beside them, [`CAMERAS`], into which
//! whatever the archive states is easily brought: a line per photograph with its file name, its focal length in pixels
//! and the nine numbers of the rotation from world to camera, row by row (x right, y down, z forward; the world's y
//! points down). Lines that begin with `#` are remarks. A set without the file has no truth: it takes part where none
//! is needed.

use std::fs;
use std::path::Path;

use trueup::{Error, ImageTruth, Result, Truth};
use trueup_core::geometry::{matrix_from_rows, roll_from_down};
use trueup_core::source::SourceImage;

/// Name of the file with a set's cameras.
const CAMERAS: &str = "cameras.txt";

/// What is known of a set's cameras; `None` without a file of them.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read; [`Error::Input`] for lines that cannot be understood, rotations that are
/// none, or photographs without a camera.
pub(super) fn truth(folder: &Path, images: &[SourceImage]) -> Result<Option<Truth>> {
    let path = folder.join(CAMERAS);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(Error::io("reading", &path, error)),
    };
    let hint = "Give each photograph a line: file name, focal length in pixels, nine numbers of its rotation.";
    let wrong = |reason: String| Error::input(path.display(), reason, hint);
    let mut cameras = Vec::new();
    for (number, line) in text.lines().map(str::trim).enumerate() {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        cameras.push(Camera::read(line).ok_or_else(|| wrong(format!("line {} is no camera", number + 1)))?);
    }
    let of_image = |image: &SourceImage| {
        let file = image.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let camera = cameras.iter().find(|camera| camera.file == file);
        camera.map(|camera| camera.truth(image)).ok_or_else(|| wrong(format!("{file} has no camera")))
    };
    let images = images.iter().map(of_image).collect::<Result<Vec<ImageTruth>>>()?;
    let truth = Truth { source: folder.display().to_string(), images, level: None };
    truth.check(&path.display().to_string())?;
    Ok(Some(truth))
}

/// A line of the file.
struct Camera {
    file: String,
    focal_px: f64,
    rotation: [[f64; 3]; 3],
}

impl Camera {
    fn read(line: &str) -> Option<Self> {
        let mut words = line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty());
        let file = words.next()?.to_owned();
        let numbers: Vec<f64> = words.map(|word| word.parse().ok()).collect::<Option<_>>()?;
        let [focal_px, rows @ ..] = numbers.as_slice() else { return None };
        let [a, b, c, d, e, f, g, h, i] = *<&[f64; 9]>::try_from(rows).ok()?;
        Some(Self { file, focal_px: *focal_px, rotation: [[a, b, c], [d, e, f], [g, h, i]] })
    }

    fn truth(&self, image: &SourceImage) -> ImageTruth {
        let down = matrix_from_rows(&self.rotation) * nalgebra::Vector3::y();
        ImageTruth {
            file: self.file.clone(),
            width: image.width,
            height: image.height,
            focal_px: self.focal_px,
            lens: None,
            rotation: self.rotation,
            gamma_deg: roll_from_down(&down).to_degrees(),
            center: None,
            depth: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use trueup::StageContext;

    use super::*;
    use crate::sets::photographs;

    fn sets(folder: &Path) -> Result<Vec<crate::sets::SetSpec>> {
        photographs::sets("vpg", &[folder.to_owned()])
    }

    fn write_photograph(path: &Path, gray: u8) {
        let file = fs::File::create(path).expect("a file");
        let mut writer = png::Encoder::new(file, 96, 64).write_header().expect("a header");
        writer.write_image_data(&[gray; 96 * 64]).expect("written");
    }

    /// An imitation of the layout: set 01 with cameras, set 13 without, a folder of something else.
    fn imitation(folder: &Path) {
        for (set, count) in [("01", 2_u8), ("13", 3)] {
            let set = folder.join(set);
            fs::create_dir(&set).expect("folder");
            (0..count).for_each(|index| write_photograph(&set.join(format!("{index}.png")), 60 * index));
        }
        fs::create_dir(folder.join("readme")).expect("folder");
        // The second camera is rolled clockwise by 30 degrees: what is down in the world shows to the right of its
        // down.
        let cameras = "# file, focal length, rotation\n0.png 80 1 0 0 0 1 0 0 0 1\n\
                       1.png 82.5 0.8660254 0.5 0 -0.5 0.8660254 0 0 0 1\n";
        fs::write(folder.join("01").join(CAMERAS), cameras).expect("written");
    }

    #[test]
    fn sets_are_read_with_the_cameras_that_are_there() {
        let folder = tempfile::tempdir().expect("folder");
        imitation(folder.path());
        let sets = sets(folder.path()).expect("sets");
        let names: Vec<&str> = sets.iter().map(|set| set.name.as_str()).collect();
        assert_eq!(names, ["vpg/01", "vpg/13"]);
        let (data, context) = (folder.path().join("data"), StageContext::default());
        let known = sets[0].prepare(&data, &context).expect("ready");
        let truth = known.truth.expect("cameras");
        assert_eq!((known.photographs.len(), truth.images.len(), truth.images[1].file.as_str()), (2, 2, "1.png"));
        assert_eq!((truth.images[0].gamma_deg, truth.images[1].focal_px, truth.images[1].width), (0.0, 82.5, 96));
        assert!((truth.images[1].gamma_deg - 30.0).abs() < 1e-4, "{}", truth.images[1].gamma_deg);
        let unknown = sets[1].prepare(&data, &context).expect("ready");
        assert_eq!((unknown.photographs.len(), unknown.truth), (3, None));
        assert_eq!(sets[1].photograph_count().expect("count"), 3);
    }

    #[test]
    fn cameras_that_cannot_be_are_refused_by_their_line() {
        let folder = tempfile::tempdir().expect("folder");
        imitation(folder.path());
        let set = &sets(folder.path()).expect("sets")[0];
        let file = folder.path().join("01").join(CAMERAS);
        for (text, reason) in [
            ("0.png 80 1 0 0 0 1 0 0 0\n", "line 1 is no camera"),
            ("0.png 80 1 0 0 0 1 0 0 0 1\n", "1.png has no camera"),
            ("0.png 80 1 0 0 0 1 0 0 0 1\n1.png 80 1 0 0 0 2 0 0 0 1\n", "R of 1.png is no rotation"),
        ] {
            fs::write(&file, text).expect("written");
            let said = set.prepare(folder.path(), &StageContext::default()).expect_err("must fail").to_string();
            assert!(said.contains(reason) && said.contains(CAMERAS), "{said}");
        }
    }
}
