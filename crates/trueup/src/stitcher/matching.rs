//! From the photographs found to the groups that overlap.

use trueup_align::stitch_graph::{GraphFile, StitchGraph, parse_graph_file};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result};
use trueup_io::decode::FilePhotographs;
use trueup_io::source::Sources;
use trueup_vision::features::Features;

use super::Stitcher;
use crate::cache::Known;
use crate::clock::Clock;
use crate::inputs::{Inputs, Reference};
use crate::masks::MaskRecord;
use crate::matched::{Matched, no_overlap, none_usable, reason_of_rejected};
use crate::measure;
use crate::pairs;

impl Stitcher<'_> {
    pub(super) fn check_any(&self, sources: &Sources, inputs: &Inputs) -> Result<()> {
        if !sources.images.is_empty() {
            return Ok(());
        }
        if sources.rejected.is_empty() {
            return Err(Error::input(
                if inputs.photographs.is_empty() { "photographs".to_owned() } else { inputs.photographs.join(", ") },
                "no photographs were given",
                "Name at least two overlapping photographs, or a folder that holds them.",
            ));
        }
        Err(none_usable(sources.rejected.iter().cloned().map(reason_of_rejected).collect()))
    }

    pub(super) fn match_all(
        &self,
        (sources, masks): (Sources, Vec<Vec<MaskRecord>>),
        photographs: &FilePhotographs,
        (known, at_once): (Option<Known<'_>>, usize),
        inputs: &Inputs,
        clock: &mut Clock,
    ) -> Result<Matched> {
        let names: Vec<String> = sources.images.iter().map(|image| image.name.clone()).collect();
        let graph_file = match &inputs.graph {
            None => GraphFile::default(),
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|error| Error::io("reading", path, error))?;
                parse_graph_file(&text, &names, &path.display().to_string())?
            }
        };
        let (mut measured, mut undecodable) = (Vec::new(), Vec::new());
        let known = known.as_ref();
        for outcome in measure::run(photographs, (known, at_once), self.options, self.context, clock)? {
            match outcome {
                Ok(one) => {
                    measured.push(Some(one));
                    undecodable.push(None);
                }
                Err(error) if measure::concerns_one_photograph(&error) => {
                    measured.push(None);
                    undecodable.push(Some(error));
                }
                Err(error) => return Err(error),
            }
        }
        let unmeasured = Features::default();
        let placeholder = WorkingFrame { width: 1.0, height: 1.0, working_from_full: 1.0 };
        let frames: Vec<WorkingFrame> =
            measured.iter().map(|one| one.as_ref().map_or(placeholder, |one| one.frame)).collect();
        let features: Vec<Features> = measured
            .iter_mut()
            .map(|one| one.as_mut().map_or(unmeasured.clone(), |one| std::mem::take(&mut one.features)))
            .collect();
        let pairs = clock.time("matching", || {
            let usable = |index: usize| measured[index].is_some();
            pairs::run(&features, &frames, &graph_file.edges, &usable, known, self.options, self.context)
        })?;
        let graph = StitchGraph::new(names.len(), &pairs);
        Ok(Matched { sources, measured, undecodable, pairs, graph, graph_file, masks })
    }

    /// The groups to be stitched: the largest, or all with at least two members; a single photograph is a group.
    pub(super) fn components_to_stitch(&self, matched: &Matched, inputs: &Inputs) -> Result<Vec<Vec<usize>>> {
        let decodable: Vec<usize> =
            (0..matched.measured.len()).filter(|&index| matched.measured[index].is_some()).collect();
        match decodable.as_slice() {
            [] => return Err(matched.none_usable()),
            [only] => {
                self.context.report(Diagnostic::warning(
                    "single-photograph",
                    Subject::Photograph(*only),
                    "there is only one photograph to use; it is written as it is",
                    "Name at least two overlapping photographs, or a folder that holds them.",
                ));
                return Ok(vec![vec![*only]]);
            }
            _ => {}
        }
        let mut joined: Vec<Vec<usize>> =
            matched.graph.components.iter().filter(|component| component.len() > 1).cloned().collect();
        if joined.is_empty() {
            return Err(no_overlap(matched));
        }
        if let Reference::Named(name) = &inputs.reference
            && !inputs.all
        {
            // The panorama that holds the named reference is the one that is wanted.
            let wanted = matched.picture_named(name)?;
            let Some(position) = joined.iter().position(|component| component.contains(&wanted)) else {
                return Err(Error::input(
                    name,
                    "it cannot be the reference because it overlaps no other photograph",
                    "Choose another reference, or leave --reference out.",
                ));
            };
            joined.swap(0, position);
        }
        if !inputs.all {
            joined.truncate(1);
        }
        Ok(joined)
    }
}
