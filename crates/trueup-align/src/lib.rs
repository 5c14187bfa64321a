//! Measurements to geometry: stitch graph, cameras, vanishing points, similarity prior and mesh.
#![forbid(unsafe_code)]

pub mod cameras;
mod evidence;
pub mod far_horizon;
pub mod full_turn;
mod horizon;
pub mod match_points;
pub mod mesh;
pub mod metrics;
mod moving_dlt;
pub mod parallax;
mod plane_similarity;
pub mod projection;
pub mod similarity;
pub mod stitch_graph;
mod straightening;
pub mod vanishing;
pub mod warps;
