#![warn(unreachable_pub)]
//! Pixels to measurements: SIFT features, matching, pairing, line segments, stacks of exposures, and the frames that
//! are needed of a video.
//!
//! Positions are in the pixels of the photograph given (working pixels in the pipeline), corner at (0, 0), the center
//! of the first pixel at (0.5, 0.5).

pub mod border;
pub mod carrier;
pub mod features;
pub mod frames;
mod gray;
pub mod line_matching;
pub mod lines;
pub mod matching;
pub mod padding;
pub mod pairing;
mod squares;
pub mod stacks;
