//! The table of formats, and the page that shows it.

use std::path::Path;

use trueup_core::options::OptionValue;

use super::*;
use crate::encode::Depth;
use crate::format::Transparency;

fn format_of_content(start: &[u8]) -> Option<&'static str> {
    readable().find(|(_, reading)| (reading.has_signature)(start)).map(|(format, _)| format.name)
}

fn format_of_name(path: &str) -> Option<&'static str> {
    FORMATS.iter().find(|format| format.names(Path::new(path))).map(|format| format.name)
}

#[test]
fn content_decides_not_the_name() {
    assert_eq!(format_of_content(b"\xff\xd8\xff\xe0rest"), Some("JPEG"));
    assert_eq!(format_of_content(b"RIFF\x00\x00\x00\x00WEBPVP8 "), Some("WebP"));
    assert_eq!(format_of_content(b"RIFF\x00\x00\x00\x00WAVEfmt "), None);
    assert_eq!(format_of_content(b"MM\x00*"), Some("TIFF"));
    assert_eq!(format_of_content(b"II*\0\x10\0\0\0CR\x02\0"), None);
    assert_eq!(format_of_content(b"\x89PNG\r\n\x1a\n\0"), Some("PNG"));
    assert_eq!(format_of_content(b"\0\0\0\x18ftypheic\0\0\0\0"), Some("HEIC"));
    assert_eq!(format_of_content(b"\0\0\0\x18ftypmif1\0\0\0\0"), Some("HEIC"));
    assert_eq!(format_of_content(b"\0\0\0\x1cftypavif\0\0\0\0"), Some("AVIF"));
    assert_eq!(format_of_content(b"\0\0\0\x1cftypmif1\0\0\0\0mif1avif...."), Some("AVIF"));
    assert_eq!(format_of_content(b"\0\0\0\x18ftypmif1\0\0\0\0mif1heicavif"), Some("HEIC"));
    assert_eq!(format_of_content(b"\xff\x0a\xfa\x1f"), Some("JPEG XL"));
    assert_eq!(format_of_content(b"\0\0\0\x0cJXL \r\n\x87\n"), Some("JPEG XL"));
    assert_eq!(format_of_content(b"\x76\x2f\x31\x01\x02\0\0\0"), Some("OpenEXR"));
    assert_eq!(format_of_content(b"#?RADIANCE\nFORMAT"), Some("Radiance"));
    assert_eq!(format_of_content(b""), None);
}

#[test]
fn extensions_are_read_in_any_case() {
    assert_eq!(format_of_name("a/B.JpEg"), Some("JPEG"));
    assert_eq!(format_of_name("a.JFIF"), Some("JPEG"));
    assert_eq!(format_of_name("a.dzi"), Some("Deep Zoom"));
    assert_eq!(format_of_name("a.txt"), None);
    assert_eq!(format_of_name("IMG_1.HEIC"), Some("HEIC"));
    assert!(has_foreign_extension(Path::new("IMG_1.CR3")));
    assert!(
        names_photograph(Path::new("IMG_1.CR3"))
            && names_photograph(Path::new("IMG_1.HEIC"))
            && !names_photograph(Path::new("a.dzi"))
    );
}

#[test]
fn messages_name_every_format() {
    assert_eq!(alternatives(["a", "b", "c"].map(str::to_owned).into_iter()), "a, b or c");
    let names = |words: &str, one: &str| words.replace(" or ", ", ").split(", ").any(|word| word == one);
    for (format, _) in readable() {
        assert!(names(&readable_formats(), format.name), "{format:?}");
    }
    for (format, _) in writable() {
        let all = written_extensions();
        assert!(format.extensions.iter().all(|extension| names(&all, &format!(".{extension}"))), "{format:?}");
    }
    let deep = extensions(|writing| writing.depths.contains(&Depth::Sixteen));
    assert!(names(&deep, ".png") && names(&deep, ".tif") && !names(&deep, ".jpg"), "{deep}");
}

/// No ending and no signature belongs to two formats.
#[test]
fn formats_do_not_overlap() {
    let mut endings: Vec<&str> =
        FORMATS.iter().flat_map(|format| format.extensions.iter().chain(format.rare_extensions)).copied().collect();
    let count = endings.len();
    endings.sort_unstable();
    endings.dedup();
    assert_eq!(endings.len(), count);
    let starts: [&[u8]; 9] = [
        b"\xff\xd8\xff\xe0",
        b"\x89PNG\r\n\x1a\n",
        b"II*\0",
        b"RIFF....WEBP",
        b"\0\0\0\x18ftypheic",
        b"\0\0\0\x18ftypavif",
        b"\xff\x0a",
        b"\x76\x2f\x31\x01",
        b"#?RGBE",
    ];
    for start in starts {
        assert_eq!(readable().filter(|(_, reading)| (reading.has_signature)(start)).count(), 1, "{start:?}");
    }
}

/// 65535 as 65,535.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|group| str::from_utf8(group).expect("digits")).collect();
    groups.join(",")
}

fn writing_row(format: &Format, writing: &Writing) -> String {
    let extensions: Vec<String> = format.extensions.iter().map(|extension| format!("`.{extension}`")).collect();
    let depths: Vec<String> = writing.depths.iter().map(|depth| depth.display()).collect();
    let alpha = match writing.transparency {
        Transparency::Never => "no",
        Transparency::Always => "yes",
        Transparency::With { case, .. } => case,
    };
    let (extensions, depths) = (extensions.join(", "), depths.join(", "));
    let side = grouped(writing.sides.largest);
    format!("| {} | {extensions} | {depths} | {alpha} | {side} px | {} |", format.name, writing.memory)
}

/// The rows of the table that follows this line of docs/formats.md, its two rows of headings left out.
fn rows_below<'a>(page: &'a str, heading: &str) -> Vec<&'a str> {
    let (_, rest) = page.split_once(heading).unwrap_or_else(|| panic!("no {heading}"));
    rest.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|')).skip(2).collect()
}

#[test]
fn the_page_says_what_the_declarations_say() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let read: Vec<String> =
        readable().map(|(format, reading)| format!("| {} | {} |", format.name, reading.kinds)).collect();
    assert_eq!(rows_below(&page, "\n## Photographs\n"), read);
    let written: Vec<String> = writable().map(|(format, writing)| writing_row(format, writing)).collect();
    assert_eq!(rows_below(&page, "\n## The panorama\n"), written);
}
