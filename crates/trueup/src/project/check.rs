//! What no stitch records: numbers and words of a project file that contradict what they mean.

use std::fmt::Display;
use std::ops::RangeInclusive;

use trueup_core::geometry::{is_rotation, matrix_from_rows};
use trueup_core::{Error, Result};

use super::record::{ImageRecord, Project};

/// Recorded factors on light: twenty stops to both sides, several more than a camera's darkest and brightest exposures
/// of one scene lie apart.
const GAINS: RangeInclusive<f64> = 1e-6..=1e6;

impl Project {
    /// Refuses what no stitch records and reading would go on with, in the project of the file `file`.
    ///
    /// # Errors
    /// [`Error::Input`] that names file and field, and what is allowed there.
    pub(super) fn check(&self, file: &str) -> Result<()> {
        let wrong = |reason: String| {
            Error::input(file, reason, "Give it what a stitch wrote there, or stitch the photographs again.")
        };
        for (position, image) in self.images.iter().enumerate() {
            image.check().map_err(|fault| wrong(format!("images[{position}] ({}): {fault}", image.file_name())))?;
        }
        let count = self.images.len();
        // Without any photographs, that is what is wrong.
        for (position, pair) in self.pairs.iter().enumerate().filter(|_| count > 0) {
            if pair.a >= count || pair.b >= count {
                let fault = format!("a and b are positions in images from 0 to {}", count - 1);
                return Err(wrong(format!("pairs[{position}]: {fault}, not {} and {}", pair.a, pair.b)));
            }
        }
        Ok(())
    }
}

impl ImageRecord {
    /// What is wrong about it, if anything is.
    fn check(&self) -> std::result::Result<(), String> {
        for (field, rows) in [("rotation", &self.rotation), ("upright_rotation", &self.upright_rotation)] {
            if rows.as_ref().is_some_and(|rows| !is_rotation(&matrix_from_rows(rows))) {
                return Err(format!("{field} is no rotation: three rows of length 1 at right angles, right-handed"));
            }
        }
        within("gain", self.gain, &GAINS)?;
        let gains = self.correction.map_or([1.0; 3], |correction| correction.gain);
        gains.into_iter().try_for_each(|gain| within("correction.gain", Some(gain), &GAINS))
    }
}

/// Refuses a number of the field `field` that is not `allowed`.
fn within<T: PartialOrd + Display>(
    field: &str,
    number: Option<T>,
    allowed: &RangeInclusive<T>,
) -> std::result::Result<(), String> {
    match number {
        Some(number) if !allowed.contains(&number) => {
            Err(format!("{field} is {number}, allowed are {} to {}", allowed.start(), allowed.end()))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn what_no_stitch_records_is_refused_by_its_field() {
        let image = |path: &str, status: &str| {
            json!({
                "path": path, "width": 8, "height": 6, "status": status, "reason": "", "hint": "", "gain": 1.2,
                "rotation": [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], "upright_rotation": null,
                "correction": {"gain": [1.1, 1.0, 0.9], "vignetting": [0.0, 0.0, 0.0]}, "mesh": null
            })
        };
        let project = json!({
            "format": "trueup-project", "version": 2, "method": "vpg", "options": {}, "reference": "f/b.jpg",
            "images": [image("f/a.jpg", "used"), image("f/b.jpg", "used"), image("f/c.jpg", "left_out")],
            "pairs": [{"a": 0, "b": 1, "matches": 50, "inliers": 40, "needed": 15, "verdict": "joined"}],
            "manhattan": {"threshold": 0.1, "accepted": false, "inliers": []},
            "canvas": {"width": 14, "height": 6}, "seconds": {}, "diagnostics": []
        });
        let read = |project: &Value| Project::from_json(&project.to_string(), "p.json");
        assert!(read(&project).is_ok());
        // Who says that a photograph is left out leaves it out.
        let mut left_out = project.clone();
        let grid = json!({"rows": 2, "cols": 2, "source": [[0.0, 0.0], [8.0, 0.0], [0.0, 6.0], [8.0, 6.0]],
            "target": [[0.0, 0.0], [8.0, 0.0], [0.0, 6.0], [8.0, 6.0]]});
        (left_out["images"][2]["mesh"], left_out["images"][1]["mesh"]) = (grid.clone(), grid);
        let images = read(&left_out).expect("a project").images;
        assert_eq!([1, 2].map(|number| images[number].mesh.is_some()), [true, false]);
        let mirrored = json!([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        for (pointer, value, told) in [
            (
                "/images/1/upright_rotation",
                json!([[0, 0, 0], [0, 0, 0], [0, 0, 0]]),
                "images[1] (b.jpg): upright_rotation is no rotation",
            ),
            ("/images/0/rotation", mirrored, "images[0] (a.jpg): rotation is no rotation"),
            ("/images/0/gain", json!(1e30), "images[0] (a.jpg): gain is 1000000000000000000000000000000, allowed are"),
            ("/images/0/gain", json!(-1.0), "images[0] (a.jpg): gain is -1, allowed are 0.000001 to 1000000"),
            ("/images/1/correction/gain/2", json!(0.0), "images[1] (b.jpg): correction.gain is 0, allowed are"),
            ("/pairs/0/b", json!(7), "pairs[0]: a and b are positions in images from 0 to 2, not 0 and 7"),
        ] {
            let mut edited = project.clone();
            *edited.pointer_mut(pointer).expect("a field") = value;
            let message = read(&edited).expect_err(pointer).to_string();
            assert!(message.starts_with(&format!("p.json: {told}")), "{message}");
        }
    }
}
