//! Who is shown: the numbers by which seams name photographs.

/// Position of a photograph among those placed.
pub type Label = u16;

/// Label of pixels that no photograph covers.
pub const NOBODY: Label = Label::MAX;
