//! Minimum cut of pixels of a grid that are joined to their four neighbors and to the two terminals.
//!
//! # Source
//! Boykov, Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy minimization in vision",
//! IEEE TPAMI 26(9), 2004, section 3; the origin checks with time stamps and distances are those of Kolmogorov's
//! dissertation (Cornell, 2004), section 3.2.
//!
//! # Departures
//! Arcs are stored by direction, with their nodes. Capacities are whole numbers, so that the cut is exact and the same
//! everywhere. A large network is first cut in two that know nothing of each other, each on a core of its own; their
//! flows are one of the whole, and their trees go on growing there (J. Liu and J. Sun, "Parallel graph-cuts by adaptive
//! bottom-up merging", CVPR 2010). Of all maximum flows the nodes from which the sink can still be reached are the
//! same, and so is the cut.

use std::collections::VecDeque;

/// Directions to the four neighbors: right, down, left, up. `direction ^ 2` leads back.
pub(crate) const RIGHT: usize = 0;
pub(crate) const DOWN: usize = 1;

const FREE: u8 = 0;
const SOURCE: u8 = 1;
const SINK: u8 = 2;

/// What [`GridFlow::parent`] holds beside a direction.
const TERMINAL: u8 = 4;
const ORPHAN: u8 = 5;
const NOBODY: u8 = 6;

/// A neighbor that is none: a node without arcs.
const NOWHERE: u32 = 0;

/// Nodes of a network, [`NOWHERE`] among them, from which on it is halved: below, sharing costs what it saves.
const WORTH_HALVING: usize = 4096;

/// A flow network on some pixels of a grid.
///
/// What is looked at together lies in arrays of its own: most of the time goes into walking along the trees.
#[derive(Debug, Default)]
pub(crate) struct GridFlow {
    /// Residual capacity from the source (above zero) or to the sink (below zero). The first node of this and all that
    /// follow is [`NOWHERE`].
    excess: Vec<i32>,
    /// Residual capacities to the four neighbors.
    residual: Vec<[i32; 4]>,
    /// The four neighbors.
    neighbors: Vec<[u32; 4]>,
    tree: Vec<u8>,
    parent: Vec<u8>,
    /// The neighbor that `parent` leads to, where it is a direction.
    above: Vec<u32>,
    /// When `distance` was last known to be right.
    stamp: Vec<u32>,
    /// Arcs to the terminal.
    distance: Vec<u32>,
    clock: u32,
    active: VecDeque<u32>,
    is_active: Vec<bool>,
    orphans: VecDeque<u32>,
    /// Where the other half of a large network is kept while it is solved.
    other_half: Option<Box<Self>>,
}

/// An arc between the two halves: a node of each as they are numbered in the whole network, the direction from the
/// first to the second, and the capacities there and back.
struct ArcBetween {
    nodes: [u32; 2],
    direction: usize,
    capacities: [i32; 2],
}

impl GridFlow {
    /// Empties the network; its nodes are numbered from 1 to `count`.
    pub(crate) fn reset(&mut self, count: usize) {
        self.clock = 0;
        self.active.clear();
        self.orphans.clear();
        let nodes = count + 1;
        refill(&mut self.excess, nodes, 0);
        refill(&mut self.residual, nodes, [0; 4]);
        refill(&mut self.neighbors, nodes, [NOWHERE; 4]);
        refill(&mut self.tree, nodes, FREE);
        refill(&mut self.parent, nodes, NOBODY);
        refill(&mut self.above, nodes, NOWHERE);
        refill(&mut self.stamp, nodes, 0);
        refill(&mut self.distance, nodes, 0);
        refill(&mut self.is_active, nodes, false);
    }

    /// Makes it cost `amount` (below zero: gain) to have `node` on the sink's side.
    pub(crate) fn add_sink_side_cost(&mut self, node: usize, amount: i32) {
        self.excess[node] = self.excess[node].saturating_add(amount);
    }

    /// Makes it cost `there` to have a node on the source's side and the `other`, its neighbor in `direction`, on the
    /// sink's, and `back` for the reverse; both at least 0.
    pub(crate) fn add_arcs(&mut self, [node, other]: [usize; 2], direction: usize, there: i32, back: i32) {
        // Nodes are numbered by 32 bits where pixels are.
        self.neighbors[node][direction] = other as u32;
        self.residual[node][direction] += there;
        self.neighbors[other][direction ^ 2] = node as u32;
        self.residual[other][direction ^ 2] += back;
    }

