//! What the record tells in words: what was left out, what was found, how long it took, what was asked for.

use serde_json::{Value, json};
use trueup::{ChangedOption, ImageStatus, Result, Severity, StitchOptions};

use super::Page;
use super::figures::figure;

/// What is told.
pub(super) struct Told {
    pub left_out: Vec<Value>,
    pub warnings: Vec<Value>,
    pub notes: Vec<Value>,
    pub time: Value,
    pub options: Vec<Value>,
}

impl Told {
    pub(super) fn of(page: &Page) -> Result<Self> {
        let images = page.project.images.iter().enumerate();
        let left_out = images.filter(|(_, image)| image.status == ImageStatus::LeftOut);
        let left_out = left_out.map(
            |(position, image)| json!({ "name": page.named(position), "reason": image.reason, "hint": image.hint }),
        );
        let of = |severity: Severity| -> Vec<Value> {
            let alike = page.project.diagnostics.iter().filter(|one| one.severity == severity);
            let told = alike.map(
                |one| json!({ "subject": one.subject.named(page.names), "message": one.message, "hint": one.hint }),
            );
            told.collect()
        };
        Ok(Self {
            left_out: left_out.collect(),
            warnings: of(Severity::Warning),
            notes: of(Severity::Note),
            time: time(page),
            options: differing(&page.project.options)?,
        })
    }
}

/// The stages, the longest first.
fn time(page: &Page) -> Value {
    let seconds = &page.project.seconds;
    let longest = seconds.values().copied().fold(f64::MIN_POSITIVE, f64::max);
    let mut stages: Vec<(&String, f64)> = seconds.iter().map(|(stage, &seconds)| (stage, seconds)).collect();
    stages.sort_by(|one, two| two.1.total_cmp(&one.1));
    let row = |(stage, seconds): (&String, f64)| {
        // As JSON pointers (RFC 6901) write names.
        let field = format!("/seconds/{}", stage.replace('~', "~0").replace('/', "~1"));
        json!({ "stage": stage, "seconds": figure(&field, seconds, 2) })
    };
    json!({
        "total": format!("{:.1}", seconds.values().sum::<f64>()),
        "longest": longest.to_string(),
        "stages": stages.into_iter().map(row).collect::<Vec<_>>(),
    })
}

/// The options that have other values than their defaults, in the order that options are listed in.
fn differing(options: &StitchOptions) -> Result<Vec<Value>> {
    let told = |option: ChangedOption| {
        let ChangedOption { description, value, default } = option;
        json!({ "name": description.name, "value": value, "default": default, "meaning": description.meaning })
    };
    Ok(options.changed()?.into_iter().map(told).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_that_were_changed_are_named_with_both_values() {
        let mut options = StitchOptions::default();
        assert!(differing(&options).expect("written").is_empty());
        options.set("mesh.cell_px=30").expect("an option");
        options.set("canvas.crop=none").expect("an option");
        let found = differing(&options).expect("written");
        let told: Vec<[&Value; 2]> = found.iter().map(|one| [&one["name"], &one["value"]]).collect();
        assert_eq!(told, [["mesh.cell_px", "30.0"], ["canvas.crop", "none"]]);
        assert!(found.iter().all(|one| one["meaning"] != "" && one["default"] != one["value"]));
    }
}
