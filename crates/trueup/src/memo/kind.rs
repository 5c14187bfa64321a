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
/// A panorama's geometry.
pub(crate) const GEOMETRY: Kind = Kind("geometry");
/// A panorama's cameras and carried overlaps; in memory only.
pub(crate) const OVERLAPS: Kind = Kind("overlaps");
