//! The table of times.

use super::MeasuredSet;
use super::programs::{Program, Taken};
use crate::statistics::median;

/// Medians of the runs, a row for each set; ratios are trueup's share of another program's.
pub(super) fn table(programs: &[Program], sets: &[MeasuredSet]) -> String {
    let mut heads = vec!["set".to_owned(), "photographs".to_owned()];
    for (index, program) in programs.iter().enumerate() {
        let name = program.name();
        heads.extend([format!("{name} s"), format!("{name} processor s"), format!("{name} MB")]);
        if index > 0 {
            heads.extend([format!("trueup / {name}"), "of processors".to_owned()]);
        }
    }
    let mut lines = vec![row(&heads), row(&vec!["---".to_owned(); heads.len()])];
    lines.extend(sets.iter().map(|measured| row(&cells(measured))));
    lines.join("")
}

fn row(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn cells(MeasuredSet { set, runs }: &MeasuredSet) -> Vec<String> {
    let own = runs.first().and_then(|runs| Medians::of(runs));
    let mut cells = vec![set.name.clone(), format!("{} x {:.1} MP", set.photographs.len(), set.megapixels)];
    for (index, runs) in runs.iter().enumerate() {
        let medians = Medians::of(runs);
        cells.extend(match &medians {
            Some(Medians { seconds, cpu_seconds, megabytes }) => {
                [format!("{seconds:.2}"), format!("{cpu_seconds:.2}"), format!("{megabytes:.0}")]
            }
            None => ["no panorama".to_owned(), String::new(), String::new()],
        });
        if index > 0 {
            let ratio = |of: fn(&Medians) -> f64| match (&own, &medians) {
                (Some(own), Some(other)) => format!("{:.2}", of(own) / of(other)),
                _ => String::new(),
            };
            cells.extend([ratio(|medians| medians.seconds), ratio(|medians| medians.cpu_seconds)]);
        }
    }
    cells
}

/// The middle of several runs.
struct Medians {
    seconds: f64,
    cpu_seconds: f64,
    megabytes: f64,
}

impl Medians {
    /// `None` unless every run made a panorama.
    fn of(runs: &[Taken]) -> Option<Self> {
        let middle = |of: fn(&Taken) -> f64| median(&runs.iter().map(of).collect::<Vec<f64>>());
        if !runs.iter().all(|run| run.stitched) {
            return None;
        }
        Some(Self {
            seconds: middle(|run| run.seconds)?,
            cpu_seconds: middle(|run| run.cpu_seconds)?,
            megabytes: middle(|run| run.peak_bytes as f64 / 1e6)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::SpeedSet;
    use super::*;

    #[test]
    fn ratios_are_of_medians_and_failures_are_said() {
        let taken =
            |seconds: f64, stitched| Taken { seconds, cpu_seconds: 2.0 * seconds, peak_bytes: 5_000_000, stitched };
        let set = SpeedSet { name: "attic".to_owned(), photographs: vec![PathBuf::from("a.jpg")], megapixels: 1.26 };
        let runs = vec![
            [1.0, 9.0, 2.0].map(|seconds| taken(seconds, true)).to_vec(),
            [4.0, 3.0, 5.0].map(|seconds| taken(seconds, true)).to_vec(),
            vec![taken(1.0, true), taken(1.0, false)],
        ];
        let programs = [Program::Trueup("t".into()), Program::OpenCv("p".into()), Program::Hugin];
        let table = table(&programs, &[MeasuredSet { set, runs }]);
        let last = table.lines().last().expect("three lines");
        let expected =
            "| attic | 1 x 1.3 MP | 2.00 | 4.00 | 5 | 4.00 | 8.00 | 5 | 0.50 | 0.50 | no panorama |  |  |  |  |";
        assert_eq!(last, expected);
        let columns = |line: &str| line.matches('|').count();
        assert!(table.lines().all(|line| columns(line) == columns(last)));
    }
}
