//! Which photographs overlap: the paper's graph G with edges J, its components and its spanning tree.

mod graph_file;

use petgraph::algo::min_spanning_tree;
use petgraph::data::Element;
use petgraph::graph::{NodeIndex, UnGraph};
use petgraph::unionfind::UnionFind;
use serde::{Deserialize, Serialize};
use trueup_core::matches::PairMatches;

pub use graph_file::{GraphFile, parse_graph_file};

/// Two overlapping photographs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraphEdge {
    /// Index of the first photograph.
    pub a: usize,
    /// Index of the second photograph, larger than `a`.
    pub b: usize,
    /// Number of matches that agree with the pair's global homography.
    pub weight: usize,
}

impl GraphEdge {
    /// The edge of a joined pair.
    pub fn of(pair: &PairMatches) -> Self {
        Self { a: pair.a, b: pair.b, weight: pair.agreeing }
    }
}

/// Overlapping photographs as a graph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StitchGraph {
    /// Number of photographs, joined or not.
    pub photographs: usize,
    /// The joined pairs, sorted by (a, b).
    pub edges: Vec<GraphEdge>,
    /// Connected photographs, each list ascending; the largest component first, ties by the sum of the weights.
    /// A photograph without an edge is a component of its own.
    pub components: Vec<Vec<usize>>,
}

/// A step of a spanning tree: `child` is placed relative to `parent`, which comes earlier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TreeStep {
    /// A photograph that is already placed.
    pub parent: usize,
    /// The photograph that is placed next.
    pub child: usize,
}

impl StitchGraph {
    /// The graph of the joined pairs among `photographs` photographs.
    pub fn new<'a>(photographs: usize, pairs: impl IntoIterator<Item = &'a PairMatches>) -> Self {
        let mut edges: Vec<GraphEdge> =
            pairs.into_iter().filter(|pair| pair.verdict.is_joined()).map(GraphEdge::of).collect();
        edges.sort_by_key(|edge| (edge.a, edge.b));
        Self::from_edges(photographs, edges)
    }

    /// The graph of given edges, sorted by (a, b).
    pub fn from_edges(photographs: usize, edges: Vec<GraphEdge>) -> Self {
        let components = components(photographs, &edges);
        Self { photographs, edges, components }
    }

    /// The edges inside a component.
    pub fn edges_of<'a>(&'a self, component: &'a [usize]) -> impl Iterator<Item = &'a GraphEdge> {
        self.edges.iter().filter(|edge| component.binary_search(&edge.a).is_ok())
    }

    /// The component's spanning tree of largest total weight, walked breadth first from `root`.
    ///
    /// The order is deterministic: children by falling weight, then by index.
    pub fn spanning_tree(&self, component: &[usize], root: usize) -> Vec<TreeStep> {
        let mut graph = UnGraph::<(), i64>::with_capacity(self.photographs, self.edges.len());
        for _ in 0..self.photographs {
            graph.add_node(());
        }
        for edge in self.edges_of(component) {
            // petgraph minimizes: the heaviest edges must come first.
            graph.add_edge(NodeIndex::new(edge.a), NodeIndex::new(edge.b), -(edge.weight as i64));
        }
        let mut neighbors: Vec<Vec<(i64, usize)>> = vec![Vec::new(); self.photographs];
        for element in min_spanning_tree(&graph) {
            if let Element::Edge { source, target, weight } = element {
                neighbors[source].push((weight, target));
                neighbors[target].push((weight, source));
            }
        }
        for list in &mut neighbors {
            list.sort_unstable();
        }
        let mut steps = Vec::with_capacity(component.len().saturating_sub(1));
        let mut placed = vec![false; self.photographs];
        let mut queue = std::collections::VecDeque::from([root]);
        placed[root] = true;
        while let Some(parent) = queue.pop_front() {
            for &(_, child) in &neighbors[parent] {
                if !std::mem::replace(&mut placed[child], true) {
                    steps.push(TreeStep { parent, child });
                    queue.push_back(child);
                }
            }
        }
        steps
    }

    /// The photograph in the middle of the component: the spanning tree's node with the fewest steps to the farthest
    /// one, ties by the larger sum of edge weights, then by the smaller index.
    pub fn central_photograph(&self, component: &[usize]) -> usize {
        let root = component.first().copied().unwrap_or(0);
        let tree = self.spanning_tree(component, root);
        let mut neighbors: Vec<Vec<usize>> = vec![Vec::new(); self.photographs];
        for step in &tree {
            neighbors[step.parent].push(step.child);
            neighbors[step.child].push(step.parent);
        }
        let mut weights = vec![0_usize; self.photographs];
        for edge in &self.edges {
            weights[edge.a] += edge.weight;
            weights[edge.b] += edge.weight;
        }
        component
            .iter()
            .copied()
            .min_by_key(|&photograph| {
                (eccentricity(&neighbors, photograph), usize::MAX - weights[photograph], photograph)
            })
            .unwrap_or(root)
    }
}

