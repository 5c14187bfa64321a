//! Why the panorama stands as it does: vanishing points, leans, and every photograph with its lines.

use serde_json::{Value, json};
use trueup::{ImageRecord, LineGuide, PhotographMeasures, Project, lean_side};

use super::figures::{along, chart, count, figure, reaching_down, size};
use super::{Page, picture};
use crate::charts::{Chart, Point, Series, SeriesMark};
use crate::drawings;
use crate::drawings::photograph_color;

pub(super) fn values(page: &Page) -> Value {
    let found = &page.project.manhattan;
    let upright = page.project.measures.as_ref().and_then(|measures| measures.upright.as_ref());
    let figures = upright.map(|upright| {
        json!({
            "mean": figure("/measures/upright/mean_deg", upright.mean_deg, 2),
            "max": figure("/measures/upright/max_deg", upright.max_deg, 2),
            "within": upright.within_deg.map(|within| figure("/measures/upright/within_deg", within, 2)),
            "measured": count("/measures/upright/measured", upright.measured),
        })
    });
    json!({
        "guidance": guidance(page.project),
        "level": found.level_in_words(),
        "divergence": found.divergence.map(|divergence| figure("/manhattan/divergence", divergence, 3)),
        "threshold": figure("/manhattan/threshold", found.threshold, 3),
        "figures": figures,
        "leans": leans(page.project),
    })
}

/// Whether vanishing points guided the panorama, in words.
fn guidance(project: &Project) -> String {
    let found = &project.manhattan;
    let slope = found.slope_deg.map_or(String::new(), |slope| {
        format!(" Lines along a slope of {slope:.1} degrees, such as those of a pavement, did not count.")
    });
    let guidance = match found.guide() {
        Some(LineGuide::AllLines) => {
            "The lines of all photographs together told which way is down, since those of single ones did not agree."
                .to_owned()
        }
        Some(LineGuide::UprightLines) => {
            "Upright lines alone told which way is down, since the directions of others did not agree.".to_owned()
        }
        Some(LineGuide::VanishingPoints) => format!(
            "Vanishing points told which way is down: those of {} of {} photographs agree.",
            found.inliers.len(),
            project.used()
        ),
        None => format!(
            "Vanishing points did not guide this panorama{}. What else tells which way is down levels it.",
            found.refusal_in_words()
        ),
    };
    guidance + &slope
}

/// The chart of leans, if any is known.
fn leans(project: &Project) -> Option<Value> {
    let photographs = &project.measures.as_ref()?.photographs;
    let points = |certain: bool| -> Vec<Point> {
        let alike = photographs.iter().enumerate().filter(|(_, one)| one.certain == certain);
        alike.filter_map(|(k, one)| Some(Point { x: k as f64, y: one.lean_deg?, deviation: one.within_deg? })).collect()
    };
    let series = [("sure to a degree", true), ("uncertain", false)].map(|(name, certain)| Series {
        name: name.to_owned(),
        mark: SeriesMark::Dots,
        points: points(certain),
    });
    let series: Vec<Series> = series.into_iter().filter(|series| !series.points.is_empty()).collect();
    if series.is_empty() {
        return None;
    }
    let position =
        |one: &PhotographMeasures| project.images.iter().position(|image| image.path == one.path).unwrap_or(0);
    let names = photographs.iter().map(|one| (position(one) + 1).to_string()).collect();
    let drawn = reaching_down(Chart::new("photograph", "lean to the right, degrees", series));
    let caption = "By how much each photograph leans to the right in the panorama, with its interval of 95 %.";
    Some(chart(&along(drawn, names), caption))
}

/// Every photograph in use: its picture, its lines, its figures.
pub(super) fn photographs(page: &Page) -> Vec<Value> {
    page.project.used_positions().into_iter().map(|position| photograph(page, position)).collect()
}

fn photograph(page: &Page, position: usize) -> Value {
    /// Decimals of degrees that are told.
    const DECIMALS: usize = 2;
    let image: &ImageRecord = &page.project.images[position];
    let measures = page.project.measures.as_ref().map(|measures| &measures.photographs);
    let index = measures.and_then(|all| all.iter().position(|one| one.path == image.path));
    let measured = measures.zip(index).map(|(all, index)| (index, &all[index]));
    let of_image = |name: &str, value: Option<f64>, decimals: usize| {
        value.map(|value| figure(&format!("/images/{position}/{name}"), value, decimals))
    };
    let of_measures = |name: &str, value: fn(&PhotographMeasures) -> Option<f64>| {
        let (index, one) = measured?;
        Some(figure(&format!("/measures/pictures/{index}/{name}"), value(one)?, DECIMALS))
    };
    let lines =
        measured.map(|(index, one)| count(&format!("/measures/pictures/{index}/vertical_lines"), one.vertical_lines));
    let lean = measured.and_then(|(index, one)| Some((index, one.lean_deg.filter(|_| one.within_deg.is_some())?)));
    json!({
        "name": page.named(position),
        "color": photograph_color(position),
        "is_reference": image.path == page.project.reference,
        "picture": page.pictures.photographs.get(&position).map(picture),
        "lines": drawings::lines_of_photograph(page.project, position).unwrap_or_default(),
        "lean": lean.map(|(index, degrees)| size(&format!("/measures/pictures/{index}/lean_deg"), degrees, DECIMALS)),
        "within": of_measures("within_deg", |one| one.within_deg),
        "side": lean.map_or("", |(_, degrees)| lean_side(degrees, DECIMALS)),
        "certain": measured.is_some_and(|(_, one)| one.certain),
        "vertical_lines": lines,
        "theta": of_image("theta_deg", image.theta_deg, 1),
        "scale": of_image("scale", image.scale, 3),
        "focal": of_image("focal_px", image.focal_px, 0),
    })
}
