//! The photographs that a recorded panorama is composed of again.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup_core::source::{SourceImage, StackMember};
use trueup_core::{Error, Result, StageContext};
use trueup_io::source::{self, InMemory, RejectedSource, SourceOptions};

use super::read::{as_recorded, find_photograph};
use super::record::{ImageRecord, StackMemberRecord};
use crate::report::several::several;

/// The recorded photographs themselves, in the order of `records`.
///
/// # Errors
/// [`Error::Input`] that names every one that is missing, unreadable or of another size, or a file that would stand for
/// two; [`Error::Cancelled`].
pub(crate) fn recorded_photographs(
    records: &[&ImageRecord],
    project_folder: &Path,
    options: &SourceOptions,
    context: &StageContext,
) -> Result<Vec<SourceImage>> {
    let found = records.iter().map(|record| find_photograph(record, project_folder, options, context));
    let found = all_of(found, "Give the folder that holds the photographs after --photos.")?;
    let hint = "Put the photographs back into their folders, beside the project file or where the command is run.";
    refuse_one_for_two(records, &found, hint).map(|()| found)
}

/// Refuses a file that was found for two recorded photographs, whose names are the same where their folders are not
/// looked at.
fn refuse_one_for_two(records: &[&ImageRecord], found: &[SourceImage], hint: &str) -> Result<()> {
    let mut taken: BTreeMap<PathBuf, &str> = BTreeMap::new();
    for (record, image) in records.iter().zip(found) {
        let members = record.stack.iter().zip(&image.stack).map(|(member, found)| (&member.path, &found.source.path));
        for (recorded, path) in std::iter::once((&record.path, &image.path)).chain(members) {
            let place = path.canonicalize().unwrap_or_else(|_| path.clone());
            if let Some(other) = taken.insert(place, recorded) {
                let reason = format!("it would stand for two photographs of the panorama, {other} and {recorded}");
                return Err(Error::input(path.display(), reason, hint));
            }
        }
    }
    Ok(())
}

/// Other photographs of the same sizes, in the order of `records`: each of `names` is one, a file or in memory.
///
/// # Errors
/// [`Error::Input`] if there are more or fewer of them, or one cannot be read or has another size;
/// [`Error::Cancelled`].
pub(crate) fn named_photographs(
    records: &[&ImageRecord],
    names: &[String],
    in_memory: &InMemory,
    options: &SourceOptions,
    context: &StageContext,
) -> Result<Vec<SourceImage>> {
    if names.len() != records.len() {
        let reason = format!("{} were given for {} in the panorama", names.len(), records.len());
        return Err(Error::input("photographs", reason, "Give one for each photograph that is used, in their order."));
    }
    // One by one: two cameras may well see the same black night.
    let found = records.iter().zip(names).map(|(record, name)| {
        let mut found = source::scan_with(std::slice::from_ref(name), in_memory, options, context)?;
        match (found.photographs.pop(), found.photographs.is_empty()) {
            (Some(image), true) => as_recorded(image, record),
            (None, _) if !found.rejected.is_empty() => Err(found.rejected.swap_remove(0).to_error()),
            _ => Err(Error::input(name, "it is no single photograph", "")),
        }
    });
    all_of(found, "Give photographs of the same sizes, by the same cameras in the same places.")
}

/// Other photographs of the same shape from `folder`, in the order of `records`: by their file names, by these without
/// extensions, or, if not one name is known and there are as many files as records, by the natural order of names.
///
/// # Errors
/// [`Error::Input`] that names every photograph that has no replacement, or whose replacement has another size, or a
/// file that would replace two; [`Error::Cancelled`].
pub(crate) fn other_photographs(
    records: &[&ImageRecord],
    folder: &Path,
    options: &SourceOptions,
    context: &StageContext,
) -> Result<Vec<SourceImage>> {
    let folder_text = folder.display().to_string();
    let sources = source::scan(std::slice::from_ref(&folder_text), options, context)?;
    if sources.photographs.is_empty() {
        return Err(match sources.rejected.first() {
            Some(rejected) => rejected.to_error(),
            None => Error::input(folder_text, "it holds no photographs", "Give the folder that holds them."),
        });
    }
    let names: Vec<&str> = records.iter().map(|record| record.file_name()).collect();
    let files: Vec<String> = sources.photographs.iter().map(|image| file_name(&image.path)).collect();
    let chosen = choose(&names, &files);
    let found = records.iter().zip(chosen).map(|(record, choice)| {
        let missing = |reason: String| Error::input(record.file_name(), reason, "");
        let image = match choice {
            Choice::File(position) => sources.photographs[position].clone(),
            Choice::Several => return Err(missing(format!("several files in {folder_text} have its name"))),
            Choice::None => return Err(missing(why_none(record, &folder_text, &sources.rejected))),
        };
        let image = as_recorded(image, record)?;
        let stack = replaced_stack(record, &sources.photographs);
        Ok(SourceImage { stack, ..image })
    });
    let found =
        all_of(found, "Give a folder with a photograph of the same name and size for each one of the panorama.")?;
    let hint = "Give a folder that holds one photograph for each one of the panorama, in their order and under names that are none of theirs.";
    refuse_one_for_two(records, &found, hint).map(|()| found)
}

/// The other exposures of a recorded photograph among others of the same names, or of these without extensions; none
/// where one of them is not there: the photograph then stands for itself.
fn replaced_stack(record: &ImageRecord, others: &[SourceImage]) -> Vec<StackMember> {
    let replaced = |member: &StackMemberRecord| {
        let name = member.file_name();
        let named = |other: &SourceImage| {
            let file = file_name(&other.path);
            let is_named = file == name || stem(&file) == stem(name);
            if is_named { as_recorded(other.clone(), record).ok() } else { None }
        };
        let source = others.iter().find_map(named)?;
        Some(StackMember { source, reference_from_member: member.reference_from_member })
    };
    let all: Option<Vec<StackMember>> = record.stack.iter().map(replaced).collect();
    all.unwrap_or_default()
}

