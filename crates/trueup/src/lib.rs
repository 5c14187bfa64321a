//! Photographs in, an upright panorama out.
#![forbid(unsafe_code)]
