//! `trueup batch`: the panoramas of a tree of folders, one set of photographs after the other.

mod page;
mod record;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use trueup::{Error, Inputs, Outputs, PhotographsOfFolder, SideOutput, StageContext, StitchJob, StitchOptions};

use crate::arguments::{BatchArgs, Shard, TypedOptions};
use crate::chosen;
use crate::failure::Failure;
use crate::output;
use crate::progress;
use crate::summary;

use record::{FORMAT, SetRecord, VERSION};

/// The file of all lines.
const LINES: &str = "batch.jsonl";
/// The page of all panoramas.
const PAGE: &str = "index.html";
/// What a set's panorama is called in its folder, without extension.
const PANORAMA: &str = "panorama";

pub(crate) fn run(args: BatchArgs) -> Result<(), Failure> {
    let options = chosen::options(StitchOptions::default(), &args.tuning, &TypedOptions::default())?;
    let failed = progress::shown(args.quiet || args.json, |context| {
        let sets = trueup::photograph_sets(&args.folder, &args.output, args.gap, context)?;
        let batch = Batch { args: &args, options: &options, sets: &sets };
        match args.dry_run {
            true => batch.tell_plan().map(|()| 0),
            false => batch.run(context),
        }
    })?;
    match failed {
        0 => Ok(()),
        count => Err(Failure::unsatisfied(
            format!("{} made no panorama", if count == 1 { "1 set".to_owned() } else { format!("{count} sets") }),
            format!("{} says why.", args.output.join(LINES).display()),
        )),
    }
}

/// The work.
struct Batch<'a> {
    args: &'a BatchArgs,
    options: &'a StitchOptions,
    sets: &'a [PhotographsOfFolder],
}

