//! How photographs are called.

use std::collections::BTreeMap;
use std::path::Path;

use trueup::{ImageRecord, Project};

/// Photographs named before the rest are counted.
const NAMED: usize = 4;

/// The file name of each photograph; the whole path where names collide.
pub(crate) fn names(images: &[ImageRecord]) -> Vec<String> {
    let short = |image: &ImageRecord| match Path::new(&image.path).file_name() {
        Some(name) => name.to_string_lossy().into_owned(),
        None => image.path.clone(),
    };
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    for image in images {
        *count.entry(short(image)).or_default() += 1;
    }
    images
        .iter()
        .map(|image| Some(short(image)).filter(|name| count[name] == 1).unwrap_or(image.path.clone()))
        .collect()
}

/// The name that stands for a photograph's path.
pub(crate) fn name_of<'a>(path: &'a str, project: &Project, names: &'a [String]) -> &'a str {
    project.images.iter().position(|image| image.path == path).map_or(path, |index| &names[index])
}

/// Names separated by commas; many are cut short.
pub(super) fn listed(names: &[&str]) -> String {
    match names.len() {
        count if count > NAMED + 1 => format!("{} and {} others", names[..NAMED].join(", "), count - NAMED),
        _ => names.join(", "),
    }
}
