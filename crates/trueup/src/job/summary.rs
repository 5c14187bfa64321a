//! What is told of a panorama, for programs.

use std::path::Path;

use serde_json::{Map, Value, json};
use trueup_core::diagnostics::Diagnostic;

use super::write::Written;
use crate::project::record::{ImageStatus, Project};
use crate::report::measures::Measures;

impl Written {
    /// Its summary as a JSON object, whose fields docs/command-line.md describes: that of its project, and the files.
    pub fn summary(&self) -> Value {
        let path = |path: &Path| path.display().to_string();
        let beside: Map<String, Value> =
            self.outputs.beside.iter().map(|(kind, file)| (kind.flag().to_owned(), path(file).into())).collect();
        let mut summary = self.project.summary();
        summary["panorama"] = path(&self.outputs.panorama).into();
        summary["beside"] = beside.into();
        summary["bytes"] = self.bytes.into();
        summary
    }
}

impl Project {
    /// Its summary as a JSON object, whose fields docs/command-line.md describes: size, photographs, judgement,
    /// measures, warnings, seconds.
    pub fn summary(&self) -> Value {
        let Self { images, canvas, crop, measures, seconds, reference, .. } = self;
        let names = self.photograph_names();
        let used: Vec<&str> = self.used_images().map(|image| image.path.as_str()).collect();
        let left_out = images.iter().filter(|image| image.status == ImageStatus::LeftOut);
        let warning = |one: &Diagnostic| json!({ "code": one.code, "subject": one.subject.named(&names), "message": one.message, "hint": one.hint });
        let warnings = self.warnings().map(warning);
        json!({
            "width": canvas.width,
            "height": canvas.height,
            "full_turn": canvas.full_turn,
            "cropped": crop.map(|crop| json!({ "lost": crop.lost, "filled": crop.filled })),
            "reference": reference,
            "used": used,
            "left_out": left_out
                .map(|image| json!({ "path": image.path, "reason": image.reason, "hint": image.hint }))
                .collect::<Vec<_>>(),
            "judgement": self.judgement(),
            "measures": measures.as_ref().map(Measures::without_places),
            "warnings": warnings.collect::<Vec<_>>(),
            "seconds": seconds.values().sum::<f64>(),
        })
    }
}
