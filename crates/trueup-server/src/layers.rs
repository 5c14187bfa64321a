//! Drawings over a panorama: those of the report, over what the page shows.

use serde::Serialize;
use trueup::{Alignment, Project, Rendered, Result, ShownPhotographs};
use trueup_report::drawings::{Layer, seams_size};

/// What drawings over a picture of a panorama are made from.
#[derive(Debug)]
pub(crate) struct Underlay {
    /// The record of what the picture shows.
    project: Project,
    /// Which photograph it shows where; `None` where they were averaged.
    shown: Option<ShownPhotographs>,
    /// Whether distances and lines were measured in another view.
    is_measured_elsewhere: bool,
}

impl Underlay {
    /// That of what was `rendered` of `alignment`. Where this view could not be measured, because the panorama was
    /// opened from a record, measures are those of the view in which it was `stitched`: points and lines then lie where
    /// this view shows them.
    pub(crate) fn of(alignment: &Alignment, rendered: &Rendered, stitched: &Project) -> Self {
        let shown = alignment.shown(rendered, seams_size(alignment.project.canvas));
        let is_measured_elsewhere = alignment.project.measures.is_none() && stitched.measures.is_some();
        let mut project = alignment.project.clone();
        if is_measured_elsewhere {
            project.measures.clone_from(&stitched.measures);
        }
        Self { project, shown, is_measured_elsewhere }
    }

    /// The record of what the picture shows.
    pub(crate) fn project(&self) -> &Project {
        &self.project
    }

    /// One of its drawings.
    ///
    /// # Errors
    /// Those of drawing it.
    pub(crate) fn draw(&self, layer: Layer) -> Result<ToldLayer> {
        let drawing = layer.drawn(&self.project, self.shown.as_ref())?;
        let legend = layer.legend(&self.project).into_iter().map(|entry| ToldEntry {
            color: entry.color,
            dashes: entry.dashes,
            words: entry.words,
        });
        let of_measures = matches!(layer, Layer::Lines | Layer::Alignment);
        let is_measured_elsewhere = of_measures && self.is_measured_elsewhere && drawing.is_some();
        Ok(ToldLayer { drawing, legend: legend.collect(), is_measured_elsewhere })
    }
}

/// The layer of this name.
pub(crate) fn layer_named(name: &str) -> Option<Layer> {
    Layer::ALL.into_iter().find(|layer| layer.name() == name)
}

/// A drawing, for the page.
#[derive(Debug, Serialize)]
pub(crate) struct ToldLayer {
    /// SVG over the whole picture; `None` if there is nothing to draw.
    drawing: Option<String>,
    legend: Vec<ToldEntry>,
    is_measured_elsewhere: bool,
}

#[derive(Debug, Serialize)]
struct ToldEntry {
    color: String,
    dashes: &'static str,
    words: String,
}

/// A layer that can be asked for.
#[derive(Debug, Serialize)]
pub(crate) struct PossibleLayer {
    name: &'static str,
    title: &'static str,
}

/// All there are.
pub(crate) fn possible() -> Vec<PossibleLayer> {
    Layer::ALL.map(|layer| PossibleLayer { name: layer.name(), title: layer.title() }).into()
}