    /// Adds what a seam costs between two neighbors that may both change: `keep_both` while neither does,
    /// `second_changes` and `first_changes` if one alone does; nothing if both do. Who changes is on the sink's side.
    ///
    /// # Source
    /// Kolmogorov, Zabih, "What energy functions can be minimized via graph cuts?", IEEE TPAMI 26(2), 2004, section 4.
    pub(crate) fn add_seam(
        &mut self,
        [first, second]: [usize; 2],
        direction: usize,
        [keep_both, second_changes, first_changes]: [i32; 3],
    ) {
        self.add_sink_side_cost(first, first_changes - keep_both);
        self.add_sink_side_cost(second, -first_changes);
        // Rounding may make a seam dearer by one step than the two that stand for it.
        self.add_arcs([first, second], direction, (second_changes + first_changes - keep_both).max(0), 0);
    }

    fn neighbor(&self, node: usize, direction: usize) -> usize {
        self.neighbors[node][direction] as usize
    }

    /// Residual capacity of the arc along which the tree of `node` grows in `direction`: away from the source, towards
    /// the sink.
    fn growth_capacity(&self, node: usize, direction: usize) -> i32 {
        match self.tree[node] {
            SOURCE => self.residual[node][direction],
            _ => self.residual[self.neighbor(node, direction)][direction ^ 2],
        }
    }

    /// Finds the minimum cut. Afterwards [`Self::on_sink_side`] tells the sides.
    pub(crate) fn solve(&mut self) {
        if self.excess.len() < WORTH_HALVING {
            self.plant();
        } else {
            let mut other = self.other_half.take().unwrap_or_default();
            let arcs = self.part_with(&mut other);
            rayon::join(|| self.solve(), || other.solve());
            self.join_with(&other, &arcs);
            self.other_half = Some(other);
        }
        self.augment_all();
    }

    /// Moves the later half of the nodes to `other`, and returns the arcs between the two, which neither has then.
    fn part_with(&mut self, other: &mut Self) -> Vec<ArcBetween> {
        let kept = self.excess.len() / 2;
        other.reset(self.excess.len() - kept);
        other.excess[1..].copy_from_slice(&self.excess[kept..]);
        other.residual[1..].copy_from_slice(&self.residual[kept..]);
        let mut arcs = Vec::new();
        for node in kept..self.excess.len() {
            let there = node - kept + 1;
            for direction in 0..4 {
                let neighbor = self.neighbor(node, direction);
                if neighbor >= kept {
                    other.neighbors[there][direction] = (neighbor - kept + 1) as u32;
                } else if neighbor != NOWHERE as usize {
                    let back = std::mem::take(&mut self.residual[neighbor][direction ^ 2]);
                    let capacities = [std::mem::take(&mut other.residual[there][direction]), back];
                    self.neighbors[neighbor][direction ^ 2] = NOWHERE;
                    arcs.push(ArcBetween { nodes: [node as u32, neighbor as u32], direction, capacities });
                }
            }
        }
        self.truncate(kept);
        arcs
    }

    /// Takes back the half that is `other`'s, solved as this one is, and the `arcs` between the two, across which their
    /// trees go on growing.
    fn join_with(&mut self, other: &Self, arcs: &[ArcBetween]) {
        let offset = self.excess.len() as u32 - 1;
        let moved = |&node: &u32| if node == NOWHERE { NOWHERE } else { node + offset };
        self.excess.extend_from_slice(&other.excess[1..]);
        self.residual.extend_from_slice(&other.residual[1..]);
        self.neighbors.extend(other.neighbors[1..].iter().map(|four| four.map(|node| moved(&node))));
        self.tree.extend_from_slice(&other.tree[1..]);
        self.parent.extend_from_slice(&other.parent[1..]);
        self.above.extend(other.above[1..].iter().map(moved));
        self.stamp.extend_from_slice(&other.stamp[1..]);
        self.distance.extend_from_slice(&other.distance[1..]);
        self.is_active.extend_from_slice(&other.is_active[1..]);
        // What either half knows of its distances is right until the next path is found.
        self.clock = self.clock.max(other.clock);
        for &ArcBetween { nodes, direction, capacities: [there, back] } in arcs {
            let nodes = nodes.map(|node| node as usize);
            self.add_arcs(nodes, direction, there, back);
            for node in nodes {
                if self.tree[node] != FREE {
                    self.activate(node);
                }
            }
        }
    }

