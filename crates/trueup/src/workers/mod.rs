//! One panorama that is divided among workers: other programs, on this machine or on others.
//!
//! What takes most of the time is done photograph by photograph, pair by pair and region by region, and can be done
//! anywhere: measuring, matching, making photographs small, and finishing the canvas. A [`Stitcher`](crate::Stitcher)
//! with [`Workers`] hands that to them and does the rest itself, in the same order as without: what is decided from all
//! photographs is decided once. A task is bytes that hold all it takes but the photographs' files, and does nothing but
//! return bytes; one that was lost is done again. Each does its work by the code that works without workers, so that
//! the panorama is the same to the last bit.

mod division;
mod handing_out;
mod rendering;
mod tasks;
#[cfg(test)]
mod tests;
mod worker;

pub(crate) use division::Division;
pub use worker::Worker;

use trueup_core::Result;

/// Takes what a task gave, with the task's number.
pub type TakeResult<'a> = &'a mut dyn FnMut(usize, Vec<u8>) -> Result<()>;

/// Programs that do tasks: in other processes, or on other machines that find the photographs under the same absolute
/// paths.
pub trait Workers: Sync {
    /// Has every task done by a [`Worker`] that is made of `common`, anywhere and as often as it takes, and hands what
    /// each gave once, in any order, to `take`, which keeps it.
    ///
    /// # Errors
    /// What keeps them from it, after which the whole work ends; [`trueup_core::Error::Cancelled`] if they were
    /// interrupted; those of `take`, at once.
    fn run(&self, common: &[u8], tasks: Vec<Vec<u8>>, take: TakeResult<'_>) -> Result<()>;
}
