//! The page: words written by hand, tables between markers.

use std::fs;
use std::path::Path;

use trueup::{Error, Result, check_place, write_atomically};

use super::discover::Part;
use super::row::QualityRow;
use super::tables::{every_set, medians};

/// The page of a file that does not exist yet: the project's own, whose words hold anywhere.
const TEMPLATE: &str = include_str!("../../../../docs/quality.md");

/// Puts the tables between their markers. Parts that were not run say so and keep the previous figures.
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] if the page lacks a marker.
pub(super) fn write(path: &Path, rows: &[QualityRow], previous: &[QualityRow]) -> Result<()> {
    write_atomically(path, filled(path, rows, previous)?.as_bytes())
}

/// Checks that [`write()`] could write the page, before the long work that fills it.
///
/// # Errors
/// As [`write()`].
pub(super) fn check(path: &Path) -> Result<()> {
    check_place(path)?;
    filled(path, &[], &[]).map(drop)
}

/// The page with its tables.
fn filled(path: &Path, rows: &[QualityRow], previous: &[QualityRow]) -> Result<String> {
    let mut page = match fs::read_to_string(path) {
        Ok(page) => page,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => TEMPLATE.to_owned(),
        Err(error) => return Err(Error::io("reading", path, error)),
    };
    for part in Part::ALL {
        for (suffix, render) in
            [("-medians", medians as fn(Part, &[QualityRow], &[QualityRow]) -> String), ("", every_set)]
        {
            let name = format!("{}{suffix}", part.name());
            page = replaced(&page, &name, &content(part, rows, previous, render)).ok_or_else(|| {
                let (start, end) = markers(&name);
                let hint = format!("Put a line {start} and a line {end} where the table belongs.");
                Error::input(path.display(), format!("there is no place for the table \"{name}\""), hint)
            })?;
        }
    }
    Ok(page)
}

fn content(
    part: Part,
    rows: &[QualityRow],
    previous: &[QualityRow],
    render: fn(Part, &[QualityRow], &[QualityRow]) -> String,
) -> String {
    let of = |rows: &[QualityRow]| -> Vec<QualityRow> { rows.iter().filter(|row| row.part == part).cloned().collect() };
    let (new, old) = (of(rows), of(previous));
    match (new.first(), old.first()) {
        (Some(_), _) => render(part, &new, &old),
        (None, Some(known)) => {
            let (option, version) = (part.option(), &known.version);
            let words = format!("*Skipped: no data given (`{option} DIR`). Figures of version {version}.*\n\n");
            words + &render(part, &old, &[])
        }
        (None, None) => format!("*Skipped: no data given (`{} DIR`).*\n", part.option()),
    }
}

fn markers(name: &str) -> (String, String) {
    (format!("<!-- generated: {name} -->"), format!("<!-- end: {name} -->"))
}

/// The page with `content` between the markers; `None` without them.
fn replaced(page: &str, name: &str, content: &str) -> Option<String> {
    let (start, end) = markers(name);
    let from = page.find(&start)? + start.len();
    let to = from + page[from..].find(&end)?;
    Some(format!("{}\n\n{}\n{}", &page[..from], content, &page[to..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_around_the_markers_stay() {
        let page = "before\n<!-- generated: known -->\nold\n<!-- end: known -->\nafter\n";
        let once = replaced(page, "known", "| new |\n").expect("markers");
        assert_eq!(once, "before\n<!-- generated: known -->\n\n| new |\n\n<!-- end: known -->\nafter\n");
        assert_eq!(replaced(&once, "known", "| new |\n"), Some(once.clone()));
        assert_eq!(replaced(page, "photographs", ""), None);
    }

    #[test]
    fn a_part_without_data_is_marked_skipped_and_keeps_its_figures() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("quality.md");
        let old = QualityRow { version: "0.0.9".to_owned(), ..QualityRow::empty(Part::Photographs, "hill", "multi") };
        write(&path, &[], &[old]).expect("writes");
        let page = fs::read_to_string(&path).expect("page");
        assert!(page.contains("*Skipped: no data given (`--truth-sets DIR`).*"), "{page}");
        assert!(page.contains("*Skipped: no data given (`--real DIR`). Figures of version 0.0.9.*"), "{page}");
        assert!(page.contains("| hill | multi |"), "{page}");
    }

    #[test]
    fn pages_that_cannot_be_written_are_refused_before_the_work() {
        let folder = tempfile::tempdir().expect("folder");
        let said = |path: &Path| check(path).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(said(folder.path()).contains("it is a folder"));
        assert!(said(&folder.path().join("none/quality.md")).contains("does not exist"));
        let page = folder.path().join("quality.md");
        assert_eq!(said(&page), "");
        assert!(!page.exists(), "nothing is left behind");
        fs::write(&page, "no markers\n").expect("writes");
        assert!(said(&page).contains("there is no place for the table"));
        assert_eq!(fs::read_to_string(&page).expect("page"), "no markers\n");
    }
}