fn components(photographs: usize, edges: &[GraphEdge]) -> Vec<Vec<usize>> {
    let mut union = UnionFind::new(photographs);
    for edge in edges {
        union.union(edge.a, edge.b);
    }
    let labels = union.into_labeling();
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); photographs];
    let mut weights = vec![0_usize; photographs];
    for (photograph, &label) in labels.iter().enumerate() {
        members[label].push(photograph);
    }
    for edge in edges {
        weights[labels[edge.a]] += edge.weight;
    }
    let mut order: Vec<usize> = (0..photographs).filter(|&label| !members[label].is_empty()).collect();
    order.sort_by_key(|&label| {
        (usize::MAX - members[label].len(), usize::MAX - weights[label], members[label].first().copied())
    });
    order.into_iter().map(|label| std::mem::take(&mut members[label])).collect()
}

/// Steps from `start` to the farthest node of its tree.
fn eccentricity(neighbors: &[Vec<usize>], start: usize) -> usize {
    let mut distance = vec![usize::MAX; neighbors.len()];
    let mut queue = std::collections::VecDeque::from([start]);
    distance[start] = 0;
    let mut farthest = 0;
    while let Some(node) = queue.pop_front() {
        farthest = distance[node];
        for &next in &neighbors[node] {
            if distance[next] == usize::MAX {
                distance[next] = distance[node] + 1;
                queue.push_back(next);
            }
        }
    }
    farthest
}

#[cfg(test)]
mod tests {
    use trueup_core::matches::{PairVerdict, PointMatches};

    use super::*;

    fn pair(a: usize, b: usize, agreeing: usize) -> PairMatches {
        PairMatches {
            a,
            b,
            putative: agreeing,
            in_overlap: agreeing,
            agreeing,
            needed: 15,
            verdict: if agreeing >= 15 { PairVerdict::Joined } else { PairVerdict::TooFewInliers },
            b_from_a: None,
            inliers: PointMatches::default(),
            elsewhere: PointMatches::default(),
        }
    }

    #[test]
    fn components_are_sorted_by_size_and_strangers_stand_alone() {
        let graph = StitchGraph::new(6, &[pair(0, 5, 20), pair(1, 2, 50), pair(2, 3, 50), pair(0, 4, 3)]);
        assert_eq!(graph.components, [vec![1, 2, 3], vec![0, 5], vec![4]]);
        assert_eq!(graph.edges_of(&[0, 5]).count(), 1);
    }

    #[test]
    fn equal_components_are_sorted_by_weight() {
        let graph = StitchGraph::new(4, &[pair(0, 1, 20), pair(2, 3, 90)]);
        assert_eq!(graph.components, [vec![2, 3], vec![0, 1]]);
    }

    #[test]
    fn the_tree_uses_the_heaviest_edges_and_the_center_is_in_the_middle() {
        let pairs = [pair(0, 1, 100), pair(1, 2, 80), pair(0, 2, 20), pair(2, 3, 60), pair(3, 4, 60)];
        let graph = StitchGraph::new(5, &pairs);
        let component = graph.components[0].clone();
        let center = graph.central_photograph(&component);
        assert_eq!(center, 2);
        let steps: Vec<(usize, usize)> =
            graph.spanning_tree(&component, center).iter().map(|step| (step.parent, step.child)).collect();
        assert_eq!(steps, [(2, 1), (2, 3), (1, 0), (3, 4)]);
    }
}
