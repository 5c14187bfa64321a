//! Stages know photographs by number; users know them by name.

use trueup_core::diagnostics::Diagnostic;

/// What the renderer calls a photograph: "photograph 3".
const NUMBERED: &str = "photograph ";
/// Between the two photographs of a pair: "3 - 4".
const AND: &str = " - ";

/// The finding with its subject's numbers, "photograph 3" or "3 - 4", replaced by the photographs' names.
pub(crate) fn by_name(finding: Diagnostic, names: &[String]) -> Diagnostic {
    let name = |number: &str| names.get(number.parse::<usize>().ok()?).cloned();
    let pair = || {
        let (a, b) = finding.subject.split_once(AND)?;
        Some([name(a)?, name(b)?].join(AND))
    };
    let subject = match finding.code.as_str() {
        "near-duplicate" => pair(),
        "grid-folded" | "projection-cut" | "projection-left-out" => {
            finding.subject.strip_prefix(NUMBERED).and_then(name)
        }
        _ => None,
    };
    Diagnostic { subject: subject.unwrap_or_else(|| finding.subject.clone()), ..finding }
}

/// Findings about several photographs in one line; of very many, the first.
pub(crate) fn several(findings: &[String]) -> String {
    /// Findings told: a screen's worth of what is most often one and the same.
    const TOLD: usize = 8;
    match findings.len() {
        count if count > TOLD + 1 => format!("{}; and {} more", findings[..TOLD].join("; "), count - TOLD),
        _ => findings.join("; "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn very_many_findings_are_cut_short() {
        let findings = |count: usize| several(&(1..=count).map(|one| one.to_string()).collect::<Vec<_>>());
        assert_eq!(findings(9), "1; 2; 3; 4; 5; 6; 7; 8; 9");
        assert_eq!(findings(72), "1; 2; 3; 4; 5; 6; 7; 8; and 64 more");
    }

    #[test]
    fn numbers_become_names_where_stages_know_no_names() {
        let names = ["a.jpg".to_owned(), "b.jpg".to_owned()];
        let subject = |code: &str, subject: &str| by_name(Diagnostic::warning(code, subject, "", ""), &names).subject;
        assert_eq!(subject("near-duplicate", "0 - 1"), "a.jpg - b.jpg");
        assert_eq!(subject("grid-folded", "photograph 1"), "b.jpg");
        assert_eq!(subject("near-duplicate", "0 - 7"), "0 - 7");
        assert_eq!(subject("focal-uncertain", "0 - 1"), "0 - 1");
    }
}
