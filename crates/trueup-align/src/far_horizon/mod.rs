//! The far horizon of sea or plain, where photographs show it beyond doubt: a long smooth edge under open sky that lies
//! on one circle all along.
//!
//! Whatever is straight in the scene lies on a great circle of directions, a roof or a rail as much as the horizon.
//! What tells them apart is what stands at the edge: above the horizon is sky, everywhere, and sky is nowhere below it.
//! A roof ends, and beyond its end sky goes on downward. Where something hides the horizon, it stands up into the sky
//! and is no sky itself. And the horizon is long, in more than one photograph, and lies where cameras that are held by
//! hand may have it.
//!
//! Files: `view` samples the small copies of the photographs, `edges` finds the edges under sky, `circle` lays a circle
//! through them and says how sure it is, `evidence` looks along all of the circle.

mod circle;
mod edges;
mod evidence;
mod view;

#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use trueup_core::camera::Camera;
use trueup_core::lines::EdgeCurve;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;

use edges::SkyEdge;
use evidence::HorizonEvidence;
use view::View;

/// What the far horizon is sought in: one photograph's edges, and its colors in small.
#[derive(Debug, Clone, Copy)]
pub struct ShownPhotograph<'a> {
    /// Its working frame, in which its camera is.
    pub frame: &'a WorkingFrame,
    /// Edges that may be straight, in working pixels.
    pub curves: &'a [EdgeCurve],
    /// A small copy in color.
    pub thumbnail: &'a Raster<u8>,
    /// The frame of the small copy.
    pub thumbnail_frame: &'a WorkingFrame,
}

/// A far horizon that was found.
#[derive(Debug, Clone, Copy)]
pub struct FarHorizon {
    /// Down in the common frame.
    pub down: Vector3<f64>,
    /// What it tells of the vertical: rad^-2 about the directions orthogonal to `down`.
    pub information: Matrix3<f64>,
    /// How many photographs show it.
    pub photographs: usize,
}

/// Finds the far horizon in photographs seen through their `cameras`, which are expected to be held so that `expected`
/// is about down; `is_plausible` says whether they may have been held with a given direction down. `None` where there
/// is none beyond doubt.
pub fn find(
    photographs: &[ShownPhotograph<'_>],
    cameras: &[Camera],
    expected: &Vector3<f64>,
    is_plausible: impl Fn(&Vector3<f64>) -> bool,
) -> Option<FarHorizon> {
    let views: Vec<View> = photographs.iter().zip(cameras).map(|(shown, camera)| View::new(shown, camera)).collect();
    let under_sky = |(index, view)| edges::under_sky(index, view, expected);
    let edges: Vec<SkyEdge> = views.par_iter().enumerate().flat_map_iter(under_sky).collect();
    for circle in circle::through(&edges, expected) {
        let evidence = HorizonEvidence::along(&circle, &edges, &views);
        if evidence.is_beyond_doubt() {
            // What has less of the edges than a circle that cannot be level is no better one, but part of it.
            return is_plausible(&circle.down).then(|| FarHorizon {
                down: circle.down,
                information: circle.information(),
                photographs: evidence.photographs,
            });
        }
    }
    None
}
