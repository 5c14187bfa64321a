//! `trueup-scenes study`.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use clap::{Args, ValueEnum};
use trueup_core::context::{CancelToken, Progress};
use trueup_core::{Error, Result, StageContext};
use trueup_scenes::{SetKind, SetOutcome, SetRequest};

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// Rooms and streets, sets 1 to 12.
    Manhattan,
    /// The same cameras where no direction is preferred, 1 to 12.
    Twins,
    /// One vertical, horizontals at free angles, 1 to 4.
    Mixed,
    /// Small sets for statistics, 1 to 130 with dominant directions (folder `manhattan`) and as many without
    /// (`random`).
    Gate,
}

#[derive(Debug, Args)]
pub(crate) struct StudyArguments {
    /// Folder to write to; every set gets a folder of its own there, 01, 02, ...
    #[arg(long)]
    out: PathBuf,
    /// Which family of sets.
    #[arg(long, value_enum, default_value_t = Kind::Manhattan)]
    kind: Kind,
    /// Only these numbers, as in 1,7; all when absent.
    #[arg(long, value_delimiter = ',')]
    sets: Vec<usize>,
    /// Small, rough and fast.
    #[arg(long)]
    preview: bool,
    /// Writes a depth map beside every picture (portable float map, metres).
    #[arg(long)]
    depth: bool,
}

/// Says which picture of how many is done.
#[derive(Debug, Default)]
struct Counter {
    done: AtomicU64,
    total: AtomicU64,
}

impl Progress for Counter {
    fn begin(&self, _stage: &str, total: u64) {
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }

    fn advance(&self, _stage: &str, amount: u64) {
        let done = self.done.fetch_add(amount, Ordering::Relaxed) + amount;
        eprint!("\r{done}/{} pictures", self.total.load(Ordering::Relaxed));
    }

    fn finish(&self, _stage: &str) {
        eprint!("\r\x1b[K");
    }
}

impl StudyArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let families = match self.kind {
            Kind::Manhattan => vec![(SetKind::Manhattan, self.out.clone())],
            Kind::Twins => vec![(SetKind::Twins, self.out.clone())],
            Kind::Mixed => vec![(SetKind::Mixed, self.out.clone())],
            Kind::Gate => vec![
                (SetKind::GateManhattan, self.out.join("manhattan")),
                (SetKind::GateRandom, self.out.join("random")),
            ],
        };
        // Wrong numbers are found before hours of work, not after.
        let mut requests = Vec::new();
        for (kind, out) in families {
            let numbers = if self.sets.is_empty() { (1..=kind.count()).collect() } else { self.sets.clone() };
            for number in numbers {
                if kind.set(number).is_none() {
                    let hint = format!("Choose from 1 to {}.", kind.count());
                    return Err(Error::input(format!("set {number}"), "there is no such set", hint));
                }
                let request = SetRequest { kind, number, preview: self.preview, depth: self.depth };
                requests.push((request, out.clone()));
            }
        }
        let (counter, cancel) = (Counter::default(), CancelToken::default());
        let context = StageContext::new(&counter, &cancel);
        for (request, out) in requests {
            let outcome = request.write(&out, &context)?;
            let word = if outcome == SetOutcome::Kept { "kept" } else { "rendered" };
            println!("{}: {word}", request.folder(&out).display());
        }
        Ok(())
    }
}
