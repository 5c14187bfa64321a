//! A stitch graph written by hand.
//!
//! Two notations are read, line by line; `#` at the start of a line, or behind a space, starts a comment, unless the
//! names of photographs go on there:
//!
//! * `NAME -- NAME` or `INDEX -- INDEX`: the two photographs overlap. Names are file names, with as many of the folders
//!   they lie in as tell them from others; indices count from 0 in the order in which the photographs were given.
//! * `{key | value | comment}` as in the graph files of the GSP data sets: `matching_graph_image_edges-I` lists the
//!   neighbors of photograph I, `center_image_index` names the reference, `center_image_rotation_angle` its rotation in
//!   degrees; `images_count` must fit the photographs given.

use std::path::Path;

use trueup_core::called::{Called, any_of};
use trueup_core::{Error, Result};

/// What starts a comment.
const COMMENT: char = '#';

/// What a graph file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GraphFile {
    /// Overlapping pairs (a < b), sorted, each once.
    pub edges: Vec<(usize, usize)>,
    /// The reference photograph, if stated.
    pub reference: Option<usize>,
    /// The rotation of the reference photograph in degrees, clockwise, if stated.
    pub reference_rotation_deg: Option<f64>,
}

/// Reads a graph for the photographs at these paths, in the order given. `file` is the file's name, for messages.
///
/// # Errors
/// [`Error::Input`] with the line number for unknown photographs, names of several, unreadable lines, a wrong
/// photograph count, a photograph joined to itself, or a file without any pair.
pub fn parse_graph_file(text: &str, photographs: &[&Path], file: &str) -> Result<GraphFile> {
    let mut graph = GraphFile::default();
    // Editors of some systems begin a text with a mark of its byte order, which is no part of the first name.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with(COMMENT) {
            continue;
        }
        let read = with_and_without_comment(line).map(|line| read_line(line, photographs, &mut graph));
        first_ok(read).unwrap_or(Ok(())).map_err(|reason| {
            Error::input(
                format!("{file}, line {}", number + 1),
                reason,
                "Write one pair per line as NAME -- NAME, with the names of photographs that are being stitched.",
            )
        })?;
    }
    if graph.edges.is_empty() {
        return Err(Error::input(file, "no pair of photographs in it", "Write one pair per line as NAME -- NAME."));
    }
    graph.edges.sort_unstable();
    graph.edges.dedup();
    Ok(graph)
}

/// A line as it stands, and cut before each of its comments, the shortest first: names may have the mark of a comment,
/// too.
fn with_and_without_comment(line: &str) -> impl Iterator<Item = &str> {
    let is_comment = move |&(at, _): &(usize, &str)| line[..at].ends_with(char::is_whitespace);
    let cut = line.match_indices(COMMENT).filter(is_comment).map(move |(at, _)| line[..at].trim_end());
    cut.chain(std::iter::once(line))
}

/// The first that is no error, or else the first error; `None` of nothing.
fn first_ok<T, E>(results: impl Iterator<Item = std::result::Result<T, E>>) -> Option<std::result::Result<T, E>> {
    let mut first_error = None;
    for result in results {
        match result {
            Ok(_) => return Some(result),
            Err(_) => first_error = first_error.or(Some(result)),
        }
    }
    first_error
}

fn read_line(line: &str, photographs: &[&Path], graph: &mut GraphFile) -> std::result::Result<(), String> {
    match line.strip_prefix('{').and_then(|rest| rest.strip_suffix('}')) {
        Some(fields) => keyed_line(fields, photographs.len(), graph),
        None => pair_line(line, photographs).map(|edge| graph.edges.push(edge)),
    }
}

/// The pair of a line. Names may have the mark between the two in them as well: it is where both sides name
/// photographs, most likely where spaces are about it.
fn pair_line(line: &str, photographs: &[&Path]) -> std::result::Result<(usize, usize), String> {
    let marks = |mark: &'static str| {
        let starts = line.char_indices().filter(move |&(at, _)| line[at..].starts_with(mark));
        starts.map(move |(at, _)| (&line[..at], &line[at + mark.len()..]))
    };
    let pairs = marks(" -- ").chain(marks("--"));
    let pairs = pairs.map(|(one, other)| ordered(photograph(one, photographs)?, photograph(other, photographs)?));
    first_ok(pairs).unwrap_or_else(|| Err(format!("\"{line}\" is not a pair")))
}

fn keyed_line(fields: &str, count: usize, graph: &mut GraphFile) -> std::result::Result<(), String> {
    let mut parts = fields.split('|').map(str::trim);
    let (key, value) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    if let Some(owner) = key.strip_prefix("matching_graph_image_edges-") {
        let owner = index(owner, count)?;
        for neighbor in value.split([' ', ',']).filter(|word| !word.is_empty()) {
            graph.edges.push(ordered(owner, index(neighbor, count)?)?);
        }
        return Ok(());
    }
    match key {
        "center_image_index" => graph.reference = Some(index(value, count)?),
        "center_image_rotation_angle" => {
            let angle: f64 = value.parse().map_err(|_| format!("\"{value}\" is not an angle in degrees"))?;
            graph.reference_rotation_deg = angle.is_finite().then_some(angle);
        }
        "images_count" if value.parse() != Ok(count) => {
            return Err(format!("the graph is for {value} photographs, {count} were given"));
        }
        // Other keys of the notation carry nothing this program uses.
        _ => {}
    }
    Ok(())
}

