//! Photographs that are not in the panorama, together where the reason is one.

use trueup::{Diagnostic, ImageRecord, ImageStatus, Project};

/// Photographs that are left out for one reason.
pub(super) struct LeftOut<'a> {
    /// What they are called.
    pub(super) photographs: Vec<&'a str>,
    pub(super) reason: &'a str,
    pub(super) hint: &'a str,
}

/// Those of the photographs left out that are `told`, by their reasons, in the order of the first of each; `names` are
/// what the project's photographs are called.
pub(super) fn left_out<'a>(
    project: &'a Project,
    names: &'a [String],
    told: impl Fn(&ImageRecord) -> bool,
) -> Vec<LeftOut<'a>> {
    let mut all: Vec<LeftOut> = Vec::new();
    let images = project.images.iter().zip(names);
    for (image, name) in images.filter(|(image, _)| image.status == ImageStatus::LeftOut && told(image)) {
        match all.iter_mut().find(|one| one.reason == image.reason && one.hint == image.hint) {
            Some(same) => same.photographs.push(name),
            None => all.push(LeftOut { photographs: vec![name], reason: &image.reason, hint: &image.hint }),
        }
    }
    all
}

/// Whether a finding is the reason of a left-out photograph, which stands with that photograph.
pub(super) fn tells_of_left_out(diagnostic: &Diagnostic, project: &Project) -> bool {
    project.images.iter().any(|image| image.status == ImageStatus::LeftOut && image.reason == diagnostic.message)
}
