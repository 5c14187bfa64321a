//! Panoramas for the report's qualitative figures: small, of rendered scenes, which may be shown.

use std::path::Path;

use trueup::{Error, Inputs, Outputs, Result, Silent, StageContext, Stitcher};

use crate::methods::{
    AANAP_PUBLISHED, APAP, GSP_2D_PUBLISHED, GSP_3D_PUBLISHED, SPHP, SPHP_FREE, VPG, VPG_PUBLISHED, method,
};
use crate::report::document::{Block, ReportPicture, ReportPictures, Section};
use crate::runner::Runner;
use crate::set_work::inputs_of;
use crate::sets::Catalogue;
use crate::trial::Trial;

/// Folder of the pictures, beside the report.
const FOLDER: &str = "figures";
/// Panorama pixels per pixel of the reference photograph: wide panoramas fit a page.
const SCALE: &str = "canvas.scale=0.3";
/// All of their shape.
const CROP: &str = "canvas.crop=none";
/// Bytes per picture matter more than the last of their quality.
const QUALITY: &str = "output.jpeg_quality=80";

/// A row of panoramas of one set.
struct Row {
    /// A set, by its name.
    set: &'static str,
    /// Only so many photographs around the middle one; `None` for all.
    photographs: Option<usize>,
    /// By which methods.
    methods: &'static [&'static str],
    /// What to look at.
    caption: &'static str,
}

const ROWS: [Row; 6] = [
    Row {
        set: "rolled/room-00",
        photographs: None,
        methods: &[SPHP, VPG_PUBLISHED],
        caption: "The paper's figure 1: a room in two photographs, the second not turned.",
    },
    Row {
        set: "rolled/room-30",
        photographs: None,
        methods: &[SPHP, VPG_PUBLISHED],
        caption: "The same with the second photograph turned by 30 degrees.",
    },
    Row {
        set: "study/07",
        photographs: Some(5),
        methods: &[APAP, SPHP, SPHP_FREE, VPG_PUBLISHED],
        caption: "Set 07 in five photographs by warps of homographies and by VPG (the paper's figure 6).",
    },
    Row {
        set: "study/03",
        photographs: None,
        methods: &[AANAP_PUBLISHED, GSP_2D_PUBLISHED, GSP_3D_PUBLISHED, VPG_PUBLISHED, VPG],
        caption: "Set 03 by natural methods (the paper's figure 7), and by the default.",
    },
    Row {
        set: "study/08",
        photographs: None,
        methods: &[AANAP_PUBLISHED, GSP_2D_PUBLISHED, GSP_3D_PUBLISHED, VPG_PUBLISHED, VPG],
        caption: "Set 08 by natural methods (the paper's figure 7), and by the default.",
    },
    Row {
        set: "twins/01",
        photographs: None,
        methods: &[GSP_3D_PUBLISHED, VPG_PUBLISHED, VPG],
        caption: "Blocks at random turns, which have no dominant directions: VPG falls back (the paper's figure 10).",
    },
];

/// Makes the panoramas and the section that shows them. What a method refuses is said instead.
///
/// # Errors
/// Those of making sets and of writing; [`Error::Cancelled`].
pub(crate) fn section(runner: &Runner, catalogue: &Catalogue, out: &Path) -> Result<Section> {
    let folder = out.join(FOLDER);
    std::fs::create_dir_all(&folder).map_err(|error| Error::io("making the folder", &folder, error))?;
    let mut section = Section::new(FOLDER, "Panoramas to look at");
    section.say(
        "Rendered scenes, reduced. Each method's panorama of the same photographs, with its own exposure and seams.",
    );
    for row in &ROWS {
        let Some(set) = catalogue.all().into_iter().find(|set| set.name == row.set) else { continue };
        let context = StageContext::new(&Silent, runner.cancel);
        let ready = set.prepare(&runner.data, &context)?;
        let (mut pictures, mut refused) = (Vec::new(), Vec::new());
        for one in row.methods.iter().filter_map(|name| method(name)) {
            let file = format!("{}-{}.jpg", row.set.replace('/', "-"), one.name);
            let overrides = [&one.overrides()[..], &[SCALE, CROP, QUALITY]].concat();
            let trial = Trial {
                photograph_count: row.photographs,
                central: row.photographs.is_some(),
                reference: row.set.starts_with("rolled/").then_some(0),
                ..Trial::new(FOLDER, row.set, one.name, &overrides)
            };
            match panorama(&trial, &inputs_of(&ready, &trial), &context, &folder.join(&file)) {
                Ok(()) => pictures.push(ReportPicture { file: format!("{FOLDER}/{file}"), words: one.name.to_owned() }),
                Err(error @ (Error::Cancelled | Error::Options(_) | Error::Io { .. })) => return Err(error),
                Err(error) => refused.push(format!("`{}`: {error}", one.name)),
            }
        }
        section.blocks.push(Block::Pictures(ReportPictures { caption: row.caption.to_owned(), pictures }));
        if !refused.is_empty() {
            section.blocks.push(Block::List(refused));
        }
    }
    Ok(section)
}

fn panorama(trial: &Trial, inputs: &Inputs, context: &StageContext, file: &Path) -> Result<()> {
    let options = trial.options()?;
    let stitcher = Stitcher::new(&options, context);
    let first = stitcher.align(inputs)?.alignments.into_iter().next();
    let alignment = first.ok_or_else(|| Error::input(&trial.set, "nothing was aligned", "Look at the set."))?;
    Outputs::new(file.to_owned()).write(&stitcher, alignment).map(drop)
}
