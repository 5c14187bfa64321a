//! Columns of a plane or a cylinder.

/// A column and those beside it, of `width` columns; on a cylinder of `turn` columns both are there.
pub(super) fn neighbors(x: usize, width: usize, turn: usize) -> impl Iterator<Item = usize> {
    let around = move |x: usize| if turn > 0 { x % turn } else { x };
    let first = if turn > 0 { x + turn - 1 } else { x.saturating_sub(1) };
    let end = if turn > 0 { x + turn + 2 } else { (x + 2).min(width) };
    (first..end).map(around)
}
