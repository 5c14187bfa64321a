//! Pictures with exactly known cameras: rendered scenes for examples, tests and experiments.
#![forbid(unsafe_code)]