fn photograph(text: &str, photographs: &[&Path]) -> std::result::Result<usize, String> {
    let text = text.trim().trim_matches('"');
    let name = Path::new(text.trim_start_matches("./"));
    let files = photographs.iter().copied().enumerate().filter(|_| !text.is_empty());
    match Called::by(name, files) {
        Called::Nothing => index(text, photographs.len())
            .map_err(|_| format!("\"{text}\" is none of the {} photographs given", photographs.len())),
        Called::One(found) => Ok(found),
        Called::AnyOf(several) => Err(format!("\"{text}\" {}", any_of(several.iter().map(|&at| photographs[at])))),
    }
}

fn index(text: &str, count: usize) -> std::result::Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(value) if value < count => Ok(value),
        _ => Err(format!("\"{}\" is not a photograph's index from 0 to {}", text.trim(), count.saturating_sub(1))),
    }
}

fn ordered(a: usize, b: usize) -> std::result::Result<(usize, usize), String> {
    if a == b { Err("a photograph is joined to itself".to_owned()) } else { Ok((a.min(b), a.max(b))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> [&'static Path; 3] {
        ["a 1.jpg", "b.jpg", "c.jpg"].map(Path::new)
    }

    #[test]
    fn names_with_spaces_and_indices_are_read() {
        let graph = parse_graph_file("# two pairs\nc.jpg -- a 1.jpg\n0 -- 1 # the first\n\n", &names(), "g.txt");
        assert_eq!(graph.expect("valid").edges, [(0, 1), (0, 2)]);
    }

    /// Marks of comments and of pairs are parts of names as well.
    #[test]
    fn names_with_marks_in_them_are_read() {
        let paths = ["IMG#1.jpg", "a--b.jpg", "day 1 -- noon.jpg", "no #3.jpg", "c-.jpg"].map(Path::new);
        let edges = |text: &str| parse_graph_file(text, &paths, "g.txt").map(|graph| graph.edges);
        assert_eq!(edges("IMG#1.jpg -- a--b.jpg # both").expect("valid"), [(0, 1)]);
        assert_eq!(edges("a--b.jpg--IMG#1.jpg").expect("valid"), [(0, 1)]);
        assert_eq!(edges("a--b.jpg -- day 1 -- noon.jpg").expect("valid"), [(1, 2)]);
        assert_eq!(edges("day 1 -- noon.jpg -- no #3.jpg # 0 -- 1").expect("valid"), [(2, 3)]);
        assert_eq!(edges("c-.jpg--0\n#0 -- 1\n").expect("valid"), [(0, 4)]);
        let message = edges("IMG#1.jpg -- IMG#2.jpg # none").expect_err("unknown").to_string();
        assert!(message.contains("line 1: \"IMG#2.jpg\" is none of the 5 photographs given"), "{message}");
    }

    /// By its name alone, with its folder or by its whole path; a name of several photographs is none of one.
    #[test]
    fn photographs_of_several_folders_are_told_apart() {
        let paths = ["/to/a/1.jpg", "/to/b/1.jpg", "/to/b/2.jpg"].map(Path::new);
        let edges = |text: &str| parse_graph_file(text, &paths, "g.txt").map(|graph| graph.edges);
        assert_eq!(edges("a/1.jpg -- b/1.jpg\n./b/2.jpg -- /to/a/1.jpg").expect("valid"), [(0, 1), (0, 2)]);
        assert_eq!(edges("b/1.jpg -- 2.jpg").expect("valid"), [(1, 2)]);
        let message = edges("1.jpg -- 2.jpg").expect_err("of two").to_string();
        assert!(message.contains("\"1.jpg\" may be any of /to/a/1.jpg, /to/b/1.jpg"), "{message}");
        assert!(edges("c/2.jpg -- a/1.jpg").is_err());
        let same = ["1.jpg", "b/1.jpg"].map(Path::new);
        assert_eq!(parse_graph_file("1.jpg -- b/1.jpg", &same, "g.txt").expect("valid").edges, [(0, 1)]);
    }

    #[test]
    fn the_gsp_notation_is_read() {
        let text = "{center_image_index | 1 | center}\n{center_image_rotation_angle | -3.5 | angle}\n\
                    {images_count | 3 | count}\n{matching_graph_image_edges-0 | 1 2 | edges}";
        let graph = parse_graph_file(text, &names(), "g.txt").expect("valid");
        assert_eq!(graph.edges, [(0, 1), (0, 2)]);
        assert_eq!((graph.reference, graph.reference_rotation_deg), (Some(1), Some(-3.5)));
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_a_name() {
        let graph = parse_graph_file("\u{feff}a 1.jpg -- b.jpg\r\nb.jpg -- c.jpg\r\n", &names(), "g.txt");
        assert_eq!(graph.expect("valid").edges, [(0, 1), (1, 2)]);
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, reason) in [
            ("0 -- 1\nb.jpg -- d.jpg", "line 2: \"d.jpg\" is none of the 3 photographs given"),
            ("b.jpg c.jpg", "line 1: \"b.jpg c.jpg\" is not a pair"),
            ("1 -- 1", "line 1: a photograph is joined to itself"),
            ("{images_count | 5 | count}", "the graph is for 5 photographs, 3 were given"),
            ("# nothing", "no pair of photographs in it"),
        ] {
            let message = parse_graph_file(text, &names(), "g.txt").expect_err("must fail").to_string();
            assert!(message.contains(reason), "{message}");
        }
    }
}