/// What replaces a photograph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Choice {
    /// The file at this position.
    File(usize),
    /// More than one could.
    Several,
    /// No file.
    None,
}

fn choose(names: &[&str], files: &[String]) -> Vec<Choice> {
    let the_only = |fits: &dyn Fn(&str) -> bool| {
        let mut fitting = (0..files.len()).filter(|&position| fits(&files[position]));
        match (fitting.next(), fitting.next()) {
            (None, _) => Choice::None,
            (Some(position), None) => Choice::File(position),
            (Some(_), Some(_)) => Choice::Several,
        }
    };
    let by_name = |name: &&str| match the_only(&|file| file == *name) {
        Choice::None => the_only(&|file| stem(file) == stem(name)),
        choice => choice,
    };
    let chosen: Vec<Choice> = names.iter().map(by_name).collect();
    if names.len() != files.len() || chosen.iter().any(|choice| *choice != Choice::None) {
        return chosen;
    }
    let in_order = |names: &[&str]| -> Vec<usize> {
        let mut order: Vec<usize> = (0..names.len()).collect();
        order.sort_by(|&a, &b| source::natural_order(names[a].as_ref(), names[b].as_ref()));
        order
    };
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let mut chosen = vec![Choice::None; names.len()];
    for (name, file) in in_order(names).into_iter().zip(in_order(&files)) {
        chosen[name] = Choice::File(file);
    }
    chosen
}

fn why_none(record: &ImageRecord, folder: &str, rejected: &[RejectedSource]) -> String {
    let own = |one: &&RejectedSource| stem(&file_name(&one.path)) == stem(record.file_name());
    match rejected.iter().find(own) {
        Some(one) => format!("{} cannot be used: {}", one.path.display(), one.reason),
        None => format!("no file in {folder} has its name"),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// All that were found, or one error for all that were not.
fn all_of(found: impl Iterator<Item = Result<SourceImage>>, hint: &str) -> Result<Vec<SourceImage>> {
    let (mut images, mut wrong) = (Vec::new(), Vec::new());
    for one in found {
        match one {
            Ok(image) => images.push(image),
            Err(Error::Input { subject, reason, .. }) => wrong.push((subject, reason)),
            Err(other) => return Err(other),
        }
    }
    match wrong.as_slice() {
        [] => Ok(images),
        [(subject, reason)] => Err(Error::input(subject, reason, hint)),
        many => {
            let reasons: Vec<String> = many.iter().map(|(subject, reason)| format!("{subject}: {reason}")).collect();
            let subject = format!("{} of {} photographs", many.len(), many.len() + images.len());
            Err(Error::input(subject, several(&reasons), hint))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(names: &[&str], files: &[&str]) -> Vec<Choice> {
        choose(names, &files.iter().map(|&file| file.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn one_file_stands_for_one_photograph() {
        let member =
            |path: &str| serde_json::json!({"path": path, "reference_from_member": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]});
        let record = |path: &str, others: &[&str]| -> ImageRecord {
            let stack: Vec<_> = others.iter().map(|other| member(other)).collect();
            serde_json::from_value(serde_json::json!({
                "path": path, "width": 8, "height": 6, "status": "used", "reason": "", "hint": "", "stack": stack
            }))
            .expect("a record")
        };
        let found = |path: &str, others: &[&str]| {
            let image = |path: &str| SourceImage::unknown(path, path, [8, 6]);
            let member = |path: &&str| StackMember { source: image(path), reference_from_member: [[0.0; 3]; 3] };
            SourceImage { stack: others.iter().map(member).collect(), ..image(path) }
        };
        let (a, b) = (record("a/1.jpg", &["a/2.jpg"]), record("b/1.jpg", &["b/2.jpg"]));
        let records = [&a, &b];
        let good = [found("f/1.jpg", &["f/2.jpg"]), found("g/1.jpg", &["g/2.jpg"])];
        refuse_one_for_two(&records, &good, "").expect("each is itself");
        for (other, taken, two) in [
            (found("f/1.jpg", &["g/2.jpg"]), "f/1.jpg", "a/1.jpg and b/1.jpg"),
            (found("g/1.jpg", &["f/2.jpg"]), "f/2.jpg", "a/2.jpg and b/2.jpg"),
            (found("f/2.jpg", &[]), "f/2.jpg", "a/2.jpg and b/1.jpg"),
        ] {
            let refused = refuse_one_for_two(&records, &[good[0].clone(), other], "").expect_err("twice").to_string();
            let expected = format!("{taken}: it would stand for two photographs of the panorama, {two}");
            assert!(refused.starts_with(&expected), "{refused}");
        }
    }

    #[test]
    fn names_come_before_names_without_extension_and_these_before_the_order() {
        use Choice::{File, None, Several};
        assert_eq!(chosen(&["b.jpg", "a.jpg"], &["a.jpg", "a.tif", "b.tif"]), [File(2), File(0)]);
        assert_eq!(chosen(&["a.jpg"], &["a.png", "a.tif"]), [Several]);
        assert_eq!(chosen(&["a.jpg", "b.jpg"], &["a.jpg", "x.jpg"]), [File(0), None]);
        assert_eq!(chosen(&["p10.jpg", "p9.jpg"], &["q1.tif", "q2.tif"]), [File(1), File(0)]);
        assert_eq!(chosen(&["p1.jpg", "p2.jpg"], &["q1.tif"]), [None, None]);
    }
}
