//! The summary for programs.

use serde_json::{Value, json};
use trueup::{Diagnostic, ImageStatus, Measures, Project, Written};

/// The summary of panoramas that were written, as JSON: docs/command-line.md says what its fields mean.
pub(crate) fn json(written: &[Written]) -> String {
    let panoramas: Vec<Value> = written.iter().map(panorama).collect();
    let mut text = json!({ "format": "trueup-summary", "version": 1, "panoramas": panoramas }).to_string();
    text.push('\n');
    text
}

/// The summary of one panorama.
pub(crate) fn panorama(written: &Written) -> Value {
    let Project { images, canvas, measures, seconds, reference, .. } = &written.project;
    let names = written.project.photograph_names();
    let path = |path: &std::path::Path| path.display().to_string();
    let beside: serde_json::Map<String, Value> =
        written.outputs.beside.iter().map(|(kind, file)| (kind.flag().to_owned(), path(file).into())).collect();
    let used: Vec<&str> = written.project.used_images().map(|image| image.path.as_str()).collect();
    let left_out = images.iter().filter(|image| image.status == ImageStatus::LeftOut);
    let warning = |one: &Diagnostic| json!({ "code": one.code, "subject": one.subject.named(&names), "message": one.message, "hint": one.hint });
    let warnings = written.project.warnings().map(warning);
    json!({
        "panorama": path(&written.outputs.panorama),
        "beside": beside,
        "bytes": written.bytes,
        "width": canvas.width,
        "height": canvas.height,
        "full_turn": canvas.full_turn,
        "reference": reference,
        "used": used,
        "left_out": left_out
            .map(|image| json!({ "path": image.path, "reason": image.reason, "hint": image.hint }))
            .collect::<Vec<_>>(),
        "judgement": written.project.judgement(),
        "measures": measures.as_ref().map(Measures::without_places),
        "warnings": warnings.collect::<Vec<_>>(),
        "seconds": seconds.values().sum::<f64>(),
    })
}
