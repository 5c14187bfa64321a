//! The figures of one set, and their CSV file.

use std::fs;
use std::path::Path;

use trueup::{Error, Evaluation, Measures, Project, Result, names_photograph, write_atomically};

use super::discover::{Part, StitchSet};
use super::measured::MeasuredStitch;
use crate::report::csv;
use crate::sets::read_truth;

/// What is known of one set's panorama.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct QualityRow {
    /// The table it belongs to.
    pub part: Part,
    /// The set.
    pub set: String,
    /// Its kind.
    pub kind: String,
    /// Photographs in the panorama.
    pub used: usize,
    /// Photographs in the folder.
    pub given: usize,
    /// `yes`, `all lines` (of all photographs together), `vertical only`, `no`, or `-` without a panorama.
    pub guided: String,
    /// Vanishing point divergence.
    pub divergence: Option<f64>,
    /// Deviation from upright, degrees: of the scene's vertical where it is known, else as the panorama's own lines
    /// tell it.
    pub upright_deg: Option<f64>,
    /// The same of the worst photograph.
    pub upright_max_deg: Option<f64>,
    /// Local distortion, x 1e-2.
    pub ld: Option<f64>,
    /// Global direction inconsistency, degrees; estimated from the lines of all photographs where the cameras are not
    /// known.
    pub gdic_deg: Option<f64>,
    /// Alignment, source pixels: of true correspondences where they are known, else of matches.
    pub align_px: Option<f64>,
    /// Width and height of the panorama.
    pub size: String,
    /// Wall seconds of the whole process.
    pub seconds: Option<f64>,
    /// Its largest resident set, MB.
    pub peak_mb: Option<f64>,
    /// The program's version.
    pub version: String,
    /// What went wrong.
    pub note: String,
}

/// Decimal, as file managers count.
const BYTES_PER_MB: f64 = 1e6;

const HEADS: [&str; 17] = [
    "part",
    "set",
    "kind",
    "used",
    "given",
    "guided",
    "divergence",
    "upright_deg",
    "upright_max_deg",
    "ld",
    "gdic_deg",
    "align_px",
    "size",
    "seconds",
    "peak_mb",
    "version",
    "note",
];

impl QualityRow {
    /// A row without figures.
    pub(super) fn empty(part: Part, set: &str, kind: &str) -> Self {
        Self {
            part,
            set: set.to_owned(),
            kind: kind.to_owned(),
            used: 0,
            given: 0,
            guided: "-".to_owned(),
            divergence: None,
            upright_deg: None,
            upright_max_deg: None,
            ld: None,
            gdic_deg: None,
            align_px: None,
            size: String::new(),
            seconds: None,
            peak_mb: None,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            note: String::new(),
        }
    }

    /// The figures of a set that was stitched.
    ///
    /// # Errors
    /// Those of reading the record and the truth.
    pub(super) fn new(set: &StitchSet, measured: &MeasuredStitch) -> Result<Self> {
        let mut row = Self {
            seconds: Some(measured.seconds),
            peak_mb: Some(measured.peak_bytes as f64 / BYTES_PER_MB),
            note: measured.complaint.clone(),
            given: photographs_in(&set.folder)?,
            ..Self::empty(set.part, &set.name, &set.kind)
        };
        let Some(path) = &measured.project else { return Ok(row) };
        let text = fs::read_to_string(path).map_err(|error| Error::io("reading", path, error))?;
        let project = Project::from_json(&text, &path.display().to_string())?;
        (row.used, row.given) = (project.used(), project.images.len());
        row.guided = guided(&project).to_owned();
        row.divergence = project.manhattan.divergence;
        row.size = format!("{} x {}", project.canvas.width, project.canvas.height);
        match set.part {
            Part::Known => match trueup::evaluate(&project, &read_truth(&set.folder)?.0) {
                Ok(evaluation) => row.take_truth(&evaluation),
                Err(error) => row.note = error.to_string(),
            },
            Part::Photographs => {
                if let Some(measures) = &project.measures {
                    row.take_measures(measures);
                }
            }
        }
        Ok(row)
    }

    /// What the panorama's own lines and matches say.
    fn take_measures(&mut self, measures: &Measures) {
        self.upright_deg = measures.upright.map(|upright| upright.mean_deg);
        self.upright_max_deg = measures.upright.map(|upright| upright.max_deg);
        self.ld = Some(measures.ld);
        self.gdic_deg = measures.estimated_gdic_deg;
        self.align_px = measures.reprojection.as_ref().map(|reprojection| reprojection.rms_px);
    }

