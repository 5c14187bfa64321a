//! Which photographs are stacks: the same view at several exposures, to be one photograph.
//!
//! Exposures differ in more than a factor: cameras bend their tones, and clip them. Two of one view are alike in that
//! the brighter of two places is the brighter one in both, so that one relation of tones, which never falls, makes the
//! one of the other. Where the details that are left agree, within a small shift, the view is the same (`likeness`,
//! `same_view`). Neighbors of a row agree nowhere but within the overlap, at shifts that are not searched. What cameras
//! recorded of their exposures has a voice: of one exposure there is no stack, however the pictures differ, and where
//! both say the same, less of a picture must tell.
//!
//! Steps of a bracket may be small: a third of a stop is less than an automatic exposure changes, or an editor. What
//! tells a bracket from two photographs of one view, or a photograph and its copy, is that a record says so, or that
//! exposures of the run are farther apart; those between then belong to it, however near, as long as none comes twice.
//!
//! # Source
//! Debevec and Malik, "Recovering high dynamic range radiance maps from photographs", SIGGRAPH 1997, for what a bracket
//! is; Ward, "Fast, robust image registration for compositing high dynamic range photographs from handheld exposures",
//! Journal of Graphics Tools 8(2), 2003, for the search of a small shift in pyramids of pictures that exposures do not
//! change.
//!
//! # Departures
//! Ward compares bitmaps above and below the median, which says nothing where most of an exposure is white. The
//! relation of tones is fitted instead for every shift tried, and where either exposure says nothing, nothing is
//! compared.

mod alignment;
mod likeness;
mod limits;
mod passes;
mod same_view;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::raster::Raster;

pub use alignment::{AlignedMember, MemberPair, Unaligned, align};
use likeness::{CLIPPED, CRUSHED, gray};
pub use limits::LEAST_STOPS;
use limits::{LEAST_RANGE, LEAST_STEP, MOST_SHIFT, ONE_EXPOSURE, SAME_RECORD};
use passes::ShotOrder;
use same_view::{SameView, SmallCopy, same_view};

/// A photograph is compared with so many that follow it: cameras take the darkest and the brightest of a bracket one
/// after the other, which have next to nothing in common, but the one before or after them has something of both.
const LOOK_AHEAD: usize = 3;

/// Most photographs of a stack that are fused: cameras take nine at most, and sixteen a stop apart range over more than
/// any scene does. Fusing holds all of them in memory, and takes as much longer as there are more.
const MOST_MEMBERS: usize = 16;

/// Share of the views that must be stacks for photographs to have been taken in passes: of some, the sky is all that
/// they show, and no details tell of it.
const LEAST_STACKED: f64 = 0.6;
/// Views, the first ones, that tell whether the others are worth a look.
const PROBED_VIEWS: usize = 3;

trueup_core::choice! {
    /// Which photographs are fused.
    pub enum Fuse {
        /// Photographs of one view at several exposures, which follow one another or come again with every pass over
        /// all views, become one photograph: their light where the panorama is written with floating point samples,
        /// else a picture.
        Auto = "auto",
        /// The same, always their light: for panoramas of which it is not known how they will be written.
        Light = "light",
        /// Every photograph stands for itself.
        None = "none",
    }
}

trueup_core::options! {
    /// What becomes of photographs of one view at several exposures.
    pub struct StackOptions("stacks") {
        /// Which photographs are fused before they are stitched: those that show one view at several exposures (a
        /// bracket), one after the other or pass by pass. Choose light for the light of all exposures in a panorama
        /// that is not written with floating point samples, or not yet. Choose none to have each of them stitched as it
        /// is.
        fuse: Fuse = Fuse::Auto, Allowed::Any, "", basic;
    }
}

/// A photograph that may be one of a stack.
#[derive(Debug, Clone, Copy)]
pub struct StackCandidate<'a> {
    /// Its small copy, in color; `None` for one that can be in no stack.
    pub thumbnail: Option<&'a Raster<u8>>,
    /// Those of one number have one size and lens.
    pub camera: usize,
    /// How much light the camera recorded that it took, in stops, if it did.
    pub recorded_stops: Option<f64>,
}

