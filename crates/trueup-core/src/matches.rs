//! What is known of a pair of photographs after matching.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A point seen in both photographs of a pair, in working pixels of each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointMatch {
    /// Position in photograph a (x, y).
    pub in_a: [f64; 2],
    /// Position in photograph b (x, y).
    pub in_b: [f64; 2],
}

/// Matches that copies share: pairs are handed from stage to stage, renumbered and chosen among, and their matches stay
/// what they are. Whoever changes a copy has it to itself from then on.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointMatches(Arc<Vec<PointMatch>>);

impl Deref for PointMatches {
    type Target = Vec<PointMatch>;

    fn deref(&self) -> &Vec<PointMatch> {
        &self.0
    }
}

impl DerefMut for PointMatches {
    fn deref_mut(&mut self) -> &mut Vec<PointMatch> {
        Arc::make_mut(&mut self.0)
    }
}

impl From<Vec<PointMatch>> for PointMatches {
    fn from(mut matches: Vec<PointMatch>) -> Self {
        matches.shrink_to_fit();
        Self(Arc::new(matches))
    }
}

impl FromIterator<PointMatch> for PointMatches {
    fn from_iter<I: IntoIterator<Item = PointMatch>>(matches: I) -> Self {
        matches.into_iter().collect::<Vec<_>>().into()
    }
}

impl<'a> IntoIterator for &'a PointMatches {
    type Item = &'a PointMatch;
    type IntoIter = std::slice::Iter<'a, PointMatch>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl Serialize for PointMatches {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for PointMatches {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::deserialize(deserializer).map(Self::from)
    }
}

/// Why a pair was accepted or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PairVerdict {
    /// The photographs overlap.
    Joined,
    /// The user's graph says that they overlap, and enough matches agree to use it.
    JoinedByGraph,
    /// Few matches agree, but all that they lay over each other looks alike.
    JoinedByLooks,
    /// Fewer putative matches than a homography needs.
    TooFewMatches,
    /// The best homography folds, mirrors or explodes the photograph.
    ImplausibleHomography,
    /// Too few of the matches in the predicted overlap agree.
    TooFewInliers,
    /// Enough matches agree, but little else in the overlap that they predict looks alike: equal things in different
    /// places.
    LooksDifferent,
}

impl PairVerdict {
    /// Whether the pair is an edge of the stitch graph.
    pub fn is_joined(self) -> bool {
        matches!(self, Self::Joined | Self::JoinedByGraph | Self::JoinedByLooks)
    }
}

/// The outcome of matching photographs `a` and `b` (`a < b`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairMatches {
    /// Index of the first photograph.
    pub a: usize,
    /// Index of the second photograph, larger than `a`.
    pub b: usize,
    /// Number of putative matches (after ratio and mutual tests).
    pub putative: usize,
    /// Putative matches that lie inside the overlap that the homography or the turned lens predicts; 0 without either.
    pub in_overlap: usize,
    /// Those of them that agree with the global homography or the turned lens (n_i of the Brown-Lowe test); where these
    /// alone are too few to join the pair, also those on further planes and elsewhere in depth.
    pub agreeing: usize,
    /// How many had to agree for the pair to be joined.
    pub needed: usize,
    /// Whether the pair is joined, and why not.
    pub verdict: PairVerdict,
    /// Rows of the homography from a to b in working pixels; `None` if none was found.
    pub b_from_a: Option<[[f64; 3]; 3]>,
    /// The matches kept (P_ij): global inliers first, then those of further planes. Empty unless joined.
    pub inliers: PointMatches,
    /// Further matches of which neighbors moved alike and that, with the others, one epipolar geometry explains: the
    /// same things, elsewhere in depth than the planes that `inliers` lie on. Empty unless joined.
    pub elsewhere: PointMatches,
}

impl PairMatches {
    /// How many matches agree for each that had to, of which Brown and Lowe want 8 + 0.3 n_f: from 1 on the pair is
    /// joined.
    pub fn confidence(&self) -> f64 {
        if self.needed == 0 { 0.0 } else { self.agreeing as f64 / self.needed as f64 }
    }
}
