//! The photographs after matching: what is known of them, which groups they make, and what cannot go on.

use trueup_align::stitch_graph::{GraphFile, StitchGraph};
use trueup_core::diagnostics::{Diagnostic, Subject};
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;
use trueup_core::{Error, Result, StageContext};
use trueup_io::source::RejectedSource;
use trueup_vision::matching::Stranger;

use super::align::component::Component;
use super::compose::SmallPhotograph;
use super::measure::{Measurements, concerns_one_photograph};
use super::measured::Measured;
use super::photographs::PhotographSet;
use super::shelf::ShelvedFeatures;
use crate::inputs::reference_named;
use crate::inputs::{Inputs, Reference};
use crate::memo::{Key, KeyMaker};
use crate::report::left_out::{
    LeftOut, counts, explain, no_photograph, none_usable, not_in_graph, of_another_panorama, reason_of_rejected,
    strength,
};
use crate::report::several::several;

/// Everything known of the photographs after matching.
#[derive(Debug)]
pub(crate) struct Matched {
    pub set: PhotographSet,
    /// `None` for photographs that could not be decoded, whose reason is in `undecodable`.
    pub measured: Vec<Option<Measured>>,
    pub undecodable: Vec<Option<Error>>,
    /// What decides the measurements of each photograph; all `None` where nothing is kept.
    pub keys: Vec<Option<Key>>,
    pub pairs: Vec<PairMatches>,
    /// Pictures that are no photographs of the scene; their pairs are not in the graph.
    pub strangers: Vec<Stranger>,
    pub graph: StitchGraph,
    pub graph_file: GraphFile,
}

/// What matching looks at, taken out of the measurements so that it is gone when matching is done.
pub(crate) struct LookedAt {
    /// `None` for photographs that could not be decoded.
    pub features: Vec<Option<ShelvedFeatures>>,
    pub frames: Vec<WorkingFrame>,
    pub usable: Vec<bool>,
}

impl Matched {
    /// Measured photographs of which no pairs are known yet.
    ///
    /// # Errors
    /// Of the measurements' errors the first that does not concern one photograph alone.
    pub(crate) fn unmatched(set: PhotographSet, measurements: Measurements, graph_file: GraphFile) -> Result<Self> {
        let (mut measured, mut undecodable) = (Vec::new(), Vec::new());
        for outcome in measurements.photographs {
            let (one, error) = match outcome {
                Ok(one) => (Some(one), None),
                Err(error) if concerns_one_photograph(&error) => (None, Some(error)),
                Err(error) => return Err(error),
            };
            measured.push(one);
            undecodable.push(error);
        }
        let graph = StitchGraph::new(set.images.len(), &[]);
        let keys = measurements.keys;
        Ok(Self { set, measured, undecodable, keys, pairs: Vec::new(), strangers: Vec::new(), graph, graph_file })
    }

    /// Takes the features out, to be matched.
    pub(crate) fn take_features(&mut self) -> LookedAt {
        let placeholder = WorkingFrame { width: 1.0, height: 1.0, working_from_full: 1.0 };
        let frame = |one: &Option<Measured>| one.as_ref().map_or(placeholder, |one| one.frame);
        let features = |one: &mut Option<Measured>| one.as_mut().map(|one| std::mem::take(&mut one.features));
        LookedAt {
            frames: self.measured.iter().map(frame).collect(),
            usable: self.measured.iter().map(Option::is_some).collect(),
            features: self.measured.iter_mut().map(features).collect(),
        }
    }

