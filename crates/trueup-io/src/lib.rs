//! Files to memory and back: finding and decoding photographs, reading their metadata, writing panoramas.
#![forbid(unsafe_code)]
