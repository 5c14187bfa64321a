//! Pictures among the photographs that are none: panoramas made of the others, and copies of one of them, reduced or
//! edited.
//!
//! They spoil a panorama: the first is bent by its projection and blended already, so that no camera has seen it,
//! copies add nothing but coarse pixels or other tones.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Vector2};
use trueup_core::geometry::Homography;
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::source::WorkingFrame;
use trueup_core::statistics::median_of;

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
    /// It is the photograph `of` itself with other tones, compression or size: everything lies at the same place to a
    /// fraction of a pixel.
    EditedCopy {
        /// The photograph's number.
        of: usize,
    },
    /// It shows all that each of `of` shows, and more, on a format that no camera has, as these do, or all of one size;
    /// or, on any format, nothing but what they show together, with no more detail. Where it shows them, it matches
    /// them about as densely as any other.
    Panorama {
        /// At least two photographs' numbers, ascending.
        of: Vec<usize>,
    },
}

/// Share of a view's area, each way, from which two pictures show the same view.
const SAME_VIEW: f64 = 0.97;
/// Share of the matches in the overlap that agree, from which two pictures can be of one exposure: nothing has moved.
const SAME_EXPOSURE: f64 = 0.9;
/// A reduced copy is at most this large on a side, in parts of the original: copies of nearly its size are left to the
/// user.
const REDUCED: f64 = 0.9;
/// Share of a photograph's area from which a panorama shows it whole: a panorama may be cropped, and a homography tells
/// where the corners lie on a bent one to a few hundredths.
const WHOLE: f64 = 0.9;
/// Share of a photograph's area that a panorama shows of it whose ragged borders were cut off.
const MOSTLY: f64 = 0.6;
/// Share of such a panorama that its photographs cover together, at least, and one alone, at most: a photograph that
/// its neighbors overlap as far is covered by each of them.
const CROPPED_COVERED: f64 = 0.85;
const COVERED_BY_ONE: f64 = 0.7;
/// Photographs that a picture must show to be taken for a panorama of them.
const MIN_SHOWN: usize = 2;
/// Share of a whole panorama that the photographs it was made of cover. Its empty corners are not covered; what a wider
/// lens has seen beyond the others is not, either.
const MIN_COVERED: f64 = 0.6;
/// Width by height of what cameras write, lying: square, large format, four thirds, 35 mm, high definition.
const CAMERA_FORMATS: [f64; 5] = [1.0, 5.0 / 4.0, 4.0 / 3.0, 3.0 / 2.0, 16.0 / 9.0];
/// How far a picture's format may be from a camera's, as a part of it: sensors have a few columns more or less.
const FORMAT_TOLERANCE: f64 = 0.015;
/// Sides that differ by less, as a part, are the same: lens corrections cost a few pixels.
const SAME_SIDE: f64 = 0.01;
/// A picture of a camera's format is a panorama if its photographs lie in it by this share of their area at least, ...
const INSIDE: f64 = 0.8;
/// ... each covers this share of it at most: neighbors in a row that overlap as far have the size of their neighbors,
/// ...
const PART: f64 = 0.5;
/// ... together they cover this share of it, short of what a homography errs by on a bent one: a wider lens would have
/// seen something beyond them, or nothing that they do not show, ...
const NOTHING_ELSE: f64 = 0.95;
/// ... and none is enlarged in it by more than this, as lengths go: leaving it out loses no detail.
const MOST_ENLARGED: f64 = 1.25;
/// Least number of matches for the area it shows that a panorama has with its photographs, in the middle, as a share of
/// that with the photograph that it has most matches with. Where a scene repeats a thing near and far, a photograph
/// that shows it near takes those that show it far for parts of it, by the matches of that thing alone. Of panoramas
/// put beside their photographs (six sets) it is 0.48 to 1, of two such photographs (of a rendered room with the same
/// picture on two walls) 0.1; set looking at these.
const AS_DENSE: f64 = 0.25;
/// Median distance of matches from the same place in both, working pixels, up to which two pictures are of one
/// exposure: hands, and wind on a tripod, move a camera by more between two.
const SAME_PLACE_PX: f64 = 0.2;
/// Points on a side of the grid by which shares of areas are counted.
const GRID: usize = 16;

