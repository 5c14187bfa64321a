//! What results are.

/// What a result is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Kind(pub &'static str);

/// A photograph's features, lines and small copies.
pub(crate) const MEASURED: Kind = Kind("measured");
/// A pair's matches.
pub(crate) const PAIR: Kind = Kind("pair");
/// How photographs look like each other, of all at once.
pub(crate) const LIKENESS: Kind = Kind("likeness");
/// Which photographs are stacks, of all at once.
pub(crate) const STACKS: Kind = Kind("stacks");
/// A panorama's geometry.
pub(crate) const GEOMETRY: Kind = Kind("geometry");
/// How far a panorama's photographs give way, whatever it is drawn on.
pub(crate) const PARALLAX: Kind = Kind("parallax");
/// What evens out the light of a panorama's photographs.
pub(crate) const LIGHT: Kind = Kind("light");
/// A panorama's cameras and carried overlaps; in memory only.
pub(crate) const OVERLAPS: Kind = Kind("overlaps");
