//! What trueup reads that somebody else wrote, each as a target that any fuzzer can try: the command `trueup-fuzz`,
//! whose changes are drawn at random, and libFuzzer, which is guided by the code that an input reaches (the folder
//! `fuzz`).
#![forbid(unsafe_code)]

mod png;
mod targets;

pub use png::mend_checksums;
pub use targets::{TARGETS, Target, Work, target_named};