/// What strangers are told by. Lists have an entry per photograph.
#[derive(Debug, Clone, Copy)]
pub struct StrangersInput<'a> {
    /// The frames that the photographs were matched in.
    pub frames: &'a [WorkingFrame],
    /// Every pair tried.
    pub pairs: &'a [PairMatches],
    /// Whether a camera's metadata are in the file: of copies, such a one is the original.
    pub by_camera: &'a [bool],
    /// When each was taken, as far as its file says. What was taken at two moments is no copy.
    pub taken: &'a [Option<String>],
    /// Whether the photographer marked parts of it (masks): such a photograph is meant to stand for itself, beside what
    /// it is a copy of.
    pub marked: &'a [bool],
    /// Whether edited copies are looked for: not where several exposures of a view are to be stitched as they are.
    pub copies: bool,
}

/// The pictures that the pairs show to be none of the scene's photographs, ascending by number.
///
/// Overlaps are looked at by their homographies, of lenses that bend by the one that says nearly the same of their
/// matches. Edited copies are left where nothing else would overlap.
pub fn find_strangers(input: &StrangersInput) -> Vec<Stranger> {
    let StrangersInput { frames, pairs, .. } = *input;
    let views: Vec<SharedView> = pairs.iter().filter_map(|pair| SharedView::of(pair, input)).collect();
    let mut copies = reduced_copies(&views, frames);
    if input.copies {
        let edited = edited_copies(&views, &copies, input);
        let is_left = |photograph| !edited.contains_key(&photograph) && !copies.contains_key(&photograph);
        if views.iter().any(|view| is_left(view.a) && is_left(view.b)) {
            copies.extend(edited);
        }
    }
    let panorama = |photograph: &usize| {
        let of = shown_of(*photograph, &views, &copies, frames)?;
        Some(Stranger { photograph: *photograph, kind: StrangerKind::Panorama { of } })
    };
    let originals: Vec<usize> = (0..frames.len()).filter(|photograph| !copies.contains_key(photograph)).collect();
    let copied = copies.iter().map(|(&photograph, kind)| Stranger { photograph, kind: kind.clone() });
    let mut strangers: Vec<Stranger> = copied.chain(originals.iter().filter_map(panorama)).collect();
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
    /// Number of matches.
    matches: usize,
    /// By how much a enlarges what b shows, as lengths in working pixels go, in the middle of b.
    enlarged_in_a: f64,
    /// Whether everything lies at the same place in both, and nothing says that they were taken at two moments.
    is_one_exposure: bool,
}

impl SharedView {
    fn of(pair: &PairMatches, input: &StrangersInput) -> Option<Self> {
        let frames = input.frames;
        let (frame_a, frame_b) = (frames.get(pair.a)?, frames.get(pair.b)?);
        let [x, y, w] = pair.b_from_a.filter(|_| pair.verdict.is_joined())?;
        let b_from_a = Homography(Matrix3::from_row_slice(&[x, y, w].concat()));
        let overlap = PredictedOverlap::new(b_from_a, frame_a, frame_b)?;
        let middle_of_b = Vector2::new(frame_b.width, frame_b.height) / 2.0;
        let enlarged_in_a = b_from_a.inverse()?.jacobian(middle_of_b).determinant().abs().sqrt();
        let moments = [pair.a, pair.b].map(|one| input.taken.get(one).and_then(Option::as_ref));
        let is_one_moment = !matches!(moments, [Some(one), Some(other)] if one != other);
        Some(Self {
            enlarged_in_a,
            is_one_exposure: is_one_moment && moved_px(pair, frame_a, frame_b) <= SAME_PLACE_PX,
            a: pair.a,
            b: pair.b,
            of_a: cells(frame_a).map(|at| overlap.point_in_b(at).is_some()).collect(),
            of_b: cells(frame_b).map(|at| overlap.point_in_a(at).is_some()).collect(),
            agreeing: pair.agreeing as f64 / pair.in_overlap.max(1) as f64,
            matches: pair.inliers.len(),
        })
    }

