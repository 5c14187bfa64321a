//! Whether long straight lines stay straight.

use serde_json::{Value, json};
use trueup::MeasuredLine;

use super::Page;
use super::figures::{chart, count, figure};
use crate::charts::{Chart, Series, SeriesMark};

pub(super) fn values(page: &Page) -> Value {
    let measures = page.project.measures.as_ref();
    let found = measures.and_then(|measures| measures.long_lines.as_ref());
    let field = |name: &str| format!("/measures/long_lines/{name}");
    let figures = found.map(
        |found| json!({ "bent": count(&field("bent"), found.bent), "lines": count(&field("lines"), found.lines) }),
    );
    let longest = found.and_then(|found| found.longest_bent.as_ref()).map(|line| {
        json!({
            "length": figure(&field("longest_bent/length_px"), line.length_px, 0),
            "off": figure(&field("longest_bent/off_px"), line.off_px, 1),
            "photograph": page.named_by(&line.path),
        })
    });
    let lines: Vec<&MeasuredLine> =
        measures.iter().flat_map(|measures| &measures.photographs).flat_map(|one| &one.lines).collect();
    json!({ "figures": figures, "longest": longest, "chart": straightness(&lines) })
}

/// The chart of how far lines stray.
fn straightness(lines: &[&MeasuredLine]) -> Value {
    let dots = |(name, bent): (&str, bool)| {
        let alike = lines.iter().filter(|line| line.straightness().is_bent() == bent);
        Series::plain(name, SeriesMark::Dots, alike.map(|line| (line.length_px, line.off_px)).collect::<Vec<_>>())
    };
    let series = [("straight", false), ("bent", true)].map(dots).into_iter();
    let series = series.filter(|series| !series.points.is_empty()).collect();
    let drawn = Chart::new("length in the panorama, pixels", "off straight, pixels", series);
    chart(&drawn, "How far each long line strays from straight, by its length.")
}
