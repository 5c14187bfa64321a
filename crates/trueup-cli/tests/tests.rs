//! The `trueup` command as users run it: its messages, its exit status, and what it leaves on the disk.

mod batch;
mod book;
mod borders;
mod cache;
mod cli;
mod color;
mod compare;
mod compose;
mod destinations;
mod determinism;
mod documented;
mod evaluate;
mod failures;
mod far_horizon;
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod faults;
mod flat_scene;
mod formats;
mod full_turn;
mod installing;
mod light;
mod likeness;
mod masks;
mod options;
mod pictures;
mod real_folders;
mod references;
mod report;
mod run;
#[cfg(unix)]
mod serving;
mod soak;
mod sources;
mod sphere;
#[cfg(unix)]
mod stopping;
mod strangers;
mod told;
mod video;
