//! Cropping: the part of the canvas that becomes the panorama. Chosen by what the panorama shows, or is going to show,
//! so that neither seams nor light depend on it; what lies outside of it need not be composed then.

mod ahead;
mod auto;
mod cells;
mod cut;
mod search;
mod smooth;
#[cfg(test)]
mod tests;
mod worth;

use trueup_core::Result;
use trueup_core::raster::RowSource;

use self::auto::{Choice, Filling};
use crate::gaps::Gaps;
use crate::layout::{CanvasLayout, CanvasOptions, Placed};

pub use crate::coverage::{Coverage, Rectangle};
pub use crate::layout::Crop;
pub(crate) use ahead::{BorderDeviations, CellsAhead};
pub(crate) use cells::Cells;

/// What of a canvas becomes the panorama.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Frame {
    /// All of it, as it is.
    Whole,
    /// A rectangle of it.
    Part(Rectangle),
}

/// By what a frame is chosen.
#[derive(Debug, Clone, Copy)]
pub struct Framing<'a> {
    /// What of the canvas photographs cover, or what was filled already.
    pub coverage: &'a Coverage,
    /// What is wanted.
    pub options: &'a CanvasOptions,
    /// What becomes of the canvas, if that is decided.
    pub known: Option<&'a Frame>,
    /// What judges the size of the frame before it is composed, if anything does.
    pub check: Option<&'a dyn SizeCheck>,
}

/// What judges the size of a panorama before it is composed, as the format does that it is to be written in.
pub trait SizeCheck: std::fmt::Debug {
    /// Refuses a panorama of `size` pixels (width, height).
    ///
    /// # Errors
    /// If it cannot be made use of.
    fn check(&self, size: [usize; 2]) -> Result<()>;
}

impl Frame {
    /// What of a canvas of `size` pixels (width, height) is the panorama.
    pub fn part_of(&self, size: [usize; 2]) -> Rectangle {
        match self {
            Self::Whole => Rectangle::whole(size),
            Self::Part(part) => part.clone(),
        }
    }
}

impl Framing<'_> {
    /// The frame of a panorama, which is all that was composed on the canvas of `layout`. Of a full turn, rows alone
    /// are cut.
    ///
    /// What [`Crop::Auto`] keeps may have holes that are to be filled ([`Self::gaps`]): where the picture beside them
    /// is smooth.
    ///
    /// # Errors
    /// Those of reading the panorama.
    pub fn of_panorama(&self, panorama: &dyn RowSource, layout: &CanvasLayout) -> Result<Frame> {
        match self.without_panorama(layout) {
            Some(frame) => Ok(frame),
            None => Ok(self.of_cells(&Cells::of(panorama, self.coverage, layout.period.is_some())?, layout)),
        }
    }

    /// The frame, if what the panorama shows does not count.
    pub(crate) fn without_panorama(&self, layout: &CanvasLayout) -> Option<Frame> {
        match (self.known, self.options.crop, layout.period) {
            (Some(known), _, _) => Some(known.clone()),
            (None, Crop::None, _) => Some(Frame::Whole),
            (None, Crop::Rectangle, _) => Some(self.frame(Some(self.largest(layout)))),
            (None, Crop::Auto, _) => None,
        }
    }

    /// What keeps most of what is covered, whatever that shows.
    fn largest(&self, layout: &CanvasLayout) -> Rectangle {
        match layout.period {
            None => self.coverage.largest_rectangle(),
            Some(_) => self.coverage.longest_whole_rows(),
        }
    }

    /// The frame of a panorama that is seen in `cells`.
    pub(crate) fn of_cells(&self, cells: &Cells, layout: &CanvasLayout) -> Frame {
        let enough = self.options.min_kept * self.coverage.area() as f64;
        let is_enough = |kept: &Rectangle| self.coverage.area_within(kept) as f64 >= enough;
        let choice = Choice::new(cells, layout, self.coverage);
        let chosen = |filling| choice.rectangle(filling).filter(|chosen| is_enough(&chosen.rectangle));
        let first = chosen(Filling::Unnoticed);
        // A filling that is seen is better than a tower without its top.
        let beheading = first.as_ref().filter(|first| first.beheads).map(|first| first.rectangle.rows.start);
        let with_tops = beheading.and_then(|row| chosen(Filling::CloudsAbove(row)).filter(|other| !other.beheads));
        // A thing that ends in the picture is better than ragged borders; so is one that is cut.
        let of_things = with_tops.or(first).or_else(|| chosen(Filling::Ending)).map(|chosen| chosen.rectangle);
        self.frame(of_things.or_else(|| Some(self.largest(layout)).filter(is_enough)))
    }

    /// Refuses a frame on the canvas of `layout` whose size is not accepted.
    pub(crate) fn check_size(&self, frame: &Frame, layout: &CanvasLayout) -> Result<()> {
        let size = || frame.part_of([layout.width, layout.height]).size();
        self.check.map_or(Ok(()), |check| check.check(size()))
    }

    fn frame(&self, rectangle: Option<Rectangle>) -> Frame {
        rectangle.filter(|rectangle| rectangle.area() > 0).map_or(Frame::Whole, Frame::Part)
    }

    /// What is to be filled of the part that is kept; `None` for nothing.
    pub fn gaps(&self, layout: &CanvasLayout, kept: &Rectangle) -> Option<Gaps> {
        let missing = kept.area() - self.coverage.area_within(kept);
        let wanted = self.options.crop == Crop::Auto && missing > 0;
        wanted.then(|| Gaps::within(layout, self.coverage.clone(), kept.clone()))
    }
}

/// The layout of a part of its canvas. Photographs that show nothing of it stay, outside.
pub fn cropped(layout: CanvasLayout, rectangle: &Rectangle) -> CanvasLayout {
    let shift = rectangle.corner();
    let [width, height] = rectangle.size();
    let moved = |mut placed: Placed| {
        placed.mesh.target.iter_mut().for_each(|vertex| *vertex = [vertex[0] - shift[0], vertex[1] - shift[1]]);
        placed
    };
    let placed = layout.placed.into_iter().map(moved).collect();
    let origin = [0, 1].map(|axis| layout.origin[axis] + shift[axis] / layout.canvas_from_target);
    CanvasLayout { width, height, origin, placed, ..layout }
}
