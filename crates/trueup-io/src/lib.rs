//! Files to memory and back: finding and decoding photographs, reading their metadata, writing panoramas.
//!
//! * [`source`] turns paths, folders and glob patterns into [`trueup_core::source::SourceImage`]s, reading headers
//!   only.
//! * [`color`] finds out which colors they mean;
//! * [`decode`] reads their pixels: whole photographs, and the reduced pictures that measurement works on.
//! * [`provenance`] gathers what a panorama tells of its photographs;
//! * [`encode`] writes a panorama row by row; a file appears complete or not at all.
//! * [`developing`] has camera raw developed by programs that are installed.
//! * [`video`] takes frames out of videos.
//! * [`text`] reads files of text, bounded.
//! * [`scratch`] keeps on disk what does not fit in memory, and knows how much room there is.
//!
//! Sizes are checked from the header before pixels are allocated, and no input makes these functions panic.
#![forbid(unsafe_code)]

pub mod color;
pub mod decode;
pub mod developing;
pub mod encode;
mod external;
mod format;
mod formats;
#[doc(hidden)]
pub mod fuzzing;
mod metadata;
pub mod provenance;
pub mod scratch;
pub mod source;
pub mod text;
pub mod video;