    fn take_truth(&mut self, evaluation: &Evaluation) {
        self.upright_deg = Some(evaluation.upright_deg);
        self.upright_max_deg = Some(evaluation.upright_max_deg);
        self.ld = Some(evaluation.ld);
        self.gdic_deg = Some(evaluation.gdic_deg);
        self.align_px = evaluation.align_px;
    }

    fn cells(&self) -> [String; 17] {
        let optional = |figure: Option<f64>| figure.map_or(String::new(), |figure| format!("{figure:.5}"));
        [
            self.part.name().to_owned(),
            self.set.clone(),
            self.kind.clone(),
            self.used.to_string(),
            self.given.to_string(),
            self.guided.clone(),
            optional(self.divergence),
            optional(self.upright_deg),
            optional(self.upright_max_deg),
            optional(self.ld),
            optional(self.gdic_deg),
            optional(self.align_px),
            self.size.clone(),
            optional(self.seconds),
            optional(self.peak_mb),
            self.version.clone(),
            self.note.clone(),
        ]
    }

    /// The row that [`QualityRow::cells`] made; `None` if it is none.
    fn from_cells(cells: &[String]) -> Option<Self> {
        let [part, set, kind, used, given, guided, numbers @ .., size, seconds, peak_mb, version, note] = cells else {
            return None;
        };
        let [divergence, upright, upright_max, ld, gdic, align] = numbers else { return None };
        let optional = |cell: &String| cell.parse().ok();
        Some(Self {
            part: Part::ALL.into_iter().find(|known| known.name() == part)?,
            set: set.clone(),
            kind: kind.clone(),
            used: used.parse().ok()?,
            given: given.parse().ok()?,
            guided: guided.clone(),
            divergence: optional(divergence),
            upright_deg: optional(upright),
            upright_max_deg: optional(upright_max),
            ld: optional(ld),
            gdic_deg: optional(gdic),
            align_px: optional(align),
            size: size.clone(),
            seconds: optional(seconds),
            peak_mb: optional(peak_mb),
            version: version.clone(),
            note: note.clone(),
        })
    }
}

/// How vanishing points took part.
fn guided(project: &Project) -> &'static str {
    match (project.manhattan.accepted, &project.manhattan.failed_clause) {
        (true, None) => "yes",
        (true, Some(_)) if project.manhattan.pooled => "all lines",
        (true, Some(_)) => "vertical only",
        (false, _) => "no",
    }
}

/// Files in a folder that are named like photographs, for sets that could not be stitched.
fn photographs_in(folder: &Path) -> Result<usize> {
    let entries = fs::read_dir(folder).map_err(|error| Error::io("reading the folder", folder, error))?;
    Ok(entries.filter_map(std::result::Result::ok).filter(|entry| names_photograph(&entry.path())).count())
}

/// Writes rows as CSV.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn write_rows(path: &Path, rows: &[QualityRow]) -> Result<()> {
    let mut text = csv::line(HEADS);
    for row in rows {
        text.push_str(&csv::line(row.cells().iter().map(String::as_str)));
    }
    write_atomically(path, text.as_bytes())
}

/// Reads what [`write_rows`] wrote.
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] if it is something else.
pub(super) fn read_rows(path: &Path) -> Result<Vec<QualityRow>> {
    let text = fs::read_to_string(path).map_err(|error| Error::io("reading", path, error))?;
    let mut lines = text.lines();
    let fits = lines.next().is_some_and(|head| csv::cells(head) == HEADS);
    let rows: Option<Vec<QualityRow>> = lines.map(|line| QualityRow::from_cells(&csv::cells(line))).collect();
    rows.filter(|_| fits).ok_or_else(|| {
        Error::input(path.display(), "it is no table of quality", "Give a file that `trueup-bench quality` wrote.")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_from_their_file() {
        let row = QualityRow {
            used: 3,
            given: 4,
            upright_deg: Some(0.125),
            seconds: Some(1.5),
            peak_mb: Some(64.0),
            note: "a, \"b\"".to_owned(),
            ..QualityRow::empty(Part::Known, "library", "row")
        };
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("quality.csv");
        write_rows(&path, std::slice::from_ref(&row)).expect("writes");
        assert_eq!(read_rows(&path).expect("reads"), [row]);
        fs::write(&path, "something,else\n").expect("writes");
        assert!(read_rows(&path).is_err());
    }
}