impl Batch<'_> {
    /// The sets of this part, with their positions.
    fn mine(&self) -> impl Iterator<Item = &PhotographsOfFolder> {
        let whole = Shard { number: 1, count: 1 };
        let shard = self.args.shard.unwrap_or(whole);
        self.sets.iter().enumerate().filter(move |(position, _)| shard.holds(*position)).map(|(_, set)| set)
    }

    /// Prints what would be stitched.
    fn tell_plan(&self) -> Result<(), Failure> {
        let mut text = String::new();
        for set in self.mine() {
            let paths: Vec<String> = set.photographs.iter().map(|path| path.display().to_string()).collect();
            match (self.args.json, set.is_alone()) {
                (true, _) => text += &json!({ "format": FORMAT, "version": VERSION, "set": set.name, "status": "planned", "photographs": paths }).to_string(),
                (false, true) => text += &format!("{}: 1 photograph, which makes no panorama", set.name),
                (false, false) => text += &format!("{}: {} photographs", set.name, paths.len()),
            }
            text.push('\n');
        }
        output::print(&text)
    }

    /// Stitches what is not made yet; returns the number of sets that made no panorama.
    fn run(&self, context: &StageContext) -> Result<usize, Failure> {
        let out = &self.args.output;
        std::fs::create_dir_all(out).map_err(|error| Error::Io {
            action: "making",
            path: out.clone(),
            source: error,
        })?;
        for name in [LINES, PAGE] {
            trueup::check_place(&out.join(name))?;
        }
        let mut failed = 0;
        for set in self.mine() {
            let known = SetRecord::read(&self.folder_of(set)).filter(|record| self.still_holds(record, set));
            let record = match known {
                Some(record) => record,
                None => {
                    let record = self.stitch(set, context)?;
                    record.write(&self.folder_of(set))?;
                    self.tell(&record)?;
                    self.sum_up()?;
                    record
                }
            };
            failed += usize::from(record.has_failed());
        }
        self.sum_up()?;
        Ok(failed)
    }

    /// The folder of what a set makes.
    fn folder_of(&self, set: &PhotographsOfFolder) -> PathBuf {
        self.args.output.join(&set.name)
    }

    /// Whether a set need not be stitched again: nothing that decides its panoramas is another, and it made some.
    fn still_holds(&self, record: &SetRecord, set: &PhotographsOfFolder) -> bool {
        let is_retried = self.args.retry && record.has_failed();
        !is_retried && record.made_of == self.made_of(set) && record.files_are_there(&self.args.output)
    }

    /// What decides the panoramas of a set: the program, the options and the photographs as they lie on the disk.
    fn made_of(&self, set: &PhotographsOfFolder) -> Value {
        let photograph = |path: &PathBuf| {
            let metadata = std::fs::metadata(path).ok();
            let modified = metadata.as_ref().and_then(|metadata| metadata.modified().ok());
            let since = modified.and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok());
            json!({
                "path": path.display().to_string(),
                "bytes": metadata.map(|metadata| metadata.len()),
                "modified_seconds": since.map(|since| since.as_secs_f64()),
            })
        };
        json!({
            "program": env!("CARGO_PKG_VERSION"),
            "format": self.args.format,
            "options": self.options,
            "photographs": set.photographs.iter().map(photograph).collect::<Vec<_>>(),
        })
    }

    /// Stitches a set. What goes wrong with it is recorded; only a request to stop ends the batch.
    fn stitch(&self, set: &PhotographsOfFolder, context: &StageContext) -> Result<SetRecord, Failure> {
        let start = SetRecord::of(set, self.made_of(set));
        if set.is_alone() {
            return Ok(start.alone());
        }
        let folder = self.folder_of(set);
        let made = std::fs::create_dir_all(&folder);
        made.map_err(|error| Error::Io { action: "making", path: folder.clone(), source: error })?;
        let panorama = folder.join(format!("{PANORAMA}.{}", self.args.format));
        let outputs = Outputs::new(panorama)
            .with(SideOutput::Project, folder.join(format!("{PANORAMA}.json")))
            .with(SideOutput::Thumbnail, folder.join("thumbnail.jpg"));
        let photographs = set.photographs.iter().map(|path| path.display().to_string());
        let inputs = Inputs { all: true, ..Inputs::new(photographs) };
        let job = StitchJob { inputs, outputs, cache: None, threads: chosen::threads(&self.args.tuning) };
        // A defect that one set finds is not to cost the others.
        let outcome = catch_unwind(AssertUnwindSafe(|| job.run(self.options, context)));
        match outcome {
            Ok(Ok(written)) => {
                let panoramas = written.iter().map(|one| relative(summary::panorama_json(one), &self.args.output));
                Ok(start.made(panoramas.collect()))
            }
            Ok(Err(Error::Cancelled)) => Err(Error::Cancelled.into()),
            Ok(Err(error)) => Ok(start.failed(&Failure::from(error))),
            Err(_) => Ok(start.failed(&Failure::usage("the program failed on it", "Report this as a defect."))),
        }
    }

    /// Prints what became of a set.
    fn tell(&self, record: &SetRecord) -> Result<(), Failure> {
        match (self.args.json, self.args.quiet) {
            (true, _) => output::print(&record.lines()),
            (false, true) => Ok(()),
            (false, false) => output::print(&record.in_words()),
        }
    }

    /// Writes all lines and the page, of this part and of others as far as they are made.
    fn sum_up(&self) -> Result<(), Failure> {
        let out = &self.args.output;
        let records: Vec<SetRecord> =
            self.sets.iter().filter_map(|set| SetRecord::read(&self.folder_of(set))).collect();
        let lines: String = records.iter().map(SetRecord::lines).collect();
        trueup::write_atomically(&out.join(LINES), lines.as_bytes())?;
        trueup::write_atomically(&out.join(PAGE), page::text(&records, self.sets.len())?.as_bytes())?;
        Ok(())
    }
}

/// A panorama's summary with its files as they lie in the folder `out`: it can be moved.
fn relative(mut panorama: Value, out: &Path) -> Value {
    let shorten = |value: &mut Value| {
        let inside = value.as_str().and_then(|path| Path::new(path).strip_prefix(out).ok());
        if let Some(inside) = inside.map(|path| path.display().to_string()) {
            *value = inside.into();
        }
    };
    shorten(&mut panorama["panorama"]);
    if let Some(beside) = panorama["beside"].as_object_mut() {
        beside.values_mut().for_each(shorten);
    }
    panorama
}