    /// What the geometry of the group `members` is found from.
    ///
    /// # Errors
    /// [`Error::Input`] if the reference is no photograph's name.
    pub(crate) fn component<'a>(&'a self, members: &[usize], inputs: &Inputs) -> Result<Component<'a>> {
        let reference = self.reference_of(members, inputs)?;
        let rotation_deg =
            self.graph_file.reference_rotation_deg.filter(|_| self.graph_file.reference == Some(reference));
        let rotation = rotation_deg.unwrap_or(0.0).to_radians();
        Ok(Component::new(members, reference, rotation, &self.set.images, &self.measured, &self.pairs))
    }

    /// An error of the group `members`, which names it where it is one of several `groups` and a choice that was made
    /// suits the others.
    pub(crate) fn of_group(&self, error: Error, members: &[usize], groups: &[Vec<usize>]) -> Error {
        let number = groups.iter().position(|group| group == members).filter(|_| groups.len() > 1);
        match (error, number, members) {
            (Error::NotApplicable { method, reason, hint }, Some(number), [first, others @ ..]) => {
                let first = &self.set.images[*first].name;
                let which =
                    format!("panorama {} of {}, of {first} and {} more", number + 1, groups.len(), others.len());
                Error::not_applicable(method, format!("{which}: {reason}"), hint)
            }
            (error, ..) => error,
        }
    }

    /// What decides the measurements of the group `members`; `None` where that is not known.
    pub(crate) fn key_of(&self, members: &[usize]) -> Option<KeyMaker> {
        members.iter().try_fold(KeyMaker::new(), |maker, &member| Some(maker.key(self.keys[member].as_ref()?)))
    }

    /// The small copies of a group's photographs.
    pub(crate) fn small_photographs(&self, component: &Component) -> Vec<SmallPhotograph<'_>> {
        let small = |(&member, camera): (&usize, usize)| {
            let measured = self.measured[member].as_ref()?;
            Some(SmallPhotograph { thumbnail: &measured.thumbnail, frame: measured.thumbnail_frame, camera })
        };
        component.members.iter().zip(component.camera_groups()).filter_map(small).collect()
    }

    /// The reference of the group `members`: the one named, the graph's, or the photograph in its middle.
    ///
    /// # Errors
    /// [`Error::Input`] if no photograph has the name.
    pub(crate) fn reference_of(&self, members: &[usize], inputs: &Inputs) -> Result<usize> {
        let wished = match &inputs.reference {
            Reference::Named(name) => Some(reference_named(&self.set.images, name)?),
            Reference::Auto => self.graph_file.reference,
        };
        Ok(wished.filter(|wished| members.contains(wished)).unwrap_or_else(|| self.graph.central_photograph(members)))
    }

    /// The error when not one photograph could be decoded.
    pub(crate) fn none_usable(&self) -> Error {
        let undecodable = (0..self.set.images.len()).map(|index| {
            let LeftOut { reason, hint, .. } = self.why_left_out(index, &[]);
            (self.set.images[index].name.clone(), reason, hint)
        });
        none_usable(undecodable.chain(self.set.rejected.iter().cloned().map(reason_of_rejected)).collect())
    }

    /// Why a photograph is left out of the panorama at hand: it cannot be read, is in another one of those stitched, or
    /// in none of them.
    pub(crate) fn why_left_out(&self, index: usize, stitched: &[Vec<usize>]) -> LeftOut {
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
        if let Some(stranger) = self.strangers.iter().find(|stranger| stranger.photograph == index) {
            return no_photograph(stranger, &self.set.names());
        }
        let edges = &self.graph_file.edges;
        if !edges.is_empty() && !edges.iter().any(|&(a, b)| a == index || b == index) {
            return not_in_graph();
        }
        let is_of = |members: &&Vec<usize>| members.len() > 1 && members.contains(&index);
        if let Some(members) = self.graph.components.iter().find(is_of) {
            return of_another_panorama(members, &self.set.names());
        }
        let component = stitched.first().map_or(&[][..], Vec::as_slice);
        explain(index, component, &self.pairs, &self.set.names())
    }

    /// The groups to be stitched: the largest, or all with at least two members; a single photograph is a group.
    ///
    /// # Errors
    /// [`Error::Unsolvable`] if no two photographs overlap; [`Error::Input`] if none could be decoded, or the reference
    /// overlaps no other photograph.
    pub(crate) fn groups(&self, inputs: &Inputs, context: &StageContext) -> Result<Vec<Vec<usize>>> {
        let decodable: Vec<usize> = (0..self.measured.len()).filter(|&index| self.measured[index].is_some()).collect();
        match decodable.as_slice() {
            [] => return Err(self.none_usable()),
            [only] if inputs.refuse_single => return Err(self.only_one(*only)),
            [only] => {
                context.report(Diagnostic::warning(
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
            self.graph.components.iter().filter(|component| component.len() > 1).cloned().collect();
        if joined.is_empty() {
            return Err(self.no_overlap());
        }
        if let Reference::Named(name) = &inputs.reference
            && !inputs.all
        {
            // The panorama that holds the named reference is the one that is wanted.
            let wanted = reference_named(&self.set.images, name)?;
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

    /// The error where nothing but the photograph `only` can be used.
    fn only_one(&self, only: usize) -> Error {
        let undecodable = (0..self.set.images.len()).filter(|&index| index != only).map(|index| {
            let LeftOut { reason, .. } = self.why_left_out(index, &[]);
            format!("{}: {reason}", self.set.images[index].name)
        });
        let rejected = self.set.rejected.iter().map(|one| format!("{}: {}", one.name, one.reason));
        let reasons: Vec<String> = undecodable.chain(rejected).collect();
        Error::input(
            &self.set.images[only].name,
            format!("it is the only photograph that can be used, which makes no panorama: {}", several(&reasons)),
            "Mend the others, or take the set away.",
        )
    }

    fn no_overlap(&self) -> Error {
        const HINT: &str =
            "Photographs must share a third of their view, with detail in it; join pairs by hand in a --graph file.";
        const OF_MASKS: &str =
            "White is used of a mask, black is ignored: swap them if the mask is the wrong way round.";
        let names = self.set.names();
        let none_found = |why: &str, hint: &str| {
            let why = if why.is_empty() { String::new() } else { format!("; {why}") };
            let why = format!("no overlapping photographs found{why}");
            Error::unsolvable("matching", format!("{} photographs", names.len()), why, hint)
        };
        let nothing_seen: Vec<usize> = (0..names.len()).filter(|&index| self.shows_nothing(index)).collect();
        if !nothing_seen.is_empty() {
            let is_masked = |index: usize| self.set.files.given_masks(index).ignored.is_some();
            let words = |&index: &usize| match is_masked(index) {
                true => format!("the mask of {} ignores all of it that is not black", names[index]),
                false => format!("all of {} is black or transparent", names[index]),
            };
            let words: Vec<String> = nothing_seen.iter().map(words).collect();
            return none_found(
                &several(&words),
                if nothing_seen.iter().any(|&index| is_masked(index)) { OF_MASKS } else { HINT },
            );
        }
        if !self.strangers.is_empty() {
            let words = |stranger: &Stranger| {
                format!("{}: {}", names[stranger.photograph], no_photograph(stranger, &names).reason)
            };
            let words: Vec<String> = self.strangers.iter().map(words).collect();
            return none_found(
                &several(&words),
                "Give photographs of neighboring views; copies of one make no panorama.",
            );
        }
        let best = self.pairs.iter().max_by(|one, two| strength(one).total_cmp(&strength(two)));
        match best.filter(|pair| pair.putative > 0) {
            Some(pair) => {
                let best = format!("the best pair is {} and {}: {}", names[pair.a], names[pair.b], counts(pair));
                none_found(&best, HINT)
            }
            None => none_found("", HINT),
        }
    }

    /// Whether nothing is seen in a photograph: black, transparent and masked parts are black in the small copy.
    fn shows_nothing(&self, index: usize) -> bool {
        /// Levels up to which compression leaves black.
        const BLACK: u8 = 3;
        let small = self.measured[index].as_ref().map(|measured| measured.thumbnail.data());
        small.is_some_and(|levels| levels.iter().all(|&level| level <= BLACK))
    }

    /// Refuses to leave anything out of the groups `stitched`.
    ///
    /// # Errors
    /// [`Error::Input`] with the reason for each that would be.
    pub(crate) fn require_all(&self, stitched: &[Vec<usize>]) -> Result<()> {
        let images = &self.set.images;
        // A panorama of an earlier run is no photograph that was given.
        let rejected: Vec<&RejectedSource> = self.set.rejected.iter().filter(|one| !one.is_own_output()).collect();
        let used: usize = stitched.iter().map(Vec::len).sum();
        let given = images.len() + rejected.len();
        if used == given {
            return Ok(());
        }
        let mut reasons: Vec<String> = (0..images.len())
            .filter(|index| !stitched.iter().any(|component| component.contains(index)))
            .map(|index| format!("{}: {}", images[index].name, self.why_left_out(index, stitched).reason))
            .collect();
        reasons.extend(rejected.iter().map(|one| format!("{}: {}", one.name, one.reason)));
        Err(Error::input(
            format!("{} of {given} photographs", given - used),
            format!("they cannot be used although all are required: {}", several(&reasons)),
            "Leave --require-all out to stitch the others.",
        ))
    }

    /// Says what is in none of the groups `stitched`, and why.
    pub(crate) fn report_left_out(&self, stitched: &[Vec<usize>], context: &StageContext) {
        for index in 0..self.set.images.len() {
            if stitched.iter().any(|component| component.contains(&index)) {
                continue;
            }
            self.set.files.forget(index);
            let LeftOut { code, reason, hint } = self.why_left_out(index, stitched);
            context.report(Diagnostic::warning(code, Subject::Photograph(index), reason, hint));
            if !self.set.masks[index].is_empty() {
                context.report(Diagnostic::warning(
                    "mask-not-heeded",
                    Subject::Photograph(index),
                    "there is a mask of it, but the photograph itself is left out",
                    "Look at why it is left out, or give the mask of the photograph that is used.",
                ));
            }
        }
        for rejected in &self.set.rejected {
            let subject = Subject::file(&rejected.name);
            context.report(Diagnostic::warning(&rejected.code, subject, &rejected.reason, &rejected.hint));
        }
    }
}