    fn truncate(&mut self, nodes: usize) {
        self.excess.truncate(nodes);
        self.residual.truncate(nodes);
        self.neighbors.truncate(nodes);
        self.tree.truncate(nodes);
        self.parent.truncate(nodes);
        self.above.truncate(nodes);
        self.stamp.truncate(nodes);
        self.distance.truncate(nodes);
        self.is_active.truncate(nodes);
    }

    /// Begins the trees with the nodes that are joined to a terminal.
    fn plant(&mut self) {
        for node in 1..self.excess.len() {
            if self.excess[node] != 0 {
                self.tree[node] = if self.excess[node] > 0 { SOURCE } else { SINK };
                self.parent[node] = TERMINAL;
                self.distance[node] = 1;
                self.activate(node);
            }
        }
    }

    /// Lets the trees grow, and pushes what fits along every path that they close, until none is left.
    fn augment_all(&mut self) {
        while let Some(&front) = self.active.front() {
            let node = front as usize;
            let bridge = if self.tree[node] == FREE { None } else { self.grow(node) };
            match bridge {
                Some(direction) => {
                    self.clock += 1;
                    self.augment(node, direction);
                    self.adopt();
                }
                None => {
                    self.active.pop_front();
                    self.is_active[node] = false;
                }
            }
        }
    }

    /// Whether `node` is on the sink's side of the minimum cut that is nearest to the sink.
    pub(crate) fn on_sink_side(&self, node: usize) -> bool {
        self.tree[node] == SINK
    }

    fn activate(&mut self, node: usize) {
        if !self.is_active[node] {
            self.is_active[node] = true;
            self.active.push_back(node as u32);
        }
    }

    /// Extends the tree of `node` to its free neighbors; returns the direction of an arc to the other tree.
    fn grow(&mut self, node: usize) -> Option<usize> {
        for direction in 0..4 {
            if self.growth_capacity(node, direction) <= 0 {
                continue;
            }
            let other = self.neighbor(node, direction);
            if self.tree[other] == FREE {
                self.tree[other] = self.tree[node];
                self.join(other, direction ^ 2, node);
                self.activate(other);
            } else if self.tree[other] != self.tree[node] {
                return Some(direction);
            } else if self.stamp[other] <= self.stamp[node] && self.distance[other] > self.distance[node] + 1 {
                // A shorter way to the terminal; trees stay flat.
                self.join(other, direction ^ 2, node);
            }
        }
        None
    }

    fn join(&mut self, child: usize, direction: usize, parent: usize) {
        self.parent[child] = direction as u8;
        self.above[child] = parent as u32;
        self.stamp[child] = self.stamp[parent];
        self.distance[child] = self.distance[parent] + 1;
    }

    /// Pushes what fits along the path that the arc from `node` in `direction` closes.
    fn augment(&mut self, node: usize, direction: usize) {
        let other = self.neighbor(node, direction);
        // The arc runs from the source's tree to the sink's.
        let (from, along, to) =
            if self.tree[node] == SOURCE { (node, direction, other) } else { (other, direction ^ 2, node) };
        let mut amount = self.residual[from][along];
        let mut at = from;
        while self.parent[at] < TERMINAL {
            let up = usize::from(self.parent[at]);
            at = self.above[at] as usize;
            amount = amount.min(self.residual[at][up ^ 2]);
        }
        amount = amount.min(self.excess[at]);
        at = to;
        while self.parent[at] < TERMINAL {
            let up = usize::from(self.parent[at]);
            amount = amount.min(self.residual[at][up]);
            at = self.above[at] as usize;
        }
        amount = amount.min(-self.excess[at]);

        self.push([from, to], along, amount);
        at = from;
        while self.parent[at] < TERMINAL {
            let up = usize::from(self.parent[at]);
            let above = self.above[at] as usize;
            self.push([above, at], up ^ 2, amount);
            if self.residual[above][up ^ 2] == 0 {
                self.orphan(at);
            }
            at = above;
        }
        self.excess[at] -= amount;
        if self.excess[at] == 0 {
            self.orphan(at);
        }
        at = to;
        while self.parent[at] < TERMINAL {
            let up = usize::from(self.parent[at]);
            let above = self.above[at] as usize;
            self.push([at, above], up, amount);
            if self.residual[at][up] == 0 {
                self.orphan(at);
            }
            at = above;
        }
        self.excess[at] += amount;
        if self.excess[at] == 0 {
            self.orphan(at);
        }
    }

