//! Tells the program a number that changes with the stages whose results it may keep between runs or have from other
//! programs.

use std::fs;
use std::path::{Path, PathBuf};

/// The sources that decide what is measured, matched and aligned, and what is handed to workers. Of a published crate,
/// the others' are not beside it: there the version that they have in common tells them apart.
const SOURCES: [&str; 6] = [
    "../trueup-core/src",
    "../trueup-vision/src",
    "../trueup-align/src",
    "../trueup-compose/src",
    "../trueup-io/src",
    "src",
];

fn main() -> std::io::Result<()> {
    let mut files = Vec::new();
    for folder in SOURCES.into_iter().filter(|folder| Path::new(folder).is_dir()) {
        println!("cargo:rerun-if-changed={folder}");
        collect(Path::new(folder), &mut files)?;
    }
    files.sort();
    // FNV-1a, which is the same in every build.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let target = std::env::var("TARGET").unwrap_or_default().into_bytes();
    for bytes in files.iter().map(fs::read).chain([Ok(target)]) {
        for byte in bytes? {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    println!("cargo:rustc-env=TRUEUP_STAGES={hash:016x}");
    Ok(())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}
