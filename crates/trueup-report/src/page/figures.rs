//! Figures and charts as the page has them.

use serde_json::{Value, json};

use crate::charts::Chart;

/// With more names than this along an axis, it has numbers of its own.
const NAMED: usize = 24;

/// A figure of the project: `field` is its place in the record (a JSON pointer), `decimals` how exactly it is shown.
pub(super) fn figure(field: &str, value: f64, decimals: usize) -> Value {
    json!({ "field": field, "value": value.to_string(), "shown": format!("{value:.decimals$}") })
}

/// The size of a figure of the project, whose sign is told by words beside it.
pub(super) fn size(field: &str, value: f64, decimals: usize) -> Value {
    json!({ "field": field, "value": value.to_string(), "shown": format!("{:.decimals$}", value.abs()) })
}

/// A count of the project.
pub(super) fn count(field: &str, value: usize) -> Value {
    json!({ "field": field, "value": value.to_string(), "shown": value.to_string() })
}

/// A chart with its words.
pub(super) fn chart(chart: &Chart, caption: &str) -> Value {
    json!({ "svg": chart.svg(), "caption": caption })
}

/// The chart with names along its axis, if these are few.
pub(super) fn along(chart: Chart, names: Vec<String>) -> Chart {
    if names.len() > NAMED { chart } else { chart.with_categories(names) }
}

/// The chart whose vertical axis reaches down to the lowest of its points, with their deviations.
pub(super) fn reaching_down(chart: Chart) -> Chart {
    let points = chart.series.iter().flat_map(|series| &series.points);
    let low = points.map(|point| point.y - point.deviation).filter(|low| low.is_finite()).fold(0.0, f64::min);
    Chart { y_min: Some(low), ..chart }
}
