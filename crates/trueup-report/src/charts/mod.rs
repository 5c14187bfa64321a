//! Drawings as SVG: bars with deviations, lines, points, on plain axes.

mod axis;

use std::fmt::Write;

use crate::text::escape;
use axis::Scale;

/// Colors that the color-blind can tell apart (Okabe and Ito, Color Universal Design, 2008).
const COLORS: [&str; 8] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#f0e442"];

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 330.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 56.0;

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesMark {
    /// Bars from zero, side by side with those of the other series.
    Bars,
    /// A line with a dot at every point.
    Line,
    /// A line alone.
    Curve,
    /// Dots alone.
    Dots,
}

/// One point of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Where: a number, or the position of a category.
    pub x: f64,
    /// How much.
    pub y: f64,
    /// Deviation drawn to both sides; 0 for none.
    pub deviation: f64,
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// How it is drawn.
    pub mark: SeriesMark,
    /// The points, in drawing order. Points without a finite place are left out.
    pub points: Vec<Point>,
}

/// A drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Words at the horizontal axis.
    pub x_label: String,
    /// Words at the vertical axis.
    pub y_label: String,
    /// Names along the horizontal axis instead of numbers.
    pub categories: Vec<String>,
    /// Lower and upper end of the horizontal axis where the points do not say it.
    pub x_range: Option<(f64, f64)>,
    /// Lower end of the vertical axis; 0 unless told.
    pub y_min: Option<f64>,
    /// Upper end of the vertical axis where the points do not say it.
    pub y_max: Option<f64>,
    /// What is drawn.
    pub series: Vec<Series>,
    /// Vertical lines with their words.
    pub rules: Vec<(f64, String)>,
}

impl Series {
    /// A series without deviations.
    pub fn plain(name: &str, mark: SeriesMark, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().map(|(x, y)| Point { x, y, deviation: 0.0 }).collect();
        Self { name: name.to_owned(), mark, points }
    }
}

impl Chart {
    /// A chart of these series without further wishes.
    pub fn new(x_label: &str, y_label: &str, series: Vec<Series>) -> Self {
        Self {
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            categories: Vec::new(),
            x_range: None,
            y_min: None,
            y_max: None,
            series,
            rules: Vec::new(),
        }
    }

    /// Names along the horizontal axis.
    pub fn with_categories(self, categories: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { categories: categories.into_iter().map(Into::into).collect(), ..self }
    }

