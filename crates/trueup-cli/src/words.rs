//! Numbers, names and paragraphs for people.

use std::borrow::Cow;

/// "812 bytes", "4.2 MB": decimal units, as file managers show them.
pub(crate) fn file_size(bytes: u64) -> String {
    const UNITS: [(f64, &str); 3] = [(1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let size = bytes as f64;
    match UNITS.iter().find(|(unit, _)| size >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", size / unit),
        None => format!("{bytes} bytes"),
    }
}

/// `text` without what would command the terminal or turn the order of its letters: names of files may hold anything.
/// Such characters are written as Rust writes them, `\u{1b}`; line ends and tabs are kept.
///
/// # Source
/// Unicode 16, general category Cc, and the explicit directional formatting characters of UAX #9.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    let is_formatting = |one: char| matches!(one, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let is_harmful = |one: char| (one.is_control() && !matches!(one, '\n' | '\t')) || is_formatting(one);
    if !text.contains(is_harmful) {
        return Cow::Borrowed(text);
    }
    let written = |one: char| match is_harmful(one) {
        true => one.escape_unicode().to_string(),
        false => one.to_string(),
    };
    Cow::Owned(text.chars().map(written).collect())
}

/// The same as one line: line ends and tabs are written, too.
pub(crate) fn one_line(text: &str) -> Cow<'_, str> {
    match printable(text) {
        text if !text.contains(['\n', '\t']) => text,
        text => Cow::Owned(text.replace('\n', "\\n").replace('\t', "\\t")),
    }
}

/// Breaks `text` at spaces into lines of at most `width` characters; a longer word has a line of its own.
pub(crate) fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_the_largest_unit_that_fits() {
        assert_eq!([999, 1000, 4_200_000, 7_060_000_000].map(file_size), ["999 bytes", "1.0 kB", "4.2 MB", "7.1 GB"]);
    }

    #[test]
    fn control_characters_never_reach_the_terminal() {
        assert_eq!(printable("Größe 1.jpg: 3 px\n"), "Größe 1.jpg: 3 px\n");
        assert_eq!(printable("a\u{1b}[2Jb\r\u{9b}c\u{202e}gpj"), "a\\u{1b}[2Jb\\u{d}\\u{9b}c\\u{202e}gpj");
        assert_eq!(one_line("a\nb\tc\u{7}"), "a\\nb\\tc\\u{7}");
    }

    #[test]
    fn lines_break_at_spaces_and_keep_every_word() {
        assert_eq!(wrap("one two three", 7), ["one two", "three"]);
        assert_eq!(wrap("photographs ö", 3), ["photographs", "ö"]);
        assert!(wrap("  ", 5).is_empty());
    }
}
