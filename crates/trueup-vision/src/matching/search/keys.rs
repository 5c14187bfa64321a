//! What a search keeps: keys of a distance and a number, lane by lane.

/// Columns compared at once.
pub(super) const LANES: usize = 16;
/// Rows compared at once.
pub(super) const ROWS: usize = 16;
/// Bits of a key that hold a row's or a block's number.
pub(super) const SHIFT: u32 = 9;
/// Columns whose block numbers fit a key.
pub(super) const COLUMNS_PER_PASS: usize = LANES << SHIFT;
/// Rows a thread takes at once; their numbers fit a key.
pub(super) const ROWS_PER_TASK: usize = 256;

/// One 32-bit number per lane.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct LaneWords(pub(super) [u32; LANES]);

/// Greater than every key.
pub(super) const FARTHEST: LaneWords = LaneWords([u32::MAX; LANES]);

/// The two smallest keys of every lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct LaneBest {
    pub(super) first: LaneWords,
    pub(super) second: LaneWords,
}

/// A descriptor and how far it is.
///
/// Ordered by distance, then index: the minimum is the nearest, the smaller index winning ties.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Neighbor {
    /// Squared distance in descriptor units.
    pub squared_distance: u32,
    /// Index of the descriptor.
    pub descriptor: usize,
}