/// A stack among the candidates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoundStack {
    /// The photograph that tells most, by its number.
    pub reference: usize,
    /// The others, in their order.
    pub others: Vec<FoundMember>,
    /// What need not be fused, in their order: exposures that lie closest between others of a stack that has more than
    /// enough.
    pub spare: Vec<FoundMember>,
}

/// A photograph of a stack beside its reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FoundMember {
    /// Its number.
    pub photograph: usize,
    /// How much brighter than the reference it is, in stops; negative if it is darker.
    pub stops: f64,
    /// Where it shows a thing, minus where the reference does, as parts of the width.
    pub shift: [f64; 2],
    /// Whether it shows the same view as another one of the stack whether or not it can be aligned; otherwise, it does
    /// if it can.
    pub is_sure: bool,
}

/// The stacks among `candidates`, in the order of their references: runs of consecutive photographs by one camera that
/// show the same view at exposures of which no two are alike; or, where few are of such, the same of one after the
/// other pass over all views, each at an exposure of its own.
pub fn find(candidates: &[StackCandidate]) -> Vec<FoundStack> {
    let copies: Vec<Option<SmallCopy>> =
        candidates.par_iter().map(|candidate| SmallCopy::new(candidate.thumbnail?)).collect();
    let photographs = Photographs { candidates, copies: &copies };
    let consecutive = photographs.stacks_in(&passes::one_by_one(candidates.len()));
    let of_stacks = |stacks: &[FoundStack]| -> usize { stacks.iter().map(FoundStack::photographs).sum() };
    // Where a pass ends and the next one goes back, two exposures of one view are consecutive as well.
    if 2 * of_stacks(&consecutive) >= candidates.len() {
        return consecutive;
    }
    let in_passes = passes::orders(candidates.len()).find_map(|order| photographs.taken_in(&order));
    in_passes.filter(|found| of_stacks(found) > of_stacks(&consecutive)).unwrap_or(consecutive)
}

/// The candidates, with what of each is compared.
struct Photographs<'a> {
    candidates: &'a [StackCandidate<'a>],
    copies: &'a [Option<SmallCopy>],
}

impl Photographs<'_> {
    /// The stacks of photographs that were taken in passes, unless too few views are stacks for that.
    fn taken_in(&self, order: &ShotOrder) -> Option<Vec<FoundStack>> {
        // What is no order of these photographs shows at once.
        let first = order.first_views(PROBED_VIEWS);
        let is_likely =
            |order: &ShotOrder, found: &[FoundStack]| found.len() as f64 >= LEAST_STACKED * order.views() as f64;
        let probed = self.stacks_in(&first);
        if !is_likely(&first, &probed) {
            return None;
        }
        Some(self.stacks_in(order)).filter(|found| is_likely(order, found))
    }

    /// The stacks of photographs that may be of one view where they follow one another in `order`, within what it has
    /// of one view.
    fn stacks_in(&self, order: &ShotOrder) -> Vec<FoundStack> {
        let ShotOrder { numbers, of_view } = order;
        let ordered: Vec<StackCandidate> = numbers.iter().map(|&number| self.candidates[number]).collect();
        let size = |place: usize| ordered[place].thumbnail.map(|one| (one.width(), one.height()));
        let compared = |a: usize| {
            let end_of_view = (a / of_view + 1) * of_view;
            let following = a + 1..(a + 1 + LOOK_AHEAD).min(end_of_view).min(ordered.len());
            let with = |b: usize| {
                let alike = ordered[a].camera == ordered[b].camera && size(a) == size(b);
                let recorded = [a, b].map(|one| ordered[one].recorded_stops);
                let recorded = recorded[1].zip(recorded[0]).map(|(of_b, of_a)| of_b - of_a);
                let [one, other] = [a, b].map(|place| self.copies[numbers[place]].as_ref());
                let found = if alike { same_view(one?, other?, recorded) } else { None };
                Some(((a, b), found?))
            };
            following.filter_map(with).collect::<Vec<_>>()
        };
        let same: BTreeMap<(usize, usize), SameView> =
            (0..ordered.len()).into_par_iter().flat_map_iter(compared).collect::<Vec<_>>().into_iter().collect();
        let runs = runs(ordered.len(), &same);
        let stacks = runs.into_iter().flat_map(|run| stacks_of(&run, &same, &ordered));
        let mut stacks: Vec<FoundStack> = stacks.map(|stack| stack.numbered(numbers)).collect();
        stacks.sort_by_key(|stack| stack.reference);
        stacks
    }
}

