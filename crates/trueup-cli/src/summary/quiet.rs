//! What is said in spite of `--quiet`: a script has no other way to learn that not all went into the panorama.

use std::collections::BTreeSet;
use std::path::Path;

use trueup::{Project, Written};

use super::left_out::{left_out, tells_of_left_out};
use super::names::{listed, names};
use crate::words::one_line;

/// Every warning in a line of its own, what was left out in one, without hints. What several panoramas tell alike is
/// told once, and what is in another one of them is not left out.
pub(crate) fn warnings(written: &[Written]) -> String {
    let used: BTreeSet<&Path> =
        written.iter().flat_map(|one| one.project.used_images()).map(|image| Path::new(&image.path)).collect();
    let mut lines: Vec<String> = Vec::new();
    for warning in written.iter().flat_map(|one| warnings_of(&one.project, &used)) {
        let line = format!("trueup: warning: {}\n", one_line(&warning));
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines.concat()
}

fn warnings_of(project: &Project, used: &BTreeSet<&Path>) -> Vec<String> {
    let names = names(&project.images);
    let groups = left_out(project, &names, |image| !used.contains(Path::new(&image.path)));
    let count: usize = groups.iter().map(|group| group.photographs.len()).sum();
    let reasons: Vec<String> =
        groups.iter().map(|group| format!("{}: {}", listed(&group.photographs), group.reason)).collect();
    let told = |one: &&trueup::Diagnostic| !tells_of_left_out(one, project);
    let photograph_names = project.photograph_names();
    let others =
        project.warnings().filter(told).map(|one| format!("{}: {}", one.subject.named(&photograph_names), one.message));
    let left_out = (count > 0).then(|| format!("{count} of {} left out: {}", project.images.len(), reasons.join("; ")));
    left_out.into_iter().chain(others).collect()
}
