//! The cheapest labelling of a canvas, by expanding one photograph after the other.
//!
//! # Source
//! Boykov, Veksler, Zabih, "Fast approximate energy minimization via graph cuts", IEEE TPAMI 23(11), 2001, section 5;
//! the network of one expansion is that of Kolmogorov, Zabih, "What energy functions can be minimized via graph cuts?",
//! IEEE TPAMI 26(2), 2004, section 4.

use rayon::prelude::*;

use super::band::Band;
use super::energy::SeamEnergy;
use crate::label::{Label, NOBODY};
use crate::max_flow::{DOWN, GridFlow, RIGHT};
use crate::window::Window;

/// Working memory of the expansions.
#[derive(Default)]
pub(super) struct Expansions {
    flow: GridFlow,
    /// For each pixel of the canvas its node of the flow; [`FIXED`] where it does not take part.
    node_at: Vec<u32>,
    /// The pixels that take part, row by row, beginning with that of node 1: columns as the box has them, and rows.
    taking_part: Vec<[u32; 2]>,
    /// For each of them the difference of the photograph shown and the one that expands.
    change: Vec<i32>,
}

/// A photograph that takes pixels of a box.
struct Taking<'a> {
    energy: &'a SeamEnergy<'a>,
    label: usize,
    window: Window<'a>,
}

impl Taking<'_> {
    /// Whether the box goes all the way round a cylinder.
    fn all_round(&self) -> bool {
        self.energy.turn > 0 && self.window.columns.len() == self.energy.turn
    }
}

/// See [`Expansions::node_at`].
const FIXED: u32 = 0;

/// The labelling that shows everywhere the photograph that lies deepest.
pub(super) fn deepest(energy: &SeamEnergy<'_>) -> Vec<Label> {
    let mut labels = vec![NOBODY; energy.width * energy.height];
    labels.par_chunks_exact_mut(energy.width).enumerate().for_each(|(y, labels)| {
        let mut best = vec![-1_i16; labels.len()];
        for (label, view) in energy.views.iter().enumerate().filter(|(_, view)| view.rows.contains(&y)) {
            for x in view.columns.clone() {
                let x = energy.column(x);
                if energy.allowed(label, x, y) && i16::from(energy.depth(label, x, y)) > best[x] {
                    best[x] = i16::from(energy.depth(label, x, y));
                    labels[x] = label as Label;
                }
            }
        }
    });
    labels
}

/// The photograph that lies deepest at one canvas pixel, the first of equals; [`NOBODY`] if none may be shown there.
pub(super) fn deepest_at(energy: &SeamEnergy<'_>, [x, y]: [usize; 2]) -> Label {
    let (mut deepest, mut depth) = (NOBODY, -1);
    for label in (0..energy.views.len()).filter(|&label| energy.views[label].rows.contains(&y)) {
        if energy.allowed(label, x, y) && i16::from(energy.depth(label, x, y)) > depth {
            (deepest, depth) = (label as Label, i16::from(energy.depth(label, x, y)));
        }
    }
    deepest
}

impl Expansions {
    /// Lets photograph `label` take the pixels of the box `columns` x `rows` where that lowers the cost most, all at
    /// once; only pixels that are `free` change. Returns whether any did. Columns may run into the next turn of a
    /// cylinder; of a box that goes all the way round, the first column stays as it is.
    pub(super) fn expand(
        &mut self,
        energy: &SeamEnergy<'_>,
        labels: &mut [Label],
        label: usize,
        window: Window<'_>,
        free: &Band,
    ) -> bool {
        let taking = Taking { energy, label, window };
        if self.node_at.len() != labels.len() {
            self.node_at.clear();
            self.node_at.resize(labels.len(), FIXED);
        }
        self.find_nodes(&taking, labels, free);
        if self.taking_part.is_empty() {
            return false;
        }
        self.flow.reset(self.taking_part.len());
        self.add_data_costs(&taking, labels);
        self.add_seam_costs(&taking, labels);
        self.flow.solve();
        let mut changed = false;
        for (node, &[x, y]) in (1..).zip(&self.taking_part) {
            let at = y as usize * energy.width + energy.column(x as usize);
            self.node_at[at] = FIXED;
            if self.flow.on_sink_side(node) {
                labels[at] = label as Label;
                changed = true;
            }
        }
        changed
    }

