//! T5: divergence of Manhattan scenes against others, and what threshold our own sets support.

mod classes;
mod tables;

pub(crate) use classes::{NAME, claims, trials};
pub(crate) use tables::section;
