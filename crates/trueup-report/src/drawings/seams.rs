//! Where one photograph ends and the next begins.

use std::fmt::Write;

use trueup::ShownPhotographs;

use super::palette::photograph_color;
use super::svg::{Document, Stroke};

/// The seams of a panorama, and a tint of each photograph's color over what is shown of it. The `viewBox` is the raster
/// of `shown`, over the whole canvas.
pub fn seams(shown: &ShownPhotographs) -> String {
    let mut positions: Vec<usize> = shown.positions.iter().flatten().copied().collect();
    positions.sort_unstable();
    positions.dedup();
    let mut document = Document::new([shown.width, shown.height], "seams");
    for &position in &positions {
        let (area, color) = (area(shown, position), photograph_color(position));
        document.element(format_args!(
            "<path d=\"{area}\" fill=\"{color}\" fill-opacity=\"0.22\" shape-rendering=\"crispEdges\"/>"
        ));
    }
    document.stroke(&border(shown), &Stroke { color: "#ffffff", width: 1.8, dashes: "" });
    let label = format!("Seams between the {} photographs that the panorama shows.", positions.len());
    document.finish(&label)
}

/// The edges between pixels that show different photographs, joined along rows and columns; the border of the picture
/// and of what is empty is none.
fn border(shown: &ShownPhotographs) -> String {
    let at = |x: usize, y: usize| shown.positions[y * shown.width + x];
    let differ = |one: Option<usize>, other: Option<usize>| one.is_some() && other.is_some() && one != other;
    let mut data = String::new();
    for y in 1..shown.height {
        for run in runs(shown.width, |x| differ(at(x, y - 1), at(x, y))) {
            let _ = write!(data, "M{} {y}h{}", run.start, run.len());
        }
    }
    for x in 1..shown.width {
        for run in runs(shown.height, |y| differ(at(x - 1, y), at(x, y))) {
            let _ = write!(data, "M{x} {}v{}", run.start, run.len());
        }
    }
    data
}

/// The pixels that show one photograph, row by row.
fn area(shown: &ShownPhotographs, position: usize) -> String {
    let mut data = String::new();
    for y in 0..shown.height {
        for run in runs(shown.width, |x| shown.positions[y * shown.width + x] == Some(position)) {
            let _ = write!(data, "M{} {y}h{}v1h-{}z", run.start, run.len(), run.len());
        }
    }
    data
}

/// Ranges of consecutive numbers below `count` for which `is` holds.
fn runs(count: usize, is: impl Fn(usize) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for index in (0..count).filter(|&index| is(index)) {
        match found.last_mut() {
            Some(last) if last.end == index => last.end += 1,
            _ => found.push(index..index + 1),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_run_between_photographs_and_not_along_what_is_empty() {
        let (a, b) = (Some(0), Some(3));
        let shown = ShownPhotographs { width: 3, height: 2, positions: vec![a, b, None, a, a, None] };
        assert_eq!(border(&shown), "M1 1h1M1 0v1");
        assert_eq!(area(&shown, 0), "M0 0h1v1h-1zM0 1h2v1h-2z");
        assert!(seams(&shown).contains("viewBox=\"0 0 3 2\""));
    }
}
