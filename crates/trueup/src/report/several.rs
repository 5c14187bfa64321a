//! Many findings in one line.

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
}