impl FoundStack {
    /// How many photographs it has.
    fn photographs(&self) -> usize {
        1 + self.others.len() + self.spare.len()
    }

    /// The same with the numbers of photographs that are at the places it has.
    fn numbered(mut self, numbers: &[usize]) -> Self {
        self.reference = numbers[self.reference];
        for members in [&mut self.others, &mut self.spare] {
            members.iter_mut().for_each(|member| member.photograph = numbers[member.photograph]);
            members.sort_by_key(|member| member.photograph);
        }
        self
    }
}

/// Consecutive photographs that are joined, directly or by others of the run, with where they stand beside the first of
/// them.
fn runs(count: usize, same: &BTreeMap<(usize, usize), SameView>) -> Vec<Vec<FoundMember>> {
    let mut runs = Vec::new();
    let mut first = 0;
    while first < count {
        // Whatever the first reaches within the photographs that follow, as long as none between is left out.
        let mut reached: BTreeMap<usize, FoundMember> =
            BTreeMap::from([(first, FoundMember { photograph: first, stops: 0.0, shift: [0.0; 2], is_sure: false })]);
        // The surest links first; every round joins one photograph. Those before the first are of other runs, also
        // where one that lies between parted them from these.
        let following = same.range((first, first)..);
        while let Some(member) = surest_link(&reached, following.clone()) {
            reached.insert(member.photograph, member);
        }
        let run: Vec<FoundMember> = reached
            .into_values()
            .enumerate()
            .take_while(|(k, member)| member.photograph == first + k)
            .map(|(_, one)| one)
            .collect();
        first += run.len();
        runs.push(run);
    }
    runs
}

/// The photograph that is joined most surely to one that is `reached`, and where it stands.
fn surest_link<'a>(
    reached: &BTreeMap<usize, FoundMember>,
    same: impl Iterator<Item = (&'a (usize, usize), &'a SameView)>,
) -> Option<FoundMember> {
    let link = |(&(a, b), view): (&(usize, usize), &SameView)| {
        let (known, other, sign) = match (reached.get(&a), reached.get(&b)) {
            (Some(known), None) => (known, b, 1.0),
            (None, Some(known)) => (known, a, -1.0),
            _ => return None,
        };
        let shift = [0, 1].map(|axis| known.shift[axis] + sign * view.shift[axis]);
        let stops = known.stops + sign * view.stops;
        Some((view.correlation, FoundMember { photograph: other, stops, shift, is_sure: view.is_sure() }))
    };
    let surest = same.filter_map(link).max_by(|one, other| one.0.total_cmp(&other.0));
    surest.map(|(_, member)| member)
}

/// The stacks that a run of one view holds: where an exposure comes again, another one begins.
fn stacks_of(
    run: &[FoundMember],
    same: &BTreeMap<(usize, usize), SameView>,
    candidates: &[StackCandidate],
) -> Vec<FoundStack> {
    let mut stacks: Vec<Vec<FoundMember>> = Vec::new();
    for member in run {
        match stacks.last_mut() {
            Some(stack) if stack.iter().all(|other| may_share_a_stack(other, member, candidates)) => {
                stack.push(*member)
            }
            _ => stacks.push(vec![*member]),
        }
    }
    stacks
        .into_iter()
        .filter(|stack| is_bracket(stack, same))
        .filter_map(|stack| with_reference(&stack, candidates))
        .collect()
}