    /// The drawing.
    pub fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|series| &series.points).filter(|point| drawable(point));
        let highest = points().map(|point| point.y + point.deviation).fold(0.0, f64::max);
        let y = Scale::new(self.y_min.unwrap_or(0.0), self.y_max.unwrap_or(highest), HEIGHT - BOTTOM, TOP);
        let x = match (self.categories.len(), self.x_range) {
            (0, Some((low, high))) => Scale::exact(low, high, LEFT, WIDTH - RIGHT),
            (0, None) => {
                let low = points().map(|point| point.x).fold(f64::INFINITY, f64::min);
                let high = points().map(|point| point.x).fold(f64::NEG_INFINITY, f64::max);
                Scale::exact(low, high, LEFT, WIDTH - RIGHT)
            }
            (count, _) => Scale::exact(-0.5, count as f64 - 0.5, LEFT, WIDTH - RIGHT),
        };
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" class=\"chart\" role=\"img\" \
             aria-label=\"Chart: {} by {}\" font-family=\"system-ui, sans-serif\" font-size=\"12\" \
             xmlns=\"http://www.w3.org/2000/svg\">\n",
            escape(&self.y_label),
            escape(&self.x_label)
        );
        self.draw_axes(&mut svg, &x, &y);
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut svg, index, series, &x, &y);
        }
        for (place, words) in &self.rules {
            let at = x.place(*place);
            let _ = writeln!(
                svg,
                "<line x1=\"{at:.1}\" y1=\"{TOP}\" x2=\"{at:.1}\" y2=\"{:.1}\" stroke=\"#444\" stroke-dasharray=\"5 4\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#444\">{}</text>",
                HEIGHT - BOTTOM,
                at + 5.0,
                TOP + 12.0,
                escape(words)
            );
        }
        self.draw_legend(&mut svg);
        svg.push_str("</svg>");
        svg
    }

    fn draw_axes(&self, svg: &mut String, x: &Scale, y: &Scale) {
        for tick in y.ticks() {
            let at = y.place(tick);
            let _ = writeln!(
                svg,
                "<line x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{:.1}\" y2=\"{at:.1}\" stroke=\"#e3e8ee\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#5b6675\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 8.0,
                at + 4.0,
                y.label(tick)
            );
        }
        let floor = HEIGHT - BOTTOM;
        if self.y_min.is_some_and(|low| low < 0.0) {
            let (zero, right) = (y.place(0.0), WIDTH - RIGHT);
            let _ = writeln!(
                svg,
                "<line x1=\"{LEFT}\" y1=\"{zero:.1}\" x2=\"{right:.1}\" y2=\"{zero:.1}\" stroke=\"#444\"/>"
            );
        }
        let named: Vec<(f64, String)> = match self.categories.is_empty() {
            true => x.ticks().into_iter().map(|tick| (tick, x.label(tick))).collect(),
            false => self.categories.iter().enumerate().map(|(k, name)| (k as f64, name.clone())).collect(),
        };
        for (tick, name) in named {
            let at = x.place(tick);
            let _ = writeln!(
                svg,
                "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#5b6675\">{}</text>",
                floor + 18.0,
                escape(&name)
            );
        }
        let middle = (TOP + floor) / 2.0;
        let _ = writeln!(
            svg,
            "<line x1=\"{LEFT}\" y1=\"{floor}\" x2=\"{:.1}\" y2=\"{floor}\" stroke=\"#1d2430\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(16 {middle}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            WIDTH - RIGHT,
            (LEFT + WIDTH - RIGHT) / 2.0,
            HEIGHT - 12.0,
            escape(&self.x_label),
            escape(&self.y_label)
        );
    }

    fn draw_series(&self, svg: &mut String, index: usize, series: &Series, x: &Scale, y: &Scale) {
        /// Share of a category's width that its bars take together.
        const FILLED: f64 = 0.8;
        let color = COLORS[index % COLORS.len()];
        let bars = self.series.iter().filter(|other| other.mark == SeriesMark::Bars).count().max(1) as f64;
        let rank = self.series[..index].iter().filter(|other| other.mark == SeriesMark::Bars).count() as f64;
        let step = FILLED * (x.place(1.0) - x.place(0.0)) / bars;
        let points: Vec<&Point> = series.points.iter().filter(|point| drawable(point)).collect();
        if matches!(series.mark, SeriesMark::Line | SeriesMark::Curve) {
            let path: Vec<String> =
                points.iter().map(|point| format!("{:.1},{:.1}", x.place(point.x), y.place(point.y))).collect();
            let path = path.join(" ");
            let _ = writeln!(svg, "<polyline points=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>");
        }
        for point in points {
            let mut at = x.place(point.x);
            let top = y.place(point.y);
            match series.mark {
                SeriesMark::Bars => {
                    let left = at + (rank - bars / 2.0) * step;
                    let height = (y.place(0.0) - top).abs();
                    let top = top.min(y.place(0.0));
                    at = left + step / 2.0;
                    let _ = writeln!(
                        svg,
                        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{step:.1}\" height=\"{height:.1}\" \
                         fill=\"{color}\" stroke=\"#fff\" stroke-width=\"0.6\"/>"
                    );
                }
                SeriesMark::Curve => {}
                SeriesMark::Line | SeriesMark::Dots => {
                    let _ = writeln!(svg, "<circle cx=\"{at:.1}\" cy=\"{top:.1}\" r=\"3.2\" fill=\"{color}\"/>");
                }
            }
            if point.deviation > 0.0 {
                let (low, high) = (
                    y.place((point.y - point.deviation).max(self.y_min.unwrap_or(0.0))),
                    y.place(point.y + point.deviation),
                );
                let _ = writeln!(
                    svg,
                    "<line x1=\"{at:.1}\" y1=\"{low:.1}\" x2=\"{at:.1}\" y2=\"{high:.1}\" stroke=\"#1d2430\"/>"
                );
            }
        }
    }

    fn draw_legend(&self, svg: &mut String) {
        /// Mean advance of a letter at the legend's size, pixels.
        const LETTER: f64 = 6.6;
        /// Between the lines of the legend, two of which lie above the drawing.
        const LINE: f64 = 16.0;
        let (mut at, mut line) = (LEFT, 4.0);
        for (index, series) in self.series.iter().enumerate() {
            let color = COLORS[index % COLORS.len()];
            let width = 34.0 + LETTER * series.name.chars().count() as f64;
            if at > LEFT && at + width > WIDTH {
                (at, line) = (LEFT, line + LINE);
            }
            let _ = writeln!(
                svg,
                "<rect x=\"{at:.1}\" y=\"{line}\" width=\"12\" height=\"12\" fill=\"{color}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                at + 17.0,
                line + 10.5,
                escape(&series.name)
            );
            at += width;
        }
    }
}

fn drawable(point: &Point) -> bool {
    point.x.is_finite() && point.y.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_of_two_series_stand_side_by_side() {
        let chart = Chart::new(
            "set",
            "deg",
            vec![
                Series::plain("a", SeriesMark::Bars, [(0.0, 1.0), (1.0, 2.0)]),
                Series::plain("b", SeriesMark::Bars, [(0.0, 2.0), (1.0, f64::NAN)]),
            ],
        )
        .with_categories(["01", "02"]);
        let svg = chart.svg();
        assert_eq!(svg.matches("stroke-width=\"0.6\"").count(), 3);
        // Each of the two categories is 390 px wide; its bars fill 0.8 of it around its middle, 64 + 195.
        assert!(svg.contains("<rect x=\"103.0\""), "{svg}");
        assert!(svg.contains("<rect x=\"259.0\""), "{svg}");
        assert!(!svg.contains("NaN"));
    }

    /// -1.5 to 1.5 in steps of 0.5 over 234 px: a unit is 78 px, and 0 lies 117 px below the upper end at 40.
    #[test]
    fn bars_below_zero_hang_from_it() {
        let bars = Series::plain("a", SeriesMark::Bars, [(0.0, -1.0), (1.0, 1.5)]);
        let svg =
            Chart { y_min: Some(-1.5), ..Chart::new("set", "stops", vec![bars]) }.with_categories(["01", "02"]).svg();
        assert!(svg.contains("y=\"157.0\" width=\"312.0\" height=\"78.0\""), "{svg}");
        assert!(svg.contains("y=\"40.0\" width=\"312.0\" height=\"117.0\""), "{svg}");
    }

    #[test]
    fn a_long_legend_goes_on_below() {
        let series = (0..10).map(|index| Series::plain(&format!("a method number {index}"), SeriesMark::Line, []));
        let svg = Chart::new("x", "y", series.collect()).svg();
        assert!(svg.contains("y=\"4\" width=\"12\"") && svg.contains("y=\"20\" width=\"12\""), "{svg}");
    }

    #[test]
    fn a_chart_without_points_is_still_a_drawing() {
        let svg = Chart::new("x", "y", Vec::new()).svg();
        assert!(svg.ends_with("</svg>") && !svg.contains("inf") && !svg.contains("NaN"), "{svg}");
    }
}