    /// Finds the pixels that take part: those that are `free` and that the photograph may take.
    fn find_nodes(&mut self, taking: &Taking<'_>, labels: &[Label], free: &Band) {
        let &Taking { energy, label, window: Window { columns, rows } } = taking;
        self.taking_part.clear();
        self.change.clear();
        let columns = columns.start + usize::from(taking.all_round())..columns.end;
        for y in rows.clone() {
            for x in free.within(&columns, y) {
                let on_canvas = energy.column(x);
                let at = y * energy.width + on_canvas;
                let old = labels[at];
                if old != NOBODY && usize::from(old) != label && energy.allowed(label, on_canvas, y) {
                    // A small canvas has far fewer than 2^32 pixels.
                    self.taking_part.push([x as u32, y as u32]);
                    self.change.push(energy.difference(usize::from(old), label, [on_canvas, y]));
                    self.node_at[at] = self.taking_part.len() as u32;
                }
            }
        }
    }

    /// Adds what the pixels that take part cost themselves.
    fn add_data_costs(&mut self, taking: &Taking<'_>, labels: &[Label]) {
        let &Taking { energy, label, .. } = taking;
        for (node, &[x, y]) in (1..).zip(&self.taking_part) {
            let (x, y) = (energy.column(x as usize), y as usize);
            let old = usize::from(labels[y * energy.width + x]);
            self.flow.add_sink_side_cost(node, energy.data_cost(label, x, y) - energy.data_cost(old, x, y));
        }
    }

    /// Adds what seams cost between the pixels that take part, and between them and their neighbors.
    fn add_seam_costs(&mut self, taking: &Taking<'_>, labels: &[Label]) {
        let energy = taking.energy;
        let all_round = taking.all_round();
        let taking_part = std::mem::take(&mut self.taking_part);
        for &[x, y] in &taking_part {
            let (x, y) = (x as usize, y as usize);
            if x + 1 < energy.width || energy.turn > 0 {
                self.join(taking, labels, [[x, y], [x + 1, y]], RIGHT);
            }
            if y + 1 < energy.height {
                self.join(taking, labels, [[x, y], [x, y + 1]], DOWN);
            }
            // A pair of two that take part was joined from its first.
            let left = match x {
                0 => (energy.turn > 0 && !all_round).then(|| energy.turn - 1),
                _ => Some(x - 1),
            };
            let above = y.checked_sub(1).filter(|&above| self.node_at(taking, [x, above]).is_none());
            if let Some(left) = left.filter(|&left| x == 0 || self.node_at(taking, [left, y]).is_none()) {
                self.join(taking, labels, [[left, y], [x, y]], RIGHT);
            }
            if let Some(above) = above {
                self.join(taking, labels, [[x, above], [x, y]], DOWN);
            }
        }
        self.taking_part = taking_part;
    }

    /// The node of a pixel, by its column as the box has them, and its difference; `None` if it does not take part.
    fn node_at(&self, taking: &Taking<'_>, [x, y]: [usize; 2]) -> Option<(usize, i32)> {
        let Window { columns, rows } = taking.window;
        if !(columns.contains(&x) && rows.contains(&y)) {
            return None;
        }
        let node = self.node_at[y * taking.energy.width + taking.energy.column(x)];
        (node != FIXED).then(|| (node as usize, self.change[node as usize - 1]))
    }

    /// Adds the cost of a seam between neighboring pixels p and q. A node on the sink's side takes the new label.
    fn join(&mut self, taking: &Taking<'_>, labels: &[Label], [p, q]: [[usize; 2]; 2], direction: usize) {
        let &Taking { energy, label, .. } = taking;
        let (node_p, node_q) = (self.node_at(taking, p), self.node_at(taking, q));
        if node_p.is_none() && node_q.is_none() {
            return;
        }
        let [p, q] = [p, q].map(|[x, y]| [energy.column(x), y]);
        let old = |[x, y]: [usize; 2]| labels[y * energy.width + x];
        let (a, b) = (old(p), old(q));
        if a == NOBODY || b == NOBODY {
            return;
        }
        let (a, b) = (usize::from(a), usize::from(b));
        match (node_p, node_q) {
            (Some((at_p, change_p)), Some((at_q, change_q))) if a == b => {
                let seam = energy.cost_of(p, q, change_p + change_q);
                self.flow.add_arcs([at_p, at_q], direction, seam, seam);
            }
            (Some((at_p, _)), Some((at_q, _))) => {
                let keep_both = energy.seam_cost(p, a, q, b);
                let q_changes = energy.seam_cost(p, a, q, label);
                let p_changes = energy.seam_cost(p, label, q, b);
                self.flow.add_seam([at_p, at_q], direction, [keep_both, q_changes, p_changes]);
            }
            (Some((at_p, _)), None) => {
                let change = energy.seam_cost(p, label, q, b) - energy.seam_cost(p, a, q, b);
                self.flow.add_sink_side_cost(at_p, change);
            }
            (None, Some((at_q, _))) => {
                let change = energy.seam_cost(p, a, q, label) - energy.seam_cost(p, a, q, b);
                self.flow.add_sink_side_cost(at_q, change);
            }
            (None, None) => {}
        }
    }
}