/// Whether two photographs of one view are two exposures, and near enough to lie on each other.
fn may_share_a_stack(one: &FoundMember, other: &FoundMember, candidates: &[StackCandidate]) -> bool {
    let recorded = [one, other].map(|member| candidates[member.photograph].recorded_stops);
    let recorded = recorded[0].zip(recorded[1]).map(|(one, other)| (one - other).abs());
    let are_two = match recorded {
        Some(stops) if stops <= SAME_RECORD => false,
        Some(stops) if stops >= ONE_EXPOSURE => true,
        _ => (one.stops - other.stops).abs() >= LEAST_STEP,
    };
    // Links of less than that, one after the other, may lead along a row of photographs.
    let longer_from_width = candidates[one.photograph]
        .thumbnail
        .map_or(1.0, |small| small.width() as f64 / small.width().max(small.height()) as f64);
    let [x, y] = [0, 1].map(|axis| (one.shift[axis] - other.shift[axis]) * longer_from_width);
    are_two && x.hypot(y) <= 2.0 * MOST_SHIFT
}

/// Whether what may be one stack shows itself as exposures of one view: two of them are a bracket already, or all of
/// them range far enough.
fn is_bracket(stack: &[FoundMember], same: &BTreeMap<(usize, usize), SameView>) -> bool {
    let is_of_it = |number: usize| stack.iter().any(|member| member.photograph == number);
    let within = |&(&(a, b), _): &(&(usize, usize), &SameView)| is_of_it(a) && is_of_it(b);
    let stops = || stack.iter().map(|member| member.stops);
    let range = stops().fold(f64::NEG_INFINITY, f64::max) - stops().fold(f64::INFINITY, f64::min);
    same.iter().filter(within).any(|(_, view)| view.is_bracket || range >= LEAST_RANGE)
}

/// The stack seen from the member that tells most: least of it is clipped or crushed; of equals the first.
fn with_reference(stack: &[FoundMember], candidates: &[StackCandidate]) -> Option<FoundStack> {
    let lost = |member: &FoundMember| {
        let gray = candidates[member.photograph].thumbnail.and_then(gray)?;
        Some(gray.data().iter().filter(|&&level| level >= CLIPPED || level <= CRUSHED).count())
    };
    let reference = stack.iter().min_by_key(|member| lost(member).unwrap_or(usize::MAX))?;
    let seen = |member: &FoundMember| FoundMember {
        stops: member.stops - reference.stops,
        shift: [0, 1].map(|axis| member.shift[axis] - reference.shift[axis]),
        ..*member
    };
    let spare = spare(stack, reference.photograph);
    let (spare, others): (Vec<FoundMember>, Vec<FoundMember>) = stack
        .iter()
        .filter(|member| member.photograph != reference.photograph)
        .map(seen)
        .partition(|member| spare.contains(&member.photograph));
    Some(FoundStack { reference: reference.photograph, others, spare })
}

/// The numbers of what a stack of more than [`MOST_MEMBERS`] can do without: one after the other the exposure, not the
/// reference, the darkest or the brightest, that leaves the smallest gap.
fn spare(stack: &[FoundMember], reference: usize) -> Vec<usize> {
    let mut kept: Vec<&FoundMember> = stack.iter().collect();
    kept.sort_by(|one, other| one.stops.total_cmp(&other.stops));
    let mut spare = Vec::new();
    while kept.len() > MOST_MEMBERS {
        let gap = |place: &usize| kept[place + 1].stops - kept[place - 1].stops;
        let inner = (1..kept.len() - 1).filter(|&place| kept[place].photograph != reference);
        let Some(least) = inner.min_by(|one, other| gap(one).total_cmp(&gap(other))) else { break };
        spare.push(kept.remove(least).photograph);
    }
    spare
}
