//! How the photographs' light was evened out.

use serde_json::{Value, json};
use trueup::{BrightnessStep, ImageRecord, Project};

use super::Page;
use super::figures::{along, chart, reaching_down};
use crate::charts::{Chart, Series, SeriesMark};

/// Names of the channels.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];
/// Steps of a curve over the radius.
const STEPS: usize = 40;

pub(super) fn values(page: &Page) -> Value {
    json!({
        "is_evened": page.project.options.compose.exposure.enabled,
        "gains": gains(page.project),
        "vignetting": vignetting(page.project),
        "steps": (!page.brightness.is_empty()).then(|| steps(page.brightness)),
    })
}

fn used(project: &Project) -> Vec<(usize, &ImageRecord)> {
    project.used_positions().into_iter().map(|position| (position, &project.images[position])).collect()
}

/// The chart of gains.
fn gains(project: &Project) -> Value {
    let used = used(project);
    let stops = |channel: usize| {
        let gain = move |(k, (_, image)): (usize, &(usize, &ImageRecord))| {
            Some((k as f64, image.correction?.gain[channel].log2()))
        };
        used.iter().enumerate().filter_map(gain).collect::<Vec<_>>()
    };
    let series = (0..CHANNELS.len()).map(|channel| Series::plain(CHANNELS[channel], SeriesMark::Bars, stops(channel)));
    let drawn = reaching_down(Chart::new("photograph", "brighter, stops", series.collect()));
    let names = used.iter().map(|(position, _)| (position + 1).to_string()).collect();
    chart(&along(drawn, names), "By how much each photograph was brightened (above zero) or darkened, by channel.")
}

/// The chart of vignetting, in which photographs that were corrected alike share a curve; `None` where there is none.
fn vignetting(project: &Project) -> Option<Value> {
    let mut curves: Vec<([f64; 3], Vec<usize>)> = Vec::new();
    for (position, image) in used(project) {
        let Some(correction) = image.correction else { continue };
        match curves.iter_mut().find(|(known, _)| *known == correction.vignetting) {
            Some((_, positions)) => positions.push(position),
            None => curves.push((correction.vignetting, vec![position])),
        }
    }
    if curves.iter().all(|(curve, _)| curve.iter().all(|&coefficient| coefficient == 0.0)) {
        return None;
    }
    let series = curves.iter().filter_map(|(_, positions)| {
        let correction = project.images[*positions.first()?].correction?;
        let at = |step: usize| {
            let radius = step as f64 / STEPS as f64;
            (radius, correction.at_radius(radius * radius).log2())
        };
        let name = match positions.as_slice() {
            [first, .., last] => format!("photographs {} to {}", first + 1, last + 1),
            _ => format!("photograph {}", positions.first()? + 1),
        };
        Some(Series::plain(&name, SeriesMark::Curve, (0..=STEPS).map(at).collect::<Vec<_>>()))
    });
    let drawn = Chart::new("distance from the middle (1 is the corner)", "brighter, stops", series.collect());
    Some(chart(&reaching_down(drawn), "By how much places were brightened towards the corners."))
}

/// The chart of how far neighbors were apart before and after.
fn steps(brightness: &[BrightnessStep]) -> Value {
    let bars = |name: &str, levels: fn(&BrightnessStep) -> f64| {
        let points = brightness.iter().enumerate().map(|(k, step)| (k as f64, levels(step).abs()));
        Series::plain(name, SeriesMark::Bars, points.collect::<Vec<_>>())
    };
    let series = vec![bars("before", |step| step.before), bars("after", |step| step.after)];
    let names = brightness.iter().map(|step| format!("{}-{}", step.a + 1, step.b + 1)).collect();
    let drawn = along(Chart::new("neighbors", "levels of 255 apart", series), names);
    chart(&drawn, "How much brighter the one of two neighbors is where both show the same, before and after.")
}
