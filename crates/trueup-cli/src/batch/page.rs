//! The page of all panoramas of a batch.

use minijinja::Environment;
use serde_json::{Value, json};
use trueup::{Error, SetOutcome, SetRecord};

/// The page. Its name in the environment ends in `.html`, by which values are escaped.
const TEMPLATE: &str = include_str!("index.html");
/// The title of such a page, which ends what is the same of all of them.
const TITLE: &str = "<title>Panoramas</title>";

/// The page of the sets that are done, of `planned` in all.
///
/// # Errors
/// [`Error::Input`] if it cannot be made (never).
pub(super) fn text(records: &[SetRecord], planned: usize) -> Result<String, Error> {
    let wrong = |error: minijinja::Error| Error::input("page", error, "Report this as a defect.");
    let sets: Vec<Value> = records.iter().map(set).collect();
    let failed = records.iter().filter(|record| record.has_failed()).count();
    let panoramas: usize = records.iter().map(|record| record.panoramas().len()).sum();
    let values =
        json!({ "sets": sets, "planned": planned, "done": records.len(), "failed": failed, "panoramas": panoramas });
    let mut environment = Environment::new();
    environment.add_template("index.html", TEMPLATE).map_err(wrong)?;
    environment.get_template("index.html").and_then(|page| page.render(minijinja::value::Serde(values))).map_err(wrong)
}

/// Whether a file that begins so is such a page.
pub(super) fn is_own(start: &[u8]) -> bool {
    let end = TEMPLATE.find(TITLE).map_or(TEMPLATE.len(), |at| at + TITLE.len());
    start.starts_with(&TEMPLATE.as_bytes()[..end])
}

fn set(record: &SetRecord) -> Value {
    let (panoramas, error, hint): (&[Value], _, _) = match &record.outcome {
        SetOutcome::Made(panoramas) => (panoramas.as_slice(), "", ""),
        SetOutcome::Failed { error, hint, .. } => (&[], error.as_str(), hint.as_str()),
        SetOutcome::Alone => (&[], "a single photograph makes no panorama", ""),
    };
    let one = |one: &Value| {
        json!({
            "file": address(&one["panorama"]),
            "thumbnail": address(&one["beside"]["thumbnail"]),
            "width": one["width"],
            "height": one["height"],
            "used": one["used"].as_array().map_or(0, Vec::len),
            "judgement": one["judgement"],
            "warnings": one["warnings"].as_array().map_or(0, Vec::len),
        })
    };
    json!({
        "name": record.set,
        "photographs": record.photographs,
        "error": error,
        "hint": hint,
        "panoramas": panoramas.iter().map(one).collect::<Vec<_>>(),
        "outdated": record.outdated.iter().map(|file| json!({ "name": file, "file": address(&file.as_str().into()) })).collect::<Vec<_>>(),
    })
}

/// The address of a file beside the page.
///
/// # Source
/// RFC 3986, section 2.3: what is neither unreserved nor a separator of folders is written as its bytes.
fn address(path: &Value) -> String {
    let text = path.as_str().unwrap_or_default();
    let letter = |byte: u8| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => char::from(byte).to_string(),
        _ => format!("%{byte:02X}"),
    };
    // A name with a colon in it is no scheme.
    format!("./{}", text.bytes().map(letter).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_and_addresses_lead_to_files() {
        let panorama = json!({"panorama": "a b/#1?.jpg", "beside": {"thumbnail": "a b/thumbnail.jpg"}, "width": 3, "height": 2,
            "used": ["x", "y"], "judgement": {"upright": "good"}, "warnings": []});
        let record = SetRecord {
            set: "<script>alert(1)</script>".to_owned(),
            photographs: 2,
            made_of: Value::Null,
            ended_ms: 0,
            outcome: SetOutcome::Made(vec![panorama]),
            outdated: Vec::new(),
        };
        let failed = SetOutcome::Failed { error: "<b>".to_owned(), hint: String::new(), may_pass: false };
        let outdated = vec!["old #1.jpg".to_owned()];
        let failed = SetRecord { outcome: failed, outdated, ..record.clone() };
        let page = text(&[record.clone(), failed], 2).expect("a page");
        assert!(page.contains("old%20%231.jpg") && page.contains("earlier attempt"), "{page}");
        let one = text(&[record], 1).expect("a page");
        assert!(
            !one.contains("earlier attempt") && one.contains("1 panorama of 1 set of photographs; 1 set was found"),
            "{one}"
        );
        assert!(page.contains("1 panorama of 2 sets of photographs; 2 sets were found"), "{page}");
        assert!(!page.contains("<script") && !page.contains("<b>"), "{page}");
        assert_eq!(address(&"a b/#1?.jpg".into()), "./a%20b/%231%3F.jpg");
        assert!(page.contains("a%20b") && page.contains("%231%3F.jpg"), "{page}");
    }
}
