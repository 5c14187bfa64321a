//! `trueup report`, and `--report` beside a panorama: the page that shows why it looks as it does.

use std::path::{Path, PathBuf};

use serde_json::json;
use trueup::{Error, Outputs, Project, ReadFile, RunOptions, StageContext, Written};
use trueup_report::ReportJob;

use crate::arguments::ReportArgs;
use crate::failure::Failure;
use crate::inspect;
use crate::output;
use crate::progress;
use crate::words::file_size;

/// Extensions of pages.
const EXTENSIONS: [&str; 2] = ["html", "htm"];

pub(crate) fn run(args: &ReportArgs) -> Result<(), Failure> {
    let project = inspect::read_to_use(&args.project)?;
    check(&args.output)?;
    Outputs::new(&args.output).refuse_over([(args.project.as_path(), ReadFile::Project)])?;
    let job = ReportJob {
        name: stem(&args.project),
        project,
        project_folder: args.project.parent().unwrap_or(Path::new("")).to_owned(),
        photographs: args.photos.clone(),
        // Another machine may have stitched, which has other memory and other folders.
        run: RunOptions::default(),
        threads: args.threads.map_or(0, usize::from),
    };
    let page = progress::shown(args.quiet, |context| job.run(context))?;
    trueup::write_atomically(&args.output, page.as_bytes())?;
    let file = args.output.display();
    match (args.json, args.quiet) {
        (true, _) => {
            let told =
                json!({ "format": "trueup-report", "version": 1, "report": file.to_string(), "bytes": page.len() });
            output::print(&format!("{told}\n"))
        }
        (false, true) => Ok(()),
        (false, false) => output::print(&format!("report      {file}  {}\n", file_size(page.len() as u64))),
    }
}

/// Where the pages of panoramas are written that are made now.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct ReportBeside {
    pub file: Option<PathBuf>,
    pub threads: usize,
}

impl ReportBeside {
    /// Refuses before work starts a page that could not be written, or that would take the place of another output.
    pub(crate) fn check(&self, outputs: &Outputs) -> Result<(), Failure> {
        let Some(file) = &self.file else { return Ok(()) };
        check(file)?;
        let others = std::iter::once(&outputs.panorama).chain(outputs.beside.values());
        match others.into_iter().any(|other| trueup::same_place(other, file)) {
            true => Err(Failure::usage(
                format!("{}: it cannot be the file of both --report and another output", file.display()),
                "Give them different names.",
            )),
            false => Ok(()),
        }
    }

    /// Writes the page of every panorama, numbered as these are.
    pub(crate) fn write(&self, written: &[Written], context: &StageContext) -> Result<(), Error> {
        let Some(file) = &self.file else { return Ok(()) };
        for (index, one) in written.iter().enumerate() {
            let number = (written.len() > 1).then_some(index + 1);
            let page = self.page(&one.outputs.panorama, &one.project, context)?;
            trueup::write_atomically(&Outputs::new(file).numbered(number).panorama, page.as_bytes())?;
        }
        Ok(())
    }

    fn page(&self, panorama: &Path, project: &Project, context: &StageContext) -> Result<String, Error> {
        let job = ReportJob {
            name: stem(panorama),
            project: project.clone(),
            project_folder: PathBuf::new(),
            photographs: None,
            // As was asked for the panorama, here and now.
            run: project.options.run.clone(),
            threads: self.threads,
        };
        job.run(context)
    }
}

/// Refuses a place that takes no page: no photograph or project is written over by a slip of the hand.
fn check(file: &Path) -> Result<(), Failure> {
    let extension = file.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    if !extension.is_some_and(|extension| EXTENSIONS.contains(&extension.as_str())) {
        let message = format!("{}: the report is a page in HTML", file.display());
        return Err(Failure::usage(message, "Give it a name that ends in .html."));
    }
    Ok(trueup::check_place(file)?)
}

/// The name of a file without folder and extension.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
