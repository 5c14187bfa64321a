//! The page of a panorama: one HTML file that loads nothing and runs nothing. What it says stands in `page.html`, whose
//! values are escaped; the files here tell it the figures.

mod alignment;
mod figures;
mod light;
mod lines;
mod told;
mod upright;

use std::collections::BTreeMap;

use minijinja::Environment;
use serde_json::{Value, json};
use trueup::{BrightnessStep, Error, Judgement, Project, Result, ShownPhotographs, Verdict};

use crate::drawings::{Layer, LineDirection};
use crate::pictures::EmbeddedPicture;
use figures::count;

/// The page. Its name in the environment ends in `.html`, by which values are escaped.
const TEMPLATE: &str = include_str!("page.html");
/// The page's looks.
const STYLE: &str = include_str!("page.css");

/// The pictures on the page.
#[derive(Debug)]
pub(crate) struct Pictures {
    pub panorama: EmbeddedPicture,
    /// The photographs in use, by their positions in the project.
    pub photographs: BTreeMap<usize, EmbeddedPicture>,
}

/// What a page is made of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Page<'a> {
    pub name: &'a str,
    /// The record of the panorama, for figures.
    pub project: &'a Project,
    /// The same of the small panorama on the page, for drawings.
    pub drawn: &'a Project,
    pub pictures: &'a Pictures,
    /// Which photograph is shown where; `None` where they were averaged.
    pub shown: Option<&'a ShownPhotographs>,
    pub brightness: &'a [BrightnessStep],
    /// The photographs' names, by their positions.
    pub names: &'a [String],
}

impl Page<'_> {
    /// The page.
    ///
    /// # Errors
    /// [`Error::Input`] if the project's grids are damaged.
    pub(crate) fn text(&self) -> Result<String> {
        let told = told::Told::of(self)?;
        let values = json!({
            "name": self.name,
            "style": STYLE,
            "in_short": self.in_short(),
            "panorama": picture(&self.pictures.panorama),
            "drawings": self.drawings()?,
            "directions": LineDirection::ALL.map(direction),
            "photographs": upright::photographs(self),
            "upright": upright::values(self),
            "alignment": alignment::values(self),
            "pairs": alignment::pairs(self),
            "lines": lines::values(self),
            "light": light::values(self),
            "left_out": told.left_out,
            "warnings": told.warnings,
            "notes": told.notes,
            "time": told.time,
            "options": told.options,
        });
        let wrong = |error: minijinja::Error| Error::input("report", error, "Report this as a defect.");
        let mut environment = Environment::new();
        environment.add_template("page.html", TEMPLATE).map_err(wrong)?;
        environment
            .get_template("page.html")
            .and_then(|page| page.render(minijinja::value::Serde(values)))
            .map_err(wrong)
    }

    /// What lies over the panorama.
    fn drawings(&self) -> Result<Value> {
        let drawn = Layer::ALL.iter().map(|layer| Ok((layer.name(), layer.drawn(self.drawn, self.shown)?)));
        let drawn: BTreeMap<&str, Option<String>> = drawn.collect::<Result<_>>()?;
        Ok(json!(drawn))
    }

    /// The first words: what was made, and how good it is.
    fn in_short(&self) -> Value {
        let Judgement { upright, alignment, lines } = self.project.judgement();
        let judged = [
            ("Upright", upright, "whether what is vertical stands vertical"),
            ("Alignment", alignment, "whether neighboring photographs meet"),
            ("Lines", lines, "whether straight edges stay straight"),
        ];
        let judged = judged.map(|(what, verdict, meaning)| {
            let class = match verdict {
                Some(Verdict::Good) => "good",
                Some(Verdict::Fair) => "fair",
                Some(Verdict::LookAtIt) => "look",
                None => "none",
            };
            let verdict = verdict.map_or("not judged".to_owned(), |verdict| verdict.to_string());
            json!({ "what": what, "class": class, "verdict": verdict, "meaning": meaning })
        });
        json!({
            "used": self.project.used(),
            "given": self.project.images.len(),
            "width": count("/canvas/width", self.project.canvas.width),
            "height": count("/canvas/height", self.project.canvas.height),
            "full_turn": self.project.canvas.full_turn,
            "method": self.project.method,
            "judged": judged,
        })
    }

    /// The photograph's number on the page and its name.
    fn named(&self, position: usize) -> String {
        format!("{}: {}", position + 1, self.names.get(position).map_or("", String::as_str))
    }

    /// The same of the photograph at this path.
    fn named_by(&self, path: &str) -> String {
        let position = self.project.images.iter().position(|image| image.path == path);
        position.map_or_else(|| path.to_owned(), |position| self.named(position))
    }
}

/// A picture as the page has it.
fn picture(picture: &EmbeddedPicture) -> Value {
    json!({ "address": picture.address, "width": picture.width, "height": picture.height })
}

fn direction(direction: LineDirection) -> Value {
    json!({ "color": direction.color(), "dashes": direction.dashes(), "words": direction.words() })
}
