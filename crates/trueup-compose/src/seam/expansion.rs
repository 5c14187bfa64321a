//! The cheapest labelling of a canvas, by expanding one photograph after the other.
//!
//! # Source
//! Boykov, Veksler, Zabih, "Fast approximate energy minimization via graph cuts", IEEE TPAMI 23(11), 2001, section 5;
//! the network of one expansion is that of Kolmogorov, Zabih, "What energy functions can be minimized via graph cuts?",
//! IEEE TPAMI 26(2), 2004, section 4.

use super::energy::SeamEnergy;
use super::max_flow::{DOWN, GridFlow, RIGHT};
use crate::label::{Label, NOBODY};
use crate::window::Window;

/// Working memory of the expansions.
#[derive(Default)]
pub(super) struct Expansions {
    flow: GridFlow,
    /// For each pixel of the box the difference of the photograph shown and the one that expands; [`FIXED`] where the
    /// pixel does not take part.
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

/// See [`Expansions::change`].
const FIXED: i32 = -1;

/// The labelling that shows everywhere the photograph that lies deepest.
pub(super) fn deepest(energy: &SeamEnergy<'_>) -> Vec<Label> {
    let mut labels = vec![NOBODY; energy.width * energy.height];
    let mut best = vec![-1_i16; labels.len()];
    for (label, view) in energy.views.iter().enumerate() {
        for y in view.rows.clone() {
            for x in view.columns.clone() {
                let x = energy.column(x);
                let at = y * energy.width + x;
                if energy.allowed(label, x, y) && i16::from(energy.depth(label, x, y)) > best[at] {
                    best[at] = i16::from(energy.depth(label, x, y));
                    labels[at] = label as Label;
                }
            }
        }
    }
    labels
}

impl Expansions {
    /// Lets photograph `label` take the pixels of the box `columns` x `rows` where that lowers the cost most, all at once;
    /// only pixels that are `free` change. Returns whether any did. Columns may run into the next turn of a cylinder; of a
    /// box that goes all the way round, the first column stays as it is.
    pub(super) fn expand(
        &mut self,
        energy: &SeamEnergy<'_>,
        labels: &mut [Label],
        label: usize,
        window: Window<'_>,
        free: &dyn Fn(usize) -> bool,
    ) -> bool {
        let taking = Taking { energy, label, window };
        if !self.find_nodes(&taking, labels, free) {
            return false;
        }
        self.flow.reset(window.columns.len(), window.rows.len());
        self.add_data_costs(&taking, labels);
        self.add_seam_costs(&taking, labels);
        self.flow.solve();
        let Window { columns, rows } = window;
        let mut changed = false;
        for (v, y) in rows.clone().enumerate() {
            for (u, x) in columns.clone().enumerate() {
                if self.change[v * columns.len() + u] != FIXED && self.flow.on_sink_side(self.flow.node(u, v)) {
                    labels[y * energy.width + energy.column(x)] = label as Label;
                    changed = true;
                }
            }
        }
        changed
    }

    /// Finds the pixels that take part: those that are `free` and that the photograph may take. Returns whether there are any.
    fn find_nodes(&mut self, taking: &Taking<'_>, labels: &[Label], free: &dyn Fn(usize) -> bool) -> bool {
        let &Taking { energy, label, window: Window { columns, rows } } = taking;
        let width = columns.len();
        self.change.clear();
        self.change.resize(width * rows.len(), FIXED);
        let mut any = false;
        for y in rows.clone() {
            for x in columns.clone().skip(usize::from(taking.all_round())) {
                let place = (y - rows.start) * width + x - columns.start;
                let x = energy.column(x);
                let at = y * energy.width + x;
                let old = labels[at];
                if old != NOBODY && usize::from(old) != label && free(at) && energy.allowed(label, x, y) {
                    self.change[place] = energy.difference(usize::from(old), label, [x, y]);
                    any = true;
                }
            }
        }
        any
    }

    /// Adds what the pixels that take part cost themselves.
    fn add_data_costs(&mut self, taking: &Taking<'_>, labels: &[Label]) {
        let &Taking { energy, label, window: Window { columns, rows } } = taking;
        for (v, y) in rows.clone().enumerate() {
            for (u, x) in columns.clone().enumerate() {
                if self.change[v * columns.len() + u] != FIXED {
                    let x = energy.column(x);
                    let old = usize::from(labels[y * energy.width + x]);
                    let change = energy.data_cost(label, x, y) - energy.data_cost(old, x, y);
                    self.flow.add_sink_side_cost(self.flow.node(u, v), change);
                }
            }
        }
    }

    /// Adds what seams cost within the box and along its border.
    fn add_seam_costs(&mut self, taking: &Taking<'_>, labels: &[Label]) {
        let &Taking { energy, window: Window { columns, rows }, .. } = taking;
        for y in rows.clone() {
            for x in columns.clone() {
                for (direction, other) in [(RIGHT, [x + 1, y]), (DOWN, [x, y + 1])] {
                    if (other[0] < energy.width || energy.turn > 0) && other[1] < energy.height {
                        self.join(taking, labels, [[x, y], other], direction);
                    }
                }
            }
        }
        // Neighbors left of and above the box.
        for x in columns.clone() {
            if rows.start > 0 {
                self.join(taking, labels, [[x, rows.start - 1], [x, rows.start]], DOWN);
            }
        }
        for y in rows.clone() {
            if columns.start > 0 && !taking.all_round() {
                self.join(taking, labels, [[columns.start - 1, y], [columns.start, y]], RIGHT);
            } else if energy.turn > 0 && !taking.all_round() {
                self.join(taking, labels, [[energy.turn - 1, y], [0, y]], RIGHT);
            }
        }
    }

    /// Adds the cost of a seam between neighboring pixels p and q. A node on the sink's side takes the new label.
    fn join(&mut self, taking: &Taking<'_>, labels: &[Label], [p, q]: [[usize; 2]; 2], direction: usize) {
        let &Taking { energy, label, window: Window { columns, rows } } = taking;
        let node = |[x, y]: [usize; 2]| {
            if !(columns.contains(&x) && rows.contains(&y)) {
                return None;
            }
            let (u, v) = (x - columns.start, y - rows.start);
            let change = self.change[v * columns.len() + u];
            (change != FIXED).then(|| (self.flow.node(u, v), change))
        };
        let (node_p, node_q) = (node(p), node(q));
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
            (Some((at_p, change_p)), Some((_, change_q))) if a == b => {
                let seam = energy.cost_of(p, q, change_p + change_q);
                self.flow.add_arcs(at_p, direction, seam, seam);
            }
            (Some((at_p, _)), Some((at_q, _))) => {
                let keep_both = energy.seam_cost(p, a, q, b);
                let q_changes = energy.seam_cost(p, a, q, label);
                let p_changes = energy.seam_cost(p, label, q, b);
                self.flow.add_sink_side_cost(at_p, p_changes - keep_both);
                self.flow.add_sink_side_cost(at_q, -p_changes);
                // Rounding may miss the triangle inequality by one.
                self.flow.add_arcs(at_p, direction, (q_changes + p_changes - keep_both).max(0), 0);
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
