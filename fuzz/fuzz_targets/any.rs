//! libFuzzer on the target that `TRUEUP_FUZZ_TARGET` names. A panic is a finding, one that trueup contains as well; so are a
//! crash, an input that takes longer than the limit, and one that takes more memory.
#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use trueup_fuzz::{TARGETS, Target, Work, mend_checksums};

/// Names the target; with [`LIST`], all are printed instead.
const VARIABLE: &str = "TRUEUP_FUZZ_TARGET";
const LIST: &str = "list";

/// Names a folder that the target's seeds are written to.
const SEEDS: &str = "TRUEUP_FUZZ_SEEDS";

fn begin() {
    if std::env::var(VARIABLE).is_ok_and(|wanted| wanted == LIST) {
        TARGETS.iter().for_each(|target| println!("{}", target.name));
        std::process::exit(0);
    }
    let Some(folder) = std::env::var_os(SEEDS) else { return };
    for (number, seed) in (target().0.seeds)().iter().enumerate() {
        std::fs::write(std::path::Path::new(&folder).join(format!("seed-{number}")), seed).expect("a seed is written");
    }
}

fn target() -> &'static (&'static Target, Work) {
    static TARGET: OnceLock<(&Target, Work)> = OnceLock::new();
    TARGET.get_or_init(|| {
        let wanted = std::env::var(VARIABLE).unwrap_or_default();
        let target = TARGETS.iter().find(|target| target.name == wanted);
        let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        let target = target.unwrap_or_else(|| panic!("{VARIABLE} names none of {}", names.join(", ")));
        (target, Work::new().expect("a folder for files"))
    })
}

fuzz_target!(init: begin(), |input: &[u8]| {
    let (target, work) = target();
    (target.read)(work, input);
});

// Behind checksums that are wrong nothing is read.
fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let size = fuzzer_mutate(data, size, max_size);
    if seed % 2 == 0 {
        mend_checksums(&mut data[..size]);
    }
    size
});
