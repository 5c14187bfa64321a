//! libFuzzer on the target that `TRUEUP_FUZZ_TARGET` names when this is compiled. A panic is a finding, one that trueup
//! contains as well; so are a crash, an input that takes longer than the limit, and one that takes more memory.
#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use trueup_fuzz::{Work, mend_checksums, target_named};

/// Nothing else is in the program: libFuzzer looks at the counters of all its code after every input.
const READ: fn(&Work, &[u8]) = match target_named(env!("TRUEUP_FUZZ_TARGET")) {
    Some(target) => target.read,
    None => panic!("TRUEUP_FUZZ_TARGET names no target"),
};

fuzz_target!(|input: &[u8]| {
    static WORK: OnceLock<Work> = OnceLock::new();
    READ(WORK.get_or_init(|| Work::new().expect("a folder for files")), input);
});

// Behind checksums that are wrong nothing is read.
fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let size = fuzzer_mutate(data, size, max_size);
    if seed % 2 == 0 {
        mend_checksums(&mut data[..size]);
    }
    size
});
