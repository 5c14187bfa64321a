//! Of which sources this program was built.

/// What tells one build from another. Found when the program is built (`build.rs`), not when it runs: a checkout may
/// have moved on since.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BuildStamp {
    /// The commit that was checked out; empty if the sources were no checkout, or git was not there.
    pub commit: String,
    /// Whether sources differed from that commit.
    pub changed: bool,
    /// Stands for the content of all sources.
    pub sources: String,
    /// Whether it was built without optimization's last steps and with checks, so that times do not compare.
    pub debug: bool,
}

/// Digits of a commit that people read.
const SHORT: usize = 12;

impl BuildStamp {
    /// The stamp of the running program.
    pub(crate) fn of_this_program() -> Self {
        Self {
            commit: env!("TRUEUP_BENCH_COMMIT").to_owned(),
            changed: env!("TRUEUP_BENCH_CHANGED") == "true",
            sources: env!("TRUEUP_BENCH_SOURCES").to_owned(),
            debug: cfg!(debug_assertions),
        }
    }

    /// Whether the commit alone says what was built: nothing was changed.
    pub(crate) fn is_clean(&self) -> bool {
        !self.commit.is_empty() && !self.changed
    }

    /// What results of this build are stored under: the same for the same sources only.
    pub(crate) fn identity(&self) -> String {
        let source = match (self.commit.is_empty(), self.changed) {
            (true, _) => format!("sources {}", self.sources),
            (false, false) => format!("commit {}", self.commit),
            (false, true) => format!("commit {} changed, sources {}", self.commit, self.sources),
        };
        format!("{source}{}", if self.debug { ", debug build" } else { "" })
    }

    /// The same for people, with what it means for the report.
    pub(crate) fn in_words(&self) -> String {
        let short: String = self.commit.chars().take(SHORT).collect();
        let build = if self.debug { " (a debug build: its times do not compare)" } else { "" };
        match (self.commit.is_empty(), self.changed) {
            (true, _) => format!("sources {} outside of a checkout{build}", self.sources),
            (false, false) => format!("commit {short}, unchanged{build}"),
            (false, true) => format!("commit {short} with changes, sources {}{build}: not to be cited", self.sources),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(commit: &str, changed: bool, sources: &str) -> BuildStamp {
        BuildStamp { commit: commit.to_owned(), changed, sources: sources.to_owned(), debug: false }
    }

    #[test]
    fn builds_are_told_apart_by_what_they_were_made_of() {
        let clean = stamp("0123456789abcdef", false, "aa");
        assert!(clean.is_clean());
        // The commit alone decides: sources hashed elsewhere, with other line ends, are the same build.
        assert_eq!(clean.identity(), stamp("0123456789abcdef", false, "bb").identity());
        let others = [
            stamp("fedcba9876543210", false, "aa"),
            stamp("0123456789abcdef", true, "aa"),
            stamp("0123456789abcdef", true, "bb"),
            stamp("", false, "aa"),
            stamp("", false, "bb"),
            BuildStamp { debug: true, ..clean.clone() },
        ];
        for (index, other) in others.iter().enumerate() {
            assert_ne!(other.identity(), clean.identity());
            assert!(others[..index].iter().all(|known| known.identity() != other.identity()), "{other:?}");
        }
        assert!(!others[1].is_clean() && !others[3].is_clean());
        assert!(clean.in_words().starts_with("commit 0123456789ab, unchanged"));
    }

    #[test]
    fn this_program_knows_its_sources() {
        let stamp = BuildStamp::of_this_program();
        assert_eq!(stamp.sources.len(), 16);
        assert!(stamp.commit.is_empty() || stamp.commit.len() >= 40);
    }
}