    fn push(&mut self, [node, other]: [usize; 2], direction: usize, amount: i32) {
        self.residual[node][direction] -= amount;
        self.residual[other][direction ^ 2] += amount;
    }

    fn orphan(&mut self, node: usize) {
        self.parent[node] = ORPHAN;
        self.orphans.push_back(node as u32);
    }

    /// Finds new parents for the orphans, or sets them free.
    fn adopt(&mut self) {
        while let Some(orphan) = self.orphans.pop_front() {
            let node = orphan as usize;
            let tree = self.tree[node];
            let mut best: Option<(u32, usize)> = None;
            for direction in 0..4 {
                if self.capacity_from_parent(node, direction) > 0
                    && let Some(distance) = self.distance_to_terminal(self.neighbor(node, direction), tree)
                    && best.is_none_or(|(least, _)| distance < least)
                {
                    best = Some((distance, direction));
                }
            }
            if let Some((distance, direction)) = best {
                self.parent[node] = direction as u8;
                self.above[node] = self.neighbors[node][direction];
                self.stamp[node] = self.clock;
                self.distance[node] = distance + 1;
                continue;
            }
            for direction in 0..4 {
                let other = self.neighbor(node, direction);
                if self.tree[other] != tree {
                    continue;
                }
                if self.capacity_from_parent(node, direction) > 0 {
                    self.activate(other);
                }
                if usize::from(self.parent[other]) == direction ^ 2 {
                    self.orphan(other);
                }
            }
            self.tree[node] = FREE;
            self.parent[node] = NOBODY;
        }
    }

    /// Residual capacity of the tree arc between `node` and a possible parent in `direction`.
    fn capacity_from_parent(&self, node: usize, direction: usize) -> i32 {
        match self.tree[node] {
            SOURCE => self.residual[self.neighbor(node, direction)][direction ^ 2],
            _ => self.residual[node][direction],
        }
    }

    /// Arcs from `start`, a node of `tree`, to its terminal; `None` if it is of another tree or hangs on an orphan.
    fn distance_to_terminal(&mut self, start: usize, tree: u8) -> Option<u32> {
        if self.tree[start] != tree {
            return None;
        }
        let (mut at, mut steps) = (start, 0);
        let distance = loop {
            if self.stamp[at] == self.clock {
                break self.distance[at];
            }
            match self.parent[at] {
                TERMINAL => break 1,
                ORPHAN | NOBODY => return None,
                _ => at = self.above[at] as usize,
            }
            steps += 1;
        };
        // Remember along the way.
        let mut left = distance + steps;
        at = start;
        while self.stamp[at] != self.clock {
            self.stamp[at] = self.clock;
            self.distance[at] = left;
            if self.parent[at] >= TERMINAL {
                break;
            }
            at = self.above[at] as usize;
            left -= 1;
        }
        Some(distance + steps)
    }
}

