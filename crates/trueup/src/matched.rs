//! What is known of the photographs after matching, and what cannot go on.

use trueup_align::stitch_graph::{GraphFile, StitchGraph};
use trueup_core::matches::PairMatches;
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};
use trueup_io::source::{RejectedSource, Sources};

use crate::inputs::{Inputs, Reference};
use crate::left_out::{self, LeftOut};
use crate::masks::{MaskRecord, photograph_named};
use crate::measure::Measured;
use crate::names::several;

/// The photograph the user calls `name` for the reference: by name, by path, or by the end of its path.
pub(crate) fn reference_named(images: &[SourceImage], name: &str) -> Result<usize> {
    photograph_named(images, name, "so it cannot be the reference")
}

/// Everything known after matching.
#[derive(Debug)]
pub(crate) struct Matched {
    pub sources: Sources,
    /// `None` for photographs that could not be decoded, whose reason is in `undecodable`.
    pub measured: Vec<Option<Measured>>,
    pub undecodable: Vec<Option<Error>>,
    pub pairs: Vec<PairMatches>,
    pub graph: StitchGraph,
    pub graph_file: GraphFile,
    /// The masks of each photograph.
    pub masks: Vec<Vec<MaskRecord>>,
}

impl Matched {
    pub fn names(&self) -> Vec<String> {
        self.sources.images.iter().map(|image| image.name.clone()).collect()
    }

    pub fn picture_named(&self, name: &str) -> Result<usize> {
        reference_named(&self.sources.images, name)
    }

    pub fn reference_of(&self, members: &[usize], inputs: &Inputs) -> Result<usize> {
        let wished = match &inputs.reference {
            Reference::Named(name) => Some(self.picture_named(name)?),
            Reference::Auto => self.graph_file.reference,
        };
        Ok(wished.filter(|wished| members.contains(wished)).unwrap_or_else(|| self.graph.central_photograph(members)))
    }

    /// The error when not one photograph could be decoded.
    pub fn none_usable(&self) -> Error {
        let undecodable = (0..self.sources.images.len()).map(|index| {
            let LeftOut { reason, hint, .. } = self.why_left_out(index, &[]);
            (self.sources.images[index].name.clone(), reason, hint)
        });
        none_usable(undecodable.chain(self.sources.rejected.iter().cloned().map(reason_of_rejected)).collect())
    }

    /// Why a photograph is left out of the panorama at hand: it cannot be read, is in another one of those stitched, or in
    /// none of them.
    pub fn why_left_out(&self, index: usize, stitched: &[Vec<usize>]) -> LeftOut {
        if let Some(error) = &self.undecodable[index] {
            let (reason, hint) = match error {
                Error::Input { reason, hint, .. } => (reason.clone(), hint.clone()),
                other => (other.to_string(), "Check the file, or copy it again.".to_owned()),
            };
            return LeftOut { code: "picture-damaged", reason, hint };
        }
        if let Some(position) = stitched.iter().position(|members| members.contains(&index)) {
            let reason = format!("it is in panorama {} of {}", position + 1, stitched.len());
            return LeftOut { code: "other-panorama", reason, hint: String::new() };
        }
        let component = stitched.first().map_or(&[][..], Vec::as_slice);
        left_out::explain(index, component, &self.pairs, &self.names())
    }
}

/// Name, reason and hint of an input that cannot be used.
pub(crate) fn reason_of_rejected(rejected: RejectedSource) -> (String, String, String) {
    (rejected.name, rejected.reason, rejected.hint)
}

/// The error when none of the inputs, each with name, reason and hint, can be used.
pub(crate) fn none_usable(inputs: Vec<(String, String, String)>) -> Error {
    match inputs.as_slice() {
        [(name, reason, hint)] => Error::input(name, reason, hint),
        _ => {
            let reasons: Vec<String> = inputs.iter().map(|(name, reason, _)| format!("{name}: {reason}")).collect();
            Error::input(
                format!("{} files", inputs.len()),
                format!("none of them can be used: {}", several(&reasons)),
                "Name at least two overlapping photographs, or a folder that holds them.",
            )
        }
    }
}

pub(crate) fn no_overlap(matched: &Matched) -> Error {
    let names = matched.names();
    let best = matched.pairs.iter().max_by(|one, two| left_out::strength(one).total_cmp(&left_out::strength(two)));
    let why = match best.filter(|pair| pair.putative > 0) {
        Some(pair) => format!(
            "no overlapping photographs found; the best pair is {} and {}: {}",
            names[pair.a],
            names[pair.b],
            left_out::counts(pair)
        ),
        None => "no overlapping photographs found".to_owned(),
    };
    Error::unsolvable(
        "matching",
        format!("{} photographs", names.len()),
        why,
        "Photographs must share a third of their view, with detail in it; join pairs by hand in a --graph file.",
    )
}

pub(crate) fn require_all(matched: &Matched, stitched: &[Vec<usize>]) -> Result<()> {
    let used: usize = stitched.iter().map(Vec::len).sum();
    let given = matched.sources.images.len() + matched.sources.rejected.len();
    if used == given {
        return Ok(());
    }
    let mut reasons: Vec<String> = (0..matched.sources.images.len())
        .filter(|index| !stitched.iter().any(|component| component.contains(index)))
        .map(|index| {
            format!("{}: {}", matched.sources.images[index].name, matched.why_left_out(index, stitched).reason)
        })
        .collect();
    reasons.extend(matched.sources.rejected.iter().map(|one| format!("{}: {}", one.name, one.reason)));
    Err(Error::input(
        format!("{} of {given} photographs", given - used),
        format!("they cannot be used although all are required: {}", several(&reasons)),
        "Leave --require-all out to stitch the others.",
    ))
}
