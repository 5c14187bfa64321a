//! The subcommands that have a file of their own.

mod cut;
mod flat;
mod level;
mod specs;
mod study;
mod words;

pub(crate) use cut::CutArguments;
pub(crate) use flat::FlatArguments;
pub(crate) use level::LevelArguments;
pub(crate) use specs::SpecsArguments;
pub(crate) use study::StudyArguments;