fn refill<T: Clone>(values: &mut Vec<T>, length: usize, value: T) {
    values.clear();
    values.resize(length, value);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const WIDTH: usize = 4;
    const HEIGHT: usize = 3;
    const NODES: usize = WIDTH * HEIGHT;

    /// Cost of the assignment whose bit i tells whether node i is on the sink's side.
    fn cost(sides: u32, unary: &[i32], arcs: &[[i32; 4]]) -> i64 {
        let side = |node: usize| sides >> node & 1 == 1;
        let mut sum = 0;
        for node in 0..NODES {
            if side(node) {
                sum += i64::from(unary[node]);
            }
            let (x, y) = (node % WIDTH, node / WIDTH);
            let mut arc = |other: usize, there: i32, back: i32| {
                if !side(node) && side(other) {
                    sum += i64::from(there);
                }
                if side(node) && !side(other) {
                    sum += i64::from(back);
                }
            };
            if x + 1 < WIDTH {
                arc(node + 1, arcs[node][0], arcs[node][1]);
            }
            if y + 1 < HEIGHT {
                arc(node + WIDTH, arcs[node][2], arcs[node][3]);
            }
        }
        sum
    }

    fn cut(flow: &mut GridFlow, unary: &[i32], arcs: &[[i32; 4]]) -> u32 {
        flow.reset(NODES);
        for node in 0..NODES {
            let (x, y) = (node % WIDTH, node / WIDTH);
            let at = node + 1;
            flow.add_sink_side_cost(at, unary[node]);
            if x + 1 < WIDTH {
                flow.add_arcs([at, at + 1], RIGHT, arcs[node][0], arcs[node][1]);
            }
            if y + 1 < HEIGHT {
                flow.add_arcs([at, at + WIDTH], DOWN, arcs[node][2], arcs[node][3]);
            }
        }
        flow.solve();
        let sink_side = |node: usize| flow.on_sink_side(node + 1);
        (0..NODES).filter(|&node| sink_side(node)).map(|node| 1 << node).sum()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn no_assignment_costs_less_than_the_cut(
            unary in prop::collection::vec(-9..9_i32, NODES),
            arcs in prop::collection::vec([0..7_i32, 0..7_i32, 0..7_i32, 0..7_i32], NODES),
        ) {
            let found = cost(cut(&mut GridFlow::default(), &unary, &arcs), &unary, &arcs);
            let least = (0..1 << NODES).map(|sides| cost(sides, &unary, &arcs)).min();
            prop_assert_eq!(Some(found), least);
        }
    }

    /// The sides of a grid of pseudorandom costs, large enough to be halved twice, as its halves have them together and
    /// as one network has them.
    #[test]
    fn halves_find_the_same_cut() {
        const SIDE: usize = 100;
        const { assert!(SIDE * SIDE / 2 > WORTH_HALVING) };
        let mut state = 7_u32;
        let mut below = |limit: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 8) % limit) as i32
        };
        let mut flows = [GridFlow::default(), GridFlow::default()];
        flows.iter_mut().for_each(|flow| flow.reset(SIDE * SIDE));
        for at in 1..=SIDE * SIDE {
            let (unary, arcs) = (below(41) - 20, [(); 4].map(|()| below(12)));
            for flow in &mut flows {
                flow.add_sink_side_cost(at, unary);
                if at % SIDE != 0 {
                    flow.add_arcs([at, at + 1], RIGHT, arcs[0], arcs[1]);
                }
                if at + SIDE <= SIDE * SIDE {
                    flow.add_arcs([at, at + SIDE], DOWN, arcs[2], arcs[3]);
                }
            }
        }
        let [halved, whole] = &mut flows;
        halved.solve();
        whole.plant();
        whole.augment_all();
        let sides = |flow: &GridFlow| (1..=SIDE * SIDE).map(|node| flow.on_sink_side(node)).collect::<Vec<_>>();
        assert_eq!(sides(halved), sides(whole));
        let on_sink_side = sides(whole).iter().filter(|&&side| side).count();
        assert!((SIDE..SIDE * SIDE - SIDE).contains(&on_sink_side), "{on_sink_side}");
        assert_eq!(
            halved.excess.iter().map(|&left| i64::from(left)).sum::<i64>(),
            whole.excess.iter().map(|&left| i64::from(left)).sum::<i64>()
        );
    }

    #[test]
    fn a_network_can_be_used_again() {
        let arcs = vec![[2, 2, 2, 2]; NODES];
        let mut flow = GridFlow::default();
        let unary: Vec<i32> = (0..NODES as i32).map(|node| node - 6).collect();
        let first = cut(&mut flow, &unary, &arcs);
        assert_ne!(cut(&mut flow, &[5; NODES], &arcs), first);
        assert_eq!(cut(&mut flow, &unary, &arcs), first);
    }
}
