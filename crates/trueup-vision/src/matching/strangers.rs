//! Pictures among the photographs that are none: panoramas made of the others, and reduced copies of one of them.
//!
//! Both spoil a panorama: the first is bent by its projection and blended already, so that no camera has seen it, the second
//! adds nothing but its coarse pixels.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Vector2};
use trueup_core::geometry::Homography;
use trueup_core::matches::PairMatches;
use trueup_core::source::WorkingFrame;

use super::overlap::PredictedOverlap;

/// A picture that is no photograph of the scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stranger {
    /// Its number among the photographs.
    pub photograph: usize,
    /// What it is taken for.
    pub kind: StrangerKind,
}

/// What a picture among the photographs is taken for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StrangerKind {
    /// It shows the whole view of the photograph `of`, and nothing else, with fewer pixels.
    ReducedCopy {
        /// The photograph's number.
        of: usize,
    },
    /// It shows all that each of `of` shows, on a format that no camera has.
    Panorama {
        /// At least two photographs' numbers, ascending.
        of: Vec<usize>,
    },
}

/// Share of a view's area, each way, from which two pictures show the same view.
const SAME_VIEW: f64 = 0.97;
/// Share of the matches in the overlap that agree, from which two pictures can be of one exposure: nothing has moved.
const SAME_EXPOSURE: f64 = 0.9;
/// A reduced copy is at most this large on a side, in parts of the original: copies of nearly its size are left to the user.
const REDUCED: f64 = 0.9;
/// Share of a photograph's area from which a panorama shows it whole: a panorama may be cropped, and a homography tells where
/// the corners lie on a bent one to a few hundredths.
const WHOLE: f64 = 0.9;
/// Share of a photograph's area that a panorama shows of it whose ragged borders were cut off.
const MOSTLY: f64 = 0.6;
/// Share of such a panorama that its photographs cover together, at least, and one alone, at most: a photograph that its neighbors
/// overlap as far is covered by each of them.
const CROPPED_COVERED: f64 = 0.85;
const COVERED_BY_ONE: f64 = 0.7;
/// Photographs that a picture must show to be taken for a panorama of them.
const MIN_SHOWN: usize = 2;
/// Share of a whole panorama that the photographs it was made of cover. Its empty corners are not covered; what a wider lens has seen
/// beyond the others is not, either.
const MIN_COVERED: f64 = 0.6;
/// Width by height of what cameras write, lying: square, large format, four thirds, 35 mm, high definition.
const CAMERA_FORMATS: [f64; 5] = [1.0, 5.0 / 4.0, 4.0 / 3.0, 3.0 / 2.0, 16.0 / 9.0];
/// How far a picture's format may be from a camera's, as a part of it: sensors have a few columns more or less.
const FORMAT_TOLERANCE: f64 = 0.015;
/// Sides that differ by less, as a part, are the same: lens corrections cost a few pixels.
const SAME_SIDE: f64 = 0.01;
/// Points on a side of the grid by which shares of areas are counted.
const GRID: usize = 16;

/// The pictures that `pairs` show to be none of the scene's photographs; `frames` has one for each, ascending by number.
///
/// Overlaps of lenses that bend are not looked at: they have no homography.
pub fn find_strangers(frames: &[WorkingFrame], pairs: &[PairMatches]) -> Vec<Stranger> {
    // A stranger is of another size than what it shows; in most sets there is only one.
    if frames.windows(2).all(|two| sides(&two[0]) == sides(&two[1])) {
        return Vec::new();
    }
    let views: Vec<SharedView> = pairs.iter().filter_map(|pair| SharedView::of(pair, frames)).collect();
    let copies = reduced_copies(&views, frames);
    let panorama = |photograph: &usize| {
        let of = shown_of(*photograph, &views, &copies, frames)?;
        Some(Stranger { photograph: *photograph, kind: StrangerKind::Panorama { of } })
    };
    let copy = |(&photograph, &of): (&usize, &usize)| Stranger { photograph, kind: StrangerKind::ReducedCopy { of } };
    let originals: Vec<usize> = (0..frames.len()).filter(|photograph| !copies.contains_key(photograph)).collect();
    let mut strangers: Vec<Stranger> = copies.iter().map(copy).chain(originals.iter().filter_map(panorama)).collect();
    strangers.sort_by_key(|stranger| stranger.photograph);
    strangers
}

/// What the photographs of a joined pair show of each other.
struct SharedView {
    a: usize,
    b: usize,
    /// The cells of a's grid that b shows, in rows.
    of_a: Vec<bool>,
    /// The cells of b's grid that a shows.
    of_b: Vec<bool>,
    /// Share of the matches in the overlap that agree.
    agreeing: f64,
}

