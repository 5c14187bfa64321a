//! The figures of one run, by name.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;
use trueup::{Error, Project, Result, StageContext, Truth};

/// Everything that is measured of a panorama with known cameras: the numbers of [`trueup::evaluate`], the gate's, and the distance
/// of matched points.
/// `accepted`: the dominant directions guide; `guided`: they or the vertical alone do. What could not be measured is
/// absent.
///
/// # Errors
/// Those of [`trueup::evaluate`].
pub(crate) fn figures(project: &Project, truth: &Truth) -> Result<BTreeMap<String, f64>> {
    let evaluation = trueup::evaluate(project, truth)?;
    let value = serde_json::to_value(&evaluation)
        .map_err(|error| Error::input("evaluation", error, "Report this as a defect."))?;
    let mut figures = numbers_of(&value);
    // Where the vertical alone guides, the clause that kept the other directions out is stated.
    let guided = project.manhattan.accepted;
    let accepted = guided && project.manhattan.failed_clause.is_none();
    figures.insert("guided".to_owned(), f64::from(u8::from(guided)));
    figures.insert("accepted".to_owned(), f64::from(u8::from(accepted)));
    if let Some(divergence) = project.manhattan.divergence.filter(|divergence| divergence.is_finite()) {
        figures.insert("divergence".to_owned(), divergence);
    }
    if let Some(reprojection) = project.measures.as_ref().and_then(|measures| measures.reprojection) {
        figures.insert("match_rms_px".to_owned(), reprojection.rms_px);
    }
    Ok(figures)
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
