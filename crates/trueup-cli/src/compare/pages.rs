//! The pages of a comparison: templates with the figures as JSON in them.

use std::fmt::Write;

use serde_json::{Value, json};
use trueup::Error;
use trueup_compare::{Comparison, Drawing, Polyline, Ranking};

const INDEX: &str = include_str!("index.html");
const INDEX_STYLE: &str = include_str!("index.css");
const INDEX_SCRIPT: &str = include_str!("index.js");
const RANKING: &str = include_str!("ranking.html");
const RANKING_STYLE: &str = include_str!("ranking.css");
const RANKING_SCRIPT: &str = include_str!("ranking.js");
/// What both pages share.
const STYLE: &str = include_str!("shared.css");
const SCRIPT: &str = include_str!("shared.js");

/// The page that shows all panoramas with their figures.
pub(crate) fn side_by_side(comparison: &Comparison, drawings: &[Drawing]) -> Result<String, Error> {
    let comparison = serde_json::to_value(comparison)
        .map_err(|error| Error::input("comparison", error, "Report this as a defect."))?;
    let drawings: Vec<Value> = drawings.iter().map(drawn).collect();
    let data = json!({ "comparison": comparison, "drawings": drawings });
    Ok(page(INDEX, &[STYLE, INDEX_STYLE], &[SCRIPT, INDEX_SCRIPT], &data))
}

/// The page on which people rank panoramas without their names. The names are in it, so that results can be saved, but
/// not in a form that is read at a glance.
pub(crate) fn blind_ranking(comparison: &Comparison, ranking: &Ranking) -> Result<String, Error> {
    let panoramas: Vec<Value> = ranking
        .panoramas
        .iter()
        .filter_map(|ranked| {
            let entry = comparison.entries.iter().find(|entry| entry.name == ranked.entry)?;
            let panorama = entry.panorama.as_ref()?;
            Some(json!({
                "file": ranked.file,
                "key": veiled(&ranked.entry),
                "width": panorama.width,
                "height": panorama.height,
            }))
        })
        .collect();
    let data = json!({
        "format": trueup_compare::RANKING_FORMAT,
        "version": trueup_compare::RANKING_VERSION,
        "comparison": comparison.id,
        "panoramas": panoramas,
    });
    Ok(page(RANKING, &[STYLE, RANKING_STYLE], &[SCRIPT, RANKING_SCRIPT], &data))
}

/// A template with its parts filled in; the data last, so that nothing in them is taken for a place to fill in.
fn page(template: &str, styles: &[&str], scripts: &[&str], data: &Value) -> String {
    template.replacen("/*STYLE*/", &styles.concat(), 1).replacen("/*SCRIPT*/", &scripts.concat(), 1).replacen(
        "/*DATA*/",
        &in_script(data),
        1,
    )
}

/// JSON that can stand in a `script` element: no name of a file ends the element or begins a comment.
fn in_script(data: &Value) -> String {
    data.to_string().replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

/// A name as hexadecimal digits, the last letter first.
fn veiled(name: &str) -> String {
    name.bytes().rev().fold(String::new(), |mut digits, byte| {
        let _ = write!(digits, "{byte:02x}");
        digits
    })
}

/// A drawing as SVG paths.
fn drawn(drawing: &Drawing) -> Value {
    let grids: Vec<Value> =
        drawing.grids.iter().map(|grid| json!({ "photograph": grid.path, "path": path(&grid.lines) })).collect();
    json!({
        "vertical": path(&drawing.vertical_lines),
        "other": path(&drawing.other_lines),
        "grids": grids,
    })
}

/// Lines as the data of one SVG path, to tenths of a pixel.
fn path(lines: &[Polyline]) -> String {
    let mut path = String::new();
    for line in lines {
        for (position, [x, y]) in line.iter().enumerate() {
            let _ = write!(path, "{}{} {}", if position == 0 { 'M' } else { 'L' }, tenths(*x), tenths(*y));
        }
    }
    path
}

fn tenths(coordinate: f64) -> f64 {
    (coordinate * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_of_a_file_ends_the_script() {
        let data = json!({ "name": "</script><script>alert(1)</script><!--/*DATA*/.jpg", "more": "a & b" });
        let text = in_script(&data);
        assert!(!text.contains('<') && !text.contains('>') && !text.contains('&'), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), data);
        let whole = page("<style>/*STYLE*/</style>/*SCRIPT*/ /*DATA*/", &["s"], &["x", "y"], &data);
        assert_eq!(whole, format!("<style>s</style>xy {text}"));
    }

    #[test]
    fn templates_have_every_place_to_fill_in_once() {
        for template in [INDEX, RANKING] {
            for place in ["/*STYLE*/", "/*SCRIPT*/", "/*DATA*/"] {
                assert_eq!(template.matches(place).count(), 1, "{place}");
            }
        }
        for part in [INDEX_STYLE, INDEX_SCRIPT, RANKING_STYLE, RANKING_SCRIPT, STYLE, SCRIPT] {
            assert!(!part.contains("/*SCRIPT*/") && !part.contains("/*DATA*/") && !part.contains("</script"));
        }
    }

    #[test]
    fn names_are_veiled() {
        // v = 76, p = 70, g = 67.
        assert_eq!(veiled("vpg"), "677076");
    }

    #[test]
    fn paths_are_short() {
        assert_eq!(path(&[vec![[0.04, 1.0], [2.55, -3.26]], vec![[5.0, 6.0]]]), "M0 1L2.6 -3.3M5 6");
    }
}
