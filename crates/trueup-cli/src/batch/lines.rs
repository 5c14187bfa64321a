//! What became of sets of photographs, in lines: of JSON for programs, of words for people. docs/batch.md describes the
//! former.

use std::path::Path;

use serde_json::{Value, json};
use trueup::{Batch, SetOutcome, SetRecord};

use crate::words::one_line;

/// The `format` field of every line.
const FORMAT: &str = "trueup-batch";
/// The `version` field: raised when a field changes its meaning or goes away.
const VERSION: u32 = 1;

/// A line of JSON for every panorama of a set, or one that says why there is none.
pub(super) fn json(record: &SetRecord) -> String {
    let told = |status: &str, mut more: Value| {
        if !record.outdated.is_empty() {
            more["outdated"] = json!(record.outdated);
        }
        line(&record.set, status, record.photographs.into(), more)
    };
    match &record.outcome {
        SetOutcome::Made(panoramas) => panoramas.iter().map(|one| told("made", one.clone())).collect(),
        SetOutcome::Failed { error, hint, may_pass } => {
            told("failed", json!({ "error": error, "hint": hint, "may_pass": may_pass }))
        }
        SetOutcome::Alone => told("alone", json!({})),
    }
}

fn line(set: &str, status: &str, photographs: Value, more: Value) -> String {
    let mut line = json!({
        "format": FORMAT, "version": VERSION, "set": set, "status": status, "photographs": photographs
    });
    if let (Some(line), Value::Object(more)) = (line.as_object_mut(), more) {
        line.extend(more);
    }
    format!("{line}\n")
}

/// Whether a file that begins so holds such lines.
pub(super) fn is_own(start: &[u8]) -> bool {
    String::from_utf8_lossy(start).contains(&format!("\"format\":\"{FORMAT}\""))
}

/// The same for people.
pub(super) fn words(record: &SetRecord) -> String {
    let set = one_line(&record.set);
    let outdated = record.outdated.iter().map(|file| format!("{set}: {} is of an earlier attempt\n", one_line(file)));
    let told = match &record.outcome {
        SetOutcome::Made(panoramas) => {
            let one = |one: &Value| {
                let used = one["used"].as_array().map_or(0, Vec::len);
                let file = one_line(one["panorama"].as_str().unwrap_or_default());
                format!(
                    "{set}: {file}  {} x {} px, {used} of {} photographs\n",
                    one["width"], one["height"], record.photographs
                )
            };
            panoramas.iter().map(one).collect()
        }
        SetOutcome::Failed { error, .. } => format!("{set}: no panorama: {}\n", one_line(error)),
        SetOutcome::Alone => format!("{set}: 1 photograph, which makes no panorama\n"),
    };
    std::iter::once(told).chain(outdated).collect()
}

/// The sets that are to be stitched.
pub(super) fn plan(batch: &Batch, as_json: bool) -> String {
    let one = |set: &trueup::PhotographsOfFolder| {
        let paths: Vec<String> = set.photographs.iter().map(|path| path.display().to_string()).collect();
        match (as_json, set.is_alone()) {
            (true, _) => line(&set.name, "planned", paths.into(), json!({})),
            (false, true) => format!("{}: 1 photograph, which makes no panorama\n", one_line(&set.name)),
            (false, false) => format!("{}: {} photographs\n", one_line(&set.name), paths.len()),
        }
    };
    batch.planned().map(one).collect()
}

/// What became of all sets, for people; `page` shows them.
pub(super) fn all(records: &[SetRecord], page: &Path) -> String {
    let panoramas: usize = records.iter().map(|record| record.panoramas().len()).sum();
    let failed = records.iter().filter(|record| record.has_failed()).count();
    let alone = records.iter().filter(|record| record.outcome == SetOutcome::Alone).count();
    let counted = |count: usize, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
    let mut parts =
        vec![format!("{} of {}", counted(panoramas, "panorama", "panoramas"), counted(records.len(), "set", "sets"))];
    if failed > 0 {
        parts.push(counted(failed, "set made none", "sets made none"));
    }
    if alone > 0 {
        parts.push(counted(alone, "is a single photograph", "are single photographs"));
    }
    format!("{}: {}\n", parts.join(", "), one_line(&page.display().to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(set: &str, outcome: SetOutcome) -> SetRecord {
        SetRecord {
            set: set.to_owned(),
            photographs: 3,
            made_of: Value::Null,
            ended_ms: 0,
            outcome,
            outdated: Vec::new(),
        }
    }

    #[test]
    fn every_panorama_has_a_line_and_all_are_counted() {
        let panorama = |file: &str| json!({ "panorama": file, "width": 30, "height": 20, "used": ["x", "y"] });
        let made = record("a", SetOutcome::Made(vec![panorama("a/1.jpg"), panorama("a/2.jpg")]));
        let failure = SetOutcome::Failed { error: "no overlap".to_owned(), hint: "Look.".to_owned(), may_pass: false };
        let (failed, alone) = (record("b", failure), record("c", SetOutcome::Alone));
        assert_eq!(
            words(&made),
            "a: a/1.jpg  30 x 20 px, 2 of 3 photographs\na: a/2.jpg  30 x 20 px, 2 of 3 photographs\n"
        );
        assert_eq!(words(&failed), "b: no panorama: no overlap\n");
        let lines: Vec<Value> =
            json(&made).lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect();
        assert_eq!((lines.len(), &lines[1]["panorama"], &lines[1]["status"]), (2, &"a/2.jpg".into(), &"made".into()));
        assert!(json(&failed).contains("\"hint\":\"Look.\"") && json(&alone).contains("\"alone\""));
        let told = all(&[made, failed, alone], Path::new("out/index.html"));
        assert_eq!(told, "2 panoramas of 3 sets, 1 set made none, 1 is a single photograph: out/index.html\n");
    }

    #[test]
    fn what_an_earlier_attempt_left_is_told_from_what_is_made() {
        let outdated = vec!["c/panorama.jpg".to_owned()];
        let left = SetRecord { outdated, ..record("c", SetOutcome::Alone) };
        let said = "c: 1 photograph, which makes no panorama\nc: c/panorama.jpg is of an earlier attempt\n";
        assert_eq!(words(&left), said);
        assert!(json(&left).contains("\"outdated\":[\"c/panorama.jpg\"]"), "{}", json(&left));
        assert!(!json(&record("c", SetOutcome::Alone)).contains("outdated"));
    }

    #[test]
    fn a_set_has_a_line_whatever_its_name() {
        let failure = SetOutcome::Failed { error: "a\nb: none".to_owned(), hint: String::new(), may_pass: false };
        assert_eq!(words(&record("a\nb\tc", failure)), "a\\nb\\tc: no panorama: a\\nb: none\n");
        let panorama = json!({ "panorama": "a\nb/p.jpg", "width": 3, "height": 2, "used": [] });
        assert_eq!(words(&record("a\nb", SetOutcome::Made(vec![panorama]))).lines().count(), 1);
    }
}
