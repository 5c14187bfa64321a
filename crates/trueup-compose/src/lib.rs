//! Geometry and pixels to the panorama: canvas, exposure, warp and blend.
