//! What became of sets of photographs, as a table for spreadsheets.

use serde_json::Value;
use trueup::{SetOutcome, SetRecord};

/// The columns' names.
const COLUMNS: [&str; 14] = [
    "set",
    "status",
    "photographs",
    "used",
    "panorama",
    "width",
    "height",
    "upright",
    "alignment",
    "lines",
    "warnings",
    "seconds",
    "error",
    "outdated",
];
/// The positions of those that every set has.
const ERROR: usize = COLUMNS.len() - 2;
const OUTDATED: usize = COLUMNS.len() - 1;
/// So many of the first columns tell such a table from others.
const KNOWN_BY: usize = 4;
/// What parts the files in the last column.
const BETWEEN_FILES: &str = "; ";

/// A row for every panorama, and one for every set that made none.
///
/// # Source
/// RFC 4180: fields between quotation marks, those within doubled, lines that end with CR and LF.
pub(super) fn text(records: &[SetRecord]) -> String {
    let head = COLUMNS.map(str::to_owned);
    let rows = std::iter::once(head).chain(records.iter().flat_map(rows));
    rows.map(|row| row.map(|field| quoted(&field)).join(",") + "\r\n").collect()
}

/// Whether a file that begins so is such a table, whatever its last columns.
pub(super) fn is_own(start: &[u8]) -> bool {
    let first = COLUMNS.iter().take(KNOWN_BY).map(|column| quoted(column));
    start.starts_with(first.collect::<Vec<_>>().join(",").as_bytes())
}

fn rows(record: &SetRecord) -> Vec<[String; COLUMNS.len()]> {
    let without = |status: &str, error: String| {
        let mut row = [const { String::new() }; COLUMNS.len()];
        row[0].clone_from(&record.set);
        row[1] = status.to_owned();
        row[2] = record.photographs.to_string();
        row[ERROR] = error;
        row[OUTDATED] = record.outdated.join(BETWEEN_FILES);
        row
    };
    match &record.outcome {
        SetOutcome::Made(panoramas) => panoramas.iter().map(|one| row(record, one)).collect(),
        SetOutcome::Failed { error, hint, .. } => {
            vec![without("failed", format!("{error}. {hint}").trim_end().to_owned())]
        }
        SetOutcome::Alone => vec![without("alone", String::new())],
    }
}

/// The row of a panorama by its summary.
fn row(record: &SetRecord, panorama: &Value) -> [String; COLUMNS.len()] {
    let count = |field: &str| panorama[field].as_array().map_or(0, Vec::len).to_string();
    let judged = |what: &str| panorama["judgement"][what].as_str().unwrap_or_default().to_owned();
    [
        record.set.clone(),
        "made".to_owned(),
        record.photographs.to_string(),
        count("used"),
        panorama["panorama"].as_str().unwrap_or_default().to_owned(),
        panorama["width"].to_string(),
        panorama["height"].to_string(),
        judged("upright"),
        judged("alignment"),
        judged("lines"),
        count("warnings"),
        panorama["seconds"].as_f64().map(|seconds| format!("{seconds:.1}")).unwrap_or_default(),
        String::new(),
        record.outdated.join(BETWEEN_FILES),
    ]
}

/// A field as it stands in the file. Spreadsheets would compute what begins like a formula, and folders may be called
/// anything: such a text gets an apostrophe before it.
fn quoted(field: &str) -> String {
    let is_formula = field.starts_with(['=', '+', '-', '@', '\t', '\r']) && field.parse::<f64>().is_err();
    let before = if is_formula { "'" } else { "" };
    format!("\"{before}{}\"", field.replace('"', "\"\""))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn every_panorama_and_every_failure_has_a_row_that_spreadsheets_read() {
        let panorama = json!({"panorama": "a/p.jpg", "width": 30, "height": 20, "used": ["x", "y"], "seconds": 1.24,
            "judgement": {"upright": "good", "alignment": null}, "warnings": []});
        let record = SetRecord {
            set: "=cmd|\"a\"".to_owned(),
            photographs: 3,
            made_of: Value::Null,
            ended_ms: 0,
            outcome: SetOutcome::Made(vec![panorama]),
            outdated: Vec::new(),
        };
        let failure = SetOutcome::Failed { error: "x: none".to_owned(), hint: "Look.".to_owned(), may_pass: false };
        let outdated = vec!["b/1.jpg".to_owned(), "b/2.jpg".to_owned()];
        let failed = SetRecord { set: "b, c".to_owned(), outcome: failure, outdated, ..record.clone() };
        let text = text(&[record, failed]);
        let lines: Vec<&str> = text.split_terminator("\r\n").collect();
        assert_eq!(lines.len(), 3);
        assert!(lines[0].starts_with("\"set\",\"status\","));
        let made = r#""'=cmd|""a""","made","3","2","a/p.jpg","30","20","good","","","0","1.2","","""#;
        assert_eq!(lines[1], made);
        assert_eq!(lines[2], r#""b, c","failed","3","","","","","","","","","","x: none. Look.","b/1.jpg; b/2.jpg""#);
    }
}
