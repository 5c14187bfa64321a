//! Tells the program of which sources it is built: the report says so, and results of other sources are refused.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What decides the figures, below the workspace's root. Pages and reports do not.
const SOURCES: [&str; 4] = ["Cargo.toml", "Cargo.lock", "crates", "tools"];

fn main() -> std::io::Result<()> {
    let root = Path::new("../..");
    let mut files = Vec::new();
    for name in SOURCES {
        println!("cargo:rerun-if-changed={}", root.join(name).display());
        collect(&root.join(name), &mut files)?;
    }
    files.sort();
    // FNV-1a, which is the same in every build.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for bytes in files.iter().map(fs::read) {
        for byte in bytes? {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    let commit = commit(root).unwrap_or_default();
    // Whatever git cannot say of a known commit counts as changed.
    let changed = git(root, &[&["status", "--porcelain", "--"], &SOURCES[..]].concat());
    let changed = !commit.is_empty() && changed.is_none_or(|listed| !listed.is_empty());
    println!("cargo:rustc-env=TRUEUP_BENCH_SOURCES={hash:016x}");
    println!("cargo:rustc-env=TRUEUP_BENCH_COMMIT={commit}");
    println!("cargo:rustc-env=TRUEUP_BENCH_CHANGED={changed}");
    Ok(())
}

/// The commit that is checked out, if these sources are a checkout and do not merely lie within another one.
fn commit(root: &Path) -> Option<String> {
    if !git(root, &["rev-parse", "--show-prefix"])?.is_empty() {
        return None;
    }
    // A commit changes the reference that HEAD names, another checkout HEAD itself.
    let reference = git(root, &["symbolic-ref", "--quiet", "HEAD"]).unwrap_or_default();
    for name in ["HEAD", "packed-refs", &reference].into_iter().filter(|name| !name.is_empty()) {
        let path = git(root, &["rev-parse", "--path-format=absolute", "--git-path", name])?;
        if Path::new(&path).exists() {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    git(root, &["rev-parse", "HEAD"])
}

/// What git says, without the last line's end; `None` without git, without a repository, or if it fails.
fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").arg("-C").arg(root).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim_end().to_owned())
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        // Caches of tools that look at the sources.
        let name = entry.file_name();
        if !name.to_string_lossy().starts_with('.') && name != "__pycache__" {
            collect(&entry.path(), files)?;
        }
    }
    Ok(())
}
