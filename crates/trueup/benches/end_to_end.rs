//! The whole way from photographs to a JPEG, and each stage's share of it.
//!
//! Sets are folders of photographs: the repository's example, and those named in `TRUEUP_BENCH_SETS`, separated by `:`.

use divan::Bencher;
use trueup::{Inputs, Outputs, StageContext, StitchJob, StitchOptions};

fn main() {
    divan::main();
}

fn sets() -> Vec<String> {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/room").to_owned();
    let named = std::env::var("TRUEUP_BENCH_SETS").unwrap_or_default();
    std::iter::once(example).chain(named.split(':').filter(|set| !set.is_empty()).map(str::to_owned)).collect()
}

#[divan::bench(args = sets(), sample_count = 5, sample_size = 1)]
fn stitch(bencher: Bencher, set: &str) {
    let output = std::env::temp_dir().join("trueup-bench.jpg");
    let job = StitchJob { inputs: Inputs::new([set]), outputs: Outputs::new(&output), cache: None, threads: 0 };
    let options = StitchOptions::default();
    bencher.bench_local(|| job.run(&options, &StageContext::default()).expect("a set that stitches"));
    // Nothing depends on the file; it may already be gone.
    let _ = std::fs::remove_file(output);
}
