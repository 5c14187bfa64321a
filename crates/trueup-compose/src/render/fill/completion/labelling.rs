//! Which offset each sample of a gap is filled from.

use super::part::Part;
use super::samples::difference;
use crate::max_flow::{DOWN, GridFlow, RIGHT};

/// Costs are whole numbers of such steps of roots of light.
const STEPS: f32 = 4096.0;

/// Cost of what may not be shown: more than a sample, its border and its four seams cost together, so that no cut is
/// cheaper with it.
const FORBIDDEN: i32 = 1 << 22;

/// How much more a step at the border costs than one within the gap: of photographs beside what lies elsewhere, more is
/// seen.
const BORDER_WEIGHT: f32 = 2.0;

/// Rounds of expansions, at most.
const ROUNDS: usize = 2;

/// What is shown in a gap: the smooth surface, 0, or what lies at one of some offsets, one more than its index.
pub(super) type Shown = u16;

/// What it costs to fill a gap in such a way.
pub(super) struct Energy<'a> {
    pub(super) part: &'a Part,
    offsets: &'a [[isize; 2]],
    /// The smooth surface at each sample, or what is known there.
    smooth: &'a [Option<[f32; 3]>],
    /// Of each sample of the gap, for each of what may be shown.
    own: Vec<Vec<i32>>,
}

/// Chooses for each sample of a gap what is shown there.
///
/// # Source
/// The cost of a seam between two offsets is that of Kwatra, Schödl, Essa, Turk, Bobick, "Graphcut textures", SIGGRAPH
/// 2003, equation 1, with the offsets as labels of Pritch, Kav-Venaki, Peleg, "Shift-map image editing", ICCV 2009.
///
/// # Departures
/// The smooth surface is one of the labels.
pub(super) fn of(energy: &Energy<'_>) -> Vec<Shown> {
    let &Energy { part, offsets, .. } = energy;
    let mut place = vec![0_u32; part.colors.len()];
    (1..).zip(&part.gap).for_each(|(node, &at)| place[at] = node);
    let mut shown = vec![0; part.gap.len()];
    let mut flow = GridFlow::default();
    // Nothing changes any more when as many expansions in a row have changed nothing.
    let (mut idle, all) = (0, offsets.len() + 1);
    for label in (0..all).cycle().skip(1).take(ROUNDS * all) {
        idle = if energy.expand(&mut flow, &place, &mut shown, label as Shown) { 0 } else { idle + 1 };
        if idle == all {
            break;
        }
    }
    shown
}

impl<'a> Energy<'a> {
    pub(super) fn of(part: &'a Part, offsets: &'a [[isize; 2]], smooth: &'a [Option<[f32; 3]>]) -> Self {
        let mut energy = Self { part, offsets, smooth, own: Vec::new() };
        let mut borders = vec![Vec::new(); part.colors.len()];
        part.border.iter().for_each(|&[at, nearest]| borders[nearest].push(at));
        let cost = |(at, rough): (usize, f32), label: usize| {
            if label > 0 && part.source(at, offsets[label - 1]).is_none() {
                return FORBIDDEN;
            }
            let at_border = |other: usize| difference(part.colors[other], energy.color(other, label as Shown));
            let border: f32 = borders[at].iter().copied().map(at_border).sum();
            let smooth = if label == 0 { rough } else { 0.0 };
            ((BORDER_WEIGHT * border + smooth) * STEPS) as i32
        };
        let of_sample = |sample| (0..=offsets.len()).map(|label| cost(sample, label)).collect();
        energy.own = part.gap.iter().copied().zip(part.rough.iter().copied()).map(of_sample).collect();
        energy
    }

    /// What is shown at a sample by a label.
    pub(super) fn color(&self, at: usize, label: Shown) -> Option<[f32; 3]> {
        match usize::from(label).checked_sub(1) {
            Some(offset) => self.part.moved(at, self.offsets[offset]).and_then(|source| self.part.colors[source]),
            None => self.smooth[at],
        }
    }

    /// The cost of a seam between two samples beside each other.
    fn seam(&self, samples: [usize; 2], [one, other]: [Shown; 2]) -> i32 {
        if one == other {
            return 0;
        }
        let steps = samples.map(|at| difference(self.color(at, one), self.color(at, other)));
        // A little for its length.
        ((steps[0] + steps[1]) * STEPS) as i32 + 1
    }

    /// Lets `label` be shown where that lowers the cost most; returns whether it is anywhere it was not. `place` is one
    /// more than the place of a sample in the gap.
    ///
    /// # Source
    /// Boykov, Veksler, Zabih, "Fast approximate energy minimization via graph cuts", IEEE TPAMI 23(11), 2001,
    /// section 5.
    fn expand(&self, flow: &mut GridFlow, place: &[u32], shown: &mut [Shown], label: Shown) -> bool {
        flow.reset(shown.len());
        for (index, &now) in shown.iter().enumerate() {
            let own = &self.own[index];
            flow.add_sink_side_cost(index + 1, own[usize::from(label)] - own[usize::from(now)]);
        }
        let width = self.part.width();
        for (index, &at) in self.part.gap.iter().enumerate() {
            let right = (at % width + 1 < width).then_some((at + 1, RIGHT));
            let below = (at / width + 1 < self.part.rows.len()).then_some((at + width, DOWN));
            for (other, direction) in [right, below].into_iter().flatten() {
                let Some(beside) = (place[other] as usize).checked_sub(1) else { continue };
                let (one, two) = (shown[index], shown[beside]);
                let seams = [[one, two], [one, label], [label, two]].map(|labels| self.seam([at, other], labels));
                flow.add_seam([index + 1, beside + 1], direction, seams);
            }
        }
        flow.solve();
        let mut changes = false;
        for (index, now) in shown.iter_mut().enumerate() {
            if *now != label && flow.on_sink_side(index + 1) {
                *now = label;
                changes = true;
            }
        }
        changes
    }
}
