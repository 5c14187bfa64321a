//! Findings a stage reports beside its product: data, not log lines.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// How much a [`Diagnostic`] matters to the panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Worth knowing; the panorama is as good as the photographs allow.
    Note,
    /// The panorama is worse for it, or lacks a photograph.
    Warning,
}

/// What a finding is about. Photographs go by number where stages work, and get their names where a person reads them:
/// [`Subject::named`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", from = "RecordedSubject")]
pub enum Subject {
    /// One photograph, by its number.
    Photograph(usize),
    /// Two photographs, by their numbers.
    Pair(usize, usize),
    /// A stage of the work, by its name, or the whole panorama.
    Stage(String),
    /// A file or folder that is no photograph of the set, as the user knows it.
    File(String),
}

/// A subject as it may be recorded: by kind, or as a mere text in files of programs that knew no kinds.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum KnownSubject {
    Photograph(usize),
    Pair(usize, usize),
    Stage(String),
    File(String),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum RecordedSubject {
    Known(KnownSubject),
    Text(String),
}

impl From<RecordedSubject> for Subject {
    fn from(recorded: RecordedSubject) -> Self {
        match recorded {
            RecordedSubject::Known(KnownSubject::Photograph(number)) => Self::Photograph(number),
            RecordedSubject::Known(KnownSubject::Pair(a, b)) => Self::Pair(a, b),
            RecordedSubject::Known(KnownSubject::Stage(name)) => Self::Stage(name),
            RecordedSubject::Known(KnownSubject::File(name)) | RecordedSubject::Text(name) => Self::File(name),
        }
    }
}

impl Subject {
    /// A stage, by its name.
    pub fn stage(name: impl Into<String>) -> Self {
        Self::Stage(name.into())
    }

    /// A file, by its name or path.
    pub fn file(name: impl ToString) -> Self {
        Self::File(name.to_string())
    }

    /// The subject in words: photographs by their `names`, a number that has none as it is.
    pub fn named(&self, names: &[impl AsRef<str>]) -> String {
        let name =
            |number: usize| names.get(number).map_or_else(|| number.to_string(), |name| name.as_ref().to_owned());
        match self {
            Self::Photograph(number) => name(*number),
            Self::Pair(a, b) => format!("{} - {}", name(*a), name(*b)),
            Self::Stage(text) | Self::File(text) => text.clone(),
        }
    }

    /// The same subject where photographs are numbered otherwise: photograph `k` is now `renumbered(k)`.
    #[must_use]
    pub fn renumbered(self, renumbered: impl Fn(usize) -> usize) -> Self {
        match self {
            Self::Photograph(number) => Self::Photograph(renumbered(number)),
            Self::Pair(a, b) => Self::Pair(renumbered(a), renumbered(b)),
            other => other,
        }
    }
}

/// One finding about a photograph, a pair or the whole panorama.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Stable machine-readable name in kebab case, e.g. `photograph-left-out`.
    pub code: String,
    /// How much it matters.
    pub severity: Severity,
    /// What it is about.
    pub subject: Subject,
    /// What was found, with the numbers that led to it.
    pub message: String,
    /// What the user can do about it; empty when there is nothing to do.
    pub hint: String,
}

impl Diagnostic {
    /// A note. `code` must be a stable kebab-case name.
    pub fn note(code: &str, subject: Subject, message: impl ToString, hint: impl ToString) -> Self {
        Self::new(Severity::Note, code, subject, message, hint)
    }

    /// A warning. `code` must be a stable kebab-case name.
    pub fn warning(code: &str, subject: Subject, message: impl ToString, hint: impl ToString) -> Self {
        Self::new(Severity::Warning, code, subject, message, hint)
    }

    fn new(severity: Severity, code: &str, subject: Subject, message: impl ToString, hint: impl ToString) -> Self {
        Self { code: code.to_owned(), severity, subject, message: message.to_string(), hint: hint.to_string() }
    }
}

/// A stage's product with what was found on the way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reported<T> {
    /// The product.
    pub value: T,
    /// The findings, in the order in which they were made.
    pub findings: Vec<Diagnostic>,
    /// Wall seconds by the name of the stage that took them.
    pub seconds: BTreeMap<String, f64>,
}

/// Adds wall seconds by the name of the stage that took them to those told before.
pub fn add_seconds(seconds: &mut BTreeMap<String, f64>, more: BTreeMap<String, f64>) {
    for (stage, spent) in more {
        *seconds.entry(stage).or_default() += spent;
    }
}

impl<T> Reported<T> {
    /// The same findings beside what `change` makes of the product.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Reported<U> {
        Reported { value: change(self.value), findings: self.findings, seconds: self.seconds }
    }

    /// The product, and what was told beside it.
    pub fn split(self) -> (T, Reported<()>) {
        (self.value, Reported { value: (), findings: self.findings, seconds: self.seconds })
    }

    /// What was told beside the product.
    pub fn told(&self) -> Reported<()> {
        Reported { value: (), findings: self.findings.clone(), seconds: self.seconds.clone() }
    }

    /// The same where photographs are numbered otherwise, see [`Subject::renumbered`].
    #[must_use]
    pub fn renumbered(mut self, renumbered: impl Fn(usize) -> usize) -> Self {
        for finding in &mut self.findings {
            let subject = std::mem::replace(&mut finding.subject, Subject::Photograph(0));
            finding.subject = subject.renumbered(&renumbered);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photographs_get_their_names_where_they_are_read() {
        let names = ["a.jpg", "b.jpg"];
        assert_eq!(Subject::Photograph(1).named(&names), "b.jpg");
        assert_eq!(Subject::Pair(0, 1).named(&names), "a.jpg - b.jpg");
        assert_eq!(Subject::Pair(0, 7).named(&names), "a.jpg - 7");
        assert_eq!(Subject::stage("mesh").named(&names), "mesh");
        assert_eq!(Subject::file("photograph 1").named(&names), "photograph 1");
    }

    #[test]
    fn subjects_are_read_as_they_are_written_and_as_they_were_texts_once() {
        for subject in [Subject::Photograph(3), Subject::Pair(1, 2), Subject::stage("mesh"), Subject::file("a.jpg")] {
            let written = serde_json::to_string(&subject).expect("written");
            assert_eq!(serde_json::from_str::<Subject>(&written).expect("read"), subject, "{written}");
        }
        assert_eq!(serde_json::from_str::<Subject>("\"a.jpg\"").expect("read"), Subject::file("a.jpg"));
        assert_eq!(serde_json::to_string(&Subject::Photograph(3)).expect("written"), r#"{"photograph":3}"#);
    }

    #[test]
    fn numbers_of_a_group_become_those_of_the_set() {
        let members = [4, 7];
        let finding = |subject| Diagnostic::note("some-code", subject, "", "");
        let found = Reported {
            value: (),
            findings: vec![
                finding(Subject::Photograph(1)),
                finding(Subject::Pair(0, 1)),
                finding(Subject::stage("mesh")),
            ],
            seconds: BTreeMap::new(),
        };
        let subjects: Vec<Subject> =
            found.renumbered(|local| members[local]).findings.into_iter().map(|one| one.subject).collect();
        assert_eq!(subjects, [Subject::Photograph(7), Subject::Pair(4, 7), Subject::stage("mesh")]);
    }
}
