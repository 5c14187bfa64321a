//! Where a comparison may be written.

use std::collections::BTreeSet;
use std::path::Path;

use trueup_core::{Error, Result};

use super::record::COMPARISON_FORMAT;

/// The file that says what a folder holds.
pub(crate) const RECORD: &str = "compare.json";

/// Refuses a folder that holds anything but an older comparison, which a new one may replace.
pub(crate) fn check_replaceable(folder: &Path) -> Result<()> {
    if !folder.is_dir() {
        // Nothing there, or a file, which is refused where the folder is made.
        return Ok(());
    }
    let failed = |error| Error::io("reading", folder, error);
    let own = own_files(folder);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if !own.contains(&name) {
            return Err(Error::input(
                folder.display(),
                format!("the folder holds something that is not part of an older comparison: {name}"),
                "Choose another folder, or move that file away.",
            ));
        }
    }
    Ok(())
}

/// The files that the folder's own record names; none without a record.
fn own_files(folder: &Path) -> BTreeSet<String> {
    let record = std::fs::read(folder.join(RECORD)).ok();
    let record: Option<serde_json::Value> = record.and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let Some(record) = record.filter(|record| record["format"] == COMPARISON_FORMAT) else { return BTreeSet::new() };
    let files = record["files"].as_array().into_iter().flatten();
    files.filter_map(|name| name.as_str().map(str::to_owned)).collect()
}

/// Refuses to write where photographs lie: replacing the folder would remove them.
pub(crate) fn refuse_photographs<'a>(folder: &Path, photographs: impl Iterator<Item = &'a Path>) -> Result<()> {
    let Ok(folder) = folder.canonicalize() else { return Ok(()) };
    for path in photographs {
        if path.canonicalize().is_ok_and(|path| path.starts_with(&folder)) {
            return Err(Error::input(
                path.display(),
                format!("this photograph lies in {}, which the comparison would replace", folder.display()),
                "Choose another folder for the comparison.",
            ));
        }
    }
    Ok(())
}

/// File names for entries: lower case letters, digits and dashes, each unlike the others and the pages' own names.
pub(crate) fn file_stems(names: &[&str]) -> Vec<String> {
    let mut taken: BTreeSet<String> = ["index", "compare", "ranking"].map(str::to_owned).into();
    names
        .iter()
        .map(|name| {
            let plain = plain(name);
            let mut stem = plain.clone();
            let mut number = 2;
            // Ranked panoramas are called ranking-1 and so on.
            while taken.contains(&stem) || stem.starts_with("ranking-") {
                stem = format!("{}-{number}", if plain.starts_with("ranking-") { "entry" } else { &plain });
                number += 1;
            }
            taken.insert(stem.clone());
            stem
        })
        .collect()
}

/// A name in letters that every file system and browser takes.
fn plain(name: &str) -> String {
    let kept = |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { ' ' };
    let words: String = name.chars().map(kept).collect();
    let plain = words.split_whitespace().collect::<Vec<_>>().join("-");
    if plain.is_empty() { "entry".to_owned() } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_plain_and_unlike_each_other() {
        let stems =
            file_stems(&["vpg", "VPG", "thin mesh (20 px)", "../../etc", "Größe", "index", "写真", "ranking-1"]);
        assert_eq!(stems, ["vpg", "vpg-2", "thin-mesh-20-px", "etc", "gr-e", "index-2", "entry", "entry-2"]);
    }
}
