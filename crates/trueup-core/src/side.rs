//! The four sides of a picture.

/// A side of a picture as it is shown, y down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Where columns begin.
    Left,
    /// Where rows begin.
    Top,
    /// Where columns end.
    Right,
    /// Where rows end.
    Bottom,
}

impl Side {
    /// All four, clockwise.
    pub const ALL: [Self; 4] = [Self::Left, Self::Top, Self::Right, Self::Bottom];

    /// The side across the picture.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Top => Self::Bottom,
            Self::Right => Self::Left,
            Self::Bottom => Self::Top,
        }
    }
}
