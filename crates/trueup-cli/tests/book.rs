//! The pages: every link leads somewhere, and the book of docs holds every page.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// Where the pages are.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
/// The pages of the book.
const DOCS: &str = "docs";
/// Its table of contents.
const CONTENTS: &str = "docs/SUMMARY.md";
/// A page that the book has as it is: `report.html` beside it, with drawings, is what links to it come to.
const NOT_IN_THE_BOOK: &str = "docs/paper/report.md";

/// Every page by its path from the root.
fn pages() -> BTreeMap<PathBuf, String> {
    let mut pages = BTreeMap::new();
    let root = Path::new(ROOT);
    let mut folders = vec![root.to_owned(), root.join(DOCS), root.join(DOCS).join("paper")];
    for group in ["crates", "tools"] {
        folders.extend(entries(&root.join(group)));
    }
    for file in folders.iter().flat_map(|folder| entries(folder)) {
        if file.extension().is_some_and(|extension| extension == "md") {
            let text = std::fs::read_to_string(&file).expect("a page");
            pages.insert(file.strip_prefix(root).expect("below the root").to_owned(), text);
        }
    }
    pages
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
}

/// The lines of a page outside of blocks of code.
fn prose(page: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    page.lines().filter(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    })
}

/// The destinations of a page's links and pictures.
fn links(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    // A link's words may go on in the next line.
    let text: Vec<String> = prose(page).map(without_code).collect();
    let text = text.join("\n");
    for (place, _) in text.match_indices("](") {
        let rest = &text[place + 2..];
        let end = rest.find([')', ' ', '\n']).expect("the end of a link");
        found.push(rest[..end].to_owned());
    }
    found
}

/// A line without what is code in it.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect()
}

/// What links call the headings of a page: lower case, words joined by hyphens, without other punctuation, as GitHub
/// and mdBook have it.
fn anchors(page: &str) -> BTreeSet<String> {
    let headings = prose(page).filter(|line| line.starts_with('#'));
    let anchor = |heading: &str| {
        let words = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = words.chars().filter(|&one| one.is_alphanumeric() || matches!(one, ' ' | '-' | '_'));
        kept.map(|one| if one == ' ' { '-' } else { one }).collect()
    };
    headings.map(anchor).collect()
}

/// A path without `.` and `..`; `None` if it leads out of the root.
fn plain(path: &Path) -> Option<PathBuf> {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => plain.push(name),
            Component::CurDir => {}
            Component::ParentDir => {
                if !plain.pop() {
                    return None;
                }
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(plain)
}

/// Why a link of the page at `from` leads nowhere.
fn fault(from: &Path, link: &str, pages: &BTreeMap<PathBuf, String>) -> Option<String> {
    if ["http://", "https://", "mailto:"].iter().any(|scheme| link.starts_with(scheme)) {
        return None;
    }
    let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target = match path {
        "" => from.to_owned(),
        path => match plain(&from.parent()?.join(path)) {
            Some(target) => target,
            None => return Some("it leads out of the sources".to_owned()),
        },
    };
    if !Path::new(ROOT).join(&target).exists() {
        return Some("there is no such file".to_owned());
    }
    if from.starts_with(DOCS) && !target.starts_with(DOCS) {
        return Some("it leads out of the book".to_owned());
    }
    let is_renamed = from.starts_with(DOCS) && from != Path::new(CONTENTS) && target.ends_with("README.md");
    if is_renamed {
        return Some("mdBook makes it index.html and leaves links to it as they are".to_owned());
    }
    if !anchor.is_empty() && !pages.get(&target).is_some_and(|page| anchors(page).contains(anchor)) {
        return Some("there is no such heading".to_owned());
    }
    None
}

#[test]
fn every_link_leads_somewhere() {
    let pages = pages();
    assert!(pages.len() > 20 && pages.contains_key(Path::new("README.md")), "{:?}", pages.keys());
    let mut faults = Vec::new();
    let mut count = 0;
    for (from, page) in &pages {
        for link in links(page) {
            count += 1;
            faults.extend(fault(from, &link, &pages).map(|why| format!("{}: {link}: {why}", from.display())));
        }
    }
    assert!(count > 200, "{count} links");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_book_holds_every_page_once() {
    let pages = pages();
    let contents = &pages[Path::new(CONTENTS)];
    let mut listed: Vec<PathBuf> = links(contents).iter().map(|link| Path::new(DOCS).join(link)).collect();
    listed.sort();
    let apart = [CONTENTS, NOT_IN_THE_BOOK].map(PathBuf::from);
    let written: Vec<PathBuf> =
        pages.keys().filter(|page| page.starts_with(DOCS) && !apart.contains(page)).cloned().collect();
    assert_eq!(listed, written);
    let settings = std::fs::read_to_string(Path::new(ROOT).join("book.toml")).expect("the book's settings");
    assert!(settings.lines().any(|line| line == format!("src = \"{DOCS}\"")), "{settings}");
}

#[test]
fn faults_are_found() {
    let page = "# One: two\n\n## A `code` head\n\n```\n[no](nowhere.md)\n```\n`[no](nowhere.md)` [a](b.md) and [two\nlines](#one-two)";
    assert_eq!(links(page), ["b.md", "#one-two"]);
    assert_eq!(Vec::from_iter(anchors(page)), ["a-code-head", "one-two"]);
    let pages = BTreeMap::from([(PathBuf::from("docs/page.md"), page.to_owned())]);
    let from = Path::new("docs/page.md");
    assert_eq!(fault(from, "#one-two", &pages), None);
    assert_eq!(fault(from, "room.jpg", &pages), None);
    assert_eq!(fault(from, "https://example.org/none", &pages), None);
    for wrong in ["#three", "none.md", "../README.md", "../../elsewhere.md", "page.md#three", "paper/README.md"] {
        assert!(fault(from, wrong, &pages).is_some(), "{wrong}");
    }
}
