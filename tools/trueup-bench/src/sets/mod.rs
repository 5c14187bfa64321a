//! The sets of photographs that experiments run on, most of them with known cameras, made when they are first needed.

mod catalogue;
mod central;
mod focal_claim;
mod folders;
mod from_panorama;
mod photographs;
mod ready;
mod rendered;
mod spec;
mod vpg_data;

pub(crate) use catalogue::{Catalogue, GivenFolders};
pub(crate) use central::central;
pub(crate) use folders::{name_of, photographs_in};
pub(crate) use ready::{ReadySet, TRUTH_FILE, read_truth, truth_folders};
#[cfg(test)]
pub(crate) use spec::Recipe;
pub(crate) use spec::SetSpec;