impl SharedView {
    fn of(pair: &PairMatches, frames: &[WorkingFrame]) -> Option<Self> {
        let (frame_a, frame_b) = (frames.get(pair.a)?, frames.get(pair.b)?);
        let [x, y, w] = pair.b_from_a.filter(|_| pair.verdict.is_joined())?;
        let b_from_a = Homography(Matrix3::from_row_slice(&[x, y, w].concat()));
        let overlap = PredictedOverlap::new(b_from_a, frame_a, frame_b)?;
        Some(Self {
            a: pair.a,
            b: pair.b,
            of_a: cells(frame_a).map(|at| overlap.point_in_b(at).is_some()).collect(),
            of_b: cells(frame_b).map(|at| overlap.point_in_a(at).is_some()).collect(),
            agreeing: pair.agreeing as f64 / pair.in_overlap.max(1) as f64,
        })
    }

    /// The other photograph, the cells of `photograph` that it shows, and its cells that `photograph` shows; `None` if the
    /// pair is of others.
    fn seen_from(&self, photograph: usize) -> Option<(usize, &[bool], &[bool])> {
        match photograph {
            one if one == self.a => Some((self.b, &self.of_a, &self.of_b)),
            one if one == self.b => Some((self.a, &self.of_b, &self.of_a)),
            _ => None,
        }
    }

    fn is_same(&self) -> bool {
        self.agreeing >= SAME_EXPOSURE && share(&self.of_a) >= SAME_VIEW && share(&self.of_b) >= SAME_VIEW
    }
}

/// The middles of a photograph's cells, row by row.
fn cells(frame: &WorkingFrame) -> impl Iterator<Item = Vector2<f64>> {
    let (width, height) = (frame.width, frame.height);
    let middle = |cell: usize, side: f64| (cell as f64 + 0.5) / GRID as f64 * side;
    (0..GRID * GRID).map(move |cell| Vector2::new(middle(cell % GRID, width), middle(cell / GRID, height)))
}

fn share(shown: &[bool]) -> f64 {
    shown.iter().filter(|&&shown| shown).count() as f64 / shown.len().max(1) as f64
}

/// Pixels of a photograph's longer and shorter side.
fn sides(frame: &WorkingFrame) -> [f64; 2] {
    let (width, height) = (frame.width / frame.working_from_full, frame.height / frame.working_from_full);
    [width.max(height), width.min(height)]
}

fn alike(one: f64, other: f64, tolerance: f64) -> bool {
    (one - other).abs() <= tolerance * one.max(other)
}

/// By the number of each reduced copy that of the largest picture of its view.
fn reduced_copies(views: &[SharedView], frames: &[WorkingFrame]) -> BTreeMap<usize, usize> {
    let mut copies: BTreeMap<usize, usize> = BTreeMap::new();
    for view in views.iter().filter(|view| view.is_same()) {
        let long = |photograph: usize| sides(&frames[photograph])[0];
        let (small, large) = if long(view.a) < long(view.b) { (view.a, view.b) } else { (view.b, view.a) };
        if long(small) <= REDUCED * long(large) {
            let of = copies.entry(small).or_insert(large);
            *of = if long(large) > long(*of) { large } else { *of };
        }
    }
    copies
}

