//! The figures of one run, by name.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;
use trueup::{Error, Project, Result, StageContext, Truth};

/// The name of the local distortion that the experiments state: of the cells that lie with their centers and all their
/// corners in no other photograph (equations 12 and 13). Known with the truth; what a panorama says of itself, `ld`,
/// judges cells by their centers.
pub(crate) const LD: &str = "ld_corners";

/// Everything that is measured of a panorama: the gate's numbers, what the panorama's own lines and matches say, and
/// with known cameras the numbers of [`trueup::evaluate`].
///
/// `accepted`: the dominant directions guide; `guided`: they or the vertical alone do. `lean_deg`, `estimated_gdic_deg`
/// and `certain` are told by the lines of all photographs, without the truth. What could not be measured is absent.
///
/// # Errors
/// Those of [`trueup::evaluate`].
pub(crate) fn figures(project: &Project, truth: Option<&Truth>) -> Result<BTreeMap<String, f64>> {
    let mut figures = own_figures(project);
    if let Some(truth) = truth {
        let evaluation = trueup::evaluate(project, truth)?;
        let value = serde_json::to_value(&evaluation)
            .map_err(|error| Error::input("evaluation", error, "Report this as a defect."))?;
        figures.extend(numbers_of(&value));
    }
    Ok(figures)
}

/// What a panorama says of itself.
fn own_figures(project: &Project) -> BTreeMap<String, f64> {
    // Where the vertical alone guides, the clause that kept the other directions out is stated.
    let guided = project.manhattan.accepted;
    let accepted = guided && project.manhattan.failed_clause.is_none();
    let flag = |value: bool| Some(f64::from(u8::from(value)));
    let measures = project.measures.as_ref();
    let upright = measures.and_then(|measures| measures.upright);
    let found = [
        ("guided", flag(guided)),
        ("accepted", flag(accepted)),
        ("divergence", project.manhattan.divergence),
        ("used", Some(project.used() as f64)),
        ("given", Some(project.images.len() as f64)),
        ("match_rms_px", measures.and_then(|measures| measures.reprojection.as_ref()).map(|found| found.rms_px)),
        ("ld", measures.map(|measures| measures.ld)),
        ("folds", measures.map(|measures| measures.folds as f64)),
        ("estimated_gdic_deg", measures.and_then(|measures| measures.estimated_gdic_deg)),
        ("lean_deg", upright.map(|upright| upright.mean_deg)),
        ("certain", upright.map(|upright| upright.measured as f64)),
    ];
    let finite = |(name, value): (&str, Option<f64>)| Some((name.to_owned(), value.filter(|value| value.is_finite())?));
    found.into_iter().filter_map(finite).collect()
}

/// How alike the photographs look where they overlap: the numbers of [`trueup::evaluate_pixels`].
///
/// # Errors
/// Those of [`trueup::evaluate_pixels`].
pub(crate) fn pixel_figures(project: &Project, context: &StageContext) -> Result<BTreeMap<String, f64>> {
    let evaluation = trueup::evaluate_pixels(project, Path::new(""), context)?;
    serde_json::to_value(evaluation)
        .map(|value| numbers_of(&value))
        .map_err(|error| Error::input("evaluation", error, "Report this as a defect."))
}

/// The finite numbers on the top level of a JSON object; truth values count 1 and 0.
fn numbers_of(value: &Value) -> BTreeMap<String, f64> {
    let fields = value.as_object().into_iter().flatten();
    fields
        .filter_map(|(name, value)| {
            let number = match value {
                Value::Bool(true) => 1.0,
                Value::Bool(false) => 0.0,
                other => other.as_f64()?,
            };
            number.is_finite().then(|| (name.clone(), number))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_taken_and_everything_else_is_left() {
        let value = serde_json::json!({ "ld": 0.8, "used": 5, "level": true, "gdic_deg": null, "images": [1, 2] });
        let expected = [("ld", 0.8), ("level", 1.0), ("used", 5.0)].map(|(name, number)| (name.to_owned(), number));
        assert_eq!(numbers_of(&value), BTreeMap::from(expected));
    }
}