    /// By how much `photograph` enlarges what the other one shows, as lengths in pixels of the files go.
    fn enlarged_in(&self, photograph: usize, frames: &[WorkingFrame]) -> f64 {
        let in_files = frames[self.b].working_from_full / frames[self.a].working_from_full;
        if photograph == self.a { self.enlarged_in_a * in_files } else { (self.enlarged_in_a * in_files).recip() }
    }

    /// The other photograph, the cells of `photograph` that it shows, and its cells that `photograph` shows; `None` if
    /// the pair is of others.
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

/// Median distance of a pair's matches from the same place in both, in working pixels of b; infinite without matches.
fn moved_px(pair: &PairMatches, frame_a: &WorkingFrame, frame_b: &WorkingFrame) -> f64 {
    let scale = [frame_b.width / frame_a.width, frame_b.height / frame_a.height];
    let moved = |one: &PointMatch| (one.in_b[0] - scale[0] * one.in_a[0]).hypot(one.in_b[1] - scale[1] * one.in_a[1]);
    let mut moved: Vec<f64> = pair.inliers.iter().map(moved).collect();
    moved.sort_by(f64::total_cmp);
    moved.get(moved.len() / 2).copied().unwrap_or(f64::INFINITY)
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

fn same_size(one: [f64; 2], other: [f64; 2]) -> bool {
    (0..2).all(|side| alike(one[side], other[side], SAME_SIDE))
}

/// Whether cameras write pictures with these sides.
fn is_camera_format(sides: [f64; 2]) -> bool {
    CAMERA_FORMATS.iter().any(|camera| alike(sides[0] / sides[1], *camera, FORMAT_TOLERANCE))
}

/// By the number of each reduced copy the largest picture of its view.
fn reduced_copies(views: &[SharedView], frames: &[WorkingFrame]) -> BTreeMap<usize, StrangerKind> {
    let mut copies: BTreeMap<usize, usize> = BTreeMap::new();
    for view in views.iter().filter(|view| view.is_same()) {
        let long = |photograph: usize| sides(&frames[photograph])[0];
        let (small, large) = if long(view.a) < long(view.b) { (view.a, view.b) } else { (view.b, view.a) };
        if long(small) <= REDUCED * long(large) {
            let of = copies.entry(small).or_insert(large);
            *of = if long(large) > long(*of) { large } else { *of };
        }
    }
    copies.into_iter().map(|(small, of)| (small, StrangerKind::ReducedCopy { of })).collect()
}

/// By the number of each edited copy its original: the picture of that exposure with a camera's metadata, of these the
/// largest, of these the first.
fn edited_copies(
    views: &[SharedView],
    reduced: &BTreeMap<usize, StrangerKind>,
    input: &StrangersInput,
) -> BTreeMap<usize, StrangerKind> {
    let area = |photograph: usize| sides(&input.frames[photograph]).iter().product::<f64>();
    let by_camera = |photograph: usize| input.by_camera.get(photograph).copied().unwrap_or(false);
    let mut of: BTreeMap<usize, usize> = BTreeMap::new();
    let is_reduced = |photograph| reduced.contains_key(&photograph);
    let is_marked = |photograph: usize| input.marked.get(photograph).copied().unwrap_or(false);
    for view in views.iter().filter(|view| view.is_same() && view.is_one_exposure) {
        if [view.a, view.b].into_iter().any(|one| is_reduced(one) || is_marked(one)) {
            continue;
        }
        // `a` has the smaller number.
        let b_is_original =
            by_camera(view.b).cmp(&by_camera(view.a)).then(area(view.b).total_cmp(&area(view.a))).is_gt();
        let (copy, original) = if b_is_original { (view.a, view.b) } else { (view.b, view.a) };
        of.entry(copy).or_insert(original);
    }
    let original = |copy: usize| {
        let mut original = copy;
        // Each step leads to a better one, so that it ends.
        while let Some(&next) = of.get(&original) {
            original = next;
        }
        original
    };
    of.keys().map(|&copy| (copy, StrangerKind::EditedCopy { of: original(copy) })).collect()
}

/// The photographs that `picture` shows, if it is a panorama made of them.
fn shown_of(
    picture: usize,
    views: &[SharedView],
    copies: &BTreeMap<usize, StrangerKind>,
    frames: &[WorkingFrame],
) -> Option<Vec<usize>> {
    let of_picture = sides(&frames[picture]);
    if is_camera_format(of_picture) {
        return superfluous_beside(picture, views, copies, frames);
    }
    // What was cropped by hand, each picture otherwise, has neither a camera's format nor another one's size.
    let is_as_taken = |photograph: usize| {
        let of_photograph = sides(&frames[photograph]);
        let is_another = |other| ![photograph, picture].contains(&other);
        let is_alike = |other| is_another(other) && same_size(of_photograph, sides(&frames[other]));
        is_camera_format(of_photograph) || (0..frames.len()).any(is_alike)
    };
    let mut covered = vec![false; GRID * GRID];
    let (mut whole, mut mostly) = (BTreeSet::new(), BTreeSet::new());
    for (other, of_picture_shown, of_other_shown) in views.iter().filter_map(|view| view.seen_from(picture)) {
        let is_part = share(of_picture_shown) < share(of_other_shown) && is_as_taken(other);
        if copies.contains_key(&other) || !is_part || same_size(of_picture, sides(&frames[other])) {
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
    let is_one = |shown: &BTreeSet<usize>| several(shown) && is_matched_as_densely(picture, shown, views);
    if is_one(&whole) && covered >= MIN_COVERED {
        return Some(whole.into_iter().collect());
    }
    (is_one(&mostly) && covered >= CROPPED_COVERED).then(|| mostly.into_iter().collect())
}

/// Whether `picture` has enough matches with the photographs that it shows, for what it shows of them, to be made of
/// them: see [`AS_DENSE`].
fn is_matched_as_densely(picture: usize, shown: &BTreeSet<usize>, views: &[SharedView]) -> bool {
    let of_picture = |view: &SharedView| {
        let (other, of_picture, _) = view.seen_from(picture)?;
        Some((other, view.matches, view.matches as f64 / share(of_picture).max(f64::MIN_POSITIVE)))
    };
    let all: Vec<_> = views.iter().filter_map(of_picture).collect();
    let most = all.iter().max_by_key(|(_, matches, _)| *matches).map_or(0.0, |(.., density)| *density);
    let middle = median_of(all.iter().filter(|(other, ..)| shown.contains(other)).map(|(.., density)| *density));
    middle.is_some_and(|middle| middle >= AS_DENSE * most)
}

/// The photographs that together show all that `picture` does, with as much detail, and overlap each other without it:
/// it is a panorama of them, or adds no more than one would. `None` if there are none.
fn superfluous_beside(
    picture: usize,
    views: &[SharedView],
    copies: &BTreeMap<usize, StrangerKind>,
    frames: &[WorkingFrame],
) -> Option<Vec<usize>> {
    let mut covered = vec![false; GRID * GRID];
    let mut inside = BTreeSet::new();
    for view in views {
        let Some((other, of_picture_shown, of_other_shown)) = view.seen_from(picture) else { continue };
        let is_part = share(of_other_shown) >= INSIDE
            && share(of_picture_shown) <= PART
            && view.enlarged_in(picture, frames) <= MOST_ENLARGED;
        if is_part && !copies.contains_key(&other) {
            covered.iter_mut().zip(of_picture_shown).for_each(|(covered, shown)| *covered |= shown);
            inside.insert(other);
        }
    }
    // What shows the same view counts once.
    let among = |view: &&SharedView| inside.contains(&view.a) && inside.contains(&view.b);
    let same = views.iter().filter(among).filter(|view| view.is_same()).count();
    let is_all = inside.len() >= MIN_SHOWN + same && share(&covered) >= NOTHING_ELSE;
    let first = *inside.first()?;
    let mut reached = BTreeSet::from([first]);
    while let Some(view) =
        views.iter().filter(among).find(|view| reached.contains(&view.a) != reached.contains(&view.b))
    {
        reached.extend([view.a, view.b]);
    }
    (is_all && reached == inside && is_matched_as_densely(picture, &inside, views))
        .then(|| inside.into_iter().collect())
}

#[cfg(test)]
#[path = "strangers_tests.rs"]
mod tests;