/// The photographs that `picture` shows, if it is a panorama made of them.
fn shown_of(
    picture: usize,
    views: &[SharedView],
    copies: &BTreeMap<usize, usize>,
    frames: &[WorkingFrame],
) -> Option<Vec<usize>> {
    let of_picture = sides(&frames[picture]);
    let format = of_picture[0] / of_picture[1];
    if CAMERA_FORMATS.iter().any(|camera| alike(format, *camera, FORMAT_TOLERANCE)) {
        return None;
    }
    let mut covered = vec![false; GRID * GRID];
    let (mut whole, mut mostly) = (BTreeSet::new(), BTreeSet::new());
    for (other, of_picture_shown, of_other_shown) in views.iter().filter_map(|view| view.seen_from(picture)) {
        let of_other = sides(&frames[other]);
        if copies.contains_key(&other) || (0..2).all(|side| alike(of_picture[side], of_other[side], SAME_SIDE)) {
            continue;
        }
        covered.iter_mut().zip(of_picture_shown).for_each(|(covered, shown)| *covered |= shown);
        if share(of_other_shown) >= WHOLE {
            whole.insert(other);
        }
        if share(of_other_shown) >= MOSTLY && share(of_picture_shown) <= COVERED_BY_ONE {
            mostly.insert(other);
        }
    }
    // What shows the same view counts once.
    let several = |shown: &BTreeSet<usize>| {
        let same = |view: &&SharedView| shown.contains(&view.a) && shown.contains(&view.b) && view.is_same();
        shown.len() >= MIN_SHOWN + views.iter().filter(same).count()
    };
    let covered = share(&covered);
    if several(&whole) && covered >= MIN_COVERED {
        return Some(whole.into_iter().collect());
    }
    (several(&mostly) && covered >= CROPPED_COVERED).then(|| mostly.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use trueup_core::matches::PairVerdict;

    use super::*;

    /// Joined by what moves a point of `a` by (`right`, `down`) into `b` and makes it `scale` times as large.
    fn pair(a: usize, b: usize, scale: f64, right: f64, down: f64) -> PairMatches {
        PairMatches {
            a,
            b,
            putative: 100,
            in_overlap: 100,
            agreeing: 97,
            needed: 30,
            verdict: PairVerdict::Joined,
            b_from_a: Some([[scale, 0.0, right], [0.0, scale, down], [0.0, 0.0, 1.0]]),
            inliers: Vec::new(),
        }
    }

    /// Frames of pictures of these sizes in full pixels, measured at half of them.
    fn frames(sizes: &[[f64; 2]]) -> Vec<WorkingFrame> {
        let frame = |[width, height]: &[f64; 2]| WorkingFrame {
            width: width / 2.0,
            height: height / 2.0,
            working_from_full: 0.5,
        };
        sizes.iter().map(frame).collect()
    }

    /// Three photographs of a row, and as number 3 a picture of `size` full pixels that begins `left` working pixels left of
    /// the first one.
    fn row_and(size: [f64; 2], left: f64) -> Vec<Stranger> {
        let frames = frames(&[[600.0, 400.0], [600.0, 400.0], [600.0, 400.0], size]);
        let pairs = [
            pair(0, 1, 1.0, -150.0, 0.0),
            pair(1, 2, 1.0, -150.0, 0.0),
            pair(0, 3, 1.0, left, 5.0),
            pair(1, 3, 1.0, left + 150.0, 5.0),
            pair(2, 3, 1.0, left + 300.0, 5.0),
        ];
        find_strangers(&frames, &pairs)
    }

    #[test]
    fn a_panorama_of_the_others_is_found() {
        let expected = Stranger { photograph: 3, kind: StrangerKind::Panorama { of: vec![0, 1, 2] } };
        assert_eq!(row_and([1240.0, 420.0], 10.0), [expected]);
    }

    /// Its rows above and below are cut off: 300 of the photographs' 400.
    #[test]
    fn a_cropped_panorama_of_the_others_is_found() {
        let frames = frames(&[[600.0, 400.0], [600.0, 400.0], [600.0, 400.0], [1180.0, 300.0]]);
        let pairs = [
            pair(0, 1, 1.0, -150.0, 0.0),
            pair(1, 2, 1.0, -150.0, 0.0),
            pair(0, 3, 1.0, -5.0, -25.0),
            pair(1, 3, 1.0, 145.0, -25.0),
            pair(2, 3, 1.0, 295.0, -25.0),
        ];
        let expected = Stranger { photograph: 3, kind: StrangerKind::Panorama { of: vec![0, 1, 2] } };
        assert_eq!(find_strangers(&frames, &pairs), [expected]);
    }

    /// Larger than its neighbors, which show most of it, each.
    #[test]
    fn a_photograph_of_another_size_in_a_dense_row_is_one() {
        let frames = frames(&[[600.0, 400.0], [600.0, 400.0], [660.0, 390.0]]);
        let pairs = [pair(0, 1, 1.0, -120.0, 0.0), pair(0, 2, 1.0, -45.0, 0.0), pair(1, 2, 1.0, 75.0, 0.0)];
        assert_eq!(find_strangers(&frames, &pairs), []);
    }

    /// 1,215 x 810 is a camera's format: a camera with a wider lens may have seen all of them.
    #[test]
    fn what_a_camera_can_have_taken_is_a_photograph() {
        assert_eq!(row_and([1215.0, 810.0], 10.0), []);
    }

    /// It shows the three, and as much beside them: 600 of 2,600 columns are theirs.
    #[test]
    fn what_shows_much_beside_the_others_is_a_photograph() {
        assert_eq!(row_and([2600.0, 420.0], 300.0), []);
    }

    #[test]
    fn neighbors_in_a_row_are_photographs() {
        let frames = frames(&[[610.0, 350.0]; 4]);
        let pairs = [pair(0, 1, 1.0, -20.0, 0.0), pair(1, 2, 1.0, -20.0, 0.0), pair(0, 2, 1.0, -10.0, 0.0)];
        assert_eq!(find_strangers(&frames, &pairs), []);
    }

    #[test]
    fn a_smaller_picture_of_the_same_view_is_a_copy() {
        let frames = frames(&[[150.0, 100.0], [600.0, 400.0], [600.0, 400.0], [300.0, 200.0]]);
        // The photographs 1 and 2 differ in their exposure alone: both stay.
        let pairs = [
            pair(0, 1, 4.0, 0.0, 0.0),
            pair(0, 2, 4.0, 0.0, 0.0),
            pair(0, 3, 2.0, 0.0, 0.0),
            pair(1, 2, 1.0, 0.0, 0.0),
            pair(1, 3, 0.5, 0.0, 0.0),
        ];
        let copy = |photograph, of| Stranger { photograph, kind: StrangerKind::ReducedCopy { of } };
        assert_eq!(find_strangers(&frames, &pairs), [copy(0, 1), copy(3, 1)]);
    }

    /// A part of the view, enlarged: it may be of a longer lens.
    #[test]
    fn a_part_of_a_view_is_a_photograph() {
        let frames = frames(&[[300.0, 200.0], [600.0, 400.0]]);
        assert_eq!(find_strangers(&frames, &[pair(0, 1, 1.0, 60.0, 40.0)]), []);
    }
}
