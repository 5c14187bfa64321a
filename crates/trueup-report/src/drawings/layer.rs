//! All drawings that can lie over a panorama, by their names.

use trueup::{Canvas, Project, Result, ShownPhotographs};

use super::{
    LineDirection, alignment_error, alignment_legend, lines_of_panorama, outlines, overlaps, photograph_color, seams,
};

/// A drawing that can lie over a panorama.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Layer {
    /// [`outlines`].
    Outlines,
    /// [`seams`].
    Seams,
    /// [`lines_of_panorama`].
    Lines,
    /// [`alignment_error`].
    Alignment,
    /// [`overlaps`].
    Overlaps,
}

/// Longer side of the raster that seams are drawn on: as fine as is seen over a panorama on a screen.
const SEAMS_PX: usize = 900;

/// The columns and rows of a [`ShownPhotographs`] as fine as [`seams`] needs it over this canvas, for
/// [`trueup::Alignment::shown`].
pub fn seams_size(canvas: Canvas) -> [usize; 2] {
    within(SEAMS_PX, [canvas.width, canvas.height])
}

/// The largest size of the same shape whose longer side is at most `longest`.
fn within(longest: usize, [width, height]: [usize; 2]) -> [usize; 2] {
    let scale = (longest as f64 / width.max(height).max(1) as f64).min(1.0);
    [width, height].map(|side| ((side as f64 * scale).round() as usize).max(1))
}

/// What a color of a layer stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LegendEntry {
    /// As CSS writes colors.
    pub color: String,
    /// Lengths of dashes and gaps of a line; empty for none.
    pub dashes: &'static str,
    /// What it stands for.
    pub words: String,
}

impl Layer {
    /// All there are, in the order of the report.
    pub const ALL: [Self; 5] = [Self::Outlines, Self::Seams, Self::Lines, Self::Alignment, Self::Overlaps];

    /// A name for addresses and the like, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Outlines => "outlines",
            Self::Seams => "seams",
            Self::Lines => "lines",
            Self::Alignment => "alignment",
            Self::Overlaps => "overlaps",
        }
    }

    /// What people call it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Outlines => "Outlines of the photographs",
            Self::Seams => "Seams",
            Self::Lines => "Lines by vanishing point",
            Self::Alignment => "Alignment error",
            Self::Overlaps => "Overlaps",
        }
    }

    /// The drawing over the panorama of `project`, as SVG; `shown` is which photograph it shows where. `None` if there
    /// is nothing to draw: seams where photographs are averaged, lines and errors where none were measured.
    ///
    /// # Errors
    /// [`trueup::Error::Input`] if the project's grids are damaged.
    pub fn drawn(self, project: &Project, shown: Option<&ShownPhotographs>) -> Result<Option<String>> {
        let measures = project.measures.as_ref();
        match self {
            Self::Outlines => outlines(project).map(Some),
            Self::Seams => Ok(shown.map(seams)),
            Self::Lines => {
                let has_lines =
                    measures.is_some_and(|measures| measures.photographs.iter().any(|one| !one.lines.is_empty()));
                has_lines.then(|| lines_of_panorama(project)).transpose()
            }
            Self::Alignment => {
                let has_places = measures.is_some_and(|measures| !measures.pairs.is_empty());
                has_places.then(|| alignment_error(project)).transpose()
            }
            Self::Overlaps => overlaps(project).map(Some),
        }
    }

    /// What its colors stand for.
    pub fn legend(self, project: &Project) -> Vec<LegendEntry> {
        match self {
            Self::Outlines | Self::Seams => {
                let names = project.photograph_names();
                let used = project.used_positions().into_iter();
                let entry = |position: usize| LegendEntry {
                    color: photograph_color(position).to_owned(),
                    dashes: "",
                    words: format!("{}: {}", position + 1, names.get(position).map_or("", String::as_str)),
                };
                used.map(entry).collect()
            }
            Self::Lines => {
                let entry = |direction: LineDirection| LegendEntry {
                    color: direction.color().to_owned(),
                    dashes: direction.dashes(),
                    words: direction.words().to_owned(),
                };
                LineDirection::ALL.map(entry).to_vec()
            }
            Self::Alignment => {
                let entry = |(color, error): (String, f64)| LegendEntry {
                    color,
                    dashes: "",
                    words: format!("{error:.1} px apart"),
                };
                alignment_legend(project).into_iter().map(entry).collect()
            }
            Self::Overlaps => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_keep_their_shape_and_are_never_enlarged() {
        assert_eq!(within(900, [3600, 600]), [900, 150]);
        assert_eq!(within(900, [300, 200]), [300, 200]);
        assert_eq!(within(10, [4000, 1]), [10, 1]);
    }
}
